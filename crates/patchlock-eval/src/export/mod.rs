//! Tracks out, in the formats of annotation tools and of other benchmarks. One file a format; each makes the text of its files from a [`Track`], and [`write()`] puts
//! them in their place, all or none.
//!
//! A box covers the pixels from `x` to `x + w - 1`, and tools that draw pixel `k` from `k` to `k + 1` draw the same box with the same numbers: COCO, CVAT, YOLO
//! and GOT-10k count from 0. MOT and LaSOT count from 1.

mod coco;
mod cvat;
mod frames;
mod got10k;
mod lasot;
mod mot;
mod place;
mod sequence;
mod track;
mod yolo;

use std::path::{Path, PathBuf};

use crate::Error;
use frames::Frames;
pub use track::{Entry, Track};

/// The formats.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// A text file with `frame,id,left,top,width,height,confidence,-1,-1,-1` a line, frames and pixels counted from 1: the results of MOTChallenge.
    Mot,
    /// A JSON file in COCO's form, with `videos`, `tracks`, and in each annotation `track_id`, the turned outline as `segmentation` and the score.
    Coco,
    /// "CVAT for video 1.1": an XML file with a track a target.
    Cvat,
    /// A folder with `data.yaml` and `labels/train`, one text file a frame with `class centre-x centre-y width height`, relative to the frame and cut off at its
    /// border. Targets can't be told apart in it.
    Yolo,
    /// A folder `<label>/<label>-<id>` a target with `groundtruth.txt`, `full_occlusion.txt`, `out_of_view.txt`.
    Lasot,
    /// A folder `<name>_<id>` a target with `groundtruth.txt`, `absence.label`, `cover.label`, `cut_by_image.label`, `meta_info.ini`; and `list.txt`.
    Got10k,
}

impl Format {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::Mot, Self::Coco, Self::Cvat, Self::Yolo, Self::Lasot, Self::Got10k];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mot => "mot",
            Self::Coco => "coco",
            Self::Cvat => "cvat",
            Self::Yolo => "yolo",
            Self::Lasot => "lasot",
            Self::Got10k => "got10k",
        }
    }

    /// The format of this name.
    ///
    /// # Errors
    /// [`Error::Export`] lists the names.
    pub fn named(name: &str) -> Result<Self, Error> {
        Self::ALL.into_iter().find(|format| format.name() == name).ok_or_else(|| {
            let known = Self::ALL.map(Self::name).join(", ");
            Error::Export(format!("there is no format {name}; there is: {known}"))
        })
    }

    /// Whether it says how large the frames are, or boxes relative to them.
    pub fn needs_size(self) -> bool {
        matches!(self, Self::Coco | Self::Cvat | Self::Yolo | Self::Got10k)
    }

    /// Whether frames belong into it: they are copied where there are any.
    pub fn holds_frames(self) -> bool {
        matches!(self, Self::Yolo | Self::Lasot | Self::Got10k)
    }
}

/// What is to be said beside the boxes.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// The format.
    pub format: Format,
    /// Name of the video.
    pub name: String,
    /// What the targets are, such as `car`: one word for all of them.
    pub label: String,
    /// Width and height of the frames in pixels; `None` where `images` tells, or the format does not ask.
    pub size: Option<(usize, usize)>,
    /// The folder of the frames: frame 0 of the track is its first image in natural order. Formats with files name them, and formats that hold frames get copies.
    pub images: Option<PathBuf>,
}

/// One file of an export.
#[derive(Debug, Clone, PartialEq)]
struct Item {
    /// Where it lies below the output.
    path: PathBuf,
    content: Content,
}

#[derive(Debug, Clone, PartialEq)]
enum Content {
    Text(String),
    /// A copy of this image, its bytes unchanged.
    Copy(PathBuf),
    /// This image as JPEG, for formats that know no other.
    Jpeg(PathBuf),
}

impl Item {
    fn text(path: impl Into<PathBuf>, text: impl Into<String>) -> Self {
        Self { path: path.into(), content: Content::Text(text.into()) }
    }
}

/// What an export consists of.
enum Files {
    One(String),
    Folder(Vec<Item>),
}

/// Everything that the formats are made of.
struct Job<'a> {
    track: &'a Track,
    name: &'a str,
    label: &'a str,
    frames: Frames,
}

/// Writes a track: a file, or a folder that is not there yet or empty. It is complete, or nothing is there. Gives the number of files.
///
/// # Errors
/// [`Error::Export`] where something is missing or does not fit together, or where `out` is in use: a file is replaced with `overwrite`, a folder never;
/// [`Error::Read`] and [`Error::Frame`] for the images, [`Error::Write`].
pub fn write(
    track: &Track,
    options: &Options,
    out: &Path,
    overwrite: bool,
) -> Result<usize, Error> {
    check_word("label", &options.label)?;
    check_word("name", &options.name)?;
    place::check(
        out,
        matches!(options.format, Format::Mot | Format::Coco | Format::Cvat),
        overwrite,
    )?;
    let frames = Frames::new(track, options)?;
    let job = Job { track, name: &options.name, label: &options.label, frames };
    let files = match options.format {
        Format::Mot => Files::One(mot::text(&job)),
        Format::Coco => Files::One(coco::text(&job)),
        Format::Cvat => Files::One(cvat::text(&job)),
        Format::Yolo => Files::Folder(yolo::items(&job)),
        Format::Lasot => Files::Folder(lasot::items(&job)),
        Format::Got10k => Files::Folder(got10k::items(&job)),
    };
    match files {
        Files::One(text) => place::file(out, &text, overwrite).map(|()| 1),
        Files::Folder(items) => place::folder(out, &items).map(|()| items.len()),
    }
}

/// Names become parts of paths and lines of text files.
fn check_word(what: &str, word: &str) -> Result<(), Error> {
    let strange = |c: char| c.is_control() || matches!(c, '/' | '\\');
    if word.trim() != word || word.is_empty() || word.starts_with('.') || word.contains(strange) {
        return Err(Error::Export(format!(
            "the {what} is {word:?}; it must have letters, and no slash, line break, dot at the beginning or blank at an end"
        )));
    }
    Ok(())
}

/// Four digits behind the point: more than any tracker means.
fn round(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}
