//! One export of many clips: a folder in which all clips have the same classes, and those that are
//! kept for judging a detector are apart from those for training it.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use super::output::{self, Reader};
use super::{
    Counts, Error, ExportSummary, Frames, Item, Job, Options, Track, check, check_outlines,
    check_some, check_word,
};

/// A clip of an export.
#[derive(Debug, Clone, PartialEq)]
pub struct Clip {
    /// Its name, unlike that of all others, with which the names of its images begin.
    pub name: String,
    /// Its boxes.
    pub track: Track,
    /// Its frames, as [`Options::images`].
    pub images: Option<PathBuf>,
    /// What it is for.
    pub part: Part,
}

/// What a clip is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// A detector is trained with it.
    Train,
    /// A detector is judged by it.
    Val,
}

impl Part {
    /// Its name in folders and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Train => "train",
            Self::Val => "val",
        }
    }
}

/// Chooses a share of the clips for validation, by their names alone: the same clips each time, and
/// in any order.
///
/// # Errors
/// [`Error::Export`] if the share is not between 0 and 1, or there are fewer than two clips.
pub fn split(names: &[&str], share: f64) -> Result<Vec<Part>, Error> {
    if !(share > 0.0 && share < 1.0) {
        return Err(Error::Export(format!(
            "the share of clips for validation is {share}; it must be above 0 and below 1"
        )));
    }
    let all = names.len();
    if all < 2 {
        return Err(empty_part(all, all));
    }
    let count = ((share * all as f64).round() as usize).clamp(1, all - 1);
    let mut order: Vec<usize> = (0..all).collect();
    order.sort_unstable_by_key(|&k| (scattered(names[k]), names[k]));
    let mut parts = vec![Part::Train; all];
    order[..count].iter().for_each(|&k| parts[k] = Part::Val);
    Ok(parts)
}

/// One part of `all` clips would be empty, with this number of them for validation.
pub fn empty_part(clips: usize, all: usize) -> Error {
    Error::Export(format!("{clips} of {all} clips would be for validation; both parts need a clip"))
}

/// FNV-1a, then mixed: a number that is nearly random for names that differ in one digit.
fn scattered(name: &str) -> u64 {
    let fold = |hash: u64, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    let hash = name.bytes().fold(0xcbf2_9ce4_8422_2325, fold);
    (hash ^ (hash >> 32)).wrapping_mul(0x9e37_79b9_7f4a_7c15)
}

/// Writes the clips to a folder that does not exist yet or is empty, all or nothing. Classes are
/// numbered in the order of [`Options::labels`]. COCO has `annotations/instances_train.json`, YOLO
/// and VOC are one set; of the other formats each clip has its files, in `train` and `val` if the
/// clips are divided. Formats that name or copy the frames have copies of the images of clips that
/// have any. [`Options::images`] and [`Options::size`] are not used.
///
/// # Errors
/// As [`super::write_unless`]; [`Error::Export`] if there are no clips, if two have the same name,
/// or if two images would.
pub fn write_all(
    clips: &[Clip],
    options: &Options,
    out: &Path,
    stopped: &dyn Fn() -> bool,
) -> Result<ExportSummary, Error> {
    check(options)?;
    check_clips(clips.iter().map(|clip| clip.name.as_str()))?;
    check_outlines(&options.format, clips.iter().map(|clip| &clip.track))?;
    output::check(out, false, false)?;
    let own: Vec<Options> = clips.iter().map(|clip| of_clip(clip, options)).collect();
    let divided = clips.iter().any(|clip| clip.part == Part::Val);
    let selected: Vec<(Track, Counts)> =
        clips.iter().map(|clip| options.selection.of(&clip.track, &options.format)).collect();
    let boxes = selected.iter().fold(Counts::default(), |all, (_, counts)| all.plus(*counts));
    check_some(&boxes)?;
    let mut jobs = Vec::new();
    for ((clip, own), (track, _)) in clips.iter().zip(&own).zip(&selected) {
        let mut job = Job::new(track, &clip.track, own, Frames::new(&clip.track, own)?);
        (job.prefix, job.part) = (format!("{}_", clip.name), clip.part);
        job.folder = if divided { clip.part.name() } else { "" };
        jobs.push(job);
    }
    // A label that is not listed has the same class in all clips, too.
    let labels = jobs.iter().map(|job| job.labels.clone()).collect::<Vec<_>>().concat();
    for job in &mut jobs {
        for &label in &labels {
            job.add(label);
        }
    }
    if options.format.holds_frames() {
        labels.iter().try_for_each(|label| check_word("label", label))?;
    }
    let items = files(&jobs, options)?;
    check_names(&items)?;
    let files = items.iter().map(Vec::len).sum();
    let readers = own.iter().map(Reader::new).collect::<Result<Vec<_>, Error>>()?;
    output::check_not(stopped)?;
    output::write_folder(out, items.into_iter().zip(readers).collect(), stopped)?;
    let targets = selected.iter().map(|(track, _)| track.targets_with_boxes()).sum();
    let notes = options.format.notes(clips.iter().map(|clip| &clip.track));
    Ok(ExportSummary { files, targets, boxes, notes })
}

/// Checks the names of all clips.
fn check_clips<'a>(clips: impl Iterator<Item = &'a str>) -> Result<(), Error> {
    let mut names = HashSet::new();
    for name in clips {
        check_word("name of the clip", name)?;
        if !names.insert(name) {
            return Err(Error::Export(format!("two clips have the name {name:?}")));
        }
    }
    match names.is_empty() {
        true => Err(Error::Export("there is no clip with boxes".to_owned())),
        false => Ok(()),
    }
}

/// The options of one clip.
fn of_clip(clip: &Clip, options: &Options) -> Options {
    Options {
        name: clip.name.clone(),
        size: None,
        images: clip.images.clone().filter(|_| options.format.copies_frames()),
        ..options.clone()
    }
}

/// The files of each clip. What belongs to no clip comes with the first one.
pub(super) fn files(jobs: &[Job<'_>], options: &Options) -> Result<Vec<Vec<Item>>, Error> {
    if let Some(folder) = options.format.folder {
        return folder.files(&options.name, jobs);
    }
    let Some((ending, text)) = options.format.file else { return Ok(Vec::new()) };
    let file = |job: &Job<'_>| {
        let path = Path::new(job.folder).join(format!("{}.{ending}", job.name));
        Ok(vec![Item::text(path, text(job)?)])
    };
    jobs.iter().map(file).collect()
}

/// Two clips may give their images one name, as `a` with `b_1.jpg` and `a_b` with `1.jpg`.
fn check_names(clips: &[Vec<Item>]) -> Result<(), Error> {
    let mut paths = HashSet::new();
    match clips.iter().flatten().find(|item| !paths.insert(&item.path)) {
        None => Ok(()),
        Some(item) => Err(Error::Export(format!(
            "two clips would both have the file {}: rename one of them",
            item.path.display()
        ))),
    }
}
