//! From key frames to boxes on every frame: one span between neighbouring key frames at a time,
//! tracked from both sides and [joined](join::join) where the two agree best. [`review::suggestions`]
//! says which frames to look at next.
//!
//! Nothing here opens files or runs a tracker: the caller does, and hands over what was [`FrameEstimate`].

pub mod join;
pub mod review;

use patchlock::{BoundingBox, Estimate, Status};

use crate::project::TrackedBox;

/// Where a tracker found the target in a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameEstimate {
    /// The box.
    pub bbox: BoundingBox,
    /// How sure the tracker is, 0 to 1.
    pub score: f64,
    /// Whether the target is followed.
    pub status: Status,
    /// The visible share of the target, 0 to 1, if known.
    pub visible: Option<f64>,
}

impl From<&Estimate> for FrameEstimate {
    fn from(estimate: &Estimate) -> Self {
        Self {
            bbox: estimate.bbox,
            score: estimate.score,
            status: estimate.status,
            visible: estimate.visibility.as_ref().map(patchlock::Visibility::share),
        }
    }
}

impl From<FrameEstimate> for TrackedBox {
    fn from(found: FrameEstimate) -> Self {
        let FrameEstimate { bbox, score, status, visible } = found;
        Self { bbox, score, status, visible, agreement: None }
    }
}
