//! The numbers by which a tracker of many targets tells them apart.

use serde::{Deserialize, Serialize};
use std::fmt;

/// Identifies a target of a [`MultiTracker`](crate::MultiTracker): 1 for the first that was added, 2 for the next. No number is used twice.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct TargetId(u64);

impl TargetId {
    /// The number.
    pub fn number(self) -> u64 {
        self.0
    }
}

impl From<u64> for TargetId {
    /// The id with this number; whether there is such a target, the tracker decides.
    fn from(number: u64) -> Self {
        Self(number)
    }
}

impl fmt::Display for TargetId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}
