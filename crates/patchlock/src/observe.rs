//! A way to look inside a tracker without touching its loop: one view for each method.

pub use crate::patchwise::view::{PatchView, PatchwiseView, UpdateView};

/// What happened on one frame, in the terms of the method that tracked it.
#[derive(Debug)]
#[non_exhaustive]
pub enum FrameView<'a> {
    /// The paper's tracker.
    Patchwise(PatchwiseView<'a>),
}

/// Looks at each frame; any `FnMut(&FrameView)` is one.
pub trait Observer {
    /// Called once for each frame that [`Tracker::update_observed`](crate::Tracker::update_observed) tracks.
    fn observe(&mut self, view: &FrameView<'_>);
}

impl<F: FnMut(&FrameView<'_>)> Observer for F {
    fn observe(&mut self, view: &FrameView<'_>) {
        self(view);
    }
}
