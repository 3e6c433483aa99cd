//! What can go wrong with frames, said so that the user knows what to change.

use std::fmt::Display;
use std::io;

/// Every error of this crate. Its message names the source or the frame; [`Error::hint`] is the next step.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The range of frames is wrong in itself, or does not fit the source.
    #[error("{message}")]
    Range {
        /// What is wrong with it.
        message: String,
        /// What to do next.
        hint: Option<String>,
    },
    /// A source can't be opened, or a frame of it can't be read.
    #[error("{message}")]
    Source {
        /// Which one, and the reason.
        message: String,
        /// What to do next.
        hint: Option<String>,
    },
    /// A video can't be written: the reason that the system gives. The caller knows the name of the file.
    #[error(transparent)]
    Write(#[from] io::Error),
    /// A frame can't be encoded.
    #[error("{0}")]
    Encode(String),
}

impl Error {
    /// One line: what to do next, where anything can be done.
    pub fn hint(&self) -> Option<&str> {
        match self {
            Self::Range { hint, .. } | Self::Source { hint, .. } => hint.as_deref(),
            Self::Write(_) | Self::Encode(_) => None,
        }
    }

    /// Whether the caller asked for something that can't be: for frames that there are not.
    pub fn is_misuse(&self) -> bool {
        matches!(self, Self::Range { .. })
    }

    /// A range that can't be used.
    pub(crate) fn range(message: impl Into<String>, hint: impl Into<String>) -> Self {
        Self::Range { message: message.into(), hint: Some(hint.into()) }
    }

    /// A source that can't be used, with the next step.
    pub(crate) fn source(message: impl Into<String>, hint: impl Into<String>) -> Self {
        Self::Source { message: message.into(), hint: Some(hint.into()) }
    }

    /// A source that can't be used, where nothing is to be advised.
    pub(crate) fn plain(message: impl Into<String>) -> Self {
        Self::Source { message: message.into(), hint: None }
    }

    /// The same as a closure for `map_err`: `what` can't be done, for the reason that follows.
    pub(crate) fn because<E: Display>(what: String) -> impl FnOnce(E) -> Self {
        move |reason| Self::plain(format!("{what}: {reason}"))
    }
}

/// The cause in an error of a temporary file, which adds the file's name: that is of no use to users, who
/// know another one. `None` for other errors.
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
        let error = tempfile::NamedTempFile::new_in(folder.path().join("there")).unwrap_err();
        assert!(error.to_string().contains("at path"), "{error}");
        assert!(!without_path(&error).unwrap().to_string().contains("at path"));
        assert!(without_path(&io::Error::other("words")).is_none());
    }
}
