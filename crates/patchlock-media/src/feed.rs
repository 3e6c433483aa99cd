//! Frames for a tracker, wherever they come from.

use crate::live::LiveSource;
use crate::{Error, NextFrame, Note, Picture, Prefetcher, prefetch};

/// Frames of a file, decoded ahead, or the newest of a live source.
pub enum Feed {
    /// All frames of a range, in order.
    File(Prefetcher),
    /// The newest frame.
    Live(LiveSource),
}

impl Feed {
    /// Waits up to 100 ms for the next frame.
    ///
    /// # Errors
    /// As [`Prefetcher::wait`] and [`LiveSource::wait`].
    pub fn wait(&mut self) -> Result<NextFrame, Error> {
        match self {
            Self::File(prefetch) => prefetch.wait(),
            Self::Live(live) => live.wait(),
        }
    }

    /// Waits for the next frame and returns it with its number. Returns `None` at the end, and soon
    /// after `stopped` returns true. `note` gets what has happened meanwhile.
    ///
    /// # Errors
    /// As [`Feed::wait`].
    pub fn next_unless(
        &mut self,
        stopped: &dyn Fn() -> bool,
        mut note: impl FnMut(Note),
    ) -> Result<Option<(usize, Picture)>, Error> {
        prefetch::next_unless(stopped, || {
            let next = self.wait();
            self.notes().into_iter().for_each(&mut note);
            next
        })
    }

    /// What a user should know of the source, found since the last call.
    pub fn notes(&self) -> Vec<Note> {
        match self {
            Self::File(prefetch) => prefetch.notes().collect(),
            Self::Live(live) => live.notes().collect(),
        }
    }

    /// Frames that were not given because a newer one had come; `None` if no frame is ever left
    /// out.
    pub fn dropped(&self) -> Option<usize> {
        match self {
            Self::File(_) => None,
            Self::Live(live) => Some(live.dropped()),
        }
    }
}
