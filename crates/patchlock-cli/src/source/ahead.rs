//! Decoding ahead on a thread of its own, so that the tracker never waits for the decoder.

use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use anyhow::Result;

use super::FrameSource;
use crate::complaint::failed;
use crate::interrupt;
use patchlock_eval::picture::Picture;

/// Frames that wait, decoded: more would only cost memory.
const DEPTH: usize = 2;
/// How often a wait for the decoder looks for Ctrl-C.
const PATIENCE: Duration = Duration::from_millis(100);

/// The frames of a source, in a given order, decoded ahead.
pub struct Ahead {
    frames: Receiver<(usize, Result<Option<Picture>>)>,
    last: Option<usize>,
    ended: bool,
}

/// What a wait for the decoder brought.
#[derive(Debug)]
pub enum Next {
    /// A frame with its number.
    Frame(usize, Picture),
    /// There are no more.
    End,
    /// The decoder is not done with the next one.
    NotYet,
}

impl Ahead {
    /// Starts the thread. It ends with the frames, at an error, or when this value is dropped.
    pub fn start(
        mut source: Box<dyn FrameSource>,
        indices: impl Iterator<Item = usize> + Send + 'static,
    ) -> Self {
        let (sender, frames) = mpsc::sync_channel(DEPTH);
        thread::spawn(move || {
            for index in indices {
                let frame = source.frame(index);
                let more = matches!(frame, Ok(Some(_)));
                if sender.send((index, frame)).is_err() || !more {
                    return;
                }
            }
            let _ = sender.send((0, Ok(None)));
        });
        Self { frames, last: None, ended: false }
    }

    /// The next frame with its number; `None` at the end, and soon after Ctrl-C.
    #[expect(
        clippy::should_implement_trait,
        reason = "a fallible next reads better here than an iterator of results"
    )]
    pub fn next(&mut self) -> Result<Option<(usize, Picture)>> {
        loop {
            if interrupt::requested() {
                return Ok(None);
            }
            match self.wait()? {
                Next::Frame(index, picture) => return Ok(Some((index, picture))),
                Next::End => return Ok(None),
                Next::NotYet => {}
            }
        }
    }

    /// Waits a moment for the next frame.
    pub fn wait(&mut self) -> Result<Next> {
        if self.ended {
            return Ok(Next::End);
        }
        let waited = self.frames.recv_timeout(PATIENCE);
        self.ended = !matches!(waited, Ok((_, Ok(Some(_)))) | Err(RecvTimeoutError::Timeout));
        match waited {
            Ok((index, frame)) => {
                self.last = Some(index);
                Ok(frame?.map_or(Next::End, |picture| Next::Frame(index, picture)))
            }
            Err(RecvTimeoutError::Timeout) => Ok(Next::NotYet),
            Err(RecvTimeoutError::Disconnected) => Err(self.decoder_died()),
        }
    }

    /// The thread is gone without a last word: the decoder library panicked.
    fn decoder_died(&self) -> anyhow::Error {
        let place = self
            .last
            .map_or("the first frame".to_string(), |index| format!("the frame after {index}"));
        failed(format!("the decoder gave up at {place}: its data are damaged"))
            .hint("convert the video once with ffmpeg -i IN -c:v libx264 OUT.mp4")
            .into()
    }
}
