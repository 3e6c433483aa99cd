//! Frame sources, and how to open one by name.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::image_sequence::{ImageSequence, Pattern};
use crate::limits::Limits;
use crate::mp4_reader::{self, Mp4};
use crate::{Error, FrameFault, Picture, ffmpeg, guard, image_file, y4m};

/// Frames per second, as a fraction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameRate {
    /// Numerator: number of frames.
    pub frames: u32,
    /// Denominator: the seconds that these frames take.
    pub seconds: u32,
}

impl FrameRate {
    /// Assumed if a source does not specify its frame rate.
    pub const DEFAULT: Self = Self { frames: 30, seconds: 1 };

    /// `None` if either number is 0.
    pub fn new(frames: u32, seconds: u32) -> Option<Self> {
        (frames > 0 && seconds > 0).then_some(Self { frames, seconds })
    }

    /// When the frame with this index is shown, in seconds, if all frames last equally long.
    pub(crate) fn time(self, index: usize) -> f64 {
        index as f64 * f64::from(self.seconds) / f64::from(self.frames)
    }
}

/// A sequence of frames, numbered from 0 in presentation order.
///
/// Reading frames in increasing order is cheap for every source. Decreasing order requires a source that was
/// opened for reverse order; it takes more memory.
pub trait FrameSource: Send {
    /// The number of frames, if it is known in advance.
    fn length(&self) -> Option<usize>;

    /// The frame rate, if the source specifies one.
    fn rate(&self) -> Option<FrameRate>;

    /// Whether the source also has sound, which this crate does not read.
    fn has_sound(&self) -> bool {
        false
    }

    /// The number of frames. If it is neither known nor told by the file, frames are read to the end.
    ///
    /// # Errors
    /// As [`FrameSource::frame`].
    fn count(&mut self) -> Result<usize, Error> {
        match self.length() {
            Some(length) => Ok(length),
            None => count_by_reading(self, 0),
        }
    }

    /// Reads the frame with this index; `None` after the last frame.
    ///
    /// # Errors
    /// [`Error::Frame`], [`Error::Image`] or [`Error::TooLarge`] for a frame that cannot be read, and others
    /// for a source that cannot be read any more.
    fn frame(&mut self, index: usize) -> Result<Option<Picture>, Error>;
}

/// The number of frames of a source of which this many are known to be there.
pub(crate) fn count_by_reading(
    source: &mut (impl FrameSource + ?Sized),
    known: usize,
) -> Result<usize, Error> {
    let mut count = known;
    while source.frame(count)?.is_some() {
        count += 1;
    }
    Ok(count)
}

/// Opens a folder of images, a printf pattern, a glob, an image, a video file, or `-` for Y4M on standard
/// input. With `reverse`, frames can be read from the last to the first.
///
/// # Errors
/// [`Error::Missing`] if there is no such source; others if it cannot be opened.
pub fn open(name: &str, reverse: bool) -> Result<Box<dyn FrameSource>, Error> {
    open_within(name, reverse, Limits::default())
}

/// Opens a source as [`open`] does, with other limits on what a file may claim.
///
/// # Errors
/// As [`open`].
pub fn open_within(
    name: &str,
    reverse: bool,
    limits: Limits,
) -> Result<Box<dyn FrameSource>, Error> {
    let others: OtherFormats = |path, reason, reverse, limits, times| {
        ffmpeg::open(path, reason, reverse, limits, times, ffmpeg::Program::default())
    };
    guarded(name, || open_unguarded(name, reverse, limits, others))
}

/// Opens a source as [`open`] does, but gives an error for what needs ffmpeg. Fuzzing tries our own readers
/// with it; it is no part of the public interface.
///
/// # Errors
/// As [`open`].
#[doc(hidden)]
pub fn open_without_ffmpeg(name: &str, reverse: bool) -> Result<Box<dyn FrameSource>, Error> {
    let refuse: OtherFormats = |path, reason, _, _, _| {
        Err(Error::unreadable(path.display(), format!("it {reason}, which ffmpeg would read")))
    };
    guarded(name, || open_unguarded(name, reverse, Limits::default(), refuse))
}

