//! The motion model (Sec. 2): independent Gaussian noise around the last estimate.

use super::state::State;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

/// Maximum number of redraws of a state; then the last state is kept. Even if half of all draws were refused,
/// this number would never be reached.
const MAX_REDRAWS: usize = 100;

/// Standard deviations of the six numbers of a state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Of x and y (pixels), scale, rotation (radians), aspect, and skew (radians).
    pub sigma: [f64; 6],
}

impl Motion {
    /// Draws a state around `last`. A state that is not valid is drawn again.
    pub fn draw(&self, last: &State, rng: &mut Pcg64) -> State {
        for _ in 0..MAX_REDRAWS {
            let state = self.draw_once(last, rng);
            if state.is_valid() {
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
