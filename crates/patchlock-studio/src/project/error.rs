//! Errors of projects, with hints for the user.

use std::io;
use std::path::{Path, PathBuf};

use patchlock_media::without_path;

/// An error of a project or its file. The message says what is wrong, with the value and what is allowed;
/// [`Error::hint`] suggests what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
    /// The project file cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
    /// The file is not a valid project.
    #[error("{} is not a valid project: {reason}", path.display())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// The file is a project of a version that this program does not know.
    #[error(
        "{} is a project of version {version}; this program reads version {}",
        path.display(),
        super::file::VERSION
    )]
    Version {
        /// The file.
        path: PathBuf,
        /// Its version.
        version: u64,
    },
    /// There is a project file already.
    #[error("{} exists already", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// Another process has the project open.
    #[error("{} is open in {by}", path.display())]
    InUse {
        /// The project file.
        path: PathBuf,
        /// The other process.
        by: String,
    },
    /// The file has been written by somebody else since it was read.
    #[error("{} has been changed by another program since it was read", path.display())]
    Overtaken {
        /// The file.
        path: PathBuf,
    },
    /// The project belongs to another video.
    #[error("{} belongs to {}, not to {}", path.display(), expected.display(), given.display())]
    OtherVideo {
        /// The project file.
        path: PathBuf,
        /// The video of the project.
        expected: PathBuf,
        /// The video that was given.
        given: PathBuf,
    },
    /// An edit is not possible.
    #[error("{0}")]
    Edit(String),
    /// A file cannot be imported.
    #[error("cannot import: {0}")]
    Import(String),
    /// The project cannot be exported.
    #[error("{message}")]
    Export {
        /// What is wrong.
        message: String,
        /// What the user can do about it.
        hint: Option<String>,
        /// Whether the request was invalid.
        is_misuse: bool,
    },
    /// The video cannot be read.
    #[error(transparent)]
    Video(#[from] patchlock_media::Error),
}

impl Error {
    /// Shorthand that copies the path.
    pub(super) fn read(path: &Path, source: io::Error) -> Self {
        Self::Read { path: path.to_path_buf(), source }
    }

    /// Shorthand that copies the path.
    pub(crate) fn write(path: &Path, source: io::Error) -> Self {
        let source = without_path(&source).unwrap_or(source);
        Self::Write { path: path.to_path_buf(), source }
    }

    /// Whether the request was invalid, as opposed to a failure while serving it.
    pub fn is_misuse(&self) -> bool {
        match self {
            Self::Exists { .. } | Self::OtherVideo { .. } | Self::Edit(_) | Self::Import(_) => true,
            Self::Export { is_misuse, .. } => *is_misuse,
            Self::Video(error) => error.is_misuse(),
            _ => false,
        }
    }

    /// One line on what the user can do about the error, if anything.
    pub fn hint(&self) -> Option<&str> {
        Some(match self {
            Self::Read { .. } => {
                "check that the path is right and that you have permission to read it"
            }
            Self::Write { .. } => {
                "choose a folder that you can write to, and check the free disk space"
            }
            Self::Invalid { .. } => {
                "docs/project-file.md describes the file; it is never written in part, so somebody else \
                 changed it"
            }
            Self::Version { .. } => "use the version of Patchlock that wrote it, or a newer one",
            Self::Exists { .. } => "open it, or name another file",
            Self::InUse { .. } => "close it there, or work there",
            Self::Overtaken { .. } => "open it again, and repeat the changes",
            Self::OtherVideo { .. } => "name another project file with --project",
            Self::Import(_) => "docs/annotating.md says what is read from each format",
            Self::Edit(_) => return None,
            Self::Export { hint, .. } => return hint.as_deref(),
            Self::Video(error) => return error.hint(),
        })
    }
}

impl From<patchlock_track::Error> for Error {
    fn from(error: patchlock_track::Error) -> Self {
        let (hint, is_misuse) = (error.advice(), error.is_misuse());
        Self::Export { message: error.to_string(), hint, is_misuse }
    }
}
