//! What a format is. A new one is a module with a `FORMAT`, and its line in the list `FORMATS` of the
//! module `export`: the program, the Python package, the studio and tests of all take what they say
//! from it.

use std::fmt;

use patchlock::Status;

use super::{Error, Item, Job, Track};

/// An export format.
#[derive(Clone, Copy)]
pub struct Format {
    /// The name in commands, such as `coco`.
    pub name: &'static str,
    /// The name for people, such as `COCO with tracks`.
    pub title: &'static str,
    /// What is written, as a phrase in plain English.
    pub content: &'static str,
    /// How frames in which a target is lost are marked, as a phrase; `None` if the format cannot mark
    /// them.
    pub lost: Option<&'static str>,
    /// What the files are for.
    pub purpose: Purpose,
    /// What the format does with the frames.
    pub images: ImageUse,
    /// Whether it needs the frame size.
    pub needs_size: bool,
    /// Whether its boxes are rotated, for which the track needs outlines.
    pub is_rotated: bool,
    /// Whether it is only for outlines of the tracker, which projects do not have.
    pub is_of_tracker: bool,
    /// Whether it is only for projects, and has all that they say.
    pub is_of_project: bool,
    /// Whether it has key frames, between which the tool interpolates.
    pub has_key_frames: bool,
    /// What a person has to know who imports the file of a track, if there is anything.
    pub(super) note: Option<fn(&Track) -> Option<String>>,
    /// The ending and the text of a format that is one file. Of many clips, each has one, unless there
    /// is a folder.
    pub(super) file: Option<(&'static str, Text)>,
    /// The files of a format that is a folder, or of one that is a folder for many clips.
    pub(super) folder: Option<Folder>,
}

/// Makes the text of a file.
pub(super) type Text = fn(&Job<'_>) -> Result<String, Error>;

/// Makes the files of a folder of clips, which have the same labels.
#[derive(Clone, Copy)]
pub(super) struct Folder {
    /// Makes the files of a clip.
    pub clip: fn(&Job<'_>) -> Result<Vec<Item>, Error>,
    /// Makes the files that belong to no clip, for a folder of this name.
    pub common: fn(&str, &[Job<'_>]) -> Vec<Item>,
}

impl Folder {
    /// The files of each clip. What belongs to no clip comes with the first one.
    pub fn files(self, name: &str, jobs: &[Job<'_>]) -> Result<Vec<Vec<Item>>, Error> {
        let clips = jobs.iter().map(|job| (self.clip)(job));
        let mut clips = clips.collect::<Result<Vec<_>, Error>>()?;
        if let Some(first) = clips.first_mut() {
            first.extend((self.common)(name, jobs));
        }
        Ok(clips)
    }
}

/// What the files of a format are for, which decides what is left out of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// Tools and people go on with the track. Boxes are left out singly, and all are written unless
    /// the caller chooses.
    Exchange,
    /// Detectors are trained with single frames, and would learn that a target without its box is
    /// background. Of a frame of which a box is left out, nothing is written. Unless the caller
    /// chooses, boxes are left out that are not tracked.
    Training,
    /// Trackers are judged by sequences. Frames are left out as with [`Purpose::Training`], but all
    /// are written unless the caller chooses.
    Benchmark,
}

/// What a format does with the frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ImageUse {
    /// Nothing.
    Unused,
    /// It has their size and number.
    Measured,
    /// It names them. Of many clips it has copies.
    Named,
    /// It has copies.
    Copied,
}

impl Format {
    /// The properties that most formats have.
    pub(super) const BASE: Self = Self {
        name: "",
        title: "",
        content: "",
        lost: None,
        purpose: Purpose::Exchange,
        images: ImageUse::Measured,
        needs_size: true,
        is_rotated: false,
        is_of_tracker: false,
        is_of_project: false,
        has_key_frames: false,
        note: None,
        file: None,
        folder: None,
    };

    /// The formats of projects, or else those of what a tracker has found.
    pub fn all(of_project: bool) -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().filter(move |format| match of_project {
            true => !format.is_of_tracker,
            false => !format.is_of_project,
        })
    }

    /// The format of this name, of [`Format::all`].
    ///
    /// # Errors
    /// [`Error::Export`] if there is no such format; the message lists the names.
    pub fn named(name: &str, of_project: bool) -> Result<Self, Error> {
        Self::all(of_project).find(|format| format.name == name).ok_or_else(|| {
            let known = Self::all(of_project).map(|format| format.name);
            let known = known.collect::<Vec<_>>().join(", ");
            Error::Export(format!("there is no format {name:?}; the formats are {known}"))
        })
    }

    /// Whether the format includes the frames, which are copied if there are any.
    pub fn holds_frames(&self) -> bool {
        self.images == ImageUse::Copied
    }

    /// Whether an export of many clips has copies of their frames.
    pub fn copies_frames(&self) -> bool {
        matches!(self.images, ImageUse::Copied | ImageUse::Named)
    }

    /// What a person has to know who imports these tracks.
    pub(super) fn notes<'a>(&self, tracks: impl IntoIterator<Item = &'a Track>) -> Vec<String> {
        let notes = tracks.into_iter().filter_map(|track| self.note?(track));
        let mut notes: Vec<String> = notes.collect();
        notes.sort_unstable();
        notes.dedup();
        notes
    }

    /// Whether the format is a single file, as opposed to a folder.
    pub fn is_file(&self) -> bool {
        self.file.is_some()
    }

    /// The ending of the file, without a dot; `None` for a folder.
    pub fn ending(&self) -> Option<&'static str> {
        self.file.map(|(ending, _)| ending)
    }

    /// The statuses whose boxes are written unless the caller chooses.
    pub fn statuses(&self) -> &'static [Status] {
        match self.purpose {
            Purpose::Training => &[Status::Tracked],
            Purpose::Exchange | Purpose::Benchmark => {
                &[Status::Tracked, Status::Uncertain, Status::Lost]
            }
        }
    }
}

impl fmt::Debug for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Format({})", self.name)
    }
}

impl PartialEq for Format {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Eq for Format {}
