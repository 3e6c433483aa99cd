//! The frames behind a track: their size, their names, and their files where there are any.

use std::path::{Path, PathBuf};

use patchlock_media::image_file;

use super::{Content, Item, Options, Track};
use crate::{Error, files};

/// What is known of the frames.
pub struct Frames {
    /// Width and height; 0 where the format does not ask.
    pub size: (usize, usize),
    /// The images, in natural order; empty where no folder was given.
    files: Vec<PathBuf>,
}

impl Frames {
    /// Looks into the folder of images, and checks that what is said fits to what is there.
    pub fn new(track: &Track, options: &Options) -> Result<Self, Error> {
        let format = options.format;
        if options.size.is_some() && !format.needs_size() {
            return Err(wrong(format!("the format {} does not ask for a size", format.name())));
        }
        if options.images.is_some() && !format.needs_size() && !format.holds_frames() {
            return Err(wrong(format!("the format {} does not ask for images", format.name())));
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
                return Err(wrong(format!(
                    "the format {} asks for the size of the frames: give it, or the folder of the images",
                    format.name()
                )));
            }
        };
        if format.needs_size() && (size.0 == 0 || size.1 == 0) {
            return Err(wrong(format!(
                "the size is {} x {}; both sides must be at least 1",
                size.0, size.1
            )));
        }
        Ok(Self { size, files })
    }

    /// The name of a frame's file: that of the image, or one made from its number.
    pub fn name(&self, frame: usize) -> String {
        match self.files.get(frame) {
            Some(file) => files::name_of(file),
            None => format!("frame_{frame:06}.jpg"),
        }
    }

    /// The frame's image under this path, where there are images.
    pub fn copy(&self, frame: usize, path: PathBuf) -> Option<Item> {
        let file = self.files.get(frame)?.clone();
        Some(Item { path, content: Content::Copy(file) })
    }

    /// The same as JPEG: a copy where it is one.
    pub fn jpeg(&self, frame: usize, path: PathBuf) -> Option<Item> {
        let file = self.files.get(frame)?.clone();
        let is_jpeg = files::ends_with(&file, "jpg") || files::ends_with(&file, "jpeg");
        let content = if is_jpeg { Content::Copy(file) } else { Content::Jpeg(file) };
        Some(Item { path, content })
    }
}

fn wrong(reason: String) -> Error {
    Error::Export(reason)
}

fn images_in(folder: &Path, track: &Track) -> Result<Vec<PathBuf>, Error> {
    if !folder.is_dir() {
        return Err(wrong(format!("{} is no folder of images", folder.display())));
    }
    let files = files::images(folder)?;
    match track.frames().last() {
        Some(&last) if last >= files.len() => Err(wrong(format!(
            "the track goes to frame {last}, counted from 0, but {} has {} images",
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
        Some(given) if given != own => Err(wrong(format!(
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
