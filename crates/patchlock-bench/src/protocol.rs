//! The conventions of the comparison.
//!
//! They are the protocol of OTB by Wu, Lim and Yang (CVPR 2013, PAMI 2015). Applied to
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

/// Centre distances in pixels: the thresholds of precision.
pub const PRECISION: [f64; 51] = quotients(1);
/// Normalised centre distances.
pub const NORMALISED: [f64; 51] = quotients(100);
/// Overlaps: the thresholds of success.
pub const SUCCESS: [f64; 21] = quotients(20);

/// 0, 1, 2 .. divided by a number. 3 / 20 is the closest number to 0.15, the product 3 * 0.05 is not.
const fn quotients<const N: usize>(divisor: u32) -> [f64; N] {
    let (mut all, mut k) = ([0.0; N], 0);
    while k < N {
        all[k] = k as f64 / divisor as f64;
        k += 1;
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_indices_match_the_thresholds() {
        assert_eq!((PRECISION[DP_INDEX], SUCCESS[SUCCESS_INDEX]), (20.0, 0.5));
        assert_eq!((NORMALISED[50], SUCCESS[3], SUCCESS[20]), (0.5, 0.15, 1.0));
    }
}
