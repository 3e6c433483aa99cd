//! Compares boxes with ground truth, per frame and as curves. Independent of any tracker.

mod curves;
mod frames;

pub use curves::{Curves, Tally};
pub use frames::{FrameMeasures, compare, last_given};
