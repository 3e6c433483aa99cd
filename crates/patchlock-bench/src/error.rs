//! Errors of the benchmark.

use std::io;
use std::path::{Path, PathBuf};

/// An error of this crate. The message names the file or value and the reason. [`Error::advice`] is
/// for users of any front end; what names an option is worded by the front end.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The folder has no sequences in a supported layout.
    #[error("{} is not a dataset: {reason}", path.display())]
    NoDataset {
        /// The folder.
        path: PathBuf,
        /// What was expected.
        reason: String,
    },
    /// The path has no results in a supported layout.
    #[error("{} holds no results: {reason}", path.display())]
    NoResults {
        /// The folder or file.
        path: PathBuf,
        /// What was expected.
        reason: String,
    },
    /// The trackers cannot be compared.
    #[error("there is nothing to compare: {reason}")]
    NothingToCompare {
        /// The reason.
        reason: String,
    },
    /// A plot or page cannot be drawn.
    #[error("cannot draw: {reason}")]
    Picture {
        /// The reason.
        reason: String,
    },
    /// A manifest is invalid.
    #[error("{} is not a valid manifest: {reason}", path.display())]
    Manifest {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// A folder holds runs of a different tracker, or of different frames.
    #[error("{} already holds different runs: {difference}", path.display())]
    Conflict {
        /// The folder.
        path: PathBuf,
        /// The difference.
        difference: String,
    },
    /// The frames or the ground truth of a sequence cannot be used.
    #[error("{0}")]
    Sequence(String),
    /// The tracker failed on an image file.
    #[error("the tracker failed on {}: {reason}", path.display())]
    Tracker {
        /// The image file.
        path: PathBuf,
        /// The reason given by the tracker.
        reason: String,
    },
    /// A tracker cannot be started.
    #[error("{0}")]
    Subject(String),
    /// The dataset has no frames to track on.
    #[error("{} has ground truth but no frames", path.display())]
    NoFrames {
        /// The dataset.
        path: PathBuf,
    },
    /// The command line of an external tracker is invalid.
    #[error("the command {0}: not a valid command line")]
    CommandLine(String),
    /// The name of a folder of results is invalid.
    #[error("{0:?} is not a valid folder name")]
    FolderName(String),
    /// No target has this name; similar names.
    #[error("the dataset has no target {0}")]
    NoTarget(String, Vec<String>),
    /// No target has this attribute; the attributes that occur in the dataset.
    #[error("no target of the dataset has the attribute {0}")]
    NoAttribute(String, Vec<String>),
    /// No target matches both the names and the attributes.
    #[error("no target is selected: none of the chosen targets has any of the attributes")]
    NothingSelected,
    /// A file, frame or setting cannot be used.
    #[error(transparent)]
    Track(#[from] patchlock_track::Error),
}

impl From<patchlock_media::Error> for Error {
    fn from(error: patchlock_media::Error) -> Self {
        Self::Track(error.into())
    }
}

impl Error {
    /// The file or folder cannot be read.
    pub(crate) fn read(path: &Path, source: io::Error) -> Self {
        patchlock_track::Error::read(path, source).into()
    }

    /// The file or folder cannot be written.
    pub(crate) fn write(path: &Path, source: io::Error) -> Self {
        patchlock_track::Error::write(path, source).into()
    }

    /// A line of a file is invalid; lines count from 1.
    pub(crate) fn line(path: &Path, line: usize, reason: impl Into<String>) -> Self {
        patchlock_track::Error::line(path, line, reason).into()
    }

    /// The image file cannot be read.
    pub(crate) fn frame(path: &Path, reason: impl ToString) -> Self {
        patchlock_track::Error::frame(path, reason).into()
    }

    /// Whether the request was invalid (a usage error), as opposed to a failure while serving it.
    pub fn is_misuse(&self) -> bool {
        match self {
            Self::NoDataset { .. }
            | Self::NoResults { .. }
            | Self::Conflict { .. }
            | Self::NoFrames { .. }
            | Self::CommandLine(_)
            | Self::FolderName(_)
            | Self::NoTarget(..)
            | Self::NoAttribute(..)
            | Self::NothingSelected => true,
            Self::Track(error) => error.is_misuse(),
            _ => false,
        }
    }

    /// What the user can do, whichever front end is used; `None` if that depends on the front end,
    /// or nothing helps.
    pub fn advice(&self) -> Option<String> {
        let advice = match self {
            Self::NoDataset { .. } | Self::NoFrames { .. } => "name the folder of the sequences",
            Self::NoResults { .. } => {
                "name a tracker's folder with one text file per target, or a folder of such folders"
            }
            Self::Picture { .. } => "this is a bug in Patchlock: please report it",
            Self::Manifest { .. } => "remove the file, so that the run is made again",
            Self::Tracker { .. } | Self::Subject(_) => "the other sequences are not affected",
            Self::FolderName(_) => "use letters, digits, - and _, at most 200 of them",
            Self::NoTarget(_, near) if !near.is_empty() => {
                return Some(format!("did you mean {}?", near.join(" or ")));
            }
            Self::NoAttribute(_, known) if known.is_empty() => {
                "the attributes of this dataset are unknown; attributes.csv beside it can define \
                 them"
            }
            Self::NoAttribute(_, known) => {
                return Some(format!("the attributes are {}", known.join(", ")));
            }
            Self::Track(error) => return error.advice(),
            Self::NothingToCompare { .. }
            | Self::Conflict { .. }
            | Self::Sequence(_)
            | Self::CommandLine(_)
            | Self::NoTarget(..)
            | Self::NothingSelected => return None,
        };
        Some(advice.to_string())
    }
}
