//! A filter along scale: Danelljan, Häger, Khan and Felsberg, "Accurate scale estimation for robust visual
//! tracking" (2014).
//!
//! The target is cut out at many sizes, each crop resampled to the same few pixels. Their features, side by
//! side, are a signal along scale for each feature; a filter that is learnt to answer with a Gaussian around
//! the true scale says by its peak how much larger or smaller the target has become.

use super::fhog::{self, CELL, FhogScratch, fhog};
use super::fourier::Complex32;
use crate::vision::crop::{CropScratch, Planes, Region};
use crate::vision::frame::Frame;
use rustfft::{Fft, FftPlanner};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::sync::Arc;

/// Regularisation of the filter, relative to the energy of the features.
const LAMBDA: f32 = 0.01;

/// The numbers of a scale filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScaleRules {
    /// Number of scales, odd.
    pub scales: usize,
    /// Ratio of neighbouring scales.
    pub step: f64,
    /// Standard deviation of the label, in steps.
    pub sigma: f64,
    /// Learning rate.
    pub rate: f64,
    /// The maximum area of the resampled crops, in pixels.
    pub area: f64,
}

/// A filter along scale.
#[derive(Clone)]
pub struct ScaleFilter {
    rules: ScaleRules,
    /// Width and height of the resampled crops.
    model: [usize; 2],
    fft: Arc<dyn Fft<f32>>,
    label: Vec<Complex32>,
    numerator: Vec<Complex32>,
    denominator: Vec<f32>,
}

/// What a scale filter has learnt. Spectra are pairs of real and imaginary parts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SavedScale {
    numerator: Vec<[f32; 2]>,
    denominator: Vec<f32>,
}

impl fmt::Debug for ScaleFilter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "ScaleFilter({:?}, {:?})", self.rules, self.model)
    }
}

/// Buffers of a scale filter.
#[derive(Debug, Default)]
pub struct ScaleScratch {
    crop: CropScratch,
    patch: Planes,
    fhog: FhogScratch,
    features: Vec<f32>,
    signals: Vec<Complex32>,
    work: Vec<Complex32>,
    response: Vec<Complex32>,
}

impl ScaleFilter {
    /// A filter that has learnt the target in this region of the frame.
    pub fn begin(
        frame: &Frame<'_>,
        channels: usize,
        region: Region,
        rules: ScaleRules,
        scratch: &mut ScaleScratch,
    ) -> Self {
        let mut filter = Self::untaught(region.size, rules);
        filter.learn(frame, channels, region, 1.0, scratch);
        filter
    }

    fn untaught(base: [f64; 2], rules: ScaleRules) -> Self {
        let shrink = (rules.area / (base[0] * base[1])).sqrt().min(1.0);
        // Whole cells, and at least two of them for their blocks.
        let cells =
            |side: f64| ((side * shrink / CELL as f64).round() as usize).clamp(2, 64) * CELL;
        let model = [cells(base[0]), cells(base[1])];
        let fft = FftPlanner::new().plan_fft_forward(rules.scales);
        let mut label: Vec<Complex32> = (0..rules.scales)
            .map(|k| exponent(k, rules.scales) / rules.sigma)
            .map(|t| Complex32::new((-0.5 * t * t).exp() as f32, 0.0))
            .collect();
        fft.process(&mut label);
        let (numerator, denominator) = (Vec::new(), Vec::new());
        Self { rules, model, fft, label, numerator, denominator }
    }

    /// What it has learnt.
    pub fn saved(&self) -> SavedScale {
        let numerator = self.numerator.iter().map(|v| [v.re, v.im]).collect();
        SavedScale { numerator, denominator: self.denominator.clone() }
    }

