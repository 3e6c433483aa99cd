//! The annotated video as an animated GIF, for pages and messages that play no video.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use gif::{Encoder, Frame, Repeat};
use image::{RgbImage, imageops};
use patchlock_media::FrameRate;

use super::pending::PendingFile;
use super::view::View;
use super::{Sink, Tracked};
use crate::failure::{Failure, usage};

/// Largest width: a GIF stores each frame as a picture.
const MOST_WIDTH: u32 = 480;
/// Hundredths of a second between frames: ten frames per second.
const DELAY: u16 = 10;
/// How carefully the 256 colours of a frame are chosen: 1 is the best and slowest, 30 the fastest.
const COLOUR_SPEED: i32 = 10;

/// Fails if the name does not end in `.gif`.
pub fn check_name(path: &Path) -> Result<(), Failure> {
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("gif")) {
        return Ok(());
    }
    Err(usage(format!("--gif {}: the name must end in .gif", path.display()))
        .hint("--video writes MP4"))
}

/// Draws the track on ten frames per second and encodes them.
pub struct Gif {
    state: State,
    view: View,
    rate: FrameRate,
    /// Frames seen so far.
    count: usize,
    /// When the next frame is due, in seconds.
    due: f64,
}

/// The encoder is created with the first frame, which determines the size.
enum State {
    Waiting(PendingFile),
    Writing {
        encoder: Box<Encoder<PendingFile>>,
        size: (u32, u32),
    },
    /// An error was already reported.
    Failed,
}

impl Gif {
    /// An animation to be written to `file`, of frames at this rate if they have no times.
    pub fn new(file: PendingFile, rate: FrameRate, view: View) -> Self {
        Self { state: State::Waiting(file), view, rate, count: 0, due: 0.0 }
    }

    /// Whether the next frame of the source is one of the animation.
    fn takes(&mut self, time: Option<f64>) -> bool {
        let seconds = f64::from(self.rate.seconds) / f64::from(self.rate.frames);
        let time = time.unwrap_or(self.count as f64 * seconds);
        self.count += 1;
        let is_due = self.count == 1 || time >= self.due;
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
    fn write(&mut self, tracked: &Tracked<'_>) -> Result<()> {
        if !self.takes(tracked.picture.time) {
            return Ok(());
        }
        let canvas = self.view.draw(tracked)?;
        let (w, h) = (canvas.width() as u32, canvas.height() as u32);
        let rgb = RgbImage::from_raw(w, h, canvas.to_rgb()).context("the frame is incomplete")?;
        let file = match std::mem::replace(&mut self.state, State::Failed) {
            State::Waiting(file) => {
                let width = w.min(MOST_WIDTH);
                let height = (h * width).div_ceil(w).max(1);
                begin(file, (width, height))?
            }
            state => state,
        };
        let State::Writing { mut encoder, size } = file else {
            anyhow::bail!("the animation was abandoned after an earlier error")
        };
        let small = match (w, h) == size {
            true => rgb,
            false => imageops::resize(&rgb, size.0, size.1, imageops::FilterType::Triangle),
        };
        let (width, height) = (size.0 as u16, size.1 as u16);
        let mut frame = Frame::from_rgb_speed(width, height, &small, COLOUR_SPEED);
        frame.delay = DELAY;
        if let Err(error) = encoder.write_frame(&frame) {
            return Err(cannot_write(encoder.get_ref(), error));
        }
        self.state = State::Writing { encoder, size };
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<Option<PathBuf>> {
        match self.state {
            State::Writing { encoder, .. } => {
                let file = encoder.into_inner().context("cannot complete the animation")?;
                Ok(Some(file.commit()?))
            }
            State::Waiting(_) | State::Failed => Ok(None),
        }
    }
}

/// An endless animation of this size.
fn begin(file: PendingFile, size: (u32, u32)) -> Result<State> {
    let side = |pixels| u16::try_from(pixels).context("a GIF has at most 65535 rows");
    let mut encoder = Encoder::new(file, side(size.0)?, side(size.1)?, &[])?;
    encoder.set_repeat(Repeat::Infinite)?;
    Ok(State::Writing { encoder: Box::new(encoder), size })
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
