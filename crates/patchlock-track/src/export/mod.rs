//! Exports tracks in the formats of annotation tools and other benchmarks. There is one module per
//! format, which generates the text of its files from a [`Track`]; [`write()`] writes them, all or
//! none.
//!
//! A box covers the pixels from `x` to `x + w - 1`. In tools whose pixel `k` covers `k` to `k + 1`
//! it has the same numbers: COCO, CVAT, YOLO, Label Studio and GOT-10k count from 0. MOT, VOC and
//! LaSOT count from 1.

mod all;
mod coco;
mod cvat;
mod format;
mod frames;
mod got10k;
mod key_frames;
mod kitti;
mod label_studio;
mod lasot;
mod metadata;
mod mot;
mod output;
mod rotated;
mod selection;
mod sequence;
mod table;
mod track;
mod voc;
mod xml;
mod yolo;

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use patchlock_media::Limits;

use crate::attributes::Attribute;
use crate::outline::Outline;
use crate::{Error, files};
use frames::Frames;

pub use all::{Clip, Part, empty_part, split, write_all};
pub use format::{Format, ImageUse, Purpose};
pub use key_frames::KeyFrames;
pub use metadata::TargetMetadata;
pub use selection::{Counts, Selection};
pub use table::ATTRIBUTE;
pub use track::{Entry, ManualFlags, Track};

/// All formats, as lists of them have them.
const FORMATS: &[Format] = &[
    table::FORMAT,
    mot::FORMAT,
    kitti::FORMAT,
    coco::FORMAT,
    cvat::FORMAT,
    cvat::FORMAT_OBB,
    yolo::FORMAT,
    yolo::FORMAT_OBB,
    voc::FORMAT,
    label_studio::FORMAT,
    lasot::FORMAT,
    got10k::FORMAT,
];

impl Format {
    /// All formats.
    pub const ALL: [Self; FORMATS.len()] = *FORMATS.first_chunk().unwrap();
}

/// Most lines of an export that has more than the track: a line for each frame of a target's
/// stretch, with or without a box. A small file can claim very many.
pub const MOST_LINES: usize = 5_000_000;

/// The options of an export.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// The format.
    pub format: Format,
    /// Name of the video, used in the format's files.
    pub name: String,
    /// Class of the targets, such as `car`, unless the track has one for each.
    pub label: String,
    /// The labels in the order of their classes, which the formats number. Labels that are not in
    /// it follow, in the order of the targets' ids.
    pub labels: Vec<String>,
    /// Width and height of the frames in pixels; `None` to use that of `images` or of the track.
    /// Formats that need no size ignore it.
    pub size: Option<(usize, usize)>,
    /// The folder of the frames, or the video; frame 0 of the track is the first image in natural
    /// order. Some formats refer to the images by name, others get copies; frames of a video are
    /// saved as JPEG.
    pub images: Option<PathBuf>,
    /// Whether images may be links that leave their folder. A folder of others could lead to any
    /// image of this machine.
    pub follow_links: bool,
    /// Which boxes are written.
    pub selection: Selection,
    /// Which boxes are key frames, between which the tool interpolates.
    pub key_frames: KeyFrames,
    /// What the images or the video may claim.
    pub limits: Limits,
}

impl Options {
    /// The options of an export without images, in which all boxes are key frames and the targets
    /// are of the class `target`. `name` is that of the video.
    pub fn new(format: Format, name: impl Into<String>) -> Self {
        Self {
            format,
            name: name.into(),
            label: "target".to_owned(),
            labels: Vec::new(),
            size: None,
            images: None,
            follow_links: false,
            selection: Selection::default(),
            key_frames: KeyFrames::Every(1),
            limits: Limits::default(),
        }
    }
}

/// What an export has written.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ExportSummary {
    /// The number of files.
    pub files: usize,
    /// The number of targets of which a box is written.
    pub targets: usize,
    /// The numbers of boxes that are written and that are left out.
    pub boxes: Counts,
    /// What a person has to know who imports the files, in sentences without a full stop.
    pub notes: Vec<String>,
}

impl ExportSummary {
    /// What is left out, what is doubtful, and what has to be known: sentences without a full stop.
    pub fn remarks(&self) -> Vec<String> {
        [self.boxes.remarks(), self.notes.clone()].concat()
    }
}

