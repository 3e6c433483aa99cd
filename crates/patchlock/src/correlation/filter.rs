//! A correlation filter that is confined to the target: Li, Tian, Zuo, Zhang and Yang, "Learning
//! spatial-temporal regularized correlation filters for visual tracking" (2018), with a mask
//! instead of their weights, and with the masked filter as the result.
//!
//! The filter minimises `|sum_k x_k * f_k - y|^2 / 2 + mu / 2 |f - p|^2`, where `y` is a Gaussian
//! and `p` the filter of the frame before, over filters that are zero outside the mask. It is split
//! into `f`, free and solved per frequency, and `g`, masked; two rounds of the alternating
//! direction method of multipliers bring them together.
//!
//! Plain loops over bins with the sums of `lanes`. With AVX2, learning takes 22 % of the plain
//! instructions (`benchmarks/record/speed.md`).

use super::batch::{BatchScratch, Mask};
use super::fourier::{Complex32, Fourier, FourierScratch};
use super::lanes::{add, inner};
use crate::numeric::instructions::{Instructions, dispatch_eight};
use pulp::Simd;

/// The penalty on the difference of `f` and `g` in the first round.
const FIRST_PENALTY: f32 = 1.0;

/// The parameters of a filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilterParams {
    /// Standard deviation of the label, in roots of the target's area.
    pub label_width: f64,
    /// The penalty on the difference of `f` and `g` in the second round: larger holds it closer to
    /// the masked filter of the first.
    pub penalty: f32,
    /// `mu`: how strongly the filter is drawn to the one of the frame before.
    pub temporal: f32,
}

/// Learns filters: the label that they are learnt towards, and the mask outside which they are
/// zero.
#[derive(Debug, Clone)]
pub struct FilterLearner {
    /// The spectrum of the label; it is real, as the label is symmetric.
    label: Vec<f32>,
    /// The cells inside the target.
    mask: Mask,
    penalty: f32,
    temporal: f32,
}

/// Buffers of [`FilterLearner::learn`].
#[derive(Debug, Default)]
pub struct FilterScratch {
    energy: Vec<f32>,
    before: Vec<Complex32>,
    free: Vec<Complex32>,
    masked: Vec<Complex32>,
    cells: Vec<f32>,
    batch: BatchScratch,
}

impl FilterLearner {
    /// The learner for a target of `size` cells (width, height) in the middle of a patch; the label
    /// is a Gaussian. A filter is held as its cells inside `mask`.
    pub fn new(fourier: &Fourier, size: [f64; 2], mask: &Mask, params: FilterParams) -> Self {
        let FilterParams { label_width, penalty, temporal } = params;
        let n = fourier.side();
        let sigma = label_width * (size[0] * size[1]).sqrt();
        // Distance around the circle: the filter is centred on the first cell.
        let distance = |k: usize| k.min(n - k) as f64;
        let label: Vec<f32> = (0..n * n)
            .map(|k| distance(k % n).powi(2) + distance(k / n).powi(2))
            .map(|squared| (-0.5 * squared / (sigma * sigma)).exp() as f32)
            .collect();
        let mut spectrum = vec![Complex32::ZERO; fourier.bins()];
        fourier.forward(&label, &mut spectrum, &mut FourierScratch::default());
        let label = spectrum.iter().map(|value| value.re).collect();
        Self { label, mask: mask.clone(), penalty, temporal }
    }

    /// Learns the first filter from the spectra of a sample, bin by bin, the channels of a bin side
    /// by side.
    pub fn begin(
        &self,
        fourier: &Fourier,
        sample: &[Complex32],
        scratch: &mut FilterScratch,
    ) -> Vec<f32> {
        let channels = sample.len() / fourier.bins();
        let mut filter = vec![0.0; self.mask.len() * channels];
        let first = Self { temporal: 0.0, ..self.clone() };
        first.learn(fourier, sample, &mut filter, scratch);
        filter
    }

