//! What the user names becomes a [`FrameSource`], which gives frames by number.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::image_sequence::{ImageSequence, Pattern};
use crate::mp4_reader::{self, Mp4};
use crate::{Error, Picture, ffmpeg, image_file, y4m};

/// Frames a second, as a fraction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameRate {
    /// Frames ...
    pub frames: u32,
    /// ... in so many seconds.
    pub seconds: u32,
}

impl FrameRate {
    /// What is taken where a source does not say.
    pub const DEFAULT: Self = Self { frames: 30, seconds: 1 };

    /// `None` for a rate that makes no sense.
    pub fn new(frames: u32, seconds: u32) -> Option<Self> {
        (frames > 0 && seconds > 0).then_some(Self { frames, seconds })
    }
}

/// A sequence of frames, numbered from 0 in the order in which they are shown.
///
/// Asking for rising numbers is cheap everywhere. Sources opened for reverse order also serve falling ones.
pub trait FrameSource: Send {
    /// How many frames there are, where that is known before the end.
    fn length(&self) -> Option<usize>;

    /// Frames a second, where the source says so.
    fn rate(&self) -> Option<FrameRate>;

    /// The frame with this number, `None` after the last one.
    ///
    /// # Errors
    /// Which frame can't be read, and why.
    fn frame(&mut self, index: usize) -> Result<Option<Picture>, Error>;
}

/// Opens what the user named. `reverse`: frames will be asked for from the last to the first.
///
/// # Errors
/// Why it can't be opened.
pub fn open(name: &str, reverse: bool) -> Result<Box<dyn FrameSource>, Error> {
    if name == "-" {
        return y4m::open_stream(std::io::stdin(), "standard input", reverse);
    }
    let path = Path::new(name);
    // What is really there wins over what the name could mean as a pattern.
    if path.is_dir() {
        return Ok(Box::new(ImageSequence::folder(path)?));
    }
    if path.exists() {
        return open_file(path, reverse);
    }
    if let Some(pattern) = Pattern::parse(name) {
        return Ok(Box::new(ImageSequence::pattern(name, &pattern)?));
    }
    if name.contains(['*', '?', '[']) {
        return Ok(Box::new(ImageSequence::glob(name)?));
    }
    let shown = if name.is_empty() { "\"\"" } else { name };
    Err(Error::source(
        format!("there is no file or folder {shown}"),
        "name a folder of images, a pattern such as img/%04d.jpg, a glob, a video file, or - for \
         Y4M on stdin",
    ))
}

fn open_file(path: &Path, reverse: bool) -> Result<Box<dyn FrameSource>, Error> {
    let mut head = Vec::new();
    let file =
        File::open(path).map_err(Error::because(format!("cannot open {}", path.display())))?;
    file.take(16)
        .read_to_end(&mut head)
        .map_err(Error::because(format!("cannot read {}", path.display())))?;
    if head.is_empty() {
        return Err(Error::plain(format!("{} is empty", path.display())));
    }
    if head.starts_with(y4m::MAGIC) {
        return Ok(Box::new(y4m::Y4mFile::open(path)?));
    }
    if image_file::is_image(path) {
        return Ok(Box::new(ImageSequence::single(path)));
    }
    if !mp4_reader::looks_like_mp4(&head) {
        return ffmpeg::open(path, "is no image, MP4 or Y4M", reverse);
    }
    match Mp4::open(path) {
        Ok(video) => Ok(Box::new(video)),
        Err(mp4_reader::OpenError::Codec(codec)) => {
            ffmpeg::open(path, &format!("holds {codec}"), reverse)
        }
        Err(mp4_reader::OpenError::Broken(error)) => Err(error),
    }
}
