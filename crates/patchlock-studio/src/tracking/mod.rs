//! From key frames to boxes on every frame: one span between neighbouring key frames at a time,
//! tracked from both sides and [joined](join::join) where the two agree best. [`review::suggestions`]
//! says which frames to look at next.
//!
//! Nothing here opens files or runs a tracker: the caller does, and hands over what was found.

pub mod join;
pub mod review;

use patchlock::Estimate;

use crate::project::TrackedBox;

impl From<&Estimate> for TrackedBox {
    fn from(estimate: &Estimate) -> Self {
        Self {
            bbox: estimate.bbox,
            score: estimate.score,
            status: estimate.status,
            visible: estimate.visibility.as_ref().map(patchlock::Visibility::share),
            agreement: None,
        }
    }
}
