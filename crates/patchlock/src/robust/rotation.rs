//! The target's rotation in the frame: measured on a log-polar grid, and checked by tracking filter and
//! memory.

use super::hypothesis::Hypothesis;
use super::pose::Pose;
use crate::config::RobustConfig;
use crate::correlation::rotation::{
    RotationEstimate, RotationFilter, RotationScratch, SavedRotation,
};
use crate::vision::crop::Region;
use crate::vision::frame::Frame;
use serde::{Deserialize, Serialize};

/// What is known about the target's rotation.
#[derive(Debug)]
pub(crate) struct RotationEstimator {
    filter: RotationFilter,
    /// The mean of the filter's response.
    mean: f64,
    /// Frames for which the target counts as turning.
    turning: u32,
    params: RotationParams,
}

/// What is known about the rotation, as a snapshot holds it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct SavedRotationEstimator {
    filter: SavedRotation,
    mean: f64,
    turning: u32,
}

/// When rotation is measured, and when it counts.
#[derive(Debug, Clone, Copy, PartialEq)]
struct RotationParams {
    /// Whether rotation is followed.
    rotate: bool,
    /// It is measured where the memory's response is at most this share of its mean, or the target
    /// turns.
    below: f64,
    /// When a measured rotation is clear.
    clear: ConfidenceParams,
    /// When a measured rotation counts, and how fast the filter learns.
    still: RotationLimits,
    /// The same while the target turns.
    turning: RotationLimits,
    /// Frames without rotation after which the target no longer turns.
    turning_frames: u32,
}

/// When a measured rotation is clear.
#[derive(Debug, Clone, Copy, PartialEq)]
struct ConfidenceParams {
    /// The filter responds at least with this share of its mean response,
    share: f64,
    /// and the rotation is at most this, in radians.
    most: f64,
    /// The mean response before anything was measured.
    mean: f64,
    /// Rate of the mean response.
    rate: f64,
}

/// When a measured rotation counts.
#[derive(Debug, Clone, Copy, PartialEq)]
struct RotationLimits {
    /// The smallest rotation, in radians.
    least: f64,
    /// Tracking filter and memory must respond this many times stronger to it.
    margin: f64,
    /// Learning rate of the filter.
    rate: f32,
}

/// Rotations that were suggested for a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RotationCandidates {
    /// The rotations: the measured one, and upright.
    pub rotations: [f64; 2],
    /// Tracking filter and memory must respond this many times stronger.
    margin: f64,
}

impl RotationParams {
    fn new(config: &RobustConfig) -> Self {
        Self {
            rotate: config.rotate,
            below: config.rotation_below,
            clear: ConfidenceParams {
                share: config.rotation_clear,
                most: config.rotation_most,
                mean: config.rotation_mean,
                rate: config.rotation_mean_rate,
            },
            still: RotationLimits {
                least: config.rotation_least,
                margin: config.rotation_margin,
                rate: config.rotation_rate as f32,
            },
            turning: RotationLimits {
                least: config.turning_least,
                margin: config.turning_margin,
                rate: config.turning_rate as f32,
            },
            turning_frames: config.turning_frames as u32,
        }
    }

    /// The limits while the target turns, and while it does not.
    fn limits(&self, turning: bool) -> RotationLimits {
        if turning { self.turning } else { self.still }
    }

    /// Whether rotation is measured. A rotation that matters makes the memory less sure: `memory`
    /// is its response, `mean` its mean response.
    fn is_measured(&self, turning: bool, memory: f64, mean: f64) -> bool {
        self.rotate && (turning || memory <= self.below * mean)
    }
}

impl RotationEstimator {
    /// A filter that has learnt the target in this region.
    pub fn begin(
        frame: &Frame<'_>,
        region: Region,
        config: &RobustConfig,
        scratch: &mut RotationScratch,
    ) -> Self {
        let filter = RotationFilter::begin(frame, region, scratch);
        let params = RotationParams::new(config);
        Self { filter, mean: params.clear.mean, turning: 0, params }
    }

    /// As a snapshot holds it.
    pub fn saved(&self) -> SavedRotationEstimator {
        let Self { filter, mean, turning, .. } = self;
        SavedRotationEstimator { filter: filter.saved(), mean: *mean, turning: *turning }
    }

    /// From a snapshot.
    ///
    /// # Errors
    /// What is damaged.
    pub fn restore(
        saved: SavedRotationEstimator,
        config: &RobustConfig,
    ) -> Result<Self, &'static str> {
        let SavedRotationEstimator { filter, mean, turning } = saved;
        if !mean.is_finite() {
            return Err("the mean response of the filter over rotation is not finite");
        }
        let filter = RotationFilter::restore(filter)?;
        Ok(Self { filter, mean, turning, params: RotationParams::new(config) })
    }

    /// Other rotations that the target may have at the place that was chosen, if one is measured
    /// that is clear and large enough to count. `tracked` is the hypothesis of the tracking filter, `mean` the
    /// memory's mean response.
    pub fn suggest(
        &mut self,
        frame: &Frame<'_>,
        region: Region,
        (tracking_filter, mean): (&Hypothesis, f64),
        scratch: &mut RotationScratch,
    ) -> Option<RotationCandidates> {
        let turning = self.turning > 0;
        self.turning = self.turning.saturating_sub(1);
        if !self.params.is_measured(turning, tracking_filter.memory, mean) {
            return None;
        }
        let limits = self.params.limits(turning);
        let turn = self.filter.find(frame, region, scratch);
        if !self.params.clear.holds(turn, self.mean) {
            return None;
        }
        self.mean += self.params.clear.rate * (turn.response - self.mean);
        let rotations = [region.rotation + turn.rotation, 0.0];
        let counts = turn.rotation.abs() >= limits.least;
        counts.then_some(RotationCandidates { rotations, margin: limits.margin })
    }

    /// The target turns.
    pub fn begin_turning(&mut self) {
        self.turning = self.params.turning_frames;
    }

    /// Learns the target in this region, if rotation is followed.
    pub fn learn(&mut self, frame: &Frame<'_>, region: Region, scratch: &mut RotationScratch) {
        if self.params.rotate {
            let limits = self.params.limits(self.turning > 0);
            self.filter.learn(frame, region, limits.rate, scratch);
        }
    }
}

