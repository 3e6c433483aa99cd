//! Errors on their way from one process to another.

use std::ffi::OsString;
use std::io;

use serde::{Deserialize, Serialize};

use crate::image_file::LoadError;
use crate::limits::SizeLimitError;
use crate::{Container, Error, FrameFault};

/// An error of a reader of this crate, with all that its message and its advice need.
#[derive(Serialize, Deserialize)]
pub enum WireError {
    Missing { name: String },
    Endless { path: OsString },
    Playlist { path: OsString },
    NoImages { folder: OsString, inner: Option<OsString> },
    NoVideo { name: String },
    TooLarge { what: String, size: SizeLimitError },
    Unreadable { name: String, container: Option<Container>, reason: String },
    Image { index: usize, file: OsString, reason: String },
    Frame { index: usize, name: String, fault: FrameFault, reason: String },
}

impl WireError {
    /// The error of a source of this name.
    pub fn of(error: Error, source: &str) -> Self {
        match error {
            Error::Missing { name } => Self::Missing { name },
            Error::Endless { path } => Self::Endless { path: path.into() },
            Error::Playlist { path } => Self::Playlist { path: path.into() },
            Error::NoImages { folder, inner } => {
                Self::NoImages { folder: folder.into(), inner: inner.map(Into::into) }
            }
            Error::NoVideo { name } => Self::NoVideo { name },
            Error::TooLarge { what, size } => Self::TooLarge { what, size },
            Error::Unreadable { name, container, reason } => {
                Self::Unreadable { name, container, reason }
            }
            Error::Image { index, file, reason } => {
                Self::Image { index, file: file.into(), reason: reason.to_string() }
            }
            Error::Frame { index, name, fault, reason } => {
                Self::Frame { index, name, fault, reason }
            }
            // The others are not of the readers of files.
            error => Self::Unreadable {
                name: source.to_string(),
                container: None,
                reason: error.to_string(),
            },
        }
    }
}

impl From<WireError> for Error {
    fn from(wire_error: WireError) -> Self {
        match wire_error {
            WireError::Missing { name } => Self::Missing { name },
            WireError::Endless { path } => Self::Endless { path: path.into() },
            WireError::Playlist { path } => Self::Playlist { path: path.into() },
            WireError::NoImages { folder, inner } => {
                Self::NoImages { folder: folder.into(), inner: inner.map(Into::into) }
            }
            WireError::NoVideo { name } => Self::NoVideo { name },
            WireError::TooLarge { what, size } => Self::TooLarge { what, size },
            WireError::Unreadable { name, container, reason } => {
                Self::Unreadable { name, container, reason }
            }
            WireError::Image { index, file, reason } => {
                let reason = LoadError::File(io::Error::other(reason));
                Self::Image { index, file: file.into(), reason }
            }
            WireError::Frame { index, name, fault, reason } => {
                Self::Frame { index, name, fault, reason }
            }
        }
    }
}
