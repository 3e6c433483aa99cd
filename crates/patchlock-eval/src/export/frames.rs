//! The frames of a track: their size, names and image files.

use std::path::{Path, PathBuf};

use patchlock_media::image_file;

use super::{Content, Item, Options, Track};
use crate::{Error, files};

/// Properties of the frames.
pub struct Frames {
    /// Width and height in pixels; 0 if the format does not need them.
    pub size: (usize, usize),
    /// The images, in natural order; empty if no folder was given.
    files: Vec<PathBuf>,
}

impl Frames {
    /// Lists the images and checks the options against the track and the images.
    pub fn new(track: &Track, options: &Options) -> Result<Self, Error> {
        let format = options.format;
        if options.size.is_some() && !format.needs_size() {
            return Err(invalid(format!("the format {} does not use a frame size", format.name())));
        }
        if options.images.is_some() && !format.needs_size() && !format.holds_frames() {
            return Err(invalid(format!("the format {} does not use images", format.name())));
        }
        let files = match &options.images {
            Some(folder) => images_in(folder, track)?,
            None => Vec::new(),
        };
        let size = match (options.size, files.first()) {
            _ if !format.needs_size() => (0, 0),
            (Some(size), None) => size,
            (given, Some(first)) => checked_size(given, first)?,
            (None, None) => {
                return Err(invalid(format!(
                    "the format {} needs the frame size: give it, or the folder of the images",
                    format.name()
                )));
            }
        };
        if format.needs_size() && (size.0 == 0 || size.1 == 0) {
            return Err(invalid(format!(
                "the size is {} x {}; both sides must be at least 1",
                size.0, size.1
            )));
        }
        Ok(Self { size, files })
    }

    /// The file name of a frame: that of its image, or one made from its index.
    pub fn name(&self, frame: usize) -> String {
        match self.files.get(frame) {
            Some(file) => files::name_of(file),
            None => format!("frame_{frame:06}.jpg"),
        }
    }

    /// A copy of the frame's image at this path, if there is an image.
    pub fn copy(&self, frame: usize, path: PathBuf) -> Option<Item> {
        let file = self.files.get(frame)?.clone();
        Some(Item { path, content: Content::Copy(file) })
    }

    /// The frame's image as JPEG: copied if it is a JPEG already, converted otherwise.
    pub fn jpeg(&self, frame: usize, path: PathBuf) -> Option<Item> {
        let file = self.files.get(frame)?.clone();
        let is_jpeg = files::ends_with(&file, "jpg") || files::ends_with(&file, "jpeg");
        let content = if is_jpeg { Content::Copy(file) } else { Content::Jpeg(file) };
        Some(Item { path, content })
    }
}

fn invalid(reason: String) -> Error {
    Error::Export(reason)
}

fn images_in(folder: &Path, track: &Track) -> Result<Vec<PathBuf>, Error> {
    if !folder.is_dir() {
        return Err(invalid(format!("{} is not a folder of images", folder.display())));
    }
    let files = files::images(folder)?;
    match track.frames().last() {
        Some(&last) if last >= files.len() => Err(invalid(format!(
            "the track extends to frame {last}, counted from 0, but {} has {} images",
            folder.display(),
            files.len()
        ))),
        _ => Ok(files),
    }
}

fn checked_size(given: Option<(usize, usize)>, first: &Path) -> Result<(usize, usize), Error> {
    let own = image_file::size(first)
        .map_err(|error| Error::Frame { path: first.to_path_buf(), reason: error.to_string() })?;
    match given {
        Some(given) if given != own => Err(invalid(format!(
            "the size is given as {} x {}, but {} has {} x {}",
            given.0,
            given.1,
            first.display(),
            own.0,
            own.1
        ))),
        _ => Ok(own),
    }
}
