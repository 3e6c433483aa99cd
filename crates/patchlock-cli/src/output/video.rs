//! The annotated video.

use std::path::{Path, PathBuf};

use anyhow::Result;
use patchlock_drawing::canvas::Canvas;
use patchlock_media::{Error, FrameRate, Mp4Writer};
use patchlock_track::files;

use super::pending::PendingFile;
use super::view::View;
use super::{Sink, TrackedFrame};
use crate::failure::{Failure, usage};

/// Fails if the name does not end in `.mp4`.
pub fn check_name(path: &Path) -> Result<(), Failure> {
    if files::ends_with(path, "mp4") {
        return Ok(());
    }
    Err(usage(format!("--video {}: only .mp4 can be written", path.display()))
        .hint("use a name that ends in .mp4; --gif writes an animated GIF"))
}

/// The quantiser if the user gives none: lines of one pixel stay crisp, and the file is about half
/// as large as with that of video for analysis.
pub const QUALITY: u8 = 26;

/// Draws the track on the frames and encodes them.
pub struct Video {
    /// `None` once the writer has it, or was refused it.
    file: Option<PendingFile>,
    /// Created with the first frame, which determines the size.
    writer: Option<Box<Mp4Writer<PendingFile>>>,
    view: View,
    rate: FrameRate,
    quality: u8,
    expected: Option<usize>,
    write_error: Box<dyn Fn(Error) -> Failure + Send>,
}

/// The frame rate of every `stride`-th frame, so that the video plays at the original speed.
pub fn played_by(rate: Option<FrameRate>, stride: usize) -> FrameRate {
    let rate = rate.unwrap_or(FrameRate::DEFAULT);
    let stride = u32::try_from(stride).unwrap_or(u32::MAX);
    FrameRate { seconds: rate.seconds.saturating_mul(stride), ..rate }
}

impl Video {
    /// A video to be written to `file`, with frames at this rate if they have no times. `quality`
    /// is the quantiser, `expected` the number of frames, if it is known.
    pub fn new(
        file: PendingFile,
        rate: FrameRate,
        view: View,
        quality: u8,
        expected: Option<usize>,
    ) -> Self {
        let write_error = Box::new(file.error_handler());
        Self { file: Some(file), writer: None, view, rate, quality, expected, write_error }
    }

    fn writer(&mut self, canvas: &Canvas) -> Result<&mut Mp4Writer<PendingFile>, Error> {
        if let Some(file) = self.file.take() {
            let (width, height) = (canvas.width() as usize, canvas.height() as usize);
            let (rate, expected, quality) = (self.rate, self.expected, self.quality);
            let writer = Mp4Writer::fastest(file, width, height, rate, expected, quality)?;
            self.writer = Some(Box::new(writer));
        }
        let abandoned = || "the video was abandoned after an earlier error".to_string();
        self.writer.as_deref_mut().ok_or_else(|| Error::Encode(abandoned()))
    }
}

impl Sink for Video {
    fn write(&mut self, tracked: &TrackedFrame<'_>) -> Result<()> {
        let canvas = self.view.draw(tracked)?;
        let writer = self.writer(&canvas);
        let pushed = writer.and_then(|to| to.push_rgba_at(canvas.rgba(), tracked.picture.time));
        Ok(pushed.map_err(&self.write_error)?)
    }

    fn finish(self: Box<Self>) -> Result<Option<PathBuf>> {
        let Some(writer) = self.writer else { return Ok(None) };
        Ok(Some(writer.finish().map_err(&self.write_error)?.commit()?))
    }
}
