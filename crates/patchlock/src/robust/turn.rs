//! The target's rotation in the frame: measured on a log-polar grid, and checked by follower and
//! memory.

use super::choose::Hypothesis;
use super::place::Place;
use crate::config::RobustConfig;
use crate::correlation::rotation::{RotationFilter, RotationScratch, SavedRotation, Turn};
use crate::vision::crop::Region;
use crate::vision::frame::Frame;
use serde::{Deserialize, Serialize};

/// A measured rotation counts where the filter's response is at least this share of its mean
/// response.
const CLEAR: f64 = 0.4;

/// No larger rotation counts, in radians.
const MOST: f64 = 0.35;

/// The mean response of the filter before anything was measured.
const MEAN: f64 = 0.3;

/// Rate of the running mean of the filter's response.
const MEAN_RATE: f64 = 0.05;

/// While the target turns, no smaller rotation counts, in radians.
const TURNING_LEAST: f64 = 0.03;

/// While the target turns, follower and memory must respond this many times stronger to a rotation.
const TURNING_MARGIN: f64 = 1.02;

/// While the target turns, the learning rate of the filter.
const TURNING_RATE: f32 = 0.2;

/// Frames without rotation after which the target no longer turns.
const TURNING_FRAMES: u32 = 10;

/// What is known about the target's rotation.
#[derive(Debug)]
pub(crate) struct Rotation {
    filter: RotationFilter,
    /// The mean of the filter's response.
    mean: f64,
    /// Frames for which the target counts as turning.
    turning: u32,
    params: TurnParams,
}

/// What is known about the rotation, as a snapshot holds it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct SavedTurning {
    filter: SavedRotation,
    mean: f64,
    turning: u32,
}

/// When rotation is measured, and when it counts.
#[derive(Debug, Clone, Copy, PartialEq)]
struct TurnParams {
    /// Whether rotation is followed.
    rotate: bool,
    /// It is measured where the memory's response is at most this share of its mean, or the target
    /// turns.
    below: f64,
    /// When a measured rotation counts.
    still: TurnLimits,
    /// Learning rate of the filter.
    rate: f32,
}

/// When a measured rotation counts.
#[derive(Debug, Clone, Copy, PartialEq)]
struct TurnLimits {
    /// The smallest rotation, in radians.
    least: f64,
    /// Follower and memory must respond this many times stronger to it.
    margin: f64,
}

/// Rotations that were suggested for a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Suggestion {
    /// The rotations: the measured one, and upright.
    pub rotations: [f64; 2],
    /// Follower and memory must respond this many times stronger.
    margin: f64,
}

impl TurnParams {
    fn new(config: &RobustConfig) -> Self {
        Self {
            rotate: config.rotate,
            below: config.rotation_below,
            still: TurnLimits { least: config.rotation_least, margin: config.rotation_margin },
            rate: config.rotation_rate as f32,
        }
    }

    /// Whether rotation is measured. A rotation that matters makes the memory less sure: `memory`
    /// is its response, `mean` its mean response.
    fn is_measured(&self, turning: bool, memory: f64, mean: f64) -> bool {
        self.rotate && (turning || memory <= self.below * mean)
    }
}

impl Rotation {
    /// A filter that has learnt the target in this region.
    pub fn begin(
        frame: &Frame<'_>,
        region: Region,
        config: &RobustConfig,
        scratch: &mut RotationScratch,
    ) -> Self {
        let filter = RotationFilter::begin(frame, region, scratch);
        Self { filter, mean: MEAN, turning: 0, params: TurnParams::new(config) }
    }

    /// As a snapshot holds it.
    pub fn saved(&self) -> SavedTurning {
        let Self { filter, mean, turning, .. } = self;
        SavedTurning { filter: filter.saved(), mean: *mean, turning: *turning }
    }

