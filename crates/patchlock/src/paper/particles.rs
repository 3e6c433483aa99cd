//! The particles of a frame (Eq. 22, 23): states drawn anew around the last estimate, and their
//! candidates.

use super::motion::Motion;
use crate::numeric::parallel::*;
use crate::patch_model::model::cut_candidate;
use crate::patch_model::params::PatchParams;
use crate::patch_model::sparse::somp::batched::BLOCK;
use crate::vision::frame::GreyImage;
use crate::vision::state::State;
use rand_pcg::Pcg64;

/// The particles of a frame and their candidates.
#[derive(Debug, Default)]
pub struct Particles {
    states: Vec<State>,
    candidates: Vec<f32>,
    order: Vec<u32>,
}

impl Particles {
    /// Draws `count` particles around `last`.
    pub fn draw(&mut self, count: usize, last: &State, motion: &Motion, rng: &mut Pcg64) {
        draw(&mut self.states, count, last, motion, rng);
        arrange(&self.states, count.div_ceil(BLOCK), &mut self.order);
    }

    /// Warps and normalises the candidate of each particle, in parallel.
    pub fn warp(&mut self, image: &GreyImage, params: &PatchParams) {
        let length = params.template_side * params.template_side;
        self.candidates.resize(self.states.len() * length, 0.0);
        let candidates = self.candidates.par_chunks_mut(length).zip(&self.states);
        candidates.for_each(|(out, state)| cut_candidate(image, &state.matrix(), params, out));
    }

    /// The particles, in the order in which they were drawn.
    pub fn states(&self) -> &[State] {
        &self.states
    }

    /// The candidates of all particles, one after the other.
    pub fn candidates(&self) -> &[f32] {
        &self.candidates
    }

    /// The candidate of one particle.
    pub fn candidate(&self, k: usize) -> &[f32] {
        let length = self.candidates.len() / self.states.len().max(1);
        &self.candidates[k * length..][..length]
    }

    /// All particles, each next to similar ones.
    pub fn order(&self) -> &[u32] {
        &self.order
    }
}

/// Draws `count` particles around `last` into `particles`. All noise is drawn here, in one
/// sequence, so the result does not depend on the number of threads.
fn draw(particles: &mut Vec<State>, count: usize, last: &State, motion: &Motion, rng: &mut Pcg64) {
    particles.clear();
    particles.extend((0..count).map(|_| motion.draw(last, rng)));
}

/// Puts the particles' numbers into an order in which neighbours are similar: vertical strips from
/// left to right, traversed downwards and upwards in turn. When the order is cut into about `parts`
/// parts, each covers an area that is about square in samples of the template.
fn arrange(particles: &[State], parts: usize, order: &mut Vec<u32>) {
    order.clear();
    order.extend(0..particles.len() as u32);
    let aspect = particles.first().map_or(1.0, |particle| particle.aspect);
    let strips = ((parts as f64 * aspect).sqrt().round() as usize).clamp(1, parts.max(1));
    let at = |k: u32| &particles[k as usize];
    // No two compare as equal, and a stable sort would allocate.
    order.sort_unstable_by(|&a, &b| at(a).x.total_cmp(&at(b).x).then(a.cmp(&b)));
    let strips = order.chunks_mut(particles.len().div_ceil(strips).max(1));
    for (number, strip) in strips.enumerate() {
        strip.sort_unstable_by(|&a, &b| at(a).y.total_cmp(&at(b).y).then(a.cmp(&b)));
        if number % 2 == 1 {
            strip.reverse();
        }
    }
}

