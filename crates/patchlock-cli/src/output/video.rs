//! The annotated video.

use std::path::{Path, PathBuf};

use anyhow::Result;
use patchlock_media::{Error, FrameRate, Mp4Writer};

use super::draw;
use super::pending::PendingFile;
use super::{Sink, Tracked};
use crate::complaint::{Complaint, usage};

/// Complains about a name that does not end in `.mp4`.
pub fn check_name(path: &Path) -> Result<(), Complaint> {
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("mp4")) {
        return Ok(());
    }
    Err(usage(format!("--video {}: only .mp4 can be written", path.display()))
        .hint("end the name with .mp4; ffmpeg -i OUT.mp4 OUT.gif makes other kinds of it"))
}

/// Draws the track on the frames and encodes them.
pub struct Video {
    state: State,
    rate: FrameRate,
    expected: Option<usize>,
    complain: Box<dyn Fn(Error) -> Complaint>,
}

/// The size is known only with the first frame.
enum State {
    Waiting(PendingFile),
    Writing(Box<Mp4Writer<PendingFile>>),
    /// An error was reported already.
    Broken,
}

impl Video {
    /// A video that begins with the first frame. `expected` says how many will come, if that is known.
    pub fn new(file: PendingFile, rate: FrameRate, expected: Option<usize>) -> Self {
        let complain = Box::new(file.complainer());
        Self { state: State::Waiting(file), rate, expected, complain }
    }

    fn writer(
        &mut self,
        width: usize,
        height: usize,
    ) -> Result<&mut Mp4Writer<PendingFile>, Error> {
        if let State::Waiting(_) = self.state
            && let State::Waiting(file) = std::mem::replace(&mut self.state, State::Broken)
        {
            self.state = State::Writing(Box::new(Mp4Writer::new(
                file,
                width,
                height,
                self.rate,
                self.expected,
            )?));
        }
        match &mut self.state {
            State::Writing(writer) => Ok(writer),
            _ => Err(Error::Encode("the video was given up after an earlier error".to_string())),
        }
    }
}

impl Sink for Video {
    fn write(&mut self, tracked: &Tracked<'_>) -> Result<()> {
        let rgb = draw::annotate(tracked);
        let writer = self.writer(tracked.picture.width, tracked.picture.height);
        Ok(writer.and_then(|writer| writer.push(&rgb)).map_err(&self.complain)?)
    }

    fn finish(self: Box<Self>) -> Result<Option<PathBuf>> {
        match self.state {
            State::Writing(writer) => Ok(Some(writer.finish().map_err(&self.complain)?.commit()?)),
            State::Waiting(_) | State::Broken => Ok(None),
        }
    }
}
