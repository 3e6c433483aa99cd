//! Every convention of the comparison, as one value.
//!
//! [`Protocol::otb`] is the tracker benchmark of Wu, Lim and Yang (CVPR 2013, PAMI 2015). Applied to the raw boxes that its authors
//! published, it gives the figures that they published.
//!
//! - The centre of a box is `x + (w - 1) / 2`, `y + (h - 1) / 2`. The same in both boxes, so that counting from 0 or 1 is no matter.
//! - **Precision** at t: share of frames whose centre distance is at most t pixels (`<=`), t = 0, 1 .. 50. DP is its value at 20.
//! - **Success** at t: share of frames whose overlap (intersection over union) is more than t (`>`), t = 0, 0.05 .. 1. AUC is the mean of the 21 values.
//! - **Normalised precision** (Mueller et al., TrackingNet, ECCV 2018): as precision, with the distance in x divided by the truth's width and that in y by its
//!   height, at most t = 0, 0.01 .. 0.5. Its score is the mean of the 51 values.
//! - The first frame, whose box is given, counts. A frame whose truth has no positive width and height does not.
//! - A box that the tracker did not give is the last one that it gave.
//! - A tracker's score is the mean over targets, not over frames.

/// Place of 20 pixels among the thresholds of precision.
pub const DP_PLACE: usize = 20;
/// Place of 0.5 among the thresholds of success.
pub const SUCCESS_PLACE: usize = 10;

/// The thresholds of the curves. How they are compared is fixed: see the head of this module.
#[derive(Debug, Clone, PartialEq)]
pub struct Protocol {
    /// Centre distances in pixels, rising.
    pub precision: Vec<f64>,
    /// Normalised centre distances, rising.
    pub normalised: Vec<f64>,
    /// Overlaps, rising.
    pub success: Vec<f64>,
}

impl Protocol {
    /// The tracker benchmark's.
    pub fn otb() -> Self {
        // Quotients, not products: 3 / 20 is the nearest number to 0.15, 3 * 0.05 is not.
        Self {
            precision: (0..=50).map(f64::from).collect(),
            normalised: (0..=50).map(|k| f64::from(k) / 100.0).collect(),
            success: (0..=20).map(|k| f64::from(k) / 20.0).collect(),
        }
    }
}

impl Default for Protocol {
    fn default() -> Self {
        Self::otb()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_places_are_those_of_the_thresholds() {
        let protocol = Protocol::otb();
        assert_eq!((protocol.precision[DP_PLACE], protocol.success[SUCCESS_PLACE]), (20.0, 0.5));
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