    /// Learns a filter from the spectra of a sample; `filter` holds the one of the frame before, to
    /// which the new one is drawn, and takes the new one.
    pub fn learn(
        &self,
        fourier: &Fourier,
        sample: &[Complex32],
        filter: &mut [f32],
        scratch: &mut FilterScratch,
    ) {
        dispatch_eight!(Instructions::default(), |simd| {
            let FilterScratch { energy, before, free, masked, cells, batch } = scratch;
            let channels = sample.len() / fourier.bins();
            energy.resize(fourier.bins(), 0.0);
            for (energy, x) in energy.iter_mut().zip(sample.chunks_exact(channels)) {
                *energy = inner(simd, x, x).re;
            }
            for spectra in [&mut *before, &mut *free, &mut *masked] {
                spectra.resize(sample.len(), Complex32::ZERO);
            }
            let (transforms, mask) = (fourier.batch(), &self.mask);
            transforms.spectra(filter, mask, before, batch);
            // Round 1, with the multiplier at 0: f is drawn to the filter before alone.
            let (mu, first, second) = (self.temporal, FIRST_PENALTY, self.penalty);
            for (f, p) in free.iter_mut().zip(before.iter()) {
                *f = p * (mu / (mu + first));
            }
            self.solve(simd, (sample, energy), mu + first, fourier, free);
            cells.resize(filter.len(), 0.0);
            transforms.cells(free, mask, cells, batch);
            transforms.spectra(cells, mask, masked, batch);
            // Round 2: the multiplier is `first (f - g)`. The right side is built where f is.
            let scale = 1.0 / (mu + second);
            let [of_f, of_p, of_g] = [-first * scale, mu * scale, (second + first) * scale];
            for ((f, p), g) in free.iter_mut().zip(before.iter()).zip(masked.iter()) {
                *f = *f * of_f + p * of_p + g * of_g;
            }
            self.solve(simd, (sample, energy), mu + second, fourier, free);
            transforms.cells(free, mask, filter, batch);
        });
    }

