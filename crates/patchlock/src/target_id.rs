//! Identifiers of the targets of a multi-target tracker.

use serde::{Deserialize, Serialize};
use std::fmt;

/// Identifies a target of a [`MultiTracker`](crate::MultiTracker). The first target added has
/// number 1, the next 2. Numbers are never reused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct TargetId(u64);

impl TargetId {
    /// The number.
    pub fn number(self) -> u64 {
        self.0
    }
}

impl From<u64> for TargetId {
    /// The id with this number. The target need not exist: the tracker checks that.
    fn from(number: u64) -> Self {
        Self(number)
    }
}

impl fmt::Display for TargetId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}
