//! Compares two trackers with the paired bootstrap over targets.
//!
//! Targets are resampled with replacement, as many as there are, and the mean difference over the
//! sample is computed; many such samples show how much the difference depends on the choice of
//! targets in the benchmark. Both trackers are measured on the same targets, so differences in
//! difficulty cancel.
//!
//! As with every bootstrap, the intervals are too narrow for few targets (fewer than about ten).
//! With fewer than [`MIN_TARGETS`] no interval is computed.

use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;

/// Number of bootstrap samples, enough for a stable third digit of the intervals.
pub const DRAWS: usize = 10_000;

/// Smallest number of targets for a comparison. With fewer, even a tracker that is better on all n
/// targets is not significant: by chance this happens once in 2^(n - 1) times, which is more than 5
/// %.
pub const MIN_TARGETS: usize = 6;

/// The difference between two trackers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Difference {
    /// Number of targets.
    pub targets: usize,
    /// Mean difference over targets, first tracker minus second.
    pub mean: f64,
    /// Lower end of the 95 % interval.
    pub low: f64,
    /// Upper end of the 95 % interval.
    pub high: f64,
    /// Two-sided p-value, not corrected for the number of comparisons.
    pub p: f64,
}

/// Bootstrap samples of targets, shared by all comparisons.
pub struct BootstrapSamples {
    targets: usize,
    picks: Vec<u32>,
}

impl BootstrapSamples {
    /// Draws `draws` samples of `targets` targets each. Equal seeds give equal samples.
    pub fn new(targets: usize, draws: usize, seed: u64) -> Self {
        let mut rng = Pcg64::new(u128::from(seed), 0);
        // The upper half of the product is uniform over the targets, up to one part in 2^58.
        let pick = |rng: &mut Pcg64| ((u128::from(rng.next_u64()) * targets as u128) >> 64) as u32;
        Self { targets, picks: (0..targets * draws).map(|_| pick(&mut rng)).collect() }
    }

    /// Compares two trackers by one value per target, in the same order. `None` unless both have
    /// one value for each target, and there are at least [`MIN_TARGETS`].
    pub fn difference(&self, first: &[f64], second: &[f64]) -> Option<Difference> {
        let count = self.targets;
        if count < MIN_TARGETS
            || self.picks.is_empty()
            || first.len() != count
            || second.len() != count
        {
            return None;
        }
        let differences: Vec<f64> = first.iter().zip(second).map(|(a, b)| a - b).collect();
        let mean_of = |picks: &[u32]| {
            picks.iter().map(|&k| differences[k as usize]).sum::<f64>() / count as f64
        };
        let mut means: Vec<f64> = self.picks.chunks_exact(count).map(mean_of).collect();
        means.sort_unstable_by(f64::total_cmp);
        let (below, above) = (
            means.iter().filter(|&&mean| mean <= 0.0).count(),
            means.iter().filter(|&&mean| mean >= 0.0).count(),
        );
        // One is added to the count: a finite number of samples cannot show a probability of 0.
        let p = 2.0 * (below.min(above) + 1) as f64 / (means.len() + 1) as f64;
        Some(Difference {
            targets: count,
            mean: differences.iter().sum::<f64>() / count as f64,
            low: quantile(&means, 0.025),
            high: quantile(&means, 0.975),
            p: p.min(1.0),
        })
    }
}

/// A quantile, interpolated linearly between the two nearest values; `sorted` is not empty.
pub fn quantile(sorted: &[f64], share: f64) -> f64 {
    let position = share * (sorted.len() - 1) as f64;
    let (below, above) = (sorted[position.floor() as usize], sorted[position.ceil() as usize]);
    below + (above - below) * position.fract()
}

/// The places of the values in increasing order; equal ones keep theirs.
pub fn ascending(values: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    order
}

/// Corrects p-values for multiple comparisons (Holm, 1979), which bounds the chance of any false
/// positive.
pub fn holm(p: &[f64]) -> Vec<f64> {
    let order = ascending(p);
    let mut corrected = vec![1.0; p.len()];
    let mut largest: f64 = 0.0;
    for (k, &index) in order.iter().enumerate() {
        largest = largest.max(p[index] * (p.len() - k) as f64).min(1.0);
        corrected[index] = largest;
    }
    corrected
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_approaches_that_of_the_normal_distribution() {
        // 400 differences with mean 0.1 and standard deviation 1: the standard error is 0.05.
        let rank = |k: usize| (k as f64 + 0.5) / 400.0 - 0.5;
        let spread = (1.0 / 12.0_f64).sqrt();
        let first: Vec<f64> = (0..400).map(|k| 0.1 + rank(k) / spread).collect();
        let d = BootstrapSamples::new(400, 20_000, 1).difference(&first, &[0.0; 400]).unwrap();
        assert!((d.mean - 0.1).abs() < 1e-12);
        assert!((d.low - (0.1 - 0.098)).abs() < 0.004, "{d:?}");
        assert!((d.high - (0.1 + 0.098)).abs() < 0.004, "{d:?}");
        // 0.1 is two standard errors, so p is 0.0455.
        assert!((d.p - 0.0455).abs() < 0.01, "{d:?}");
    }

    #[test]
    fn swapping_mirrors_the_result_and_equal_trackers_do_not_differ() {
        let (a, b) = ([0.5, 0.6, 0.9, 0.2, 0.1, 0.4], [0.4, 0.7, 0.3, 0.2, 0.3, 0.3]);
        let draws = BootstrapSamples::new(6, 2000, 7);
        let (there, back) = (draws.difference(&a, &b).unwrap(), draws.difference(&b, &a).unwrap());
        assert!((there.low + back.high).abs() < 1e-12 && (there.mean + back.mean).abs() < 1e-12);
        assert_eq!(there.p, back.p);
        assert_eq!(
            draws.difference(&a, &a).unwrap(),
            Difference { targets: 6, mean: 0.0, low: 0.0, high: 0.0, p: 1.0 }
        );
        assert_eq!(
            BootstrapSamples::new(6, 2000, 7).difference(&a, &b),
            Some(there),
            "the same seed"
        );
        assert_eq!(draws.difference(&a, &b[..5]), None);
        assert_eq!(BootstrapSamples::new(0, 10, 1).difference(&[], &[]), None);
        assert_eq!(BootstrapSamples::new(5, 10, 1).difference(&a[..5], &b[..5]), None, "too few");
    }

    #[test]
    fn targets_are_drawn_equally_often() {
        let draws = BootstrapSamples::new(5, 20_000, 3);
        for target in 0..5 {
            let share = draws.picks.iter().filter(|&&k| k == target).count() as f64 / 100_000.0;
            assert!((share - 0.2).abs() < 0.006, "{target}: {share}");
        }
    }

    #[test]
    fn p_values_are_corrected_as_by_holm() {
        assert_eq!(holm(&[0.01, 0.04, 0.03, 0.005]), [0.03, 0.06, 0.06, 0.02]);
        assert_eq!(holm(&[0.9, 0.8]), [1.0, 1.0]);
    }
}
