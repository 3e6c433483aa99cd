//! Errors of projects.

use std::io;
use std::path::{Path, PathBuf};

/// An error of a project or its file. The message states what is wrong, with the value and what is
/// allowed. [`Error::advice`] is for users of any front end; what names an option is worded by the
/// front end.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The file is not a valid project.
    #[error("{} is not a valid project: {reason}", path.display())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// The file with the labels of a folder is not valid.
    #[error("the labels of the clips in {} are not valid: {reason}", path.display())]
    Labels {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// The file is a project of a version that this program does not know.
    #[error(
        "{} is a project of version {version}; this program reads versions up to {}",
        path.display(),
        super::file::VERSION
    )]
    Version {
        /// The file.
        path: PathBuf,
        /// Its version.
        version: u64,
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
    /// The project file names a video that is not in its folder, and the caller has named none.
    #[error("{} names a video outside its folder, {}", path.display(), video.display())]
    VideoOutside {
        /// The project file.
        path: PathBuf,
        /// The video, as the file names it.
        video: PathBuf,
    },
    /// An edit is not possible.
    #[error("{0}")]
    Edit(String),
    /// A file cannot be imported.
    #[error("cannot import: {0}")]
    Import(String),
    /// A file or the video cannot be read, a file cannot be written, or the project cannot be
    /// exported.
    #[error(transparent)]
    Track(#[from] patchlock_track::Error),
}

impl From<patchlock_media::Error> for Error {
    fn from(error: patchlock_media::Error) -> Self {
        Self::Track(error.into())
    }
}

impl Error {
    /// [`patchlock_track::Error::Read`] of this path.
    pub(crate) fn read(path: &Path, source: io::Error) -> Self {
        patchlock_track::Error::read(path, source).into()
    }

    /// [`patchlock_track::Error::Write`] of this path.
    pub(crate) fn write(path: &Path, source: io::Error) -> Self {
        patchlock_track::Error::write(path, source).into()
    }

    /// Whether the request was invalid, as opposed to a failure while serving it.
    pub fn is_misuse(&self) -> bool {
        match self {
            Self::OtherVideo { .. }
            | Self::VideoOutside { .. }
            | Self::Edit(_)
            | Self::Import(_) => true,
            Self::Track(error) => error.is_misuse(),
            _ => false,
        }
    }

    /// What the user can do, whichever front end is used; `None` if that depends on the front end,
    /// or nothing helps.
    pub fn advice(&self) -> Option<String> {
        let advice = match self {
            Self::Invalid { .. } => {
                "docs/project-file.md describes the file; it is never written in part, so another \
                 program changed it"
            }
            Self::Labels { .. } => {
                "docs/project-file.md describes the file; without it, the labels are those of the clips"
            }
            Self::Version { .. } => "use the version of Patchlock that wrote it, or a newer one",
            Self::InUse { .. } => "close it there, or work there",
            Self::Overtaken { .. } => "open it again, and repeat the changes",
            Self::Import(_) => "docs/annotating.md says what is read from each format",
            Self::Track(error) => return error.advice(),
            Self::VideoOutside { .. } => "name the video yourself, if the file is to be trusted",
            Self::OtherVideo { .. } | Self::Edit(_) => return None,
        };
        Some(advice.to_string())
    }
}
