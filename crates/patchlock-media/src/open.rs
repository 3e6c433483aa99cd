//! Opens a source of frames by its name.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use crate::ffmpeg::{self, Program};
use crate::find::{OpenedSource, find_guarded, guarded, images_of};
use crate::image_sequence::ImageSequence;
use crate::limits::Limits;
use crate::{Error, FrameSource, sandbox};

/// Opens a folder of images, a printf pattern, a glob, an image, a video file, or `-` for Y4M on
/// standard input. With `reverse`, frames can be read from the last to the first.
///
/// # Errors
/// [`Error::Missing`] if there is no such source; others if it cannot be opened.
pub fn open(name: impl AsRef<OsStr>, reverse: bool) -> Result<Box<dyn FrameSource>, Error> {
    open_within(name, reverse, Limits::default())
}

/// Opens a source as [`open`] does, with other limits on what a file may claim, or in another
/// process, if the limits name a helper for that.
///
/// # Errors
/// As [`open`].
pub fn open_within(
    name: impl AsRef<OsStr>,
    reverse: bool,
    limits: Limits,
) -> Result<Box<dyn FrameSource>, Error> {
    open_by(name.as_ref(), reverse, limits, Some(Program::default()))
}

/// Opens a source as [`open_within`] does, but without `program` gives an error for what needs ffmpeg.
/// Fuzzing tries our own readers with it; it is no part of the public interface.
///
/// # Errors
/// As [`open`].
#[doc(hidden)]
pub fn open_by(
    name: &OsStr,
    reverse: bool,
    limits: Limits,
    program: Option<Program>,
) -> Result<Box<dyn FrameSource>, Error> {
    let found = match sandbox::find(name, reverse, limits) {
        Some(found) => found?,
        None => find_guarded(name, reverse, limits, program.clone())?,
    };
    let path = Path::new(name);
    match (found, program) {
        (OpenedSource::Source(source), _) => Ok(source),
        (OpenedSource::ForFfmpeg { reason, times }, Some(program)) => {
            guarded(name, || ffmpeg::open(path, &reason, reverse, limits, times, program))
        }
        (OpenedSource::ForFfmpeg { reason, .. }, None) => {
            let reason = format!("it {reason}, which ffmpeg would read");
            Err(Error::unreadable(path.display(), reason))
        }
    }
}

/// The files that [`open`] would read for this name: none for standard input, and for what cannot
/// be opened.
pub fn files_of(name: impl AsRef<OsStr>) -> Vec<PathBuf> {
    let name = name.as_ref();
    let path = Path::new(name);
    let images = match name.to_str() {
        Some("-") => return Vec::new(),
        _ if path.is_dir() => Some(ImageSequence::folder(path)),
        _ if path.exists() => return vec![path.to_path_buf()],
        _ => images_of(name),
    };
    images.and_then(Result::ok).map(ImageSequence::into_files).unwrap_or_default()
}