/// One file of an export.
#[derive(Debug, Clone, PartialEq)]
struct Item {
    /// Path relative to the output folder.
    path: PathBuf,
    content: Content,
}

#[derive(Debug, Clone, PartialEq)]
enum Content {
    Text(String),
    /// A copy of this image, with its bytes as they are.
    Copy(PathBuf),
    /// This image converted to JPEG, for formats that allow nothing else.
    Jpeg(PathBuf),
    /// A frame of this video, as JPEG.
    Frame(PathBuf, usize),
}

impl Item {
    fn text(path: impl Into<PathBuf>, text: impl Into<String>) -> Self {
        Self { path: path.into(), content: Content::Text(text.into()) }
    }
}

/// The input of a format.
struct Job<'a> {
    track: &'a Track,
    name: &'a str,
    /// The label of targets of which the track has none.
    label: &'a str,
    /// All labels in the order of their classes, without repetitions.
    labels: Vec<&'a str>,
    /// The places of the labels in `labels`.
    classes: HashMap<&'a str, usize>,
    frames: Frames,
    key_frames: KeyFrames,
    /// What the names of its images begin with, to tell them from those of other clips.
    prefix: String,
    /// Whether the detector is trained with it, or judged.
    part: Part,
    /// The folder of the clip in formats that have one of each; empty if all are in one place.
    folder: &'static str,
}

impl<'a> Job<'a> {
    /// The job for the boxes of `track` that are written. Classes are those of all its targets, so that
    /// they do not depend on what is left out.
    fn new(track: &'a Track, all: &'a Track, options: &'a Options, frames: Frames) -> Self {
        let mut job = Self {
            track,
            name: &options.name,
            label: &options.label,
            labels: Vec::new(),
            classes: HashMap::new(),
            frames,
            key_frames: options.key_frames,
            prefix: String::new(),
            part: Part::Train,
            folder: "",
        };
        options.labels.iter().for_each(|label| job.add(label));
        for id in all.ids() {
            job.add(job.label(id));
        }
        job
    }

    /// Gives a label the next class, unless it has one.
    fn add(&mut self, label: &'a str) {
        let next = self.labels.len();
        if *self.classes.entry(label).or_insert(next) == next {
            self.labels.push(label);
        }
    }

    /// The name of the image of a frame.
    fn image(&self, frame: usize) -> String {
        format!("{}{}", self.prefix, self.frames.name(frame))
    }

    /// The outline of an entry: as a person has drawn it, or as the tracker has found it.
    fn outline(&self, entry: &Entry) -> Option<Outline> {
        // The centres of pixels are at whole numbers in corners of the tracker.
        let tracked =
            || entry.corners.map(|all| Outline(all.map(|[x, y]| [x + 0.5, y + 0.5]).into()));
        self.track.outline(entry).cloned().or_else(tracked)
    }

    /// The label of a target.
    fn label(&self, id: u64) -> &'a str {
        self.track.metadata(id).map_or(self.label, |metadata| &metadata.label)
    }

    /// The place of a target's label in [`Job::labels`].
    fn class(&self, id: u64) -> usize {
        self.classes.get(self.label(id)).copied().unwrap_or(0)
    }

    /// The names and values of a target's attributes in a frame.
    fn values(&self, id: u64, frame: usize) -> Vec<(&str, &str)> {
        self.track.metadata(id).map(|metadata| metadata.at(frame)).unwrap_or_default()
    }

    /// The attributes that the label of a target declares.
    fn declared(&self, id: u64) -> &[Attribute] {
        self.track.declared(self.label(id))
    }
}

/// Writes a track to a file, or to a folder that does not exist yet or is empty. If an error
/// occurs, nothing is written.
///
/// # Errors
/// [`Error::Export`] if the options are inconsistent, if they leave out all boxes, if there would be
/// more than [`MOST_LINES`], or if `out` exists: a file is replaced only with `overwrite`, a folder
/// never. [`Error::Read`] and [`Error::Frame`] for the images; [`Error::Write`].
pub fn write(
    track: &Track,
    options: &Options,
    out: &Path,
    overwrite: bool,
) -> Result<ExportSummary, Error> {
    write_unless(track, options, out, overwrite, &|| false)
}

