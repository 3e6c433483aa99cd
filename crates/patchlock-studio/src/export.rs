//! Writes a project, or all projects of a folder, in the formats of other tools or as a table.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use patchlock_media::Limits;
use patchlock_track::export::{
    self, Clip, Entry, ExportSummary, Format, ImageUse, ManualFlags, Options, Part, TargetMetadata,
    Track,
};

use crate::project::{
    Changes, Error, Label, Outline, PLACEHOLDER, Project, SharedLabels, Store, Target,
};

/// Whether an export in this format, with the frames or with boxes only, reads this video, or the
/// names of the images in this folder.
pub fn reads(format: &Format, frames: bool, video: &Path) -> bool {
    // Only the images of a folder have names.
    let names = format.images == ImageUse::Named && video.is_dir();
    names || (format.holds_frames() && frames)
}

fn refused(reason: impl Into<String>) -> Error {
    Error::from(patchlock_track::Error::Export(reason.into()))
}

/// Writes a project to a file, or to a folder that does not exist yet or is empty; all or nothing.
/// The classes are those of the project, not of the options.
///
/// # Errors
/// [`Error::Track`] if the project has no boxes, or if `out` exists: a file is replaced only with
/// `overwrite`, a folder never; or if the frames cannot be read or `out` cannot be written.
pub fn write(
    project: &Project,
    options: &Options,
    out: &Path,
    overwrite: bool,
) -> Result<ExportSummary, Error> {
    let options = Options { labels: classes(&project.labels, [project]), ..options.clone() };
    Ok(export::write(&track(project)?, &options, out, overwrite)?)
}

/// The names of labels in the order of their classes. The label with which each project begins is
/// none if no target has it.
pub fn classes<'a>(
    labels: &[Label],
    projects: impl IntoIterator<Item = &'a Project>,
) -> Vec<String> {
    let mut targets = projects.into_iter().flat_map(|project| &project.targets);
    let is_used = targets.any(|target| target.label == PLACEHOLDER);
    let names = labels.iter().map(|label| label.name.clone());
    names.filter(|name| is_used || name != PLACEHOLDER).collect()
}

/// A clip of an export of all.
#[derive(Debug, Clone)]
pub struct FolderClip {
    /// Its name, unlike that of all others.
    pub name: String,
    /// What is known of it, with the labels of all.
    pub project: Project,
    /// The video, if it may be read and its frames are wanted.
    pub video: Option<PathBuf>,
}

/// Which clips are kept for judging a detector.
#[derive(Debug, Clone, PartialEq)]
pub enum Val {
    /// This share of them, chosen by their names.
    Share(f64),
    /// These, by their names.
    Clips(Vec<String>),
}

impl Val {
    /// A share, or names with commas between them; `None` for an empty text.
    pub fn named(text: &str) -> Option<Self> {
        let names = || text.split(',').map(|name| name.trim().to_owned()).collect();
        match text.trim().parse() {
            _ if text.trim().is_empty() => None,
            Ok(share) => Some(Self::Share(share)),
            Err(_) => Some(Self::Clips(names())),
        }
    }

    fn parts(&self, names: &[&str]) -> Result<Vec<Part>, Error> {
        let chosen = match self {
            Self::Share(share) => return Ok(export::split(names, *share)?),
            Self::Clips(chosen) => chosen,
        };
        // With the ending of the video, too.
        let is = |name: &str, chosen: &String| {
            chosen == name || Path::new(chosen).file_stem().is_some_and(|stem| stem == name)
        };
        if let Some(unknown) = chosen.iter().find(|it| !names.iter().any(|name| is(name, it))) {
            let known = names.join(", ");
            return Err(refused(format!(
                "there is no clip {unknown:?} with boxes; the clips are {known}"
            )));
        }
        let part = |name: &&str| match chosen.iter().any(|it| is(name, it)) {
            true => Part::Val,
            false => Part::Train,
        };
        let parts: Vec<Part> = names.iter().map(part).collect();
        let clips = parts.iter().filter(|part| **part == Part::Val).count();
        match clips < names.len() {
            true => Ok(parts),
            false => Err(export::empty_part(clips, names.len()).into()),
        }
    }
}

/// What an export of all clips has written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CombinedExport {
    /// The numbers of files, targets and boxes.
    pub written: ExportSummary,
    /// The names of the clips for training.
    pub train: Vec<String>,
    /// The names of the clips for validation.
    pub val: Vec<String>,
    /// The names of clips without a box, which are left out.
    pub empty: Vec<String>,
}

