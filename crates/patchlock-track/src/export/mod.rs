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
mod frames;
mod got10k;
mod key_frames;
mod label_studio;
mod lasot;
mod mot;
mod output;
mod sequence;
mod track;
mod voc;
mod xml;
mod yolo;

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

use patchlock_media::Limits;

use crate::Error;
use crate::attributes::Attribute;
use frames::Frames;

pub use all::{Clip, Part, SplitError, split, write_all, write_texts};
pub use track::{About, Entry, Said, Track};

/// An export format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// The results format of MOTChallenge: a text file with
    /// `frame,id,left,top,width,height,confidence,-1,-1,-1` on each line; frames and pixels count
    /// from 1. The confidence is 0 while the target is lost.
    Mot,
    /// A JSON file in the format of COCO, with `videos` and `tracks`. Each annotation has
    /// `track_id`, and the rotated outline as `segmentation`, the score, the attribute `status` and
    /// those of the target if they are known.
    Coco,
    /// "CVAT for video 1.1": an XML file with one track per target. A target is outside from the
    /// frame after a box in which it has none, or is lost. Without the number of frames of the
    /// clip, there is taken to be a frame after the last box.
    Cvat,
    /// As [`Format::Cvat`], with the rotated outline in place of the upright box: the box before it
    /// is turned, and the attribute `rotation`. All boxes need an outline.
    CvatObb,
    /// A folder with `data.yaml` and `labels/train`, one text file per frame with `class centre-x
    /// centre-y width height`, relative to the frame and clipped to it. Targets are not told apart.
    /// Frames in which one is lost are left out.
    Yolo,
    /// As [`Format::Yolo`], with the four corners of the outline instead of the box: `class x1 y1 x2
    /// y2 x3 y3 x4 y4`. All boxes need an outline.
    YoloObb,
    /// Pascal VOC: a folder with `Annotations`, one XML file per frame, and `JPEGImages`. Boxes are
    /// clipped to the frame. Frames in which a target is lost are left out.
    Voc,
    /// Label Studio: a JSON file with one task, whose predictions are regions of the video.
    LabelStudio,
    /// One folder `<label>/<label>-<id>` per target, with `groundtruth.txt`, `full_occlusion.txt`
    /// and `out_of_view.txt`. A lost target counts as fully occluded.
    Lasot,
    /// One folder `<name>_<id>` per target, with `groundtruth.txt`, `absence.label`, `cover.label`,
    /// `cut_by_image.label` and `meta_info.ini`; and `list.txt`. A lost target is absent.
    Got10k,
}

impl Format {
    /// All formats.
    pub const ALL: [Self; 10] = [
        Self::Mot,
        Self::Coco,
        Self::Cvat,
        Self::CvatObb,
        Self::Yolo,
        Self::YoloObb,
        Self::Voc,
        Self::LabelStudio,
        Self::Lasot,
        Self::Got10k,
    ];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mot => "mot",
            Self::Coco => "coco",
            Self::Cvat => "cvat",
            Self::CvatObb => "cvat-obb",
            Self::Yolo => "yolo",
            Self::YoloObb => "yolo-obb",
            Self::Voc => "voc",
            Self::LabelStudio => "label-studio",
            Self::Lasot => "lasot",
            Self::Got10k => "got10k",
        }
    }

    /// The format of this name.
    ///
    /// # Errors
    /// [`Error::Export`] if there is no such format; the message lists the names.
    pub fn named(name: &str) -> Result<Self, Error> {
        Self::ALL.into_iter().find(|format| format.name() == name).ok_or_else(|| {
            let known = Self::ALL.map(Self::name).join(", ");
            Error::Export(format!("there is no format {name}; the formats are {known}"))
        })
    }

    /// Whether boxes of frames in which the target is lost are left out.
    pub fn leaves_out_lost(self) -> bool {
        matches!(self, Self::Yolo | Self::YoloObb | Self::Voc)
    }

    /// Whether the format needs the frame size.
    pub fn needs_size(self) -> bool {
        !matches!(self, Self::Mot | Self::Lasot)
    }

    /// Whether the format includes the frames, which are copied if there are any.
    pub fn holds_frames(self) -> bool {
        matches!(self, Self::Yolo | Self::YoloObb | Self::Voc | Self::Lasot | Self::Got10k)
    }

    /// Whether an export of many clips has copies of their frames.
    pub fn copies_frames(self) -> bool {
        self.holds_frames() || self == Self::Coco
    }

    /// Whether its boxes are rotated, for which each needs an outline.
    pub fn is_rotated(self) -> bool {
        matches!(self, Self::CvatObb | Self::YoloObb)
    }

    /// Whether the format is a single file, as opposed to a folder.
    pub fn is_file(self) -> bool {
        matches!(self, Self::Mot | Self::Coco | Self::Cvat | Self::CvatObb | Self::LabelStudio)
    }

    /// Whether the format has key frames, between which the tool interpolates.
    pub fn has_key_frames(self) -> bool {
        matches!(self, Self::Cvat | Self::CvatObb | Self::LabelStudio)
    }
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
    /// Only every so many-th box is a key frame, besides the first and the last of each run of
    /// frames with a box, those that a person has drawn, and those at which something else changes;
    /// the tool interpolates between them. 1 makes all boxes key frames.
    pub key_frames: usize,
    /// What the images or the video may claim.
    pub limits: Limits,
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