    /// From a snapshot.
    ///
    /// # Errors
    /// What is damaged.
    pub fn restore(saved: SavedTurning, config: &RobustConfig) -> Result<Self, &'static str> {
        let SavedTurning { filter, mean, turning } = saved;
        if !mean.is_finite() {
            return Err("the mean response of the filter over rotation is not finite");
        }
        let filter = RotationFilter::restore(filter)?;
        Ok(Self { filter, mean, turning, params: TurnParams::new(config) })
    }

    /// Other rotations that the target may have at the place that was chosen, if one is measured
    /// that is clear and large enough to count. `follower` is the follower's hypothesis, `mean` the
    /// memory's mean response.
    pub fn suggest(
        &mut self,
        frame: &Frame<'_>,
        region: Region,
        (follower, mean): (&Hypothesis, f64),
        scratch: &mut RotationScratch,
    ) -> Option<Suggestion> {
        let turning = self.turning > 0;
        self.turning = self.turning.saturating_sub(1);
        if !self.params.is_measured(turning, follower.memory, mean) {
            return None;
        }
        let limits = match turning {
            true => TurnLimits { least: TURNING_LEAST, margin: TURNING_MARGIN },
            false => self.params.still,
        };
        let turn = self.filter.find(frame, region, scratch);
        if !is_clear(turn, self.mean) {
            return None;
        }
        self.mean += MEAN_RATE * (turn.response - self.mean);
        let rotations = [region.rotation + turn.rotation, 0.0];
        let counts = turn.rotation.abs() >= limits.least;
        counts.then_some(Suggestion { rotations, margin: limits.margin })
    }

    /// The target turns.
    pub fn begin_turning(&mut self) {
        self.turning = TURNING_FRAMES;
    }

    /// Learns the target in this region, if rotation is followed.
    pub fn learn(&mut self, frame: &Frame<'_>, region: Region, scratch: &mut RotationScratch) {
        if self.params.rotate {
            let rate = if self.turning > 0 { TURNING_RATE } else { self.params.rate };
            self.filter.learn(frame, region, rate, scratch);
        }
    }
}

impl Suggestion {
    /// The place with each suggested rotation that it does not have yet.
    pub fn places(self, place: Place) -> impl Iterator<Item = Place> {
        let other = self.rotations.into_iter().filter(move |&rotation| rotation != place.rotation);
        other.map(move |rotation| Place { rotation, ..place })
    }

    /// The best supported of the hypotheses of turned places, if follower and memory respond to it
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

/// Whether a measured rotation is clear; `mean` is the filter's mean response.
fn is_clear(turn: Turn, mean: f64) -> bool {
    turn.response >= CLEAR * mean && turn.rotation.abs() <= MOST
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robust::choose::Source;

    const PLACE: Place = Place { centre: [40.0, 30.0], scale: 1.0, rotation: 0.2 };
    const PARAMS: TurnParams = TurnParams {
        rotate: true,
        below: 0.8,
        still: TurnLimits { least: 0.18, margin: 1.1 },
        rate: 0.1,
    };

    /// A hypothesis with this rotation, to which follower and memory respond like this together.
    fn hypothesis(rotation: f64, support: f64) -> Hypothesis {
        let place = Place { rotation, ..PLACE };
        let half = support / 2.0;
        Hypothesis { place, source: Source::Follower, response: half, memory: half }
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
            let never = TurnParams { rotate: false, ..PARAMS };
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
            assert_eq!(is_clear(Turn { rotation, response }, 0.5), clear, "{rotation} {response}");
        }
    }

    #[test]
    fn a_place_is_tried_with_the_rotations_that_it_does_not_have() {
        let rotations = |measured, place| -> Vec<f64> {
            let suggestion = Suggestion { rotations: [measured, 0.0], margin: 1.0 };
            suggestion.places(place).map(|place| place.rotation).collect()
        };
        assert_eq!(rotations(0.5, PLACE), [0.5, 0.0]);
        assert_eq!(rotations(0.2, PLACE), [0.0]);
        assert_eq!(rotations(0.3, Place { rotation: 0.0, ..PLACE }), [0.3]);
    }

    #[test]
    fn a_rotation_is_accepted_if_the_support_grows_by_the_margin() {
        let suggestion = Suggestion { rotations: [0.5, 0.0], margin: 1.5 };
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
            let found = found.map(|hypothesis| hypothesis.place.rotation);
            assert_eq!(found, accepted, "{unturned} {measured} {upright}");
        }
        assert_eq!(suggestion.accept(&hypothesis(0.2, 1.0), std::iter::empty()), None);
    }
}
