//! Compares boxes with ground truth, per frame and as curves, and what a tracker says of itself with these
//! boxes. Independent of any tracker.

mod calibration;
mod curves;
mod frames;
mod status;

pub use calibration::{BINS, Bin, Calibration};
pub use curves::{Curves, Tally};
pub use frames::{FrameMeasures, compare, last_given};
pub use status::{Said, StatusCounts};
