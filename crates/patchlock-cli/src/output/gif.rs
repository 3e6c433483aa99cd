//! The annotated video as an animated GIF, for pages and messages that play no video.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use gif::{Encoder, Frame, Repeat};
use image::{RgbImage, imageops};
use patchlock_media::FrameRate;
use patchlock_track::files;

use super::pending::PendingFile;
use super::view::View;
use super::{Sink, TrackedFrame};
use crate::failure::{Failure, usage};

/// Largest width: a GIF stores each frame as a picture.
const MOST_WIDTH: u32 = 480;
/// Widths of a smaller animation.
const WIDTHS: [u32; 4] = [MOST_WIDTH, 400, 320, 240];
/// Bits of a colour that are left out, for fewer colours.
const COARSENESS: [u32; 3] = [0, 3, 4];
/// Hundredths of a second between frames: ten frames per second.
const DELAY: u16 = 10;
/// How carefully the 256 colours of a frame are chosen: 1 is the best and slowest, 30 the fastest.
const COLOUR_SPEED: i32 = 10;
const MEGABYTE: usize = 1_000_000;
/// Bytes of a frame beside its pixels: header and colours.
const HEADER: usize = 800;
/// Bytes of an animation beside its frames.
const FRAME_OF_FILE: usize = 64;

/// Fails if the name does not end in `.gif`.
pub fn check_name(path: &Path) -> Result<(), Failure> {
    if files::ends_with(path, "gif") {
        return Ok(());
    }
    Err(usage(format!("--gif {}: the name must end in .gif", path.display()))
        .hint("--video writes MP4"))
}

/// Draws the track on ten frames per second and encodes them. The file keeps a limit: the first
/// frame decides on its size and colours, by the number of frames that are expected; if that was not
/// enough, every other frame is left out, as often as needed.
pub struct Gif {
    file: PendingFile,
    view: View,
    rate: FrameRate,
    /// Most bytes of the file.
    limit: usize,
    /// Frames of the source, if that is known.
    expected: Option<usize>,
    /// Frames seen so far.
    count: usize,
    /// When the next frame is due, in seconds.
    due: f64,
    /// Width, and bits of colours that are left out.
    fit: Option<(u32, u32)>,
    frames: Vec<Frame<'static>>,
    /// Bytes of these frames.
    bytes: usize,
    /// How many due frames one frame of the animation stands for.
    every: usize,
    /// Frames that were due so far.
    taken: usize,
}

impl Gif {
    /// An animation to be written to `file`, of frames at this rate if they have no times, with at
    /// most this many MB.
    pub fn new(
        file: PendingFile,
        rate: FrameRate,
        view: View,
        megabytes: usize,
        expected: Option<usize>,
    ) -> Self {
        let limit = megabytes.saturating_mul(MEGABYTE);
        let (fit, frames) = (None, Vec::new());
        let (count, due, bytes, every, taken) = (0, 0.0, 0, 1, 0);
        Self { file, view, rate, limit, expected, count, due, fit, frames, bytes, every, taken }
    }

    /// Frames of the animation, as far as that is known.
    fn expected(&self) -> usize {
        let seconds = f64::from(self.rate.seconds) / f64::from(self.rate.frames);
        let expected = self.expected.unwrap_or(0);
        let due = expected as f64 * seconds * 100.0 / f64::from(DELAY);
        (due.ceil() as usize).clamp(1, expected.max(1))
    }

    /// Width and coarseness of the colours with which all frames fit, if they are as this one; the
    /// smallest if none does.
    fn choose(&self, rgb: &RgbImage) -> (u32, u32) {
        let share = self.limit / self.expected();
        let own = rgb.width().min(MOST_WIDTH);
        let widths = [own].into_iter().chain(WIDTHS.into_iter().filter(|&width| width < own));
        let all: Vec<_> =
            widths.flat_map(|width| COARSENESS.map(|coarseness| (width, coarseness))).collect();
        let fits = |&fit: &(u32, u32)| bytes(&encoded(rgb, fit)) <= share;
        { all.iter().copied() }.find(fits).unwrap_or(all[all.len() - 1])
    }

    /// Leaves out every other frame until the file keeps the limit.
    fn thin(&mut self) {
        while self.bytes + FRAME_OF_FILE > self.limit && self.frames.len() > 1 {
            let mut kept = 0;
            self.frames.retain(|_| {
                kept += 1;
                kept % 2 == 1
            });
            self.bytes = self.frames.iter().map(bytes).sum();
            self.every *= 2;
        }
    }

    /// Whether the next frame of the source is one of the animation.
    fn takes(&mut self, time: Option<f64>) -> bool {
        let seconds = f64::from(self.rate.seconds) / f64::from(self.rate.frames);
        let time = time.unwrap_or(self.count as f64 * seconds);
        self.count += 1;
        // Times are sums of fractions: one that is due is not late by their rounding.
        let is_due = self.count == 1 || time >= self.due - 1e-6;
        if is_due {
            let delay = f64::from(DELAY) / 100.0;
            // After a gap in the times, frames are due from there on.
            self.due =
                if self.count == 1 || time >= self.due + delay { time } else { self.due } + delay;
        }
        is_due
    }
}

