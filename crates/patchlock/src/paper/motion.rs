//! The motion model (Sec. 2): independent Gaussian noise around the last estimate.

use super::LEAST_AREA;
use super::PaperConfig;
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
    /// Side of a template, in samples.
    pub(super) template_side: usize,
    /// No side that is drawn, and no distance from the frame's first row and column, is larger.
    pub(super) most_pixels: f64,
}

impl Motion {
    /// The motion model in frames of this width and height.
    pub fn new(config: &PaperConfig, frame: [usize; 2]) -> Self {
        Self {
            template_side: config.patches.template_side,
            most_pixels: MAX_FRAMES * frame[0].max(frame[1]) as f64,
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
            if state.is_valid() && self.allows(&state, last) {
                return state;
            }
        }
        *last
    }

    /// Whether a state drawn around `last` is within the limits. What was beyond them before,
    /// because the first box was, may stay where it is or come closer.
    fn allows(&self, state: &State, last: &State) -> bool {
        let lengths = |state: &State| {
            let (width, height) = state.size(self.template_side);
            [width, height, state.x.abs(), state.y.abs()]
        };
        let (new, old) = (lengths(state), lengths(last));
        new[0] * new[1] >= (old[0] * old[1]).min(LEAST_AREA)
            && new.iter().zip(old).all(|(new, old)| *new <= old.max(self.most_pixels))
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
