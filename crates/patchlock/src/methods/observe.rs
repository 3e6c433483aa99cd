//! Access to the intermediate results of a tracker, with one kind of view per method.

use super::FrameView;
use crate::estimate::Estimate;

/// What the members of a committee said of a frame. The observer is shown the view of each member
/// before this one.
#[derive(Debug)]
#[non_exhaustive]
pub struct CommitteeView<'a> {
    /// The members, in a fixed order.
    pub members: &'a [MemberView],
    /// Whether at least two members agree on the place that is believed.
    pub agrees: bool,
}

/// What one member said.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct MemberView {
    /// The name of the member: "filters" or "network".
    pub name: &'static str,
    /// Its own estimate, without visibility.
    pub estimate: Estimate,
    /// The logarithm of the odds that other members give its box; `None` where they agree with it or
    /// judge no boxes but their own.
    pub judgement: Option<f64>,
    /// Whether its box is part of the committee's.
    pub is_believed: bool,
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