impl Sink for Gif {
    fn write(&mut self, tracked: &TrackedFrame<'_>) -> Result<()> {
        if !self.takes(tracked.picture.time) {
            return Ok(());
        }
        let is_left_out = !self.taken.is_multiple_of(self.every);
        self.taken += 1;
        if is_left_out {
            return Ok(());
        }
        let canvas = self.view.draw(tracked)?;
        let (w, h) = (canvas.width() as u32, canvas.height() as u32);
        let rgb = RgbImage::from_raw(w, h, canvas.to_rgb()).context("the frame is incomplete")?;
        let fit = self.fit.unwrap_or_else(|| self.choose(&rgb));
        self.fit = Some(fit);
        let frame = encoded(&rgb, fit);
        self.bytes += bytes(&frame);
        self.frames.push(frame);
        self.thin();
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<Option<PathBuf>> {
        let Self { file, frames, every, .. } = *self;
        let Some(first) = frames.first() else { return Ok(None) };
        let mut encoder = Encoder::new(file, first.width, first.height, &[])?;
        encoder.set_repeat(Repeat::Infinite)?;
        let delay = u16::try_from(usize::from(DELAY) * every).unwrap_or(u16::MAX);
        for mut frame in frames {
            frame.delay = delay;
            if let Err(error) = encoder.write_lzw_pre_encoded_frame(&frame) {
                return Err(cannot_write(encoder.get_ref(), error));
            }
        }
        let file = encoder.into_inner().context("cannot complete the animation")?;
        Ok(Some(file.commit()?))
    }
}

/// A frame of this width and coarseness of colours.
fn encoded(rgb: &RgbImage, (width, coarseness): (u32, u32)) -> Frame<'static> {
    let (w, h) = rgb.dimensions();
    let height = (h * width).div_ceil(w).clamp(1, u32::from(u16::MAX));
    let mut small = match width == w && height == h {
        true => rgb.clone(),
        false => imageops::resize(rgb, width, height, imageops::FilterType::Triangle),
    };
    if coarseness > 0 {
        // The middle of each step, so that the picture stays as bright.
        let (mask, middle) = (0xffu8 << coarseness, (1u8 << coarseness) / 2);
        small.iter_mut().for_each(|sample| *sample = (*sample & mask) + middle);
    }
    let mut frame = Frame::from_rgb_speed(width as u16, height as u16, &small, COLOUR_SPEED);
    frame.make_lzw_pre_encoded();
    frame
}

/// Bytes of a frame in the file, about.
fn bytes(frame: &Frame<'_>) -> usize {
    // Data are in blocks of 255 bytes, with their length before each.
    frame.buffer.len() + frame.buffer.len() / 255 + HEADER
}

/// The error with the name of the file, and advice.
fn cannot_write(file: &PendingFile, error: gif::EncodingError) -> anyhow::Error {
    match error {
        gif::EncodingError::Io(error) => file.write_error(&error).into(),
        other => {
            anyhow::Error::new(other).context(format!("cannot write {}", file.target().display()))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::example;
    use super::super::pending::PendingFile;
    use super::*;
    use patchlock::Status;
    use patchlock_media::Picture;
    use std::sync::Arc;

    /// An animation of 40 frames of noise at ten per second, with this limit: bytes of the file,
    /// width, number of frames, and hundredths of a second in all.
    fn made(megabytes: usize, expected: Option<usize>) -> (u64, u32, usize, u32) {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.gif");
        let rate = FrameRate { frames: 10, seconds: 1 };
        let view = View::new(false, None);
        let file = PendingFile::create(&path, false).expect("a file");
        let mut gif = Box::new(Gif::new(file, rate, view, megabytes, expected));
        for frame in 0..40 {
            let noise = |k: u32| {
                let mixed = (k + 1_000_003 * frame as u32).wrapping_mul(0x9e37_79b1);
                ((mixed ^ mixed >> 15).wrapping_mul(0x85eb_ca77) >> 24) as u8
            };
            let rgb = (0..480 * 120 * 3).map(noise).collect();
            let picture = Arc::new(Picture::rgb(480, 120, rgb));
            let targets = [example::target(Status::Tracked)];
            let tracked = TrackedFrame { frame, ms: 1.0, targets: &targets, picture: &picture };
            gif.write(&tracked).expect("writes");
        }
        gif.finish().expect("writes");
        let size = path.metadata().expect("a file").len();
        let file = std::fs::File::open(path).expect("opens");
        let mut decoder = gif::DecodeOptions::new().read_info(file).expect("a GIF");
        let width = u32::from(decoder.width());
        let (mut count, mut duration) = (0, 0);
        while let Some(frame) = decoder.read_next_frame().expect("whole") {
            count += 1;
            duration += u32::from(frame.delay);
        }
        (size, width, count, duration)
    }

    #[test]
    fn an_animation_keeps_its_limit_and_its_duration() {
        let (size, width, count, duration) = made(1000, Some(40));
        assert!(size > 2_000_000, "{size}");
        assert_eq!((width, count, duration), (480, 40, 400));
        // With the number of frames known, pictures are smaller before frames are left out.
        let (size, width, count, duration) = made(1, Some(40));
        assert!(size <= 1_000_000 && width < 480 && count > 16, "{size} {width} {count}");
        assert!((400..=420).contains(&duration), "{duration}");
        // Without it, frames are left out.
        let (size, width, count, duration) = made(1, None);
        assert!(size <= 1_000_000 && size > 200_000 && width == 480, "{size} {width} {count}");
        assert!((400..=560).contains(&duration), "{duration}");
    }
}