/// The files of an export.
enum Files {
    One(String),
    Folder(Vec<Item>),
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
    key_frames: usize,
    /// What the names of its images begin with, to tell them from those of other clips.
    prefix: String,
    /// Whether the detector is trained with it, or judged.
    part: Part,
}

impl<'a> Job<'a> {
    fn new(track: &'a Track, options: &'a Options, frames: Frames) -> Self {
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
        };
        options.labels.iter().for_each(|label| job.add(label));
        for id in track.ids() {
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

    /// The outline of an entry, for a format with rotated boxes.
    fn outline(&self, entry: &Entry) -> Result<[[f64; 2]; 4], Error> {
        entry.corners.ok_or_else(|| {
            Error::Export(format!(
                "target {} of {} has no outline in frame {}; yolo-obb and cvat-obb need one of each box, as in \
                 a table of patchlock track. Projects have upright boxes: use yolo or cvat",
                entry.id, self.name, entry.frame
            ))
        })
    }

    /// The label of a target.
    fn label(&self, id: u64) -> &'a str {
        self.track.about(id).map_or(self.label, |about| &about.label)
    }

    /// The place of a target's label in [`Job::labels`].
    fn class(&self, id: u64) -> usize {
        self.classes.get(self.label(id)).copied().unwrap_or(0)
    }

    /// The values of a target's attributes in a frame, by name.
    fn values(&self, id: u64, frame: usize) -> BTreeMap<&str, &str> {
        self.track.about(id).map(|about| about.at(frame)).unwrap_or_default()
    }

    /// The attributes that the label of a target declares.
    fn declared(&self, id: u64) -> &[Attribute] {
        self.track.declared(self.label(id))
    }
}

/// Writes a track to a file, or to a folder that does not exist yet or is empty. If an error
/// occurs, nothing is written. Returns the number of files.
///
/// # Errors
/// [`Error::Export`] if the options are inconsistent, if there would be more than [`MOST_LINES`],
/// or if `out` exists: a file is replaced only with `overwrite`, a folder never. [`Error::Read`]
/// and [`Error::Frame`] for the images; [`Error::Write`].
pub fn write(
    track: &Track,
    options: &Options,
    out: &Path,
    overwrite: bool,
) -> Result<usize, Error> {
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
) -> Result<usize, Error> {
    check_word("label", &options.label)?;
    check_word("name", &options.name)?;
    check_key_frames(options)?;
    let format = options.format;
    output::check(out, format.is_file(), overwrite)?;
    let frames = Frames::new(track, options)?;
    let job = Job::new(track, options, frames);
    if format.holds_frames() {
        job.labels.iter().try_for_each(|label| check_word("label", label))?;
    }
    let files = match options.format {
        Format::Mot => Files::One(mot::text(&job)),
        Format::Coco => Files::One(coco::text(&options.name, &[&job])),
        Format::Cvat | Format::CvatObb => Files::One(cvat::text(&job, format.is_rotated())?),
        Format::Yolo | Format::YoloObb => Files::Folder({
            let mut items = yolo::of_clip(&job, yolo::Shape::of(options.format))?;
            items.push(yolo::about(&options.name, &[&job]));
            items
        }),
        Format::Voc => Files::Folder({
            let mut names = voc::Names::default();
            let mut items = voc::of_clip(&job, &mut names);
            items.extend(voc::about(&names, &[&job]));
            items
        }),
        Format::LabelStudio => Files::One(label_studio::text(&job)),
        Format::Lasot => Files::Folder(lasot::items(&job)?),
        Format::Got10k => Files::Folder(got10k::items(&job)?),
    };
    output::check_not(stopped)?;
    match files {
        Files::One(text) => output::write_file(out, &text, overwrite).map(|()| 1),
        Files::Folder(items) => {
            let reader = output::Reader::new(options)?;
            let count = items.len();
            output::write_folder(out, vec![(items, reader)], stopped).map(|()| count)
        }
    }
}

/// Checks whether the format has such key frames.
fn check_key_frames(Options { format, key_frames, .. }: &Options) -> Result<(), Error> {
    match *key_frames == 0 || (*key_frames > 1 && !format.has_key_frames()) {
        false => Ok(()),
        true => Err(Error::Export(format!(
            "every {key_frames}th frame cannot be a key frame of {}: cvat, cvat-obb and label-studio take \
             a number from 1, the other formats have no key frames",
            format.name()
        ))),
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
