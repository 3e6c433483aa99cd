//! Which of two trackers is better, and how sure that is: the paired bootstrap over targets.
//!
//! The targets are drawn anew, with repetition, as often as there are targets, and the mean difference is taken over what was drawn; many
//! such draws show how much the difference depends on which targets happen to be in the benchmark. Both trackers are measured on
//! the same targets, so what makes a target hard for both falls out.
//!
//! With few targets (less than about ten) the intervals are too narrow, as those of every bootstrap; with less than [`LEAST_TARGETS`] there are none.

use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;

/// Draws, as many as make the third digit of an interval steady.
pub const DRAWS: usize = 10_000;

/// With fewer targets than this nothing is said: even if one tracker is better on all of them, chance alone gives that once in 2^(n - 1)
/// times, which is more than 5 %.
pub const LEAST_TARGETS: usize = 6;

/// How much one tracker is above another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Difference {
    /// Targets compared.
    pub targets: usize,
    /// The mean difference over targets, first tracker minus second.
    pub mean: f64,
    /// The lower end of the interval that holds 95 % of the draws.
    pub low: f64,
    /// Its upper end.
    pub high: f64,
    /// Two-sided: how often chance alone would give a difference this far from 0. Not corrected for the number of comparisons.
    pub p: f64,
}

/// The same draws of targets for every comparison.
pub struct Draws {
    targets: usize,
    picks: Vec<u32>,
}

impl Draws {
    /// Draws from so many targets. The same seed gives the same draws.
    pub fn new(targets: usize, draws: usize, seed: u64) -> Self {
        let mut rng = Pcg64::new(u128::from(seed), 0);
        // The upper half of a product with a 64-bit number falls evenly on the targets, but for one part in 2^58.
        let pick = |rng: &mut Pcg64| ((u128::from(rng.next_u64()) * targets as u128) >> 64) as u32;
        Self { targets, picks: (0..targets * draws).map(|_| pick(&mut rng)).collect() }
    }

    /// Compares two trackers by a value for each target, in the same order of targets. `None` unless there are as many values as targets,
    /// and at least [`LEAST_TARGETS`].
    pub fn difference(&self, first: &[f64], second: &[f64]) -> Option<Difference> {
        let count = self.targets;
        if count < LEAST_TARGETS
            || self.picks.is_empty()
            || first.len() != count
            || second.len() != count
        {
            return None;
        }
        let each: Vec<f64> = first.iter().zip(second).map(|(a, b)| a - b).collect();
        let mean_of =
            |picks: &[u32]| picks.iter().map(|&k| each[k as usize]).sum::<f64>() / count as f64;
        let mut means: Vec<f64> = self.picks.chunks_exact(count).map(mean_of).collect();
        means.sort_by(f64::total_cmp);
        let (below, above) = (
            means.iter().filter(|&&mean| mean <= 0.0).count(),
            means.iter().filter(|&&mean| mean >= 0.0).count(),
        );
        // One more than counted: a finite number of draws can't show that something never happens.
        let p = 2.0 * (below.min(above) + 1) as f64 / (means.len() + 1) as f64;
        Some(Difference {
            targets: count,
            mean: each.iter().sum::<f64>() / count as f64,
            low: quantile(&means, 0.025),
            high: quantile(&means, 0.975),
            p: p.min(1.0),
        })
    }
}

/// Linear between the two nearest values; `sorted` is not empty.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let place = share * (sorted.len() - 1) as f64;
    let (below, above) = (sorted[place.floor() as usize], sorted[place.ceil() as usize]);
    below + (above - below) * place.fract()
}

/// Corrects probabilities for how many there are (Holm, 1979), so that the chance of any false one stays below the limit.
pub fn holm(p: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|&a, &b| p[a].total_cmp(&p[b]));
    let mut corrected = vec![1.0; p.len()];
    let mut most: f64 = 0.0;
    for (k, &place) in order.iter().enumerate() {
        most = most.max(p[place] * (p.len() - k) as f64).min(1.0);
        corrected[place] = most;
    }
    corrected
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_is_that_of_the_normal_distribution_where_it_should_be() {
        // 400 differences with mean 0.1 and standard deviation 1: the mean's is 0.05, 1.96 of it on both sides.
        let rank = |k: usize| (k as f64 + 0.5) / 400.0 - 0.5;
        let spread = (1.0 / 12.0_f64).sqrt();
        let first: Vec<f64> = (0..400).map(|k| 0.1 + rank(k) / spread).collect();
        let d = Draws::new(400, 20_000, 1).difference(&first, &[0.0; 400]).unwrap();
        assert!((d.mean - 0.1).abs() < 1e-12);
        assert!((d.low - (0.1 - 0.098)).abs() < 0.004, "{d:?}");
        assert!((d.high - (0.1 + 0.098)).abs() < 0.004, "{d:?}");
        // 0.1 is two standard deviations: p 0.0455.
        assert!((d.p - 0.0455).abs() < 0.01, "{d:?}");
    }

    #[test]
    fn both_ways_are_mirrored_and_equal_ones_differ_in_nothing() {
        let (a, b) = ([0.5, 0.6, 0.9, 0.2, 0.1, 0.4], [0.4, 0.7, 0.3, 0.2, 0.3, 0.3]);
        let draws = Draws::new(6, 2000, 7);
        let (there, back) = (draws.difference(&a, &b).unwrap(), draws.difference(&b, &a).unwrap());
        assert!((there.low + back.high).abs() < 1e-12 && (there.mean + back.mean).abs() < 1e-12);
        assert_eq!(there.p, back.p);
        assert_eq!(
            draws.difference(&a, &a).unwrap(),
            Difference { targets: 6, mean: 0.0, low: 0.0, high: 0.0, p: 1.0 }
        );
        assert_eq!(Draws::new(6, 2000, 7).difference(&a, &b), Some(there), "the same seed");
        assert_eq!(draws.difference(&a, &b[..5]), None);
        assert_eq!(Draws::new(0, 10, 1).difference(&[], &[]), None);
        assert_eq!(Draws::new(5, 10, 1).difference(&a[..5], &b[..5]), None, "too few");
    }

    #[test]
    fn every_target_is_drawn_equally_often() {
        let draws = Draws::new(5, 20_000, 3);
        for target in 0..5 {
            let share = draws.picks.iter().filter(|&&k| k == target).count() as f64 / 100_000.0;
            assert!((share - 0.2).abs() < 0.006, "{target}: {share}");
        }
    }

    #[test]
    fn corrected_as_holm_says() {
        assert_eq!(holm(&[0.01, 0.04, 0.03, 0.005]), [0.03, 0.06, 0.06, 0.02]);
        assert_eq!(holm(&[0.9, 0.8]), [1.0, 1.0]);
    }
}