    /// The filter that has learnt this, for a target of this width and height at scale 1.
    ///
    /// # Errors
    /// What does not fit the rules.
    pub fn restore(
        saved: SavedScale,
        base: [f64; 2],
        rules: ScaleRules,
    ) -> Result<Self, &'static str> {
        let mut filter = Self::untaught(base, rules);
        let SavedScale { numerator, denominator } = saved;
        let length = filter.features() * rules.scales;
        if numerator.len() != length || denominator.len() != rules.scales {
            return Err("the scale filter does not fit the configuration");
        }
        let positive = |v: &f32| v.is_finite() && *v >= 0.0;
        if !numerator.iter().flatten().all(|v| v.is_finite()) || !denominator.iter().all(positive) {
            return Err("the scale filter is damaged");
        }
        filter.numerator = numerator.into_iter().map(|[re, im]| Complex32::new(re, im)).collect();
        filter.denominator = denominator;
        Ok(filter)
    }

    /// Number of features of a crop.
    fn features(&self) -> usize {
        fhog::CHANNELS * self.model[0] / CELL * (self.model[1] / CELL)
    }

    /// The factor by which the size of the target in this region has changed.
    pub fn find(
        &self,
        frame: &Frame<'_>,
        channels: usize,
        region: Region,
        scratch: &mut ScaleScratch,
    ) -> f64 {
        self.signals(frame, channels, region, scratch);
        let ScaleScratch { signals, work, response, .. } = scratch;
        let scales = self.rules.scales;
        response.clear();
        response.resize(scales, Complex32::ZERO);
        for (a, x) in self.numerator.chunks_exact(scales).zip(signals.chunks_exact(scales)) {
            response.iter_mut().zip(a.iter().zip(x)).for_each(|(sum, (a, x))| *sum += a * x);
        }
        // The inverse transform of v is the conjugate of the transform of its conjugate.
        let pairs = response.iter_mut().zip(&self.denominator);
        pairs.for_each(|(r, b)| *r = (*r / (b + LAMBDA)).conj());
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
        self.rules.step.powf(exponent(best, scales) + offset)
    }

    /// Learns the target in this region with the filter's rate.
    pub fn update(
        &mut self,
        frame: &Frame<'_>,
        channels: usize,
        region: Region,
        scratch: &mut ScaleScratch,
    ) {
        self.learn(frame, channels, region, self.rules.rate as f32, scratch);
    }

    fn learn(
        &mut self,
        frame: &Frame<'_>,
        channels: usize,
        region: Region,
        rate: f32,
        scratch: &mut ScaleScratch,
    ) {
        self.signals(frame, channels, region, scratch);
        let (scales, signals) = (self.rules.scales, &scratch.signals);
        self.numerator.resize(signals.len(), Complex32::ZERO);
        self.denominator.resize(scales, 0.0);
        self.denominator.iter_mut().for_each(|b| *b *= 1.0 - rate);
        let rows = self.numerator.chunks_exact_mut(scales).zip(signals.chunks_exact(scales));
        for (numerator, signal) in rows {
            for (k, x) in signal.iter().enumerate() {
                numerator[k] = numerator[k] * (1.0 - rate) + self.label[k] * x.conj() * rate;
                self.denominator[k] += rate * x.norm_sqr();
            }
        }
    }

    /// The spectrum along scale of each feature.
    fn signals(
        &self,
        frame: &Frame<'_>,
        channels: usize,
        region: Region,
        scratch: &mut ScaleScratch,
    ) {
        let ScaleScratch { crop, patch, fhog: fhog_scratch, features, signals, work, .. } = scratch;
        let scales = self.rules.scales;
        let length = self.features();
        features.resize(length, 0.0);
        signals.resize(length * scales, Complex32::ZERO);
        work.resize(self.fft.get_inplace_scratch_len(), Complex32::ZERO);
        for k in 0..scales {
            let factor = self.rules.step.powf(exponent(k, scales));
            let part = region.scaled(factor).crop(self.model);
            part.cut(frame, channels, crop, patch);
            fhog(patch, fhog_scratch, features);
            let turns = (k as f32 + 0.5) / scales as f32;
            let window = 0.5 - 0.5 * (std::f32::consts::TAU * turns).cos();
            for (signal, &value) in signals.chunks_exact_mut(scales).zip(features.iter()) {
                signal[k] = Complex32::new(value * window, 0.0);
            }
        }
        self.fft.process_with_scratch(signals, work);
    }
}

/// The exponent of a scale: 0 in the middle.
fn exponent(k: usize, scales: usize) -> f64 {
    k as f64 - (scales as f64 - 1.0) / 2.0
}
