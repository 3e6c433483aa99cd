//! A place where the target may be, as a filter proposes it.

use super::pose::Pose;

/// A place where the target may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hypothesis {
    pub pose: Pose,
    /// The response there of the filter that proposes it.
    pub response: f64,
    /// The memory's response there.
    pub memory: f64,
}

impl Hypothesis {
    /// Both responses together.
    pub fn support(&self) -> f64 {
        self.response + self.memory
    }
}