/// Writes all clips to one folder that does not exist yet or is empty, all or nothing; ends soon
/// after `stopped` returns true. Classes are numbered in the order of `labels`, not as in the options.
///
/// # Errors
/// As [`write()`]; [`Error::Track`] if the clips cannot be divided.
pub fn write_all(
    clips: &[FolderClip],
    labels: &[Label],
    options: &Options,
    val: Option<&Val>,
    out: &Path,
    stopped: &dyn Fn() -> bool,
) -> Result<CombinedExport, Error> {
    let has_boxes = |clip: &&FolderClip| {
        clip.project.targets.iter().any(|it| !it.keys.is_empty() || !it.tracked.is_empty())
    };
    let (full, empty): (Vec<_>, Vec<_>) = clips.iter().partition(has_boxes);
    let names: Vec<&str> = full.iter().map(|clip| clip.name.as_str()).collect();
    let parts = val.map_or_else(|| Ok(vec![Part::Train; names.len()]), |val| val.parts(&names))?;
    let all = full.iter().zip(&parts).map(|(clip, &part)| {
        let (name, images) = (clip.name.clone(), clip.video.clone());
        Ok(Clip { name, track: track(&clip.project)?, images, part })
    });
    let all = all.collect::<Result<Vec<Clip>, Error>>()?;
    let of_part = |part: Part| {
        let clips = all.iter().filter(|clip| clip.part == part);
        clips.map(|clip| clip.name.clone()).collect()
    };
    let projects = || full.iter().map(|clip| &clip.project);
    let options = Options { labels: classes(labels, projects()), ..options.clone() };
    let mut written = export::write_all(&all, &options, out, stopped)?;
    written.notes.extend(one_sided(projects().zip(parts.iter().copied())));
    Ok(CombinedExport {
        written,
        train: of_part(Part::Train),
        val: of_part(Part::Val),
        empty: empty.iter().map(|clip| clip.name.clone()).collect(),
    })
}

/// Says which labels are missing in one of two parts.
fn one_sided<'a>(clips: impl Iterator<Item = (&'a Project, Part)>) -> Vec<String> {
    let mut labels = [BTreeSet::new(), BTreeSet::new()];
    let mut divided = false;
    for (project, part) in clips {
        divided |= part == Part::Val;
        let side = usize::from(part == Part::Val);
        labels[side].extend(project.targets.iter().map(|target| target.label.clone()));
    }
    let missing = |side: usize| {
        let missing = labels[1 - side].difference(&labels[side]).filter(|_| divided);
        missing.map(|label| label.as_str()).collect::<Vec<_>>().join(", ")
    };
    let parts = [(0, Part::Train), (1, Part::Val)].map(|(side, part)| (missing(side), part));
    let parts = parts.into_iter().filter(|(labels, _)| !labels.is_empty());
    let say = |(labels, part): (String, Part)| {
        format!(
            "no clip in {} has a target of these labels: {labels}; choose the clips for validation by \
             their names",
            part.name()
        )
    };
    parts.map(say).collect()
}

/// The clips of a folder: all projects in it, in natural order, with the labels of the folder. Only
/// videos in the folder may be read.
///
/// # Errors
/// As [`Store::open_shared`] and [`SharedLabels::read`]; [`Error::Track`] if there are no projects, or
/// one of them is a link out of the folder.
pub fn of_folder(folder: &Path) -> Result<(Vec<FolderClip>, Vec<Label>), Error> {
    const ENDING: &str = ".patchlock.json";
    let mut vocabulary = SharedLabels::new(folder).read()?;
    let files = patchlock_track::files::entries(folder)?;
    let mut clips = Vec::new();
    for file in files {
        let name = patchlock_track::files::name_of(&file);
        let Some(name) = name.strip_suffix(ENDING) else { continue };
        check_place(&file, folder)?;
        let store = Store::open_shared(&file, None, Limits::default())?;
        let renamed = vocabulary.absorb(store.project())?;
        clips.push((name.to_owned(), store, renamed));
    }
    if clips.is_empty() {
        return Err(refused(format!(
            "there is no project in {}; projects have names such as clip{ENDING}",
            folder.display()
        )));
    }
    let labels = vocabulary.labels();
    let clips = clips.into_iter().map(|(name, mut store, renamed)| {
        store.set_labels(&labels, &renamed);
        let video = store.video_to_read().ok().map(Path::to_path_buf);
        FolderClip { name, project: store.project().clone(), video }
    });
    Ok((clips.collect(), labels))
}