    /// Moves `filter` to the minimum of `|<x, f> - y|^2 / 2 + strength * T / 2 |f - filter|^2` for
    /// each frequency, where `T` is the number of cells: a step along the sample, as far as the
    /// filter is wrong.
    #[inline(always)]
    fn solve<S: Simd>(
        &self,
        simd: S,
        (sample, energy): (&[Complex32], &[f32]),
        strength: f32,
        fourier: &Fourier,
        filter: &mut [Complex32],
    ) {
        let (channels, cells) = (sample.len() / energy.len(), fourier.side().pow(2) as f32);
        let pairs = sample.chunks_exact(channels).zip(filter.chunks_exact_mut(channels));
        for ((x, f), (y, energy)) in pairs.zip(self.label.iter().zip(energy)) {
            let step = (y - inner(simd, x, f)) / (energy + cells * strength);
            add(simd, f, x, step);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::correlation::batch::GROUP;
    use nalgebra::{Complex, DMatrix, DVector};

    const N: usize = 8;
    const CHANNELS: usize = GROUP;

    fn learner(fourier: &Fourier, size: [f64; 2], temporal: f32) -> FilterLearner {
        let params = FilterParams { label_width: 0.2, penalty: 0.1, temporal };
        FilterLearner::new(fourier, size, &Mask::middle(N, size), params)
    }

    /// The spectra of a filter.
    fn spectra_of(fourier: &Fourier, learner: &FilterLearner, filter: &[f32]) -> Vec<Complex32> {
        let mut out = vec![Complex32::ZERO; CHANNELS * fourier.bins()];
        fourier.batch().spectra(filter, &learner.mask, &mut out, &mut BatchScratch::default());
        out
    }

    fn noise(count: usize, seed: usize) -> Vec<f32> {
        (0..count)
            .map(|k| ((k * 7919 + seed * 31 + k * k * 17) % 1009) as f32 / 500.0 - 1.0)
            .collect()
    }

    /// The spectra of planes, bin by bin.
    fn spectra(fourier: &Fourier, planes: &[f32]) -> Vec<Complex32> {
        let bins = fourier.bins();
        let (mut out, mut one) =
            (vec![Complex32::ZERO; CHANNELS * bins], vec![Complex32::ZERO; bins]);
        for (channel, plane) in planes.chunks(N * N).enumerate() {
            fourier.forward(plane, &mut one, &mut FourierScratch::default());
            (0..bins).for_each(|bin| out[bin * CHANNELS + channel] = one[bin]);
        }
        out
    }

    /// The planes of filters, cell by cell.
    fn planes(fourier: &Fourier, spectra: &[Complex32]) -> Vec<f32> {
        let mut out = vec![0.0; CHANNELS * N * N];
        for (channel, out) in out.chunks_mut(N * N).enumerate() {
            let one: Vec<_> = spectra.chunks(CHANNELS).map(|bin| bin[channel]).collect();
            fourier.inverse(&one, out, &mut FourierScratch::default());
        }
        out
    }

    fn inside(learner: &FilterLearner, cell: usize) -> bool {
        learner.mask.x.contains(&(cell % N)) && learner.mask.y.contains(&(cell / N % N))
    }

    /// Two rounds from their definition in `f64`, as dense systems for each frequency.
    fn learn_densely(
        learner: &FilterLearner,
        fourier: &Fourier,
        sample: &[Complex32],
        mu: f64,
        before: &[Complex32],
    ) -> Vec<Complex32> {
        let bins = fourier.bins();
        let cells = (N * N) as f64;
        let wide = |v: Complex32| Complex::new(f64::from(v.re), f64::from(v.im));
        let (mut g, mut h) =
            (vec![Complex32::ZERO; CHANNELS * bins], vec![Complex32::ZERO; CHANNELS * bins]);
        for penalty in [1.0, 0.1] {
            let mut f = vec![Complex32::ZERO; CHANNELS * bins];
            for bin in 0..bins {
                let of = |all: &[Complex32]| {
                    DVector::from_iterator(
                        CHANNELS,
                        (0..CHANNELS).map(|c| wide(all[bin * CHANNELS + c])),
                    )
                };
                let (x, y) = (of(sample), Complex::from(f64::from(learner.label[bin])));
                // (x x^H + T (gamma + mu) I) f = x y + T (gamma g - h + mu p)
                let real = |v: f64| Complex::new(v, 0.0);
                let left = &x * x.adjoint()
                    + DMatrix::identity(CHANNELS, CHANNELS) * real(cells * (penalty + mu));
                let right = &x * y
                    + (of(&g) * real(penalty) - of(&h) + of(before) * real(mu)) * real(cells);
                let solved = left.lu().solve(&right).unwrap();
                for c in 0..CHANNELS {
                    f[bin * CHANNELS + c] =
                        Complex32::new(solved[c].re as f32, solved[c].im as f32);
                }
            }
            // g is the masked (gamma f + h) / gamma; h grows by gamma (f - g).
            let free: Vec<Complex32> =
                f.iter().zip(&h).map(|(f, h)| f + h / penalty as f32).collect();
            let mut masked = planes(fourier, &free);
            let outside = masked.iter_mut().enumerate().filter(|(k, _)| !inside(learner, *k));
            outside.for_each(|(_, v)| *v = 0.0);
            g = spectra(fourier, &masked);
            h.iter_mut()
                .zip(f.iter().zip(&g))
                .for_each(|(h, (f, g))| *h += (f - g) * penalty as f32);
        }
        g
    }

    #[test]
    fn it_is_what_dense_systems_give() {
        let fourier = Fourier::new(N);
        let sample = spectra(&fourier, &noise(CHANNELS * N * N, 1));
        for mu in [0.0, 15.0] {
            let learner = learner(&fourier, [3.0, 4.0], mu as f32);
            let mut filter = noise(CHANNELS * learner.mask.len(), 5);
            let mut before = spectra_of(&fourier, &learner, &filter);
            if mu == 0.0 {
                filter = learner.begin(&fourier, &sample, &mut FilterScratch::default());
                before.fill(Complex32::ZERO);
            } else {
                learner.learn(&fourier, &sample, &mut filter, &mut FilterScratch::default());
            }
            let filter = spectra_of(&fourier, &learner, &filter);
            let dense = learn_densely(&learner, &fourier, &sample, mu, &before);
            let largest = dense.iter().map(|v| v.norm()).fold(0.0, f32::max);
            for (a, b) in filter.iter().zip(&dense) {
                assert!((a - b).norm() < 1e-5 * largest, "mu {mu}: {a} {b}");
            }
            let outside = planes(&fourier, &filter).into_iter().enumerate();
            for (k, v) in outside.filter(|(k, _)| !inside(&learner, *k)) {
                assert!(v.abs() < 1e-6, "{k}: {v}");
            }
        }
    }

    #[test]
    fn drawn_strongly_it_stays_what_it_was() {
        let fourier = Fourier::new(N);
        let learner = learner(&fourier, [8.0, 8.0], 1e9);
        let sample = spectra(&fourier, &noise(CHANNELS * N * N, 1));
        let before = noise(CHANNELS * learner.mask.len(), 2);
        let mut filter = before.clone();
        learner.learn(&fourier, &sample, &mut filter, &mut FilterScratch::default());
        assert!(filter.iter().zip(&before).all(|(a, b)| (a - b).abs() < 1e-4));
    }
}
