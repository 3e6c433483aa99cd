//! From key frames to boxes on every frame: one span between neighbouring key frames at a time,
//! tracked from both sides and [joined](join::join) where the two agree best. [`doubt::doubts`]
//! says which frames to look at next.
//!
//! Nothing here opens files or runs a tracker: the caller does, and hands over what was [`Found`].

pub mod doubt;
pub mod join;

use patchlock::{BoundingBox, Estimate, Status};

use crate::project::Tracked;

/// Where a tracker found the target in a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    /// The box.
    pub bbox: BoundingBox,
    /// How sure the tracker is, 0 to 1.
    pub score: f64,
    /// Whether the target is followed.
    pub status: Status,
    /// The visible share of the target, 0 to 1, if known.
    pub visible: Option<f64>,
}

impl From<&Estimate> for Found {
    fn from(estimate: &Estimate) -> Self {
        Self {
            bbox: estimate.bbox,
            score: estimate.score,
            status: estimate.status,
            visible: estimate.visibility.as_ref().map(patchlock::Visibility::share),
        }
    }
}

impl From<Found> for Tracked {
    fn from(found: Found) -> Self {
        let Found { bbox, score, status, visible } = found;
        Self { bbox, score, status, visible, agreement: None }
    }
}
