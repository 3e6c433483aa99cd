//! The conventions of the comparison.
//!
//! [`Protocol::otb`] is the protocol of OTB by Wu, Lim and Yang (CVPR 2013, PAMI 2015). Applied to
//! the raw boxes that the authors published, it reproduces the scores that they published.
//!
//! - The centre of a box is `x + (w - 1) / 2`, `y + (h - 1) / 2`. Only differences of centres are
//!   used, so it does not matter whether pixels count from 0 or 1.
//! - **Precision** at t: share of frames with a centre distance of at most t pixels (`<=`), t = 0,
//!   1 .. 50. DP is its value at 20.
//! - **Success** at t: share of frames with an overlap (intersection over union) greater than t
//!   (`>`), t = 0, 0.05 .. 1. AUC is the mean of the 21 values.
//! - **Normalised precision** (Mueller et al., TrackingNet, ECCV 2018): precision with the
//!   horizontal distance divided by the width of the true box and the vertical one by its height, t
//!   = 0, 0.01 .. 0.5. Its score is the mean of the 51 values.
//! - The target is **lost** in a frame with an overlap of less than 0.1 (`<`). The lost share is
//!   the share of such frames; the overlap when not lost is the mean overlap of the others.
//! - The box is **on the target** in a frame with an overlap of at least 0.5 (`>=`). What a tracker
//!   says of itself is compared with that; see [`StatusCounts`](crate::metrics::StatusCounts) and
//!   [`Calibration`](crate::metrics::Calibration).
//! - The first frame, whose box is given, counts. A frame without a true box of positive width and
//!   height does not.
//! - A box that the tracker did not report is replaced by the last one that it reported.
//! - The score of a tracker is the mean over targets, not over frames.

/// Index of 20 pixels in the thresholds of precision.
pub const DP_INDEX: usize = 20;
/// Index of 0.5 in the thresholds of success.
pub const SUCCESS_INDEX: usize = 10;
/// The target is lost in frames with a smaller overlap.
pub const LOST_OVERLAP: f64 = 0.1;
/// The box is on the target in frames with at least this overlap.
pub const HIT_OVERLAP: f64 = 0.5;

/// The thresholds of the curves. The comparison operators are fixed: see the module documentation.
#[derive(Debug, Clone, PartialEq)]
pub struct Protocol {
    /// Centre distances in pixels, increasing.
    pub precision: Vec<f64>,
    /// Normalised centre distances, increasing.
    pub normalised: Vec<f64>,
    /// Overlaps, increasing.
    pub success: Vec<f64>,
}

impl Protocol {
    /// The protocol of OTB.
    pub fn otb() -> Self {
        // Quotients instead of products: 3 / 20 is the closest number to 0.15, 3 * 0.05 is not.
        Self {
            precision: (0..=50).map(f64::from).collect(),
            normalised: (0..=50).map(|k| f64::from(k) / 100.0).collect(),
            success: (0..=20).map(|k| f64::from(k) / 20.0).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_indices_match_the_thresholds() {
        let protocol = Protocol::otb();
        assert_eq!((protocol.precision[DP_INDEX], protocol.success[SUCCESS_INDEX]), (20.0, 0.5));
        assert_eq!(
            (protocol.precision.len(), protocol.normalised.len(), protocol.success.len()),
            (51, 51, 21)
        );
        assert_eq!(
            (protocol.normalised[50], protocol.success[3], protocol.success[20]),
            (0.5, 0.15, 1.0)
        );
    }
}
