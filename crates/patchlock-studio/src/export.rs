//! Writes a project in the formats of other tools, and as a table.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io;
use std::path::Path;

use patchlock::{BoundingBox, Status};
use patchlock_media::Limits;
use patchlock_track::export::{self, About, Entry, Said, Track};
use patchlock_track::text::as_cell;
use serde::Serialize;

use crate::project::{Error, Project, Target, file};

/// A format that a project can be written in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// A table with one row per target and frame, which [`crate::import`] reads again, with all
    /// that the project says of the frame.
    Csv,
    /// The format of another tool.
    Other(export::Format),
}

impl Format {
    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::Other(format) => format.name(),
        }
    }

    /// All formats.
    pub fn all() -> impl Iterator<Item = Self> {
        [Self::Csv].into_iter().chain(export::Format::ALL.map(Self::Other))
    }

    /// The format of this name.
    ///
    /// # Errors
    /// [`Error::Export`] if there is no such format; the message lists the names.
    pub fn named(name: &str) -> Result<Self, Error> {
        Self::all().find(|format| format.name() == name).ok_or_else(|| {
            let known: Vec<_> = Self::all().map(Self::name).collect();
            let reason =
                format!("there is no format {name:?}; the formats are {}", known.join(", "));
            refused(reason)
        })
    }

    /// Whether the format is a single file, as opposed to a folder.
    pub fn is_file(self) -> bool {
        match self {
            Self::Csv => true,
            Self::Other(format) => format.is_file(),
        }
    }
}

/// The options of an export.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// The format.
    pub format: Format,
    /// Name of the video, used in the format's files.
    pub name: String,
    /// Whether formats that include the frames get them; otherwise they have boxes only.
    pub frames: bool,
    /// Of the tracked frames, only every so many-th is a key frame; see
    /// [`export::Options::key_frames`].
    pub key_frames: usize,
    /// What the video may claim.
    pub limits: Limits,
}

impl Options {
    /// Whether the export reads this video, or the names of the images in this folder.
    pub fn reads(&self, video: &Path) -> bool {
        let Format::Other(format) = self.format else { return false };
        // COCO refers to images by their names, which only a folder has.
        let names = format == export::Format::Coco && video.is_dir();
        names || (format.holds_frames() && self.frames)
    }
}

fn refused(reason: impl Into<String>) -> Error {
    Error::from(patchlock_track::Error::Export(reason.into()))
}

/// Writes a project to a file, or to a folder that does not exist yet or is empty; all or nothing.
/// `video` is where the frames are. Returns the number of files.
///
/// # Errors
/// [`Error::Export`] if the project has no boxes, or if `out` exists: a file is replaced only with
/// `overwrite`, a folder never; or if the frames cannot be read or `out` cannot be written.
pub fn write(
    project: &Project,
    video: &Path,
    options: &Options,
    out: &Path,
    overwrite: bool,
) -> Result<usize, Error> {
    let format = match options.format {
        Format::Csv => return write_table(project, out, overwrite),
        Format::Other(format) => format,
    };
    let options = export::Options {
        format,
        name: options.name.clone(),
        label: "target".to_owned(),
        size: None,
        images: options.reads(video).then(|| video.to_path_buf()),
        follow_links: false,
        key_frames: options.key_frames,
        limits: options.limits,
    };
    Ok(export::write(&track(project)?, &options, out, overwrite)?)
}

