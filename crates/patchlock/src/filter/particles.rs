//! The particles of a frame: states drawn afresh around the last estimate, no weights carried over.

use super::{motion::Motion, state::State};
use rand_pcg::Pcg64;

/// Draws `count` particles around `last` into `particles`. All noise is drawn here, one after the other, so the result does
/// not depend on the number of threads that weigh the particles.
pub fn draw(
    particles: &mut Vec<State>,
    count: usize,
    last: &State,
    motion: &Motion,
    rng: &mut Pcg64,
) {
    particles.clear();
    particles.extend((0..count).map(|_| motion.draw(last, rng)));
}

/// Puts the particles' numbers into an order in which neighbours are much alike: strips from left to right, and up and down each of them in turn. It is made to be
/// cut into about `parts` parts, which are about as wide as high in the template's samples.
pub fn arrange(particles: &[State], parts: usize, order: &mut Vec<u32>) {
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

    const LAST: State =
        State { x: 100.0, y: 50.0, scale: 1.2, rotation: 0.1, aspect: 0.8, skew: 0.0 };
    const PAPER: Motion =
        Motion { sigma: [6.0, 6.0, 0.02, 0.002, 0.002, 0.0], relative_scale: false };

    fn particles(motion: &Motion, last: &State, count: usize, seed: u128) -> Vec<State> {
        let mut particles = Vec::new();
        draw(&mut particles, count, last, motion, &mut Pcg64::new(seed, 1));
        particles
    }

    #[test]
    fn spread_is_the_motions() {
        let drawn = particles(&PAPER, &LAST, 20_000, 7);
        let n = drawn.len() as f64;
        type Pick = fn(&State) -> f64;
        let fields: [(Pick, f64, f64); 6] = [
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
        assert!(particles(&PAPER, &thin, 1000, 1).iter().all(State::is_valid));
        let huge = Motion { sigma: [1e308; 6], ..PAPER };
        assert!(particles(&huge, &LAST, 100, 1).iter().all(State::is_valid));
    }

    #[test]
    fn relative_scale_grows_with_the_scale() {
        let relative = Motion { relative_scale: true, ..PAPER };
        let (a, b) = (particles(&PAPER, &LAST, 10, 3), particles(&relative, &LAST, 10, 3));
        for (a, b) in a.iter().zip(&b) {
            assert!(((b.scale - 1.2) - 1.2 * (a.scale - 1.2)).abs() < 1e-12);
        }
    }

    #[test]
    fn arranged_particles_are_all_there_and_near_their_neighbours() {
        for (count, parts) in [(650, 11), (650, 1), (7, 60), (1, 1), (0, 0)] {
            let (drawn, mut order) = (particles(&PAPER, &LAST, count, 5), Vec::new());
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
