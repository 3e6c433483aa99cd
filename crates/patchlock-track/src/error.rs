//! Errors of tracking sessions, settings, networks, tables and exports.

use std::io;
use std::path::{Path, PathBuf};

use patchlock::{NetworkError, PARAMETERS, Preset};
use patchlock_media::without_path;

use crate::names::near_matches;

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
    #[error("cannot read {}: {}", .0.display(), .1)]
    Read(PathBuf, #[source] io::Error),
    /// A line of a text file, counted from 1, is invalid.
    #[error("{}, line {}: {}", .0.display(), .1, .2)]
    Line(PathBuf, usize, String),
    /// A file or folder cannot be written.
    #[error("cannot write {}: {}", .0.display(), .1)]
    Write(PathBuf, #[source] io::Error),
    /// An image file that is a frame cannot be read.
    #[error("cannot read the frame {}: {}", .0.display(), .1)]
    Frame(PathBuf, String),
    /// An image is a link that leaves the folder of the frames.
    #[error("the frame {} is a link to {}, which is not in the folder", .0.display(), .1.display())]
    LinkOutside(PathBuf, PathBuf),
    /// A track cannot be exported with these options.
    #[error("cannot export: {0}")]
    Export(String),
    /// The threads cannot be started.
    #[error("cannot start the threads: {0}")]
    Threads(String),
    /// The tracker failed on a frame of a clip.
    #[error("the tracker failed on frame {0}: {1}")]
    TrackerInFrame(usize, String),
    /// The width or height of the start box, as `X,Y,W,H`, is not 1 to this many pixels.
    #[error("the box {0}: width and height must be 1 to {1} pixels")]
    StartBoxShape(String, f64),
    /// The start box, as `X,Y,W,H`, lies outside the frame of this index and size.
    #[error(
        "the box {} does not fit frame {}, which is {} x {} pixels: no part of the box is in it",
        .0, .1, .2[0], .2[1]
    )]
    StartBoxOutside(String, usize, [usize; 2]),
    /// There is no such preset.
    #[error("unknown preset {}", if .0.is_empty() { "\"\"" } else { .0 })]
    Preset(String),
    /// A settings file cannot be read.
    #[error("cannot read the settings {}: {}", .0.display(), .1)]
    Settings(PathBuf, io::Error),
    /// A settings file is not valid TOML at a line, counted from 1.
    #[error("{}, line {}, is not valid TOML: {}", .0.display(), .1, .2)]
    NoToml(PathBuf, usize, String),
    /// A settings file has settings of several methods.
    #[error("{} has settings of several methods: {}", .0.display(), .1.join(" and "))]
    ManyMethods(PathBuf, Vec<&'static str>),
    /// A setting is not of the form `NAME=VALUE`.
    #[error("{0:?} is not of the form NAME=VALUE")]
    Assignment(String),
    /// A setting, of this file or a single one, is unknown, belongs to another method, or has an
    /// invalid value.
    #[error("{}: {}", .0.as_ref().map_or("settings".into(), |file| file.to_string_lossy()), .1)]
    Setting(Option<PathBuf>, patchlock::Error),
    /// A folder holds no ONNX file.
    #[error("{} holds no file *.onnx", .0.display())]
    NoModel(PathBuf),
    /// A file or folder is no network that can be used.
    #[error("{}: {}", .0.display(), .1)]
    Model(PathBuf, NetworkError),
    /// The library of a runtime cannot be used.
    #[error("{0}")]
    Runtime(NetworkError),
    /// The method needs a network and has none.
    #[error("the method {0} needs a network")]
    MissingModel(&'static str),
    /// The method has no use for a network.
    #[error("the network {} has no effect with the method {}", .0.display(), .1)]
    UnusedModel(PathBuf, &'static str),
    /// There is no network to be run by the library of a runtime.
    #[error("the runtime {} has no effect without a network", .0.display())]
    UnusedRuntime(PathBuf),
    /// A source of frames cannot be used.
    #[error(transparent)]
    Media(#[from] patchlock_media::Error),
}

impl Error {
    /// [`Error::Read`] of this path.
    pub fn read(path: &Path, source: io::Error) -> Self {
        Self::Read(path.to_path_buf(), source)
    }

    /// [`Error::Write`] of this path.
    pub fn write(path: &Path, source: io::Error) -> Self {
        Self::Write(path.to_path_buf(), without_path(&source).unwrap_or(source))
    }

    /// [`Error::Line`] of this file; lines count from 1.
    pub fn line(path: &Path, line: usize, reason: impl Into<String>) -> Self {
        Self::Line(path.to_path_buf(), line, reason.into())
    }

    /// [`Error::Frame`] of this image file.
    pub fn frame(path: &Path, reason: impl ToString) -> Self {
        Self::Frame(path.to_path_buf(), reason.to_string())
    }

    /// Whether the request was invalid (a usage error), as opposed to a failure while serving it.
    pub fn is_misuse(&self) -> bool {
        match self {
            Self::Media(error) => error.is_misuse(),
            Self::Read(..)
            | Self::Line(..)
            | Self::Write(..)
            | Self::Frame(..)
            | Self::LinkOutside(..)
            | Self::Threads(_)
            | Self::TrackerInFrame(..)
            | Self::Settings(..) => false,
            _ => true,
        }
    }

    /// What the user can do, whichever front end is used; `None` if that depends on the front end,
    /// or nothing helps.
    pub fn advice(&self) -> Option<String> {
        let advice = match self {
            Self::Read(..) => READ_ADVICE,
            Self::Write(..) => WRITE_ADVICE,
            Self::Line(..) => "a line is x,y,w,h; a missing box is NaN,NaN,NaN,NaN",
            Self::Frame(..) => "replace the file",
            Self::LinkOutside(..) => "look at what it leads to, then put a copy in its place",
            Self::Preset(_) => {
                let names = Preset::ALL.map(Preset::name).join(", ");
                return Some(format!("the presets are {names}"));
            }
            Self::NoToml(..) => "each line is name = value, with text values in quotes",
            Self::ManyMethods(..) => "keep the table of one method",
            Self::Setting(_, patchlock::Error::UnknownSetting { name }) => {
                let near = near_matches(name, PARAMETERS.iter().map(|parameter| parameter.name));
                return (!near.is_empty()).then(|| format!("did you mean {}?", near.join(" or ")));
            }
            Self::NoModel(_) => "give the folder with the model's *.onnx files",
            Self::Model(_, NetworkError::Incomplete { .. }) => "give the folder with both files",
            Self::Media(error) => return error.advice(),
            _ => return None,
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