/// Opens a source whose decoder may panic.
fn guarded(
    name: &str,
    open: impl FnOnce() -> Result<Box<dyn FrameSource>, Error>,
) -> Result<Box<dyn FrameSource>, Error> {
    let source = guard::decoding(open).map_err(|panicked| Error::unreadable(name, panicked))?;
    Ok(Box::new(Guarded { source: source?, name: name.to_string() }))
}

/// What reads the formats that we do not, as [`ffmpeg::open`].
type OtherFormats =
    fn(&Path, &str, bool, Limits, Option<Vec<i64>>) -> Result<Box<dyn FrameSource>, Error>;

/// A source whose decoder may panic.
struct Guarded {
    source: Box<dyn FrameSource>,
    name: String,
}

impl FrameSource for Guarded {
    fn length(&self) -> Option<usize> {
        self.source.length()
    }

    fn rate(&self) -> Option<FrameRate> {
        self.source.rate()
    }

    fn has_sound(&self) -> bool {
        self.source.has_sound()
    }

    fn count(&mut self) -> Result<usize, Error> {
        guard::decoding(|| self.source.count()).unwrap_or_else(|panicked| {
            let reason = format!("its frames cannot be counted: {panicked}");
            Err(Error::unreadable(&self.name, reason))
        })
    }

    fn frame(&mut self, index: usize) -> Result<Option<Picture>, Error> {
        guard::decoding(|| self.source.frame(index)).unwrap_or_else(|panicked| {
            let (name, fault) = (self.name.clone(), FrameFault::Unreadable);
            Err(Error::Frame { index, name, fault, reason: panicked.to_string() })
        })
    }
}

fn open_unguarded(
    name: &str,
    reverse: bool,
    limits: Limits,
    others: OtherFormats,
) -> Result<Box<dyn FrameSource>, Error> {
    if name == "-" {
        return y4m::open_stream(std::io::stdin(), "standard input", reverse, limits, None, 0);
    }
    let path = Path::new(name);
    // An existing file or folder takes precedence over a pattern or glob of the same name.
    if path.is_dir() {
        return Ok(Box::new(ImageSequence::folder(path)?.within(limits)));
    }
    if path.exists() {
        return open_file(path, reverse, limits, others);
    }
    if let Some(pattern) = Pattern::parse(name) {
        return Ok(Box::new(ImageSequence::pattern(name, &pattern)?.within(limits)));
    }
    if name.contains(['*', '?', '[']) {
        return Ok(Box::new(ImageSequence::glob(name)?.within(limits)));
    }
    Err(Error::Missing { name: name.to_string() })
}

fn open_file(
    path: &Path,
    reverse: bool,
    limits: Limits,
    others: OtherFormats,
) -> Result<Box<dyn FrameSource>, Error> {
    // Opening a pipe could wait for ever, and a device may never end.
    if path.metadata().is_ok_and(|found| !found.is_file()) {
        return Err(Error::Endless { path: path.to_path_buf() });
    }
    let mut head = Vec::new();
    File::open(path)
        .and_then(|file| file.take(16).read_to_end(&mut head))
        .map_err(|error| Error::unreadable(path.display(), error))?;
    if head.is_empty() {
        return Err(Error::unreadable(path.display(), "the file is empty"));
    }
    if head.starts_with(y4m::MAGIC) {
        return Ok(Box::new(y4m::Y4mFile::open(path, limits)?));
    }
    if image_file::is_image(path) {
        return Ok(Box::new(ImageSequence::single(path).within(limits)));
    }
    if !mp4_reader::looks_like_mp4(&head) {
        return others(path, "is not an image, MP4 or Y4M file", reverse, limits, None);
    }
    match Mp4::open(path, reverse, limits) {
        Ok(video) => Ok(Box::new(video)),
        Err(mp4_reader::OpenError::Codec(codec)) => {
            let times = mp4_reader::frame_times(path);
            others(path, &format!("holds {codec}"), reverse, limits, times)
        }
        Err(mp4_reader::OpenError::Broken(error)) => Err(error),
    }
}
