//! The target's rotation in the frame: measured on a log-polar grid, and checked by follower and memory.

use super::{Scratch, Target};
use crate::config::RobustConfig;
use crate::correlation::response::Peak;
use crate::correlation::rotation::{RotationFilter, RotationScratch, SavedRotation};
use crate::vision::crop::Region;
use crate::vision::frame::Frame;
use serde::{Deserialize, Serialize};

/// A measured rotation counts where the filter responds with this share of its mean response,
const CLEAR: f64 = 0.4;

/// and up to this many radians.
const MOST: f64 = 0.35;

/// The mean response, and its rate, before anything was measured.
const MEAN: f64 = 0.3;
const MEAN_RATE: f64 = 0.05;

/// While the target turns, rotations from this many radians count,
const TURNING_LEAST: f64 = 0.03;

/// where follower and memory respond this many times stronger,
const TURNING_MARGIN: f64 = 1.02;

/// and the filter learns at this rate.
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
}

/// What is known about the rotation, as a snapshot holds it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct SavedTurning {
    filter: SavedRotation,
    mean: f64,
    turning: u32,
}

impl Rotation {
    /// A filter that has learnt the target in this region.
    pub fn begin(frame: &Frame<'_>, region: Region, scratch: &mut RotationScratch) -> Self {
        Self { filter: RotationFilter::begin(frame, region, scratch), mean: MEAN, turning: 0 }
    }

    /// As a snapshot holds it.
    pub fn saved(&self) -> SavedTurning {
        let Self { filter, mean, turning } = self;
        SavedTurning { filter: filter.saved(), mean: *mean, turning: *turning }
    }

    /// From a snapshot.
    ///
    /// # Errors
    /// What is damaged.
    pub fn restore(saved: SavedTurning) -> Result<Self, &'static str> {
        let SavedTurning { filter, mean, turning } = saved;
        if !mean.is_finite() {
            return Err("the mean response of the filter over rotation is not finite");
        }
        Ok(Self { filter: RotationFilter::restore(filter)?, mean, turning })
    }

    /// Learns the target in this region, if rotation is followed.
    pub fn learn(
        &mut self,
        frame: &Frame<'_>,
        region: Region,
        config: &RobustConfig,
        scratch: &mut RotationScratch,
    ) {
        if config.rotate {
            let slow = config.rotation_rate as f32;
            let rate = if self.turning > 0 { TURNING_RATE } else { slow };
            self.filter.learn(frame, region, rate, scratch);
        }
    }

    /// The rotation that the filter measures in this region, if that is clear and large enough to count.
    fn measure(
        &mut self,
        frame: &Frame<'_>,
        region: Region,
        least: f64,
        scratch: &mut RotationScratch,
    ) -> Option<f64> {
        let turn = self.filter.find(frame, region, scratch);
        if turn.response < CLEAR * self.mean || turn.rotation.abs() > MOST {
            return None;
        }
        self.mean += MEAN_RATE * (turn.response - self.mean);
        (turn.rotation.abs() >= least).then_some(turn.rotation)
    }
}

impl Target {
    /// Turns by what the filter over rotation measures, or back upright, if follower and memory together
    /// respond clearly stronger there. `peak` is the follower's in the window that was followed in, to which
    /// the responses at hand are.
    pub fn check_turn(
        &mut self,
        frame: &Frame<'_>,
        peak: Peak,
        config: &RobustConfig,
        scratch: &mut Scratch,
    ) {
        let known = scratch.memory.at(self.window.features().fourier(), peak.shift);
        let turning = self.rotation.turning > 0;
        self.rotation.turning = self.rotation.turning.saturating_sub(1);
        // A rotation that matters makes the memory less sure.
        if !config.rotate || !turning && known > config.rotation_below * self.follower.mean {
            return;
        }
        let (least, margin) = match turning {
            true => (TURNING_LEAST, TURNING_MARGIN),
            false => (config.rotation_least, config.rotation_margin),
        };
        let (before, region) = (self.place, self.place.region(self.window.base()));
        let Some(turn) = self.rotation.measure(frame, region, least, &mut scratch.rotation) else {
            return;
        };
        let mut best = (margin * (peak.value + known), before);
        for rotation in [before.rotation + turn, 0.0] {
            if rotation != before.rotation {
                self.place.rotation = rotation;
                let peak = self.respond(frame, config, scratch);
                let fourier = self.window.features().fourier();
                let response = peak.value + scratch.memory.at(fourier, peak.shift);
                self.shift_by(peak.shift);
                if response > best.0 {
                    best = (response, self.place);
                }
                self.place = before;
            }
        }
        self.place = best.1;
        if self.place != before {
            self.rotation.turning = TURNING_FRAMES;
        }
    }
}
