//! Errors of reading and writing frames.

use std::fmt::Display;
use std::io;

/// An error of this crate. The message names the source or the frame; [`Error::hint`] suggests what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The range of frames is invalid, or does not fit the source.
    #[error("{message}")]
    Range {
        /// What is wrong.
        message: String,
        /// What the user can do about it.
        hint: Option<String>,
    },
    /// A source cannot be opened, or one of its frames cannot be read.
    #[error("{message}")]
    Source {
        /// The source or frame, and the reason.
        message: String,
        /// What the user can do about it.
        hint: Option<String>,
    },
    /// A video cannot be written. The caller knows the name of the file.
    #[error(transparent)]
    Write(#[from] io::Error),
    /// A frame cannot be encoded.
    #[error("{0}")]
    Encode(String),
}

impl Error {
    /// One line on what the user can do about the error, if anything.
    pub fn hint(&self) -> Option<&str> {
        match self {
            Self::Range { hint, .. } | Self::Source { hint, .. } => hint.as_deref(),
            Self::Write(_) | Self::Encode(_) => None,
        }
    }

    /// Whether the request was invalid (a usage error), as opposed to a failure while serving it.
    pub fn is_misuse(&self) -> bool {
        matches!(self, Self::Range { .. })
    }

    /// [`Error::Range`] with a hint.
    pub(crate) fn range(message: impl Into<String>, hint: impl Into<String>) -> Self {
        Self::Range { message: message.into(), hint: Some(hint.into()) }
    }

    /// [`Error::Source`] with a hint.
    pub(crate) fn source(message: impl Into<String>, hint: impl Into<String>) -> Self {
        Self::Source { message: message.into(), hint: Some(hint.into()) }
    }

    /// [`Error::Source`] without a hint.
    pub(crate) fn plain(message: impl Into<String>) -> Self {
        Self::Source { message: message.into(), hint: None }
    }

    /// A closure for `map_err` that turns an error into `{what}: {error}`.
    pub(crate) fn because<E: Display>(what: String) -> impl FnOnce(E) -> Self {
        move |reason| Self::plain(format!("{what}: {reason}"))
    }
}

/// The cause of an error of the `tempfile` crate, without the path that the crate appends: users know the
/// file under another name. `None` for other errors.
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
    fn paths_of_temporary_files_are_removed() {
        let folder = tempfile::tempdir().unwrap();
        let error = tempfile::NamedTempFile::new_in(folder.path().join("there")).unwrap_err();
        assert!(error.to_string().contains("at path"), "{error}");
        assert!(!without_path(&error).unwrap().to_string().contains("at path"));
        assert!(without_path(&io::Error::other("words")).is_none());
    }
}
