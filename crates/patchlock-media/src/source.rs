//! Sources of frames.

use serde::{Deserialize, Serialize};

use crate::{Error, Note, Picture};

/// Frames per second, as a fraction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
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

/// What is known of a source once it is open.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SourceInfo {
    /// The number of frames, if it is known in advance.
    pub length: Option<usize>,
    /// The frame rate, if the source specifies one.
    pub rate: Option<FrameRate>,
    /// Whether the source also has sound, which this crate does not read.
    pub sound: bool,
}

/// A sequence of frames, numbered from 0 in presentation order.
///
/// Reading frames in increasing order is cheap for every source. Decreasing order requires a source
/// that was opened for reverse order; it takes more memory.
pub trait FrameSource: Send {
    /// What is known of the source.
    fn info(&self) -> SourceInfo;

    /// [`SourceInfo::length`].
    fn length(&self) -> Option<usize> {
        self.info().length
    }

    /// [`SourceInfo::rate`].
    fn rate(&self) -> Option<FrameRate> {
        self.info().rate
    }

    /// [`SourceInfo::sound`].
    fn has_sound(&self) -> bool {
        self.info().sound
    }

    /// What a user should know of the frames, found since the last call.
    fn notes(&mut self) -> Vec<Note> {
        Vec::new()
    }

    /// The number of frames. If it is neither known nor told by the file, frames are read to the
    /// end.
    ///
    /// # Errors
    /// As [`FrameSource::frame`].
    fn count(&mut self) -> Result<usize, Error> {
        match self.length() {
            Some(length) => Ok(length),
            None => count_by_reading(self, 0),
        }
    }

    /// Says that frames will be read in increasing order, from `first` on and over `span` frames.
    /// The source may prepare for it; the frames are the same.
    fn announce(&mut self, first: usize, span: usize) {
        let _ = (first, span);
    }

    /// Reads the frame with this index; `None` after the last frame.
    ///
    /// # Errors
    /// [`Error::Frame`], [`Error::Image`] or [`Error::TooLarge`] for a frame that cannot be read,
    /// and others for a source that cannot be read any more.
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
