//! A filter along scale: Danelljan, Häger, Khan and Felsberg, "Accurate scale estimation for robust
//! visual tracking" (2014).
//!
//! The target is cut out at many sizes, each crop resampled to the same few pixels. Their features,
//! side by side, are a signal along scale for each feature; a filter that is learnt to answer with
//! a Gaussian around the true scale says by its peak how much larger or smaller the target has
//! become.
//!
//! With AVX2, finding and learning take 57 % and 54 % of the plain instructions
//! (`benchmarks/record/speed.md`).

use super::fhog::{self, CELL, FhogScratch, fhog};
use super::fourier::Complex32;
use super::lanes::{LANES, Octet, Vector, inner};
use super::spectral_filter::SpectralFilter;
use crate::numeric::instructions::{Instructions, dispatch_eight};
use crate::vision::crop::{CropScratch, Planes, Region};
use crate::vision::frame::Frame;
use patchlock_fft::Fft;
use std::f64::consts::TAU;
use std::fmt;
use std::sync::Arc;

/// Regularisation of the filter, relative to the energy of the features.
const LAMBDA: f32 = 0.01;

/// The parameters of a scale filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScaleFilterParams {
    /// Number of scales, odd.
    pub scales: usize,
    /// Ratio of neighbouring scales.
    pub step: f64,
    /// Standard deviation of the label, in steps.
    pub sigma: f64,
    /// The maximum area of the resampled crops, in pixels.
    pub area: f64,
}

/// Learns filters along scale, and measures with them.
#[derive(Clone)]
pub struct ScaleLearner {
    params: ScaleFilterParams,
    /// Planes of the crops.
    planes: usize,
    /// Width and height of the resampled crops.
    model: [usize; 2],
    fft: Arc<dyn Fft<f32>>,
    /// The conjugate spectrum of the label, as far as it is needed: the other half mirrors it.
    label: Vec<Complex32>,
    /// The weight of each scale in the signals.
    window: Vec<f32>,
    /// Cosines and negative sines, for each bin and each scale of the first half.
    cosines: Vec<f32>,
    sines: Vec<f32>,
}

impl fmt::Debug for ScaleLearner {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "ScaleLearner({:?}, {:?})", self.params, self.model)
    }
}

/// Buffers of a scale filter.
#[derive(Debug, Default)]
pub struct ScaleScratch {
    crop: CropScratch,
    patch: Planes,
    fhog: FhogScratch,
    /// The features of each scale.
    features: Vec<f32>,
    /// The sums of both features of each pair of scales, and the differences.
    sums: Vec<Vector>,
    differences: Vec<Vector>,
    /// The spectra along scale: bin by bin, the features side by side.
    signals: Vec<Complex32>,
    work: Vec<Complex32>,
    response: Vec<Complex32>,
}

impl ScaleLearner {
    /// For a target of this width and height at scale 1, in crops with so many planes.
    pub fn new(base: [f64; 2], planes: usize, params: ScaleFilterParams) -> Self {
        let shrink = (params.area / (base[0] * base[1])).sqrt().min(1.0);
        // Whole cells, and at least two of them for their blocks.
        let cells =
            |side: f64| ((side * shrink / CELL as f64).round() as usize).clamp(2, 64) * CELL;
        let model = [cells(base[0]), cells(base[1])];
        let fft = patchlock_fft::complex(params.scales);
        let mut label: Vec<Complex32> = (0..params.scales)
            .map(|k| exponent(k, params.scales) / params.sigma)
            .map(|t| Complex32::new((-0.5 * t * t).exp() as f32, 0.0))
            .collect();
        fft.process(&mut label);
        let bins = params.scales / 2 + 1;
        let label = label[..bins].iter().map(Complex32::conj).collect();
        let turns = |k: f64| k / params.scales as f64 * TAU;
        let window = (0..params.scales).map(|k| 0.5 - 0.5 * turns(k as f64 + 0.5).cos() as f32);
        let turned = (0..bins).flat_map(|bin| (0..bins).map(move |k| turns((bin * k) as f64)));
        let cosines = turned.clone().map(|angle| angle.cos() as f32).collect();
        let sines = turned.map(|angle| -angle.sin() as f32).collect();
        Self { params, planes, model, fft, label, window: window.collect(), cosines, sines }
    }

