//! The frames of a track: their size, number, names and image files.

use std::path::{Path, PathBuf};

use patchlock_media::{Limits, image_file};

use super::{Content, ImageUse, Item, Options, Track};
use crate::{Error, files};

/// Properties of the frames.
pub struct Frames {
    /// Width and height in pixels; 0 if the format does not need them.
    pub size: (usize, usize),
    /// The number of frames of the clip, if it is known and the format has key frames.
    pub count: Option<usize>,
    images: Images,
}

/// Where the pixels of the frames are.
enum Images {
    None,
    /// The images of a folder, in natural order.
    Files(Vec<PathBuf>),
    /// A video.
    Video(PathBuf),
}

impl Frames {
    /// Lists the images and checks the options against the track and the images.
    pub fn new(track: &Track, options: &Options) -> Result<Self, Error> {
        let format = options.format;
        if options.images.is_some() && format.images == ImageUse::Unused {
            return Err(Error::Export(format!("the format {} does not use images", format.name)));
        }
        let images = match &options.images {
            Some(video) if video.is_file() => Images::Video(video.clone()),
            Some(folder) => Images::Files(images_in(folder, track)?),
            None => Images::None,
        };
        let size = match format.needs_size {
            true => size(track, options, &images)?,
            false => (0, 0),
        };
        let count = match format.has_key_frames {
            true => count(track, options.limits, &images)?,
            false => None,
        };
        Ok(Self { size, count, images })
    }

    /// The file name of a frame: that of its image, or one made from its index.
    pub fn name(&self, frame: usize) -> String {
        match &self.images {
            Images::Files(files) => files::name_of(&files[frame]),
            Images::None | Images::Video(_) => format!("frame_{frame:06}.jpg"),
        }
    }

    /// A copy of the frame's image at this path, or the frame of a video as JPEG, if there is one.
    pub fn copy(&self, frame: usize, path: PathBuf) -> Option<Item> {
        let content = match &self.images {
            Images::None => return None,
            Images::Files(files) => Content::Copy(files[frame].clone()),
            Images::Video(video) => Content::Frame(video.clone(), frame),
        };
        Some(Item { path, content })
    }

    /// The frame's image as JPEG, if there is one: copied if it is a JPEG already, converted
    /// otherwise.
    pub fn jpeg(&self, frame: usize, path: PathBuf) -> Option<Item> {
        let is_jpeg = |file: &Path| files::ends_with(file, "jpg") || files::ends_with(file, "jpeg");
        let item = self.copy(frame, path)?;
        Some(match item.content {
            Content::Copy(file) if !is_jpeg(&file) => Item { content: Content::Jpeg(file), ..item },
            content => Item { content, ..item },
        })
    }
}

fn images_in(folder: &Path, track: &Track) -> Result<Vec<PathBuf>, Error> {
    if !folder.is_dir() {
        return Err(Error::Export(format!(
            "{} is neither a folder of images nor a video",
            folder.display()
        )));
    }
    let files = files::images(folder)?;
    match track.frames().last() {
        Some(&last) if last >= files.len() => Err(Error::Export(format!(
            "the track extends to frame {last}, counted from 0, but {} has {} images",
            folder.display(),
            files.len()
        ))),
        _ => Ok(files),
    }
}

/// The size of the frames: as given, of the images, or as the file of the track has it. They must
/// agree.
fn size(track: &Track, options: &Options, images: &Images) -> Result<(usize, usize), Error> {
    let of_images = match images {
        Images::None => None,
        Images::Files(files) => files.first().map(|first| size_of_image(first)).transpose()?,
        Images::Video(video) => Some(size_of_video(video, options.limits)?),
    };
    let known = [
        ("as given", options.size),
        ("of the images", of_images),
        ("in the file of the track", track.size()),
    ];
    let mut known = known.into_iter().filter_map(|(place, size)| Some((place, size?)));
    let Some((place, size)) = known.next() else {
        return Err(Error::Export(format!(
            "the format {} needs the frame size: give it, or the images",
            options.format.name
        )));
    };
    match known.find(|(_, other)| *other != size) {
        Some((other_place, other)) => Err(Error::Export(format!(
            "the size {place} is {} x {}, but {other_place} it is {} x {}",
            size.0, size.1, other.0, other.1
        ))),
        None if size.0 == 0 || size.1 == 0 => Err(Error::Export(format!(
            "the size is {} x {}; both sides must be at least 1",
            size.0, size.1
        ))),
        None => Ok(size),
    }
}

/// The number of frames of the clip, if it is known: that of the images, or as the track has it.
fn count(track: &Track, limits: Limits, images: &Images) -> Result<Option<usize>, Error> {
    let count = match images {
        Images::None => track.clip_frames(),
        Images::Files(files) => Some(files.len()),
        Images::Video(video) => Some(patchlock_media::open_within(video, false, limits)?.count()?),
    };
    match (track.frames().last(), count) {
        (Some(last), Some(count)) if *last >= count => Err(Error::Export(format!(
            "the track extends to frame {last}, counted from 0, but the clip has {count} frames"
        ))),
        _ => Ok(count),
    }
}

fn size_of_image(file: &Path) -> Result<(usize, usize), Error> {
    image_file::size(file).map_err(|error| Error::frame(file, error))
}

fn size_of_video(video: &Path, limits: Limits) -> Result<(usize, usize), Error> {
    let source = patchlock_media::open_within(video, false, limits)?;
    let first = { source }.frame(0)?;
    let first = first.ok_or_else(|| Error::Export(format!("{} has no frames", video.display())))?;
    Ok((first.width, first.height))
}