/// The index of the largest likelihood; of equal ones the first. Empty or all-NaN gives 0.
pub fn most_likely(likelihoods: &[f64]) -> usize {
    let mut best = 0;
    for (k, &likelihood) in likelihoods.iter().enumerate() {
        let worse = likelihoods[best].is_nan() || likelihood > likelihoods[best];
        if worse && !likelihood.is_nan() {
            best = k;
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::PaperConfig;

    const LAST: State =
        State { x: 100.0, y: 50.0, scale: 1.2, rotation: 0.1, aspect: 0.8, skew: 0.0 };
    const SIGMA: [f64; 6] = [6.0, 6.0, 0.02, 0.002, 0.002, 0.0];

    fn motion(sigma: [f64; 6]) -> Motion {
        Motion { sigma, ..Motion::new(&PaperConfig::default(), [320, 240]) }
    }

    fn particles(motion: &Motion, last: &State, count: usize, seed: u128) -> Vec<State> {
        let mut particles = Vec::new();
        draw(&mut particles, count, last, motion, &mut Pcg64::new(seed, 1));
        particles
    }

    #[test]
    fn spread_is_the_motions() {
        let drawn = particles(&motion(SIGMA), &LAST, 20_000, 7);
        let n = drawn.len() as f64;
        type Component = fn(&State) -> f64;
        let fields: [(Component, f64, f64); 6] = [
            (|s| s.x, 100.0, 6.0),
            (|s| s.y, 50.0, 6.0),
            (|s| s.scale, 1.2, 0.02),
            (|s| s.rotation, 0.1, 0.002),
            (|s| s.aspect, 0.8, 0.002),
            (|s| s.skew, 0.0, 0.0),
        ];
        for (pick, mean, sigma) in fields {
            let got = drawn.iter().map(pick).sum::<f64>() / n;
            let spread = (drawn.iter().map(|s| (pick(s) - got).powi(2)).sum::<f64>() / n).sqrt();
            // Four standard errors of a mean and of a standard deviation.
            assert!((got - mean).abs() <= 4.0 * sigma / n.sqrt(), "{got} {mean}");
            assert!((spread - sigma).abs() <= 4.0 * sigma / (2.0 * n).sqrt(), "{spread} {sigma}");
        }
    }

    #[test]
    fn impossible_shapes_are_drawn_again() {
        let thin = State { scale: 0.01, ..LAST };
        assert!(particles(&motion(SIGMA), &thin, 1000, 1).iter().all(State::is_valid));
        let huge = motion([1e308; 6]);
        assert!(particles(&huge, &LAST, 100, 1).iter().all(State::is_valid));
    }

    #[test]
    fn nothing_far_beyond_the_frame_is_drawn() {
        let wild = motion([1000.0, 1000.0, 10.0, 1.0, 10.0, 1.0]);
        let mut last = LAST;
        for seed in 0..50 {
            for state in particles(&wild, &last, 100, seed) {
                let (width, height) = state.size(32);
                assert!([width, height, state.x.abs(), state.y.abs()].iter().all(|v| *v <= 3200.0));
                last = state;
            }
        }
        // A first box beyond the limits does not grow, and can be followed.
        let large = State { scale: 200.0, ..LAST };
        let drawn = particles(&wild, &large, 1000, 1);
        assert!(drawn.iter().all(|state| state.size(32).0 <= 6400.0));
        assert!(drawn.iter().any(|state| state != &large));
    }

    #[test]
    fn no_target_below_the_smallest_area_is_drawn() {
        let area = |state: &State| state.size(32).0 * state.size(32).1;
        let wild = motion([6.0, 6.0, 0.05, 0.002, 0.3, 0.0]);
        let mut last = State { scale: 0.2, ..LAST };
        for seed in 0..20 {
            let drawn = particles(&wild, &last, 100, seed);
            assert!(drawn.iter().all(|state| area(state) >= 16.0));
            let smallest = drawn.iter().min_by(|a, b| area(a).total_cmp(&area(b)));
            last = *smallest.expect("some were drawn");
        }
        assert!(area(&last) < 20.0 && last.scale != 0.2);
    }

    #[test]
    fn arranged_particles_are_all_there_and_near_their_neighbours() {
        for (count, parts) in [(650, 11), (650, 1), (7, 60), (1, 1), (0, 0)] {
            let (drawn, mut order) = (particles(&motion(SIGMA), &LAST, count, 5), Vec::new());
            arrange(&drawn, parts, &mut order);
            let mut numbers = order.clone();
            numbers.sort_unstable();
            assert!(numbers.iter().copied().eq(0..count as u32), "{count} {parts}");
            let far = |a: u32, b: u32| {
                let (a, b) = (&drawn[a as usize], &drawn[b as usize]);
                (a.x - b.x).hypot(a.y - b.y)
            };
            let way: f64 = order.windows(2).map(|pair| far(pair[0], pair[1])).sum();
            let drawn_way: f64 = (1..count as u32).map(|k| far(k - 1, k)).sum();
            assert!(parts != 11 || way < 0.5 * drawn_way, "{way} {drawn_way}");
        }
    }

    #[test]
    fn ties_go_to_the_first() {
        assert_eq!(most_likely(&[0.1, 0.5, 0.5]), 1);
        assert_eq!(most_likely(&[f64::NAN, f64::NEG_INFINITY]), 1);
        assert_eq!(most_likely(&[]), 0);
    }
}