    /// A filter that has learnt the target in this region of the frame.
    pub fn begin(
        &self,
        frame: &Frame<'_>,
        region: Region,
        scratch: &mut ScaleScratch,
    ) -> SpectralFilter {
        let mut filter = SpectralFilter::default();
        self.learn(&mut filter, frame, region, 1.0, scratch);
        filter
    }

    /// Whether a filter is one that was learnt here.
    pub fn fits(&self, filter: &SpectralFilter) -> bool {
        filter.is_sound(self.features(), self.label.len())
    }

    /// Number of features of a crop, rounded up to whole vectors; the last may be zero.
    fn features(&self) -> usize {
        let cells = self.model[0] / CELL * (self.model[1] / CELL);
        (fhog::CHANNELS * cells).next_multiple_of(LANES)
    }

    /// The factor by which the size of the target in this region has changed.
    pub fn find(
        &self,
        filter: &SpectralFilter,
        frame: &Frame<'_>,
        region: Region,
        scratch: &mut ScaleScratch,
    ) -> f64 {
        self.signals(frame, region, scratch);
        let scales = self.params.scales;
        self.respond(filter, scratch);
        let ScaleScratch { work, response, .. } = scratch;
        // The inverse transform of v is the conjugate of the transform of its conjugate.
        self.fft.process_with_scratch(response, work);
        let at = |k: usize| response[k].re;
        let best = (0..scales).fold(0, |best, k| if at(k) > at(best) { k } else { best });
        let mut offset = 0.0;
        if (1..scales - 1).contains(&best) {
            let (before, here, after) = (at(best - 1), at(best), at(best + 1));
            let curvature = before - 2.0 * here + after;
            if curvature < 0.0 {
                offset = f64::from(0.5 * (before - after) / curvature).clamp(-0.5, 0.5);
            }
        }
        self.params.step.powf(exponent(best, scales) + offset)
    }

    /// Has a filter learn the target in this region at this rate.
    pub fn learn(
        &self,
        filter: &mut SpectralFilter,
        frame: &Frame<'_>,
        region: Region,
        rate: f32,
        scratch: &mut ScaleScratch,
    ) {
        self.signals(frame, region, scratch);
        filter.learn(&self.label, &scratch.signals, rate);
    }

    /// The spectrum along scale of each feature.
    fn signals(&self, frame: &Frame<'_>, region: Region, scratch: &mut ScaleScratch) {
        let ScaleScratch { crop, patch, fhog: fhog_scratch, features, .. } = scratch;
        let (scales, length) = (self.params.scales, self.features());
        features.resize(length * scales, 0.0);
        for (k, features) in features.chunks_exact_mut(length).enumerate() {
            let factor = self.params.step.powf(exponent(k, scales));
            let part = region.scaled(factor).crop(self.model);
            part.cut(frame, self.planes, crop, patch);
            // No crop reaches the last values.
            features[length - length % fhog::CHANNELS..].fill(0.0);
            fhog(patch, fhog_scratch, features, fhog::CHANNELS);
        }
        self.transform(scratch);
    }

    /// The spectra along scale, from their definition with scales taken in pairs.
    fn transform(&self, scratch: &mut ScaleScratch) {
        dispatch_eight!(Instructions::default(), |_| {
            let ScaleScratch { features, sums, differences, signals, .. } = scratch;
            let ScaleLearner { window, cosines, sines, label, .. } = self;
            let (scales, bins) = (window.len(), label.len());
            let length = features.len() / scales;
            sums.resize(bins, Vector::ZERO);
            differences.resize(bins, Vector::ZERO);
            signals.resize(length * bins, Complex32::ZERO);
            for first in (0..length).step_by(LANES) {
                let at = |k: usize| Vector::load(&features[k * length + first..]) * window[k];
                sums[0] = at(0);
                for k in 1..bins {
                    let (one, other) = (at(k), at(scales - k));
                    (sums[k], differences[k]) = (one + other, one - other);
                }
                let waves = cosines.chunks_exact(bins).zip(sines.chunks_exact(bins));
                for (bin, (cosines, sines)) in waves.enumerate() {
                    let value =
                        Octet { re: weighted(sums, cosines), im: weighted(differences, sines) };
                    value.store(&mut signals[bin * length + first..]);
                }
            }
        });
    }

