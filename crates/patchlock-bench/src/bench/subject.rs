//! What a tracker under test does, whatever it is.

use std::path::Path;

use patchlock::{BoundingBox, Estimate, Status};

use crate::Error;

/// The answer of a tracker for one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answer {
    /// The box, in pixels counted from 0; `None` if the tracker reported none.
    pub bbox: Option<BoundingBox>,
    /// Time that the tracker took, in seconds.
    pub seconds: f64,
    /// How sure the tracker is, 0 to 1; `None` if it does not say.
    pub score: Option<f64>,
    /// Whether the target is followed; `None` if the tracker does not say.
    pub status: Option<Status>,
}

impl Answer {
    /// The answer of a tracker that says nothing but a box.
    pub fn of_box(bbox: Option<BoundingBox>, seconds: f64) -> Self {
        Self { bbox, seconds, score: None, status: None }
    }

    /// The answer that an estimate is.
    pub(super) fn of_estimate(estimate: &Estimate, seconds: f64) -> Self {
        let (score, status) = (Some(estimate.score), Some(estimate.status));
        Self { bbox: Some(estimate.bbox), seconds, score, status }
    }
}

/// A tracker under test: started on a box, then given one frame after another.
pub trait Subject {
    /// Starts on a box in a frame.
    ///
    /// # Errors
    /// [`Error::Track`], [`Error::Tracker`].
    fn begin(&mut self, frame: &Path, bbox: BoundingBox) -> Result<Answer, Error>;

    /// Tracks the target in the next frame.
    ///
    /// # Errors
    /// As [`Subject::begin`].
    fn follow(&mut self, frame: &Path) -> Result<Answer, Error>;
}
