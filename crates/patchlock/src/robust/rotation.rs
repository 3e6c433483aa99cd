//! The target's rotation in the frame: measured on a log-polar grid, and checked by tracking filter and
//! memory.

use super::RobustConfig;
use super::hypothesis::Hypothesis;
use super::locate::FrameContext;
use super::pose::Pose;
use crate::correlation::rotation::{RotationEstimate, RotationLearner, RotationScratch};
use crate::correlation::spectral_filter::SpectralFilter;
use crate::vision::crop::Region;
use crate::vision::frame::Frame;
use serde::{Deserialize, Serialize};

/// What is known about the target's rotation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct RotationEstimator {
    filter: SpectralFilter,
    /// The mean of the filter's response.
    mean: f64,
    /// Frames for which the target counts as turning.
    turning: u32,
}

/// Rotations that were suggested for a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RotationCandidates {
    /// The rotations: the measured one, and upright.
    pub rotations: [f64; 2],
    /// Tracking filter and memory must respond this many times stronger.
    margin: f64,
}

impl RotationEstimator {
    /// With a filter that has learnt the target.
    pub fn of(filter: SpectralFilter, config: &RobustConfig) -> Self {
        Self { filter, mean: config.rotation_mean, turning: 0 }
    }

    /// Checks what was read from a snapshot.
    ///
    /// # Errors
    /// What is damaged.
    pub fn check(&self, learner: &RotationLearner) -> Result<(), &'static str> {
        if !self.mean.is_finite() {
            return Err("the mean response of the filter over rotation is not finite");
        }
        learner.fits(&self.filter).then_some(()).ok_or("the filter over rotation is damaged")
    }

    /// Other rotations that the target may have at the place that was chosen, if one is measured
    /// that is clear and large enough to count. `followed` is the hypothesis of the tracking filter.
    pub fn suggest(
        &mut self,
        learner: &RotationLearner,
        context: FrameContext<'_>,
        followed: &Hypothesis,
        scratch: &mut RotationScratch,
    ) -> Option<RotationCandidates> {
        let FrameContext { frame, window, memory, config } = context;
        let turning = self.turning > 0;
        self.turning = self.turning.saturating_sub(1);
        if !is_measured(config, turning, followed.memory, memory.mean()) {
            return None;
        }
        let region = followed.pose.region(window.base());
        let turn = learner.find(&self.filter, frame, region, scratch);
        if !is_clear(config, turn, self.mean) {
            return None;
        }
        self.mean += config.rotation_mean_rate * (turn.response - self.mean);
        let rotations = [region.rotation + turn.rotation, 0.0];
        let [least, margin, _] = limits(config, turning);
        let counts = turn.rotation.abs() >= least;
        counts.then_some(RotationCandidates { rotations, margin })
    }

    /// The target turns.
    pub fn begin_turning(&mut self, config: &RobustConfig) {
        self.turning = config.turning_frames as u32;
    }

    /// Learns the target in this region, if rotation is followed.
    pub fn learn(
        &mut self,
        learner: &RotationLearner,
        frame: &Frame<'_>,
        region: Region,
        config: &RobustConfig,
        scratch: &mut RotationScratch,
    ) {
        if config.rotate {
            let [_, _, rate] = limits(config, self.turning > 0);
            learner.learn(&mut self.filter, frame, region, rate as f32, scratch);
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

/// Whether rotation is measured. A rotation that matters makes the memory less sure: `memory` is its
/// response, `mean` its mean response.
fn is_measured(config: &RobustConfig, turning: bool, memory: f64, mean: f64) -> bool {
    config.rotate && (turning || memory <= config.rotation_below * mean)
}

/// Whether a measured rotation is clear; `mean` is the filter's mean response.
fn is_clear(config: &RobustConfig, turn: RotationEstimate, mean: f64) -> bool {
    turn.response >= config.rotation_clear * mean && turn.rotation.abs() <= config.rotation_most
}

/// The smallest rotation that counts, in radians, how many times stronger tracking filter and memory
/// must respond to it, and the learning rate of the filter.
fn limits(config: &RobustConfig, turning: bool) -> [f64; 3] {
    if turning {
        [config.turning_least, config.turning_margin, config.turning_rate]
    } else {
        [config.rotation_least, config.rotation_margin, config.rotation_rate]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const POSE: Pose = Pose { centre: [40.0, 30.0], scale: 1.0, rotation: 0.2 };

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
            let config = RobustConfig { rotation_below: 0.8, ..Default::default() };
            let is = is_measured(&config, turning, memory, mean);
            assert_eq!(is, measured, "{memory} {mean}");
            let never = RobustConfig { rotate: false, ..config };
            assert!(!is_measured(&never, turning, memory, mean));
        }
    }

    #[test]
    fn a_weak_or_a_large_measurement_is_not_clear() {
        let config =
            RobustConfig { rotation_clear: 0.4, rotation_most: 0.35, ..Default::default() };
        for (rotation, response, clear) in [
            (0.1, 0.2, true),
            (0.1, 0.199, false),
            (0.35, 0.5, true),
            (0.36, 0.5, false),
            (-0.36, 0.5, false),
            (-0.35, 0.5, true),
        ] {
            let turn = RotationEstimate { rotation, response };
            assert_eq!(is_clear(&config, turn, 0.5), clear, "{rotation} {response}");
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
