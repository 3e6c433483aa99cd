//! What can go wrong, said so that the user knows what to change.

use std::io;
use std::path::{Path, PathBuf};

use patchlock_media::without_path;

use crate::dataset::selection::SelectionError;
use crate::settings::SettingsError;
use crate::start_box;

/// Every error of this crate. Each names the place and the reason; [`Error::advice`] is the next step.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file or folder can't be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// The reason that the system gives.
        source: io::Error,
    },
    /// The folder holds no sequences in a layout that is known.
    #[error("{} is no dataset: {reason}", path.display())]
    NoDataset {
        /// The folder.
        path: PathBuf,
        /// What was looked for.
        reason: String,
    },
    /// The folder or file holds no results in a layout that is known.
    #[error("{} holds no results: {reason}", path.display())]
    NoResults {
        /// The folder or file.
        path: PathBuf,
        /// What was looked for.
        reason: String,
    },
    /// Trackers that can't be put side by side.
    #[error("there is nothing to compare: {reason}")]
    NothingToCompare {
        /// What is missing.
        reason: String,
    },
    /// A picture that can't be drawn.
    #[error("cannot draw: {reason}")]
    Picture {
        /// The reason.
        reason: String,
    },
    /// A line of a file of boxes is not a box.
    #[error("{}, line {line}: {reason}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// Line, counted from 1.
        line: usize,
        /// What is wrong with it.
        reason: String,
    },
    /// A file or folder can't be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// The reason that the system gives.
        source: io::Error,
    },
    /// A manifest of a run is damaged.
    #[error("{} is no manifest: {reason}", path.display())]
    Manifest {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// A folder holds the runs of something else.
    #[error("{} holds runs of something else: {difference}", path.display())]
    Conflict {
        /// The folder.
        path: PathBuf,
        /// What is different.
        difference: String,
    },
    /// The frames of a sequence can't be used.
    #[error("{0}")]
    Sequence(String),
    /// A frame can't be read.
    #[error("cannot read the frame {}: {reason}", path.display())]
    Frame {
        /// The image file.
        path: PathBuf,
        /// The reason.
        reason: String,
    },
    /// The tracker stopped in a frame.
    #[error("the tracker stopped at {}: {reason}", path.display())]
    Tracker {
        /// The image file.
        path: PathBuf,
        /// The reason that it gives.
        reason: String,
    },
    /// A track can't be exported as it is asked for.
    #[error("cannot export: {0}")]
    Export(String),
    /// A tracker can't be made ready.
    #[error("{0}")]
    Subject(String),
    /// The threads can't be started.
    #[error("cannot start the threads: {0}")]
    Threads(String),
    /// The tracker stopped in a frame of a clip.
    #[error("the tracker stopped in frame {index}: {reason}")]
    TrackerInFrame {
        /// Number of the frame.
        index: usize,
        /// The reason that it gives.
        reason: String,
    },
    /// The box to begin on is no box.
    #[error("the box {shown}: width and height must be 1 to {max} pixels")]
    StartBoxShape {
        /// The box, as `X,Y,W,H`.
        shown: String,
        /// The longest side that is allowed, in pixels.
        max: f64,
    },
    /// The box to begin on is beside the frame.
    #[error(
        "the box {shown} does not fit to frame {index}, which is {width} x {height} pixels: \
         no part of the box is in it"
    )]
    StartBoxOutside {
        /// The box, as `X,Y,W,H`.
        shown: String,
        /// Number of the frame.
        index: usize,
        /// Width of the frame in pixels.
        width: usize,
        /// Height of the frame in pixels.
        height: usize,
    },
    /// A dataset that nothing can be tracked on.
    #[error("{} holds truth without frames", path.display())]
    NoFrames {
        /// The dataset.
        path: PathBuf,
    },
    /// What is to be the command line of another tracker.
    #[error("--cmd {0}: it is no command line")]
    CommandLine(String),
    /// What is to be the name of a folder of results.
    #[error("--name {0}: it is the name of a folder in --out")]
    FolderName(String),
    /// Targets that a dataset does not have.
    #[error(transparent)]
    Selection(#[from] SelectionError),
    /// Settings that can't be used.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// A source of frames can't be used.
    #[error(transparent)]
    Media(#[from] patchlock_media::Error),
}

impl Error {
    /// The same for any path.
    pub(crate) fn read(path: &Path, source: io::Error) -> Self {
        Self::Read { path: path.to_path_buf(), source }
    }

    /// The same for any path.
    pub(crate) fn write(path: &Path, source: io::Error) -> Self {
        let source = without_path(&source).unwrap_or(source);
        Self::Write { path: path.to_path_buf(), source }
    }

    /// Whether the caller asked for something that can't be, rather than the work being impossible.
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

    /// One line: what to do next, where anything can be done.
    pub fn advice(&self) -> Option<String> {
        match self {
            Self::Selection(error) => Some(error.advice()),
            Self::Settings(error) => error.advice(),
            Self::Media(error) => error.hint().map(str::to_string),
            other => other.fixed_advice().map(str::to_string),
        }
    }

    /// The advice that does not depend on what is in the error.
    fn fixed_advice(&self) -> Option<&'static str> {
        Some(match self {
            Self::Read { .. } => "check the name and that you may read it",
            Self::NoDataset { .. } => {
                "name the folder that holds the sequences; patchlock dataset DIR says what is in a folder"
            }
            Self::NoResults { .. } => {
                "name a tracker's folder with one text file a target, or a folder of such folders"
            }
            Self::Write { .. } => "choose a folder that you may write in, and look at the disk",
            Self::Manifest { .. } => {
                "remove the file; the run that it belongs to is then made again"
            }
            Self::Conflict { .. } => {
                "--name gives these runs a folder of their own, --out another place"
            }
            Self::Sequence(_) => "patchlock dataset DIR says what is wrong with each sequence",
            Self::Frame { .. } => "replace the file",
            Self::Tracker { .. } | Self::Subject(_) => "the other sequences are not affected",
            Self::Export(_) => "patchlock export --help says what each format asks for",
            Self::NothingToCompare { .. } => {
                "patchlock score RESULTS --truth DATASET says which trackers and targets there are"
            }
            Self::Picture { .. } => "this is a fault of the program: please report it",
            Self::Line { .. } => {
                "a line is x,y,w,h; a box that the tracker did not give is NaN,NaN,NaN,NaN"
            }
            Self::StartBoxShape { .. } => start_box::SYNTAX,
            Self::StartBoxOutside { .. } => {
                "the box holds for the first frame that is tracked; with --reverse that is the last of \
                 the range"
            }
            Self::NoFrames { .. } => {
                "name the folder of the sequences; patchlock dataset DIR shows what is recognised"
            }
            Self::CommandLine(_) => {
                "quote it as a shell wants it: --cmd \"python3 'my tracker.py'\""
            }
            Self::FolderName(_) => "letters, digits, - and _ are good",
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
    fn temporary_files_are_not_named() {
        let folder = tempfile::tempdir().unwrap();
        let there = folder.path().join("there");
        let error = tempfile::NamedTempFile::new_in(&there).unwrap_err();
        assert!(error.to_string().contains("at path"), "{error}");
        let said = Error::write(&there, error).to_string();
        assert!(said.starts_with("cannot write ") && !said.contains("at path"), "{said}");
    }
}