/// As [`write()`], but ends soon after `stopped` returns true, with an error and without any file.
///
/// # Errors
/// As [`write()`]; [`Error::Export`] if it was stopped.
pub fn write_unless(
    track: &Track,
    options: &Options,
    out: &Path,
    overwrite: bool,
    stopped: &dyn Fn() -> bool,
) -> Result<ExportSummary, Error> {
    check_word("label", &options.label)?;
    check(options)?;
    let format = options.format;
    output::check(out, format.is_file(), overwrite)?;
    let frames = Frames::new(track, options)?;
    check_outlines(&format, [track])?;
    let (selected, boxes) = options.selection.of(track, &format);
    check_some(&boxes)?;
    let job = Job::new(&selected, track, options, frames);
    if format.holds_frames() {
        job.labels.iter().try_for_each(|label| check_word("label", label))?;
    }
    let targets = selected.targets_with_boxes();
    let notes = format.notes([track]);
    let written = |files| ExportSummary { files, targets, boxes, notes };
    if let Some((_, text)) = format.file {
        let text = text(&job)?;
        output::check_not(stopped)?;
        files::write(out, text.as_bytes(), overwrite).map_err(|error| Error::write(out, error))?;
        return Ok(written(1));
    }
    let items: Vec<Item> = all::files(&[job], options)?.into_iter().flatten().collect();
    output::check_not(stopped)?;
    let reader = output::Reader::new(options)?;
    let files = items.len();
    output::write_folder(out, vec![(items, reader)], stopped).map(|()| written(files))
}

/// Checks the options of one or of many clips.
fn check(options: &Options) -> Result<(), Error> {
    check_word("name", &options.name)?;
    options.selection.check(&options.format)?;
    let refused = |reason: String| Err(Error::Export(reason));
    let name = options.format.name;
    match options.key_frames {
        KeyFrames::Every(1) => Ok(()),
        _ if !options.format.has_key_frames => {
            let with = Format::ALL.into_iter().filter(|format| format.has_key_frames);
            let with: Vec<&str> = with.map(|format| format.name).collect();
            refused(format!("{name} has no key frames; {} have", with.join(", ")))
        }
        KeyFrames::Every(step) if step > 0 => Ok(()),
        KeyFrames::Overlap(least) if least > 0.0 && least < 1.0 => Ok(()),
        KeyFrames::Every(step) => refused(format!(
            "every {step}th frame cannot be a key frame of {name}; allowed: 1 or more"
        )),
        KeyFrames::Overlap(least) => refused(format!(
            "the least overlap of key frames is {least}; it must be above 0 and below 1"
        )),
    }
}

/// Refuses tracks without outlines for a format of rotated boxes.
fn check_outlines<'a>(
    format: &Format,
    tracks: impl IntoIterator<Item = &'a Track>,
) -> Result<(), Error> {
    if !format.is_rotated {
        return Ok(());
    }
    match tracks.into_iter().find(|track| track.has_outlines()).map(Track::without_outline) {
        Some(None) => Ok(()),
        Some(Some(Entry { id, frame, .. })) => Err(Error::Export(format!(
            "target {id} has no outline in frame {frame}, which {} needs of each box of a table. Use yolo or cvat",
            format.name
        ))),
        None => Err(Error::Export(format!(
            "no box has an outline, which {} is for: tables of patchlock track have outlines, and projects in \
             which a person has drawn some. Use yolo or cvat",
            format.name
        ))),
    }
}

/// Refuses a selection that leaves out all boxes.
fn check_some(boxes: &Counts) -> Result<(), Error> {
    match boxes.boxes == 0 && boxes.left_out() > 0 {
        true => {
            Err(Error::Export(format!("no box is to be written: {}", boxes.remarks().join("; "))))
        }
        false => Ok(()),
    }
}

/// Checks a word that becomes part of paths and of lines in text files.
fn check_word(what: &str, word: &str) -> Result<(), Error> {
    let forbidden = |c: char| c.is_control() || matches!(c, '/' | '\\');
    if word.trim() != word || word.is_empty() || word.starts_with('.') || word.contains(forbidden) {
        return Err(Error::Export(format!(
            "the {what} is {word:?}; it must not be empty, contain slashes or line breaks, start with a dot, \
             or start or end with a space"
        )));
    }
    Ok(())
}

/// Rounds to four decimal places, finer than the accuracy of any tracker.
fn round(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}
