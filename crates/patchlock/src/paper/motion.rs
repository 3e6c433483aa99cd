//! The motion model (Sec. 2): independent Gaussian noise around the last estimate.

use super::LEAST_AREA;
use crate::config::PaperConfig;
use crate::vision::state::State;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

/// Maximum number of redraws of a state; then the last state is kept. Even if half of all draws
/// were refused, this number would never be reached.
const MAX_REDRAWS: usize = 100;

/// A drawn target's sides, and the distances of its centre from the frame's first row and column,
/// are at most this many times the larger side of the frame.
const MAX_FRAMES: f64 = 10.0;

/// How states move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Standard deviations of x and y (pixels), scale, rotation (radians), aspect, and skew
    /// (radians).
    pub sigma: [f64; 6],
    /// What is never drawn.
    pub limits: Limits,
}

/// The smallest and the largest target, and the centre that is furthest away.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    template_side: usize,
    pixels: f64,
}

impl Limits {
    /// The limits in frames of this width and height, for templates of this side in samples.
    pub fn new(frame: [usize; 2], template_side: usize) -> Self {
        Self { template_side, pixels: MAX_FRAMES * frame[0].max(frame[1]) as f64 }
    }

    /// Whether a state drawn around `last` is within the limits. What was beyond them before,
    /// because the first box was, may stay where it is or come closer.
    fn hold(&self, state: &State, last: &State) -> bool {
        let area = |state: &State| {
            let (width, height) = state.size(self.template_side);
            width * height
        };
        let sizes = |state: &State| {
            let (width, height) = state.size(self.template_side);
            [width, height, state.x.abs(), state.y.abs()]
        };
        area(state) >= area(last).min(LEAST_AREA)
            && sizes(state).iter().zip(sizes(last)).all(|(new, old)| *new <= old.max(self.pixels))
    }
}

impl Motion {
    /// The motion model in frames of this width and height.
    pub fn new(config: &PaperConfig, frame: [usize; 2]) -> Self {
        Self {
            limits: Limits::new(frame, config.patches.template_side),
            sigma: [
                config.sigma_x,
                config.sigma_y,
                config.sigma_scale,
                config.sigma_rotation,
                config.sigma_aspect,
                config.sigma_skew,
            ],
        }
    }

    /// Draws a state around `last`. A state that is not valid or beyond the limits is drawn again.
    pub fn draw(&self, last: &State, rng: &mut Pcg64) -> State {
        for _ in 0..MAX_REDRAWS {
            let state = self.draw_once(last, rng);
            if state.is_valid() && self.limits.hold(&state, last) {
                return state;
            }
        }
        *last
    }

    fn draw_once(&self, last: &State, rng: &mut Pcg64) -> State {
        let noise = self.sigma.map(|sigma| {
            let normal: f64 = StandardNormal.sample(rng);
            sigma * normal
        });
        State {
            x: last.x + noise[0],
            y: last.y + noise[1],
            scale: last.scale + noise[2],
            rotation: last.rotation + noise[3],
            aspect: last.aspect + noise[4],
            skew: last.skew + noise[5],
        }
    }
}