impl RotationCandidates {
    /// The place with each suggested rotation that it does not have yet.
    pub fn poses(self, pose: Pose) -> impl Iterator<Item = Pose> {
        let other = self.rotations.into_iter().filter(move |&rotation| rotation != pose.rotation);
        other.map(move |rotation| Pose { rotation, ..pose })
    }

    /// The best supported of the hypotheses of turned places, if tracking filter and memory respond to it
    /// clearly stronger than to the one that is not turned.
    pub fn accept(
        self,
        unturned: &Hypothesis,
        turned: impl Iterator<Item = Hypothesis>,
    ) -> Option<Hypothesis> {
        let mut accepted = None;
        let mut least = self.margin * unturned.support();
        for hypothesis in turned {
            if hypothesis.support() > least {
                (least, accepted) = (hypothesis.support(), Some(hypothesis));
            }
        }
        accepted
    }
}

impl ConfidenceParams {
    /// Whether a measured rotation is clear; `mean` is the filter's mean response.
    fn holds(&self, turn: RotationEstimate, mean: f64) -> bool {
        turn.response >= self.share * mean && turn.rotation.abs() <= self.most
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const POSE: Pose = Pose { centre: [40.0, 30.0], scale: 1.0, rotation: 0.2 };
    const PARAMS: RotationParams = RotationParams {
        rotate: true,
        below: 0.8,
        clear: ConfidenceParams { share: 0.4, most: 0.35, mean: 0.3, rate: 0.05 },
        still: RotationLimits { least: 0.18, margin: 1.1, rate: 0.1 },
        turning: RotationLimits { least: 0.03, margin: 1.02, rate: 0.2 },
        turning_frames: 10,
    };

    /// A hypothesis with this rotation, to which tracking filter and memory respond like this together.
    fn hypothesis(rotation: f64, support: f64) -> Hypothesis {
        let pose = Pose { rotation, ..POSE };
        let half = support / 2.0;
        Hypothesis { pose, response: half, memory: half }
    }

    #[test]
    fn rotation_is_measured_where_the_memory_is_less_sure_or_the_target_turns() {
        for (turning, memory, mean, measured) in [
            (false, 0.81, 1.0, false),
            (false, 0.8, 1.0, true),
            (false, 0.81, 2.0, true),
            (true, 0.9, 1.0, true),
        ] {
            assert_eq!(PARAMS.is_measured(turning, memory, mean), measured, "{memory} {mean}");
            let never = RotationParams { rotate: false, ..PARAMS };
            assert!(!never.is_measured(turning, memory, mean));
        }
    }

    #[test]
    fn a_weak_or_a_large_measurement_is_not_clear() {
        for (rotation, response, clear) in [
            (0.1, 0.2, true),
            (0.1, 0.199, false),
            (0.35, 0.5, true),
            (0.36, 0.5, false),
            (-0.36, 0.5, false),
            (-0.35, 0.5, true),
        ] {
            assert_eq!(
                PARAMS.clear.holds(RotationEstimate { rotation, response }, 0.5),
                clear,
                "{rotation} {response}"
            );
        }
    }

    #[test]
    fn a_place_is_tried_with_the_rotations_that_it_does_not_have() {
        let rotations = |measured, pose| -> Vec<f64> {
            let suggestion = RotationCandidates { rotations: [measured, 0.0], margin: 1.0 };
            suggestion.poses(pose).map(|pose| pose.rotation).collect()
        };
        assert_eq!(rotations(0.5, POSE), [0.5, 0.0]);
        assert_eq!(rotations(0.2, POSE), [0.0]);
        assert_eq!(rotations(0.3, Pose { rotation: 0.0, ..POSE }), [0.3]);
    }

    #[test]
    fn a_rotation_is_accepted_if_the_support_grows_by_the_margin() {
        let suggestion = RotationCandidates { rotations: [0.5, 0.0], margin: 1.5 };
        // The support of the unturned place, of the measured rotation and of the upright one; the
        // rotation that is accepted.
        for (unturned, measured, upright, accepted) in [
            (1.0, 1.5, 1.5, None),
            (1.0, 1.51, 1.5, Some(0.5)),
            (1.0, 1.4, 1.6, Some(0.0)),
            (1.0, 1.6, 1.7, Some(0.0)),
            (1.0, 1.7, 1.6, Some(0.5)),
            (1.0, 1.7, 1.7, Some(0.5)),
        ] {
            let turned = [hypothesis(0.5, measured), hypothesis(0.0, upright)];
            let found = suggestion.accept(&hypothesis(0.2, unturned), turned.into_iter());
            let found = found.map(|hypothesis| hypothesis.pose.rotation);
            assert_eq!(found, accepted, "{unturned} {measured} {upright}");
        }
        assert_eq!(suggestion.accept(&hypothesis(0.2, 1.0), std::iter::empty()), None);
    }
}
