//! Errors of the benchmark, with hints for the user.

use std::io;
use std::path::{Path, PathBuf};

use patchlock_media::without_path;

use crate::dataset::selection::SelectionError;
use crate::settings::SettingsError;
use crate::start_box;

/// An error of this crate. The message names the file or option and the reason; [`Error::advice`] suggests
/// what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file or folder cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
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
    /// A line of a text file is invalid.
    #[error("{}, line {line}: {reason}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// Line, counted from 1.
        line: usize,
        /// What is wrong.
        reason: String,
    },
    /// A file or folder cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
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
    /// A frame cannot be read.
    #[error("cannot read the frame {}: {reason}", path.display())]
    Frame {
        /// The image file.
        path: PathBuf,
        /// The reason.
        reason: String,
    },
    /// The tracker failed on an image file.
    #[error("the tracker failed on {}: {reason}", path.display())]
    Tracker {
        /// The image file.
        path: PathBuf,
        /// The reason given by the tracker.
        reason: String,
    },
    /// A track cannot be exported with these options.
    #[error("cannot export: {0}")]
    Export(String),
    /// A tracker cannot be started.
    #[error("{0}")]
    Subject(String),
    /// The threads cannot be started.
    #[error("cannot start the threads: {0}")]
    Threads(String),
    /// The tracker failed on a frame of a clip.
    #[error("the tracker failed on frame {index}: {reason}")]
    TrackerInFrame {
        /// Index of the frame.
        index: usize,
        /// The reason given by the tracker.
        reason: String,
    },
    /// The width or height of the start box is invalid.
    #[error("the box {shown}: width and height must be 1 to {max} pixels")]
    StartBoxShape {
        /// The box as `X,Y,W,H`.
        shown: String,
        /// The largest allowed width and height, in pixels.
        max: f64,
    },
    /// The start box lies outside the frame.
    #[error(
        "the box {shown} does not fit frame {index}, which is {width} x {height} pixels: \
         no part of the box is in it"
    )]
    StartBoxOutside {
        /// The box as `X,Y,W,H`.
        shown: String,
        /// Index of the frame.
        index: usize,
        /// Width of the frame in pixels.
        width: usize,
        /// Height of the frame in pixels.
        height: usize,
    },
    /// The dataset has no frames to track on.
    #[error("{} has ground truth but no frames", path.display())]
    NoFrames {
        /// The dataset.
        path: PathBuf,
    },
    /// The command line of an external tracker is invalid.
    #[error("--cmd {0}: not a valid command line")]
    CommandLine(String),
    /// The name of a folder of results is invalid.
    #[error("--name {0:?}: not a valid folder name")]
    FolderName(String),
    /// A selection of targets is invalid.
    #[error(transparent)]
    Selection(#[from] SelectionError),
    /// The settings are invalid.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// A source of frames cannot be used.
    #[error(transparent)]
    Media(#[from] patchlock_media::Error),
}

impl Error {
    /// Shorthand that copies the path.
    pub(crate) fn read(path: &Path, source: io::Error) -> Self {
        Self::Read { path: path.to_path_buf(), source }
    }

    /// Shorthand that copies the path.
    pub(crate) fn write(path: &Path, source: io::Error) -> Self {
        let source = without_path(&source).unwrap_or(source);
        Self::Write { path: path.to_path_buf(), source }
    }

    /// Whether the request was invalid (a usage error), as opposed to a failure while serving it.
    pub fn is_misuse(&self) -> bool {
        match self {
            Self::NoDataset { .. }
            | Self::NoResults { .. }
            | Self::Conflict { .. }
            | Self::Export(_)
            | Self::StartBoxShape { .. }
            | Self::StartBoxOutside { .. }
            | Self::NoFrames { .. }
            | Self::CommandLine(_)
            | Self::FolderName(_)
            | Self::Selection(_) => true,
            Self::Settings(error) => error.is_misuse(),
            Self::Media(error) => error.is_misuse(),
            _ => false,
        }
    }

    /// One line on what the user can do about the error, if anything.
    pub fn advice(&self) -> Option<String> {
        match self {
            Self::Selection(error) => Some(error.advice()),
            Self::Settings(error) => error.advice(),
            Self::Media(error) => error.hint().map(str::to_string),
            other => other.fixed_advice().map(str::to_string),
        }
    }

    /// The advice for variants whose advice does not depend on their fields.
    fn fixed_advice(&self) -> Option<&'static str> {
        Some(match self {
            Self::Read { .. } => {
                "check that the path is right and that you have permission to read it"
            }
            Self::NoDataset { .. } => {
                "name the folder of the sequences; patchlock dataset DIR lists what a folder holds"
            }
            Self::NoResults { .. } => {
                "name a tracker's folder with one text file per target, or a folder of such folders"
            }
            Self::Write { .. } => {
                "choose a folder that you can write to, and check the free disk space"
            }
            Self::Manifest { .. } => "remove the file, so that the run is made again",
            Self::Conflict { .. } => {
                "choose another name with --name, or another folder with --out"
            }
            Self::Sequence(_) => "patchlock dataset DIR lists the problems of each sequence",
            Self::Frame { .. } => "replace the file",
            Self::Tracker { .. } | Self::Subject(_) => "the other sequences are not affected",
            Self::Export(_) => "patchlock export --help describes what each format needs",
            Self::NothingToCompare { .. } => {
                "patchlock score RESULTS --truth DATASET lists the trackers and targets"
            }
            Self::Picture { .. } => "this is a bug in Patchlock: please report it",
            Self::Line { .. } => "a line is x,y,w,h; a missing box is NaN,NaN,NaN,NaN",
            Self::StartBoxShape { .. } => start_box::SYNTAX,
            Self::StartBoxOutside { .. } => {
                "the box is for the first tracked frame; with --reverse that is the last frame of the range"
            }
            Self::NoFrames { .. } => {
                "name the folder of the sequences; patchlock dataset DIR shows what was detected"
            }
            Self::CommandLine(_) => "quote it as in a shell: --cmd \"python3 'my tracker.py'\"",
            Self::FolderName(_) => "use letters, digits, - and _, at most 200 of them",
            Self::Selection(_)
            | Self::Settings(_)
            | Self::Media(_)
            | Self::Threads(_)
            | Self::TrackerInFrame { .. } => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_of_temporary_files_are_removed() {
        let folder = tempfile::tempdir().unwrap();
        let there = folder.path().join("there");
        let error = tempfile::NamedTempFile::new_in(&there).unwrap_err();
        assert!(error.to_string().contains("at path"), "{error}");
        let message = Error::write(&there, error).to_string();
        assert!(message.starts_with("cannot write ") && !message.contains("at path"), "{message}");
    }
}