    /// The conjugate spectrum of the response.
    fn respond(&self, filter: &SpectralFilter, scratch: &mut ScaleScratch) {
        dispatch_eight!(Instructions::default(), |simd| {
            let ScaleLearner { params, label, fft, .. } = self;
            let SpectralFilter { numerator, denominator } = filter;
            let ScaleScratch { signals, work, response, .. } = scratch;
            let (scales, length) = (params.scales, signals.len() / label.len());
            work.resize(fft.get_inplace_scratch_len(), Complex32::ZERO);
            response.resize(scales, Complex32::ZERO);
            let bins = numerator.chunks_exact(length).zip(signals.chunks_exact(length));
            for (k, ((a, x), b)) in bins.zip(denominator).enumerate() {
                let value = inner(simd, a, x) / (b + LAMBDA);
                // The signals are real, so the other half mirrors this one.
                response[k] = value.conj();
                response[(scales - k) % scales] = if k == 0 { value.conj() } else { value };
            }
        });
    }
}

/// The weighted sum of vectors.
#[inline(always)]
fn weighted(values: &[Vector], weights: &[f32]) -> Vector {
    let mut sum = Vector::ZERO;
    for (&value, &weight) in values.iter().zip(weights) {
        sum = sum + value * weight;
    }
    sum
}

/// The exponent of a scale: 0 in the middle.
fn exponent(k: usize, scales: usize) -> f64 {
    k as f64 - (scales as f64 - 1.0) / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::correlation::fourier::Complex32;

    const PARAMS: ScaleFilterParams =
        ScaleFilterParams { scales: 33, step: 1.02, sigma: 1.4, area: 512.0 };

    #[test]
    fn signals_have_the_spectra_of_their_definition() {
        for scales in [3, 17, 33] {
            let params = ScaleFilterParams { scales, ..PARAMS };
            let learner = ScaleLearner::new([10.0, 10.0], 1, params);
            let (length, mut scratch) = (2 * LANES, ScaleScratch::default());
            let noise = |k: usize| ((k * 7919 + k * k * 31) % 1009) as f32 / 1009.0;
            scratch.features = (0..scales * length).map(noise).collect();
            learner.transform(&mut scratch);
            for feature in 0..length {
                let mut whole: Vec<Complex32> = (0..scales)
                    .map(|k| scratch.features[k * length + feature] * learner.window[k])
                    .map(Complex32::from)
                    .collect();
                learner.fft.process(&mut whole);
                for (bin, expected) in whole[..=scales / 2].iter().enumerate() {
                    let found = scratch.signals[bin * length + feature];
                    assert!((found - expected).norm() < 1e-4, "{scales} {feature} {bin}");
                }
            }
        }
    }

    #[test]
    fn it_finds_how_much_a_target_has_grown() {
        // A blob with a texture that grows with it, in the middle of 120 x 120 pixels.
        let render = |scale: f64| -> Vec<u8> {
            let at = |k: usize| (k as f64 - 60.0) / scale;
            let value = |x: f64, y: f64| {
                let texture = (x * 0.55).sin() * (y * 0.4).cos() + (x * 0.2 + y * 0.3).sin();
                let inside = x.abs() < 20.0 && y.abs() < 16.0;
                if inside { 128.0 + 50.0 * texture } else { 90.0 }
            };
            (0..120 * 120).map(|k| value(at(k % 120), at(k / 120)) as u8).collect()
        };
        let (first, mut scratch) = (render(1.0), ScaleScratch::default());
        let frame = Frame::grey8(&first, 120, 120).unwrap();
        let region = Region { centre: [60.0; 2], size: [40.0, 32.0], rotation: 0.0 };
        let learner = ScaleLearner::new(region.size, 1, PARAMS);
        let filter = learner.begin(&frame, region, &mut scratch);
        assert!(learner.fits(&filter));
        for grown in [0.9, 1.0, 1.04, 1.15] {
            let pixels = render(grown);
            let frame = Frame::grey8(&pixels, 120, 120).unwrap();
            let found = learner.find(&filter, &frame, region, &mut scratch);
            // Closer than a step.
            assert!((found / grown - 1.0).abs() < 0.015, "{grown}: {found}");
        }
    }
}
