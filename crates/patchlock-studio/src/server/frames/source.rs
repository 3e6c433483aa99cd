//! A video that is read frame by frame in any order.

use std::path::Path;

use patchlock_media::{Error, FrameSource, Limits, Picture};

/// Frames read on instead of starting again, and frames prepared after a step forward.
pub(super) const AHEAD: usize = 24;
/// Frames prepared after a step back. A source reads many of them at a time, and may take longer.
pub(super) const BACK: usize = 64;
/// Frames read before the one that a source has to start again for: a step back would take a
/// start, too.
const BEFORE: usize = 12;

/// An open video.
pub(super) struct Source {
    frames: Box<dyn FrameSource>,
    /// Whether it keeps frames for steps back. A source that reads from another program does not:
    /// it has to start again.
    keeps: bool,
    /// The frame after the last one that was read.
    pub(super) next: usize,
}

impl Source {
    pub(super) fn open(path: &Path, limits: Limits, keeps: bool) -> Result<Self, Error> {
        let frames = patchlock_media::open_within(path, false, limits)?;
        // The length is unknown if another program decodes.
        let keeps = keeps && frames.length().is_some();
        let frames = match keeps {
            true => patchlock_media::open_within(path, true, limits)?,
            false => frames,
        };
        Ok(Self { frames, keeps, next: 0 })
    }

    /// The first frame to read for this one. A source that has to start again does so for many
    /// steps back at once.
    pub(super) fn first(&self, frame: usize) -> usize {
        if self.keeps || (self.next..=self.next + AHEAD).contains(&frame) {
            return frame;
        }
        let is_step_back = frame < self.next && self.next - frame <= BACK;
        frame.saturating_sub(if is_step_back { AHEAD } else { BEFORE })
    }

    pub(super) fn frame(&mut self, index: usize) -> Result<Option<Picture>, Error> {
        let picture = self.frames.frame(index)?;
        self.next = index + 1;
        Ok(picture)
    }
}

#[cfg(test)]
mod tests {
    use patchlock_media::SourceInfo;

    use super::*;

    /// A video without frames.
    struct EmptyVideo;

    impl FrameSource for EmptyVideo {
        fn info(&self) -> SourceInfo {
            SourceInfo { length: Some(0), ..SourceInfo::default() }
        }

        fn frame(&mut self, _: usize) -> Result<Option<Picture>, Error> {
            Ok(None)
        }
    }

    #[test]
    fn a_source_that_starts_again_begins_before_the_frame() {
        let mut source = Source { frames: Box::new(EmptyVideo), keeps: false, next: 500 };
        assert_eq!([500, 524, 525, 900].map(|frame| source.first(frame)), [500, 524, 513, 888]);
        assert_eq!([499, 436, 435, 5].map(|frame| source.first(frame)), [475, 412, 423, 0]);
        source.keeps = true;
        assert_eq!([5, 499, 900].map(|frame| source.first(frame)), [5, 499, 900]);
    }
}
