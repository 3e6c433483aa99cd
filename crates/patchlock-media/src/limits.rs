//! What a file may claim before memory is allocated or a loop is run for it.
//!
//! Files come from strangers. A header of a few bytes can claim any number of pixels, frames or
//! bytes, so every decoder of this crate compares such a number with the limits of this module
//! first. The limits are far above what cameras and encoders make; only those of [`Limits`] can be
//! changed.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::Helper;

/// What a file may do, as far as a user may change it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Largest number of pixels of a frame or image, width times height.
    pub pixels: usize,
    /// The program that decodes files of a path for [`crate::open_within`]. Without one, or on other
    /// systems than Linux, this program does.
    pub helper: Option<&'static Helper>,
}

impl Limits {
    /// Default of [`Limits::pixels`]: 36 million, enough for video of 8192 x 4320 pixels.
    pub const DEFAULT_PIXELS: usize = 36_000_000;

    /// Checks the size of a frame or image.
    pub(crate) fn check(&self, width: usize, height: usize) -> Result<(), SizeLimitError> {
        let pixels = width.saturating_mul(height);
        if pixels > self.pixels {
            return Err(SizeLimitError { width, height, pixels, limit: self.pixels });
        }
        Ok(())
    }

    /// The most pixels that an H.264 decoder may hold as references. Level 6.2, the highest, has
    /// 178 million for frames of up to 36 million, which is this ratio.
    pub(crate) fn reference_pixels(&self) -> usize {
        self.pixels.saturating_mul(5)
    }

    /// How many frames of this many pixels a decoder may hold, at most `most`.
    pub(crate) fn held_frames(&self, pixels: usize, most: usize) -> usize {
        (self.reference_pixels() / pixels.max(1)).clamp(1, most)
    }
}

impl Default for Limits {
    fn default() -> Self {
        Self { pixels: Self::DEFAULT_PIXELS, helper: None }
    }
}

/// A frame or image has more pixels than [`Limits::pixels`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[error("{width} x {height} pixels are more than the {limit} that are accepted")]
pub struct SizeLimitError {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Width times height.
    pub pixels: usize,
    /// The limit.
    pub limit: usize,
}

impl SizeLimitError {
    /// Megabytes that a frame of this size takes at least, decoded and with what is computed from
    /// it.
    pub fn megabytes(&self) -> usize {
        self.pixels / 100_000
    }
}

/// Most frames of a video, and of a table or project about one: 38 days at 30 frames per second.
/// Frames count from 0, so the largest frame number is one less.
pub const MOST_FRAMES: usize = 100_000_000;

/// Largest index of an MP4, in bytes. An hour of video has an index of about 1 MB.
pub const INDEX_BYTES: u64 = 256 << 20;

/// Most frames of an MP4: 92 hours at 30 frames per second.
const FRAMES: u64 = 10_000_000;

/// Most frames of an MP4 of `bytes` bytes. Even an unchanged frame takes four bytes in the index,
/// or data of its own.
pub fn frames(bytes: u64) -> u64 {
    (bytes / 4).min(FRAMES)
}

/// Largest compressed frame of an MP4, in bytes: 20 times that of 8K video at 800 Mbit/s.
pub const COMPRESSED_BYTES: usize = 64 << 20;

/// Most bytes of the parameter sets in the index of an MP4, which are read again at each keyframe.
pub const PARAMETER_SET_BYTES: usize = 1 << 20;

/// Most pictures that one stored frame of an MP4 may hold: two fields.
pub const PICTURES_PER_SAMPLE: usize = 2;

/// Most frames that a decoder refers back to, or that come out of order, by the standard of H.264.
pub const REFERENCES: usize = 16;

/// Pixels that may be decoded on opening, to see whether the decoder supports the video.
pub const PROBED_PIXELS: usize = 72_000_000;

/// How long ffmpeg may be silent before it is stopped.
pub const SILENCE: Duration = Duration::from_secs(60);

/// How long a helper may be silent before it is stopped. It may itself wait for ffmpeg, and then
/// decodes without it.
pub const HELPER_SILENCE: Duration = Duration::from_secs(120);

/// How long a live source may be silent before it is taken to be gone.
pub const LIVE_SILENCE: Duration = Duration::from_secs(15);

/// Longest header line of Y4M and longest message of ffmpeg, in bytes.
pub const LINE_BYTES: u64 = 1024;

/// Largest width or height of Y4M.
pub const SIDE: usize = 32_768;

/// Bytes that decoding an image of this many pixels may take, and its file: eight per pixel, for
/// four channels of 16 bits, and some for what else is in it.
pub fn image_bytes(pixels: u64) -> u64 {
    pixels.saturating_mul(8).saturating_add(64 << 20)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_size_of_a_frame_is_compared_without_overflow() {
        let limits = Limits::default();
        assert!(limits.check(8192, 4320).is_ok());
        assert!(limits.check(0, usize::MAX).is_ok());
        let error = limits.check(usize::MAX, usize::MAX).unwrap_err();
        assert_eq!(error.pixels, usize::MAX);
        let shown = limits.check(16_000, 8_000).unwrap_err();
        assert!(shown.to_string().starts_with("16000 x 8000 pixels"), "{shown}");
        assert_eq!((shown.pixels, shown.megabytes()), (128_000_000, 1280));
    }

    #[test]
    fn more_small_frames_are_held_than_large_ones() {
        let limits = Limits::default();
        assert_eq!(limits.held_frames(640 * 480, 16), 16);
        assert_eq!(limits.held_frames(8192 * 4320, 16), 5);
        assert_eq!(Limits { pixels: 1, ..limits }.held_frames(100, 16), 1);
    }
}
