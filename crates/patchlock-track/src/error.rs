//! Errors of tracking sessions, settings, tables and exports.

use std::io;
use std::path::{Path, PathBuf};

use patchlock_media::without_path;

use crate::settings::SettingsError;

/// What the user can do about a file or folder that cannot be read.
pub const READ_ADVICE: &str =
    "check that the path is right and that you have permission to read it";
/// What the user can do about a file or folder that cannot be written.
pub const WRITE_ADVICE: &str =
    "choose a folder that you can write to, and check the free disk space";

/// An error of this crate. The message names the file or value and the reason. [`Error::advice`] is
/// for users of any front end; what names an option is worded by the front end.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file or folder cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
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
    /// A frame cannot be read.
    #[error("cannot read the frame {}: {reason}", path.display())]
    Frame {
        /// The image file.
        path: PathBuf,
        /// The reason.
        reason: String,
    },
    /// An image is a link that leaves the folder of the frames.
    #[error("the frame {} is a link to {}, which is not in the folder", path.display(), target.display())]
    LinkOutside {
        /// The link.
        path: PathBuf,
        /// Where it leads.
        target: PathBuf,
    },
    /// A track cannot be exported with these options.
    #[error("cannot export: {0}")]
    Export(String),
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
    /// The settings are invalid.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// A source of frames cannot be used.
    #[error(transparent)]
    Media(#[from] patchlock_media::Error),
}

impl Error {
    /// [`Error::Read`] of this path.
    pub fn read(path: &Path, source: io::Error) -> Self {
        Self::Read { path: path.to_path_buf(), source }
    }

    /// [`Error::Write`] of this path.
    pub fn write(path: &Path, source: io::Error) -> Self {
        let source = without_path(&source).unwrap_or(source);
        Self::Write { path: path.to_path_buf(), source }
    }

    /// [`Error::Line`] of this file; lines count from 1.
    pub fn line(path: &Path, line: usize, reason: impl Into<String>) -> Self {
        Self::Line { path: path.to_path_buf(), line, reason: reason.into() }
    }

    /// [`Error::Frame`] of this image file.
    pub fn frame(path: &Path, reason: impl ToString) -> Self {
        Self::Frame { path: path.to_path_buf(), reason: reason.to_string() }
    }

    /// Whether the request was invalid (a usage error), as opposed to a failure while serving it.
    pub fn is_misuse(&self) -> bool {
        match self {
            Self::Export(_) | Self::StartBoxShape { .. } | Self::StartBoxOutside { .. } => true,
            Self::Settings(error) => error.is_misuse(),
            Self::Media(error) => error.is_misuse(),
            _ => false,
        }
    }

    /// What the user can do, whichever front end is used; `None` if that depends on the front end,
    /// or nothing helps.
    pub fn advice(&self) -> Option<String> {
        let advice = match self {
            Self::Read { .. } => READ_ADVICE,
            Self::Write { .. } => WRITE_ADVICE,
            Self::Line { .. } => "a line is x,y,w,h; a missing box is NaN,NaN,NaN,NaN",
            Self::Frame { .. } => "replace the file",
            Self::LinkOutside { .. } => "look at what it leads to, then put a copy in its place",
            Self::Settings(error) => return error.advice(),
            Self::Media(error) => return error.advice(),
            Self::Export(_)
            | Self::Threads(_)
            | Self::TrackerInFrame { .. }
            | Self::StartBoxShape { .. }
            | Self::StartBoxOutside { .. } => return None,
        };
        Some(advice.to_string())
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