fn write_table(project: &Project, out: &Path, overwrite: bool) -> Result<usize, Error> {
    if out.exists() && (out.is_dir() || !overwrite) {
        return Err(refused(format!("{} exists already", out.display())));
    }
    let text = table(project)?;
    file::replace(out, text.as_bytes()).map_err(|error| Error::write(out, error))?;
    Ok(1)
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
/// [`Error::Export`] if there are no boxes, or more than [`export::MOST_LINES`] boxes and hidden
/// frames.
pub fn track(project: &Project) -> Result<Track, Error> {
    check_rows(project)?;
    let entries = project.targets.iter().flat_map(|target| {
        rows(target).into_iter().map(|row| Entry {
            frame: row.frame,
            id: target.id,
            bbox: row.bbox,
            score: row.score,
            corners: None,
            status: row.status,
            said: row.said,
        })
    });
    let about = project.targets.iter().map(|target| {
        let (label, attributes) = (target.label.clone(), target.attributes.clone());
        (target.id, About { label, attributes })
    });
    let about: BTreeMap<u64, About> = about.collect();
    let (width, height) = (project.video.width, project.video.height);
    Ok(Track::new(entries.collect())?.with_targets(about).sized(width, height))
}

/// What is known of a target in a frame.
struct Row {
    frame: usize,
    bbox: Option<BoundingBox>,
    score: Option<f64>,
    status: Option<Status>,
    visible: Option<f64>,
    agreement: Option<f64>,
    said: Option<Said>,
}

/// All frames of a target of which something is known, in order.
fn rows(target: &Target) -> Vec<Row> {
    let empty = |frame| Row {
        frame,
        bbox: None,
        score: None,
        status: None,
        visible: None,
        agreement: None,
        said: None,
    };
    let keys = target.keys.iter().map(|(&frame, key)| {
        let said = Said { hidden: false, occluded: key.occluded, truncated: key.truncated };
        Row { bbox: Some(key.bbox), said: Some(said), ..empty(frame) }
    });
    let tracked = target.tracked.iter().map(|(&frame, tracked)| Row {
        bbox: Some(tracked.bbox),
        score: Some(tracked.score),
        status: Some(tracked.status),
        visible: tracked.visible,
        agreement: tracked.agreement,
        ..empty(frame)
    });
    let hidden = target.hidden.iter().flat_map(|&[from, to]| from..=to).map(|frame| {
        let said = Said { hidden: true, ..Said::default() };
        Row { said: Some(said), ..empty(frame) }
    });
    let mut rows: Vec<Row> = keys.chain(tracked).chain(hidden).collect();
    rows.sort_by_key(|row| row.frame);
    rows
}

/// A line of the table.
#[derive(Serialize)]
struct Line<'a> {
    frame: usize,
    id: u64,
    label: Cow<'a, str>,
    x: Option<f64>,
    y: Option<f64>,
    w: Option<f64>,
    h: Option<f64>,
    score: Option<f64>,
    status: Option<Status>,
    key: bool,
    occluded: bool,
    truncated: bool,
    hidden: bool,
    visible: Option<f64>,
    agreement: Option<f64>,
    frame_w: usize,
    frame_h: usize,
}

/// The table of a project, ordered by target and frame: CSV with the columns that
/// [`Format::Csv`](crate::import::Format::Csv) lists.
///
/// # Errors
/// As [`track`].
pub fn table(project: &Project) -> Result<String, Error> {
    check_rows(project)?;
    let mut out = csv::Writer::from_writer(Vec::new());
    let mut count = 0;
    for target in &project.targets {
        for row in rows(target) {
            count += usize::from(row.bbox.is_some());
            let said = row.said.unwrap_or_default();
            let side = |of: fn(BoundingBox) -> f64| row.bbox.map(of);
            let line = Line {
                frame: row.frame,
                id: target.id,
                label: as_cell(&target.label),
                x: side(|b| b.x),
                y: side(|b| b.y),
                w: side(|b| b.w),
                h: side(|b| b.h),
                score: row.score,
                status: row.status,
                key: row.said.is_some() && !said.hidden,
                occluded: said.occluded,
                truncated: said.truncated,
                hidden: said.hidden,
                visible: row.visible,
                agreement: row.agreement,
                frame_w: project.video.width,
                frame_h: project.video.height,
            };
            out.serialize(line).map_err(|error| refused(error.to_string()))?;
        }
    }
    if count == 0 {
        return Err(refused("the project has no boxes"));
    }
    let bytes = out.into_inner().map_err(|error| refused(error.to_string()))?;
    String::from_utf8(bytes).map_err(|error| refused(io::Error::other(error).to_string()))
}
