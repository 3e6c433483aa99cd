//! Frames in: whatever the user names becomes a [`FrameSource`], which gives frames by number.

mod ahead;
mod ffmpeg;
mod images;
mod mp4;
mod order;
mod sps;
mod y4m;

use std::fs::File;
use std::io::Read;
use std::path::Path;

use anyhow::{Context, Result};

pub use ahead::{Ahead, Next};
pub use order::Order;

use crate::complaint::{failed, named};
use patchlock_eval::picture::Picture;

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

    /// The frame with this number, `None` after the last one. An error names the frame.
    fn frame(&mut self, index: usize) -> Result<Option<Picture>>;
}

/// Opens what the user named. `reverse`: frames will be asked for from the last to the first.
pub fn open(name: &str, reverse: bool) -> Result<Box<dyn FrameSource>> {
    if name == "-" {
        return y4m::open_stream(std::io::stdin(), "standard input", reverse);
    }
    let path = Path::new(name);
    // What is really there wins over what the name could mean as a pattern.
    if path.is_dir() {
        return Ok(Box::new(images::Images::folder(path)?));
    }
    if path.exists() {
        return open_file(path, reverse);
    }
    if let Some(pattern) = images::Pattern::parse(name) {
        return Ok(Box::new(images::Images::pattern(name, &pattern)?));
    }
    if name.contains(['*', '?', '[']) {
        return Ok(Box::new(images::Images::glob(name)?));
    }
    Err(failed(format!("there is no file or folder {}", named(name)))
        .hint("name a folder of images, a pattern such as img/%04d.jpg, a glob, a video file, or - for Y4M on stdin")
        .into())
}

fn open_file(path: &Path, reverse: bool) -> Result<Box<dyn FrameSource>> {
    let mut head = Vec::new();
    let file = File::open(path).with_context(|| format!("cannot open {}", path.display()))?;
    file.take(16)
        .read_to_end(&mut head)
        .with_context(|| format!("cannot read {}", path.display()))?;
    if head.is_empty() {
        return Err(failed(format!("{} is empty", path.display())).into());
    }
    if head.starts_with(y4m::MAGIC) {
        return Ok(Box::new(y4m::Y4mFile::open(path)?));
    }
    if patchlock_eval::images::is_image(path) {
        return Ok(Box::new(images::Images::single(path)));
    }
    if !mp4::looks_like_mp4(&head) {
        return ffmpeg::open(path, "is no image, MP4 or Y4M", reverse);
    }
    match mp4::Mp4::open(path) {
        Ok(video) => Ok(Box::new(video)),
        Err(mp4::OpenError::Codec(codec)) => ffmpeg::open(path, &format!("holds {codec}"), reverse),
        Err(mp4::OpenError::Broken(error)) => Err(error),
    }
}
