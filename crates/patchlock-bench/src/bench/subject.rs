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

/// A tracker under test.
pub trait Subject {
    /// Starts on a box in a frame, or without one tracks the target in the next frame.
    ///
    /// # Errors
    /// [`Error::Track`], [`Error::Tracker`].
    fn step(&mut self, frame: &Path, start: Option<BoundingBox>) -> Result<Answer, Error>;
}
