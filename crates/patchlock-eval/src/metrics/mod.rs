//! Boxes against truth: per frame, and as curves. Sees boxes and a protocol, never a tracker.

mod curves;
mod frames;

pub use curves::{Curves, Tally};
pub use frames::{Comparison, compare, last_given};
