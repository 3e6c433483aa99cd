//! What can go wrong, said so that the user knows what to change.

use std::io;
use std::path::{Path, PathBuf};

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

    /// One line: what to do next.
    pub fn advice(&self) -> &'static str {
        match self {
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
        }
    }
}

/// The cause in an error of a temporary file, which adds the file's name: that is of no use to who knows another one. `None` for other errors.
pub fn without_path(error: &io::Error) -> Option<io::Error> {
    error.get_ref()?;
    let text = error.to_string();
    let (cause, _) = text.split_once(" at path \"")?;
    Some(io::Error::new(error.kind(), cause))
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
        assert!(without_path(&io::Error::other("words")).is_none());
    }
}
