//! Curves over thresholds from the measures of frames.

use std::array;

use super::frames::FrameMeasures;
use crate::protocol::{DP_INDEX, LOST_OVERLAP, NORMALISED, PRECISION, SUCCESS, SUCCESS_INDEX};

/// Shares of frames, 0 to 1, at the thresholds of the protocol.
#[derive(Debug, Clone, PartialEq)]
pub struct Curves {
    /// Share of frames within each centre distance.
    pub precision: [f64; PRECISION.len()],
    /// Share of frames within each normalised centre distance.
    pub normalised: [f64; NORMALISED.len()],
    /// Share of frames above each overlap.
    pub success: [f64; SUCCESS.len()],
}

impl Curves {
    /// The curves of the frames of several runs on one target; `None` if no frame counts.
    pub fn of(runs: &[&FrameMeasures]) -> Option<Self> {
        let known = |part: fn(&FrameMeasures) -> &[Option<f64>]| -> Vec<f64> {
            runs.iter().flat_map(|run| part(run).iter().flatten().copied()).collect()
        };
        let overlaps = known(|frames| &frames.overlaps);
        let (distances, normalised) =
            (known(|frames| &frames.distances), known(|frames| &frames.normalised));
        let share = |passing: usize| passing as f64 / overlaps.len() as f64;
        let within = |distances: &[f64], most: f64| {
            share(distances.iter().filter(|distance| **distance <= most).count())
        };
        (!overlaps.is_empty()).then(|| Self {
            precision: PRECISION.map(|most| within(&distances, most)),
            normalised: NORMALISED.map(|most| within(&normalised, most)),
            success: SUCCESS
                .map(|least| share(overlaps.iter().filter(|overlap| **overlap > least).count())),
        })
    }

    /// Precision at 20 pixels.
    pub fn dp20(&self) -> f64 {
        self.precision[DP_INDEX]
    }

    /// Mean of the success curve.
    pub fn auc(&self) -> f64 {
        mean(&self.success)
    }

    /// Success at an overlap of 0.5.
    pub fn success50(&self) -> f64 {
        self.success[SUCCESS_INDEX]
    }

    /// Mean of the curve of normalised precision.
    pub fn norm_precision(&self) -> f64 {
        mean(&self.normalised)
    }

    /// The mean of several curves, threshold by threshold; `None` without curves.
    pub fn mean(all: &[&Self]) -> Option<Self> {
        let mean = |at: &dyn Fn(&Self) -> f64| mean(&all.iter().map(|c| at(c)).collect::<Vec<_>>());
        (!all.is_empty()).then(|| Self {
            precision: array::from_fn(|k| mean(&|c| c.precision[k])),
            normalised: array::from_fn(|k| mean(&|c| c.normalised[k])),
            success: array::from_fn(|k| mean(&|c| c.success[k])),
        })
    }
}

/// The mean; 0 without values.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// The share of the frames in which the target is lost, and the mean overlap of the others; `None`
/// if there are none.
pub fn loss(overlaps: &[f64]) -> (f64, Option<f64>) {
    let (lost, others): (Vec<f64>, Vec<f64>) = overlaps.iter().partition(|o| **o < LOST_OVERLAP);
    let share = lost.len() as f64 / overlaps.len() as f64;
    (share, (!others.is_empty()).then(|| mean(&others)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_count_up_to_and_overlaps_above_the_threshold() {
        let measures = FrameMeasures {
            overlaps: vec![Some(1.0), Some(0.5), None, Some(0.15), Some(0.0)],
            distances: vec![Some(0.0), Some(20.0), None, Some(20.5), Some(f64::INFINITY)],
            normalised: vec![Some(0.0), Some(0.5), None, Some(0.51), Some(f64::INFINITY)],
        };
        let curves = Curves::of(&[&measures]).unwrap();
        assert_eq!((curves.precision[0], curves.precision[20]), (0.25, 0.5));
        assert_eq!((curves.precision[21], curves.precision[50]), (0.75, 0.75));
        assert_eq!((curves.normalised[0], curves.normalised[50]), (0.25, 0.5));
        // 1 > 0.95 but not > 1; 0.15 is not > 0.15; 0 is not > 0.
        assert_eq!((curves.success[0], curves.success[2], curves.success[3]), (0.75, 0.75, 0.5));
        assert_eq!((curves.success[10], curves.success[19], curves.success[20]), (0.25, 0.25, 0.0));
        let twice = Curves::of(&[&measures, &measures]).unwrap();
        assert_eq!(twice, curves, "doubling the frames keeps the shares");
    }

    #[test]
    fn a_target_is_lost_below_a_tenth() {
        assert_eq!(loss(&[1.0, 0.1, 0.099, 0.0]), (0.5, Some(0.55)));
        assert_eq!(loss(&[0.0]), (1.0, None), "lost in all frames");
    }

    #[test]
    fn no_frames_give_no_curves() {
        assert_eq!(Curves::of(&[&FrameMeasures::default()]), None);
        assert_eq!(Curves::mean(&[]), None);
    }
}
