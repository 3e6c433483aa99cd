//! Decodes frames ahead on a separate thread, so that the tracker rarely waits for the decoder.

use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use crate::{Error, FrameSource, Note, Picture};

/// Decoded frames kept in the queue. A longer queue would only use more memory.
const DEPTH: usize = 2;
/// Longest time that [`Prefetcher::wait`] blocks, so that the caller can check whether to stop.
pub(crate) const MAX_WAIT: Duration = Duration::from_millis(100);

/// An iterator over chosen frames of a source, decoded ahead on a separate thread.
pub struct Prefetcher {
    frames: Receiver<(usize, Result<Option<Picture>, Error>)>,
    notes: Receiver<Note>,
    last: Option<usize>,
    ended: bool,
}

/// The outcome of [`Prefetcher::wait`].
#[derive(Debug)]
pub enum NextFrame {
    /// The next frame, with its index in the source.
    Frame(usize, Picture),
    /// There are no more frames.
    End,
    /// The next frame is not decoded yet.
    NotYet,
}

impl Prefetcher {
    /// Starts the decoder thread, which delivers the frames `indices` of `source` in this order. It
    /// stops after the last of them, at the end of the source, at the first error, or when this
    /// value is dropped.
    pub fn start(
        source: Box<dyn FrameSource>,
        indices: impl Iterator<Item = usize> + Send + 'static,
    ) -> Self {
        Self::spawn(source, Box::new(indices))
    }

    /// Of one type, so that threads and channels are compiled once.
    fn spawn(
        mut source: Box<dyn FrameSource>,
        mut indices: Box<dyn Iterator<Item = usize> + Send>,
    ) -> Self {
        let (sender, frames) = mpsc::sync_channel(DEPTH);
        let (noted, notes) = mpsc::channel();
        thread::spawn(move || {
            let start: Vec<usize> = indices.by_ref().take(2).collect();
            if let [first, second] = start[..]
                && let Some(stride @ 1..) = second.checked_sub(first)
            {
                let count = indices.size_hint().0.saturating_add(2);
                source.announce(first, count.saturating_mul(stride));
            }
            for index in start.into_iter().chain(indices) {
                let frame = source.frame(index);
                let more = matches!(frame, Ok(Some(_)));
                for note in source.notes() {
                    // Nobody has to listen.
                    let _ = noted.send(note);
                }
                if sender.send((index, frame)).is_err() || !more {
                    return;
                }
            }
            let _ = sender.send((0, Ok(None)));
        });
        Self { frames, notes, last: None, ended: false }
    }

    /// What a user should know of the frames, found since the last call. It may be about frames that
    /// are decoded but not taken yet.
    pub fn notes(&self) -> impl Iterator<Item = Note> {
        self.notes.try_iter()
    }

    /// Waits for the next frame and returns it with its index. Returns `None` at the end, and soon
    /// after `stopped` returns true.
    ///
    /// # Errors
    /// As [`Prefetcher::wait`].
    pub fn next_unless(
        &mut self,
        stopped: &dyn Fn() -> bool,
    ) -> Result<Option<(usize, Picture)>, Error> {
        next_unless(stopped, || self.wait())
    }

    /// Waits up to 100 ms for the next frame.
    ///
    /// # Errors
    /// As [`FrameSource::frame`]; [`Error::DecoderEnded`] if the decoder panicked. No frames follow
    /// an error.
    pub fn wait(&mut self) -> Result<NextFrame, Error> {
        if self.ended {
            return Ok(NextFrame::End);
        }
        let waited = self.frames.recv_timeout(MAX_WAIT);
        self.ended = !matches!(waited, Ok((_, Ok(Some(_)))) | Err(RecvTimeoutError::Timeout));
        match waited {
            Ok((index, frame)) => {
                self.last = Some(index);
                Ok(frame?.map_or(NextFrame::End, |picture| NextFrame::Frame(index, picture)))
            }
            Err(RecvTimeoutError::Timeout) => Ok(NextFrame::NotYet),
            // The thread ended without sending an end or an error, so the decoder library panicked.
            Err(RecvTimeoutError::Disconnected) => Err(Error::DecoderEnded { after: self.last }),
        }
    }
}

/// Waits until there is a frame, the end, or `stopped` returns true.
pub(crate) fn next_unless(
    stopped: &dyn Fn() -> bool,
    mut wait: impl FnMut() -> Result<NextFrame, Error>,
) -> Result<Option<(usize, Picture)>, Error> {
    while !stopped() {
        match wait()? {
            NextFrame::Frame(index, picture) => return Ok(Some((index, picture))),
            NextFrame::End => return Ok(None),
            NextFrame::NotYet => {}
        }
    }
    Ok(None)
}

impl Iterator for Prefetcher {
    type Item = Result<(usize, Picture), Error>;

    fn next(&mut self) -> Option<Self::Item> {
        self.next_unless(&|| false).transpose()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SourceInfo;

    /// A source of four frames. Reading frame 3 fails if `damaged`; otherwise it panics.
    struct TestSource {
        damaged: bool,
    }

    impl FrameSource for TestSource {
        fn info(&self) -> SourceInfo {
            SourceInfo::default()
        }

        fn frame(&mut self, index: usize) -> Result<Option<Picture>, Error> {
            match index {
                0..3 => Ok(Some(Picture::rgb(1, 1, vec![index as u8; 3]))),
                3 if self.damaged => Err(Error::Encode("damaged".to_string())),
                3 => panic!("as a decoder does on damaged data"),
                _ => Ok(None),
            }
        }
    }

    fn prefetch(damaged: bool, indices: &'static [usize]) -> Prefetcher {
        Prefetcher::start(Box::new(TestSource { damaged }), indices.iter().copied())
    }

    #[test]
    fn frames_come_in_the_requested_order() {
        let frames: Vec<usize> =
            prefetch(true, &[2, 0, 1]).map(|frame| frame.expect("whole").0).collect();
        assert_eq!(frames, [2, 0, 1]);
        assert_eq!(prefetch(true, &[0, 9, 1]).count(), 1, "the source ends before frame 9");
    }

    #[test]
    fn an_error_is_reported_once_and_ends_the_iterator() {
        let mut frames = prefetch(true, &[0, 3, 1]);
        assert!(frames.next().expect("a frame").is_ok());
        assert_eq!(frames.next().expect("an error").unwrap_err().to_string(), "damaged");
        assert!(frames.next().is_none() && frames.next().is_none());
    }

    #[test]
    fn a_panic_of_the_decoder_becomes_an_error() {
        let mut frames = prefetch(false, &[0, 3]);
        assert!(frames.next().expect("a frame").is_ok());
        let error = frames.next().expect("an error").unwrap_err();
        assert!(error.to_string().contains("failed at the frame after 0"), "{error}");
        assert!(frames.next().is_none());
    }

    #[test]
    fn no_frame_is_returned_once_the_caller_has_stopped() {
        let mut frames = prefetch(true, &[0, 1]);
        assert!(frames.next_unless(&|| true).expect("no error").is_none());
        assert!(frames.next_unless(&|| false).expect("no error").is_some());
    }
}