/// A project of this folder must be in it. A link of a stranger would make the boxes and the frames
/// of another folder part of what is given away.
fn check_place(file: &Path, folder: &Path) -> Result<(), Error> {
    let real = |path: &Path| fs::canonicalize(path).map_err(|error| Error::read(path, error));
    let target = real(file)?;
    match target.starts_with(real(folder)?) {
        true => Ok(()),
        false => Err(refused(format!(
            "the project {} is a link to {}, which is in another folder. Copy that project and its \
             video to the folder, or remove the link",
            file.display(),
            target.display()
        ))),
    }
}

/// Checks how many rows the targets have. Two numbers in a file can hide a target in any number of
/// frames.
fn check_rows(project: &Project) -> Result<(), Error> {
    let targets = project.targets.iter();
    let boxes: usize = targets.clone().map(|target| target.keys.len() + target.tracked.len()).sum();
    let hidden: usize = targets.flat_map(|target| &target.hidden).map(|[a, b]| b - a + 1).sum();
    match boxes.saturating_add(hidden) <= export::MOST_LINES {
        true => Ok(()),
        false => Err(refused(format!(
            "the project has {boxes} boxes, and {hidden} frames in which a target is not visible; at most {} \
             of both can be exported",
            export::MOST_LINES
        ))),
    }
}

/// The boxes of all targets, with labels, attributes and what a person has said.
///
/// # Errors
/// [`Error::Track`] if there are no boxes, or more than [`export::MOST_LINES`] boxes and hidden
/// frames.
pub fn track(project: &Project) -> Result<Track, Error> {
    check_rows(project)?;
    let entries = project.targets.iter().flat_map(entries);
    let metadata = project.targets.iter().map(|target| (target.id, metadata(project, target)));
    let metadata: BTreeMap<u64, TargetMetadata> = metadata.collect();
    let mut declared = BTreeMap::new();
    declared.extend(project.labels.iter().map(|it| (it.name.clone(), it.attributes.clone())));
    let outlines = project.targets.iter().flat_map(outlines).collect();
    let (width, height) = (project.video.width, project.video.height);
    let track = Track::new(entries.collect())?.in_clip(project.video.frames);
    let track = track.with_targets(metadata).with_declared(declared).with_outlines(outlines);
    Ok(track.sized(width, height))
}

/// The outlines of a target, drawn and carried along, by frame and target.
fn outlines(target: &Target) -> Vec<((usize, u64), Outline)> {
    if !target.has_outlines() {
        return Vec::new();
    }
    let frames = target.keys.keys().chain(target.tracked.keys());
    let outline = |&frame| Some(((frame, target.id), target.outline_at(frame)?));
    frames.filter_map(outline).collect()
}

/// The label and the attributes of a target: those that its label declares, with their defaults, and
/// others that it has.
fn metadata(project: &Project, target: &Target) -> TargetMetadata {
    let (mut attributes, mut changes) = (target.attributes.clone(), BTreeMap::new());
    for attribute in project.declared(&target.label) {
        let name = &attribute.name;
        if !attribute.mutable {
            attributes.insert(name.clone(), target.value(attribute, 0).to_owned());
            continue;
        }
        attributes.remove(name);
        let later = target.changes.get(name).into_iter().flat_map(|Changes(values)| values.keys());
        let frames = [0].into_iter().chain(later.copied());
        let values = frames.map(|frame| (frame, target.value(attribute, frame).to_owned()));
        changes.entry(name.clone()).or_insert_with(BTreeMap::new).extend(values);
    }
    TargetMetadata { label: target.label.clone(), attributes, changes }
}

/// All frames of a target of which something is known.
fn entries(target: &Target) -> impl Iterator<Item = Entry> {
    let id = target.id;
    let keys = target.keys.iter().map(move |(&frame, key)| {
        let manual =
            ManualFlags { hidden: false, occluded: key.occluded, truncated: key.truncated };
        let (bbox, manual) = (Some(key.bbox), Some(manual));
        Entry { frame, id, bbox, manual, ..Entry::default() }
    });
    let tracked = target.tracked.iter().map(move |(&frame, tracked)| Entry {
        frame,
        id,
        bbox: Some(tracked.bbox),
        score: Some(tracked.score),
        status: Some(tracked.status),
        visible: tracked.visible,
        agreement: tracked.agreement,
        ..Entry::default()
    });
    let hidden = target.hidden.iter().flat_map(|&[from, to]| from..=to).map(move |frame| {
        let manual = ManualFlags { hidden: true, ..ManualFlags::default() };
        Entry { frame, id, manual: Some(manual), ..Entry::default() }
    });
    keys.chain(tracked).chain(hidden)
}
