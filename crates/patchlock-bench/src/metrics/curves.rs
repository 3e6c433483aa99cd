//! Curves over thresholds from the measures of frames.

use super::frames::FrameMeasures;
use crate::protocol::{DP_INDEX, LOST_OVERLAP, Protocol, SUCCESS_INDEX};

/// Shares of frames, 0 to 1, at the thresholds of the protocol.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Curves {
    /// Share of frames within each centre distance.
    pub precision: Vec<f64>,
    /// Share of frames within each normalised centre distance.
    pub normalised: Vec<f64>,
    /// Share of frames above each overlap.
    pub success: Vec<f64>,
}

impl Curves {
    /// Precision at 20 pixels.
    pub fn dp20(&self) -> f64 {
        self.precision.get(DP_INDEX).copied().unwrap_or(0.0)
    }

    /// Mean of the success curve.
    pub fn auc(&self) -> f64 {
        mean(&self.success)
    }

    /// Success at an overlap of 0.5.
    pub fn success50(&self) -> f64 {
        self.success.get(SUCCESS_INDEX).copied().unwrap_or(0.0)
    }

    /// Mean of the curve of normalised precision.
    pub fn norm_precision(&self) -> f64 {
        mean(&self.normalised)
    }

    /// The mean of several curves, threshold by threshold; `None` without curves.
    pub fn mean(all: &[&Curves]) -> Option<Curves> {
        let mean = |part: fn(&Curves) -> &[f64]| -> Vec<f64> {
            let points = all.first().map_or(0, |first| part(first).len());
            let at = |k: usize| all.iter().map(|c| part(c)[k]).sum::<f64>() / all.len() as f64;
            (0..points).map(at).collect()
        };
        (!all.is_empty()).then(|| Curves {
            precision: mean(|c| &c.precision),
            normalised: mean(|c| &c.normalised),
            success: mean(|c| &c.success),
        })
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// Counts of frames, summed over several runs on one target before they are divided.
#[derive(Debug, Clone, PartialEq)]
pub struct Tally {
    /// Number of frames that count.
    pub frames: usize,
    /// Sum of their overlaps.
    pub overlap: f64,
    /// Number of frames in which the target is lost.
    lost: usize,
    /// Sum of the overlaps of the other frames.
    not_lost_overlap: f64,
    precision: Vec<usize>,
    normalised: Vec<usize>,
    success: Vec<usize>,
}

impl Tally {
    /// An empty tally.
    pub fn new(protocol: &Protocol) -> Self {
        Self {
            frames: 0,
            overlap: 0.0,
            lost: 0,
            not_lost_overlap: 0.0,
            precision: vec![0; protocol.precision.len()],
            normalised: vec![0; protocol.normalised.len()],
            success: vec![0; protocol.success.len()],
        }
    }

    /// Adds the frames of a run; `protocol` has to be the one passed to [`Tally::new`].
    pub fn add(&mut self, measures: &FrameMeasures, protocol: &Protocol) {
        for overlap in measures.overlaps.iter().flatten() {
            self.frames += 1;
            self.overlap += overlap;
            if *overlap < LOST_OVERLAP {
                self.lost += 1;
            } else {
                self.not_lost_overlap += overlap;
            }
            count(&mut self.success, &protocol.success, |threshold| *overlap > threshold);
        }
        for distance in measures.distances.iter().flatten() {
            count(&mut self.precision, &protocol.precision, |threshold| *distance <= threshold);
        }
        for distance in measures.normalised.iter().flatten() {
            count(&mut self.normalised, &protocol.normalised, |threshold| *distance <= threshold);
        }
    }

    /// The shares; `None` if no frame counts.
    pub fn curves(&self) -> Option<Curves> {
        let share = |counts: &[usize]| -> Vec<f64> {
            counts.iter().map(|&count| count as f64 / self.frames as f64).collect()
        };
        (self.frames > 0).then(|| Curves {
            precision: share(&self.precision),
            normalised: share(&self.normalised),
            success: share(&self.success),
        })
    }

    /// The mean overlap; `None` if no frame counts.
    pub fn mean_overlap(&self) -> Option<f64> {
        (self.frames > 0).then(|| self.overlap / self.frames as f64)
    }

    /// Share of the frames in which the target is lost; `None` if no frame counts.
    pub fn lost_share(&self) -> Option<f64> {
        (self.frames > 0).then(|| self.lost as f64 / self.frames as f64)
    }

    /// The mean overlap of the frames in which the target is not lost; `None` if there are none.
    pub fn overlap_not_lost(&self) -> Option<f64> {
        let others = self.frames - self.lost;
        (others > 0).then(|| self.not_lost_overlap / others as f64)
    }
}

fn count(counts: &mut [usize], thresholds: &[f64], passes: impl Fn(f64) -> bool) {
    for (count, &threshold) in counts.iter_mut().zip(thresholds) {
        *count += usize::from(passes(threshold));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_count_up_to_and_overlaps_above_the_threshold() {
        let protocol = Protocol::otb();
        let mut tally = Tally::new(&protocol);
        let measures = FrameMeasures {
            overlaps: vec![Some(1.0), Some(0.5), None, Some(0.15), Some(0.0)],
            distances: vec![Some(0.0), Some(20.0), None, Some(20.5), Some(f64::INFINITY)],
            normalised: vec![Some(0.0), Some(0.5), None, Some(0.51), Some(f64::INFINITY)],
        };
        tally.add(&measures, &protocol);
        let curves = tally.curves().unwrap();
        assert_eq!((curves.precision[0], curves.precision[20]), (0.25, 0.5));
        assert_eq!((curves.precision[21], curves.precision[50]), (0.75, 0.75));
        assert_eq!((curves.normalised[0], curves.normalised[50]), (0.25, 0.5));
        // 1 > 0.95 but not > 1; 0.15 is not > 0.15; 0 is not > 0.
        assert_eq!((curves.success[0], curves.success[2], curves.success[3]), (0.75, 0.75, 0.5));
        assert_eq!((curves.success[10], curves.success[19], curves.success[20]), (0.25, 0.25, 0.0));
        assert_eq!(tally.mean_overlap(), Some(1.65 / 4.0));
        tally.add(&measures, &protocol);
        assert_eq!(tally.curves().unwrap(), curves, "doubling the frames keeps the shares");
        assert_eq!(tally.frames, 8);
    }

    #[test]
    fn a_target_is_lost_below_a_tenth() {
        let protocol = Protocol::otb();
        let of = |overlaps: &[Option<f64>]| {
            let overlaps = overlaps.to_vec();
            let mut tally = Tally::new(&protocol);
            tally.add(&FrameMeasures { overlaps, ..FrameMeasures::default() }, &protocol);
            (tally.lost_share(), tally.overlap_not_lost())
        };
        let frames = [Some(1.0), Some(0.1), None, Some(0.099), Some(0.0)];
        assert_eq!(of(&frames), (Some(0.5), Some(0.55)));
        assert_eq!(of(&[Some(0.0), None]), (Some(1.0), None), "lost in all frames");
        assert_eq!(of(&[None]), (None, None));
    }

    #[test]
    fn no_frames_give_no_curves() {
        assert_eq!(Tally::new(&Protocol::otb()).curves(), None);
        assert_eq!(Curves::mean(&[]), None);
    }
}
