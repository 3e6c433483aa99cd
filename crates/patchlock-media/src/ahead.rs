//! Decoding ahead on a thread of its own, so that the tracker never waits for the decoder.

use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use crate::{Error, FrameSource, Picture};

/// Frames that wait, decoded: more would only cost memory.
const DEPTH: usize = 2;
/// So long the caller waits for the decoder before it may look whether to stop.
const PATIENCE: Duration = Duration::from_millis(100);

/// The frames of a source, in a given order, decoded ahead.
pub struct Ahead {
    frames: Receiver<(usize, Result<Option<Picture>, Error>)>,
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

    /// The next frame with its number, as [`Iterator::next`] gives it; `None` at the end, and soon after `stopped` has become true.
    ///
    /// # Errors
    /// As [`Ahead::wait`].
    pub fn next_unless(
        &mut self,
        stopped: &dyn Fn() -> bool,
    ) -> Result<Option<(usize, Picture)>, Error> {
        loop {
            if stopped() {
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
    ///
    /// # Errors
    /// Why the next frame can't be read.
    pub fn wait(&mut self) -> Result<Next, Error> {
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
    fn decoder_died(&self) -> Error {
        let place = self
            .last
            .map_or("the first frame".to_string(), |index| format!("the frame after {index}"));
        Error::source(
            format!("the decoder gave up at {place}: its data are damaged"),
            "convert the video once with ffmpeg -i IN -c:v libx264 OUT.mp4",
        )
    }
}

impl Iterator for Ahead {
    type Item = Result<(usize, Picture), Error>;

    fn next(&mut self) -> Option<Self::Item> {
        self.next_unless(&|| false).transpose()
    }
}
