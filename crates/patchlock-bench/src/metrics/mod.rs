//! Compares boxes with ground truth, per frame and as curves, and the scores and statuses of a
//! tracker with these boxes. Of the tracker it uses only the types `BoundingBox` and `Status`.

mod calibration;
mod curves;
mod frames;
mod status;

pub use calibration::{BINS, Bin, Calibration};
pub use curves::{Curves, loss, mean};
pub use frames::{FrameMeasures, compare, last_given};
pub use status::StatusCounts;
