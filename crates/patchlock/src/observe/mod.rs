//! Access to the intermediate results of a tracker, with one kind of view per method.

mod committee;
mod network;
mod paper;
mod robust;

pub use committee::{CommitteeView, MemberView};
pub use network::NetworkView;
pub use paper::{PaperView, PatchView, UpdateView};
pub use robust::RobustView;

/// The intermediate results of one frame, in the terms of the method that tracked it.
#[derive(Debug)]
#[non_exhaustive]
pub enum FrameView<'a> {
    /// The paper's tracker.
    Paper(PaperView<'a>),
    /// The method `robust`.
    Robust(RobustView<'a>),
    /// The method `network`.
    Network(NetworkView<'a>),
    /// A committee, after the views of its members.
    Committee(CommitteeView<'a>),
}

/// Receives the view of each frame. Implemented by every `FnMut(&FrameView)`.
pub trait Observer {
    /// Called once per frame, with a committee once per member and once for all, that [`Tracker::update_observed`](crate::Tracker::update_observed)
    /// tracks.
    fn observe(&mut self, view: &FrameView<'_>);
}

impl<F: FnMut(&FrameView<'_>)> Observer for F {
    fn observe(&mut self, view: &FrameView<'_>) {
        self(view);
    }
}
