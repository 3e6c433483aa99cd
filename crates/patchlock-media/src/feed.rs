//! Frames for a tracker, wherever they come from.

use crate::live::Live;
use crate::{Ahead, Error, Next, Note, Picture, ahead};

/// Frames of a file, decoded ahead, or the newest of a live source.
pub enum Feed {
    /// All frames of a range, in order.
    Ahead(Ahead),
    /// The newest frame.
    Live(Live),
}

impl Feed {
    /// Waits up to 100 ms for the next frame.
    ///
    /// # Errors
    /// As [`Ahead::wait`] and [`Live::wait`].
    pub fn wait(&mut self) -> Result<Next, Error> {
        match self {
            Self::Ahead(ahead) => ahead.wait(),
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
        ahead::next_unless(stopped, || {
            let next = self.wait();
            self.notes().into_iter().for_each(&mut note);
            next
        })
    }

    /// What a user should know of the source, found since the last call.
    pub fn notes(&self) -> Vec<Note> {
        match self {
            Self::Ahead(ahead) => ahead.notes().collect(),
            Self::Live(live) => live.notes().collect(),
        }
    }

    /// Frames that were not given because a newer one had come; `None` if no frame is ever left
    /// out.
    pub fn dropped(&self) -> Option<usize> {
        match self {
            Self::Ahead(_) => None,
            Self::Live(live) => Some(live.dropped()),
        }
    }
}
