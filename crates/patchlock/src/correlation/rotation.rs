//! A filter over rotation: on a log-polar grid around the target's centre, rotation and scale are
//! shifts, so the peak of a correlation filter says by how much the target has turned (Li, Zhu,
//! Hoi, Song, Wang and Liu, "Robust estimation of similarity transformation for visual object
//! tracking", 2019, Sec. 4; here with a filter that is learnt like that of [`super::scale`] instead
//! of a phase correlation).

use super::batch::{BatchScratch, GROUP};
use super::fhog::{self, CELL, FhogScratch, fhog};
use super::fourier::{Complex32, Fourier, FourierScratch};
use super::response::{Response, ResponseBuffers};
use super::spectral_filter::SpectralFilter;
use crate::vision::crop::{CropScratch, Planes, Region};
use crate::vision::frame::Frame;
use std::f64::consts::TAU;

/// Cells of the grid, along the logarithm of the radius and along the angle.
const CELLS: usize = 32;

/// Samples of the grid, along both.
const SIDE: usize = CELLS * CELL;

/// Side of the crop that the grid is sampled from, in pixels.
const CROP: usize = 96;

/// Side of that crop in the frame, relative to the mean side of the target.
const REACH: f64 = 1.5;

/// The ratio of the largest radius to the smallest.
const RADII: f64 = 16.0;

/// Regularisation of the filter, relative to the energy of the features.
const LAMBDA: f32 = 0.01;

/// Standard deviation of the label, in cells.
const LABEL: f64 = 1.0;

/// Channels of a cell: those of its gradients, and zeros.
const CHANNELS: usize = fhog::CHANNELS.next_multiple_of(GROUP);

/// Learns filters over rotation, and measures with them.
#[derive(Debug, Clone)]
pub struct RotationLearner {
    fourier: Fourier,
    /// The conjugate spectrum of the label.
    label: Vec<Complex32>,
    window: Vec<f32>,
}

/// Buffers of a filter over rotation.
#[derive(Debug, Default)]
pub struct RotationScratch {
    crop: CropScratch,
    patch: Planes,
    grid: Planes,
    fhog: FhogScratch,
    features: Vec<f32>,
    sample: Vec<Complex32>,
    filter: Vec<Complex32>,
    batch: BatchScratch,
    response: ResponseBuffers,
}

/// By how much a target has turned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RotationEstimate {
    /// In radians, from x towards y: from -pi to pi.
    pub rotation: f64,
    /// How strongly the filter responded.
    pub response: f64,
}

impl Default for RotationLearner {
    fn default() -> Self {
        let fourier = Fourier::new(CELLS);
        let wrap = |k: usize| if k < CELLS / 2 { k as f64 } else { k as f64 - CELLS as f64 };
        let distance = |k: usize| wrap(k % CELLS).hypot(wrap(k / CELLS)) / LABEL;
        let plane: Vec<f32> =
            (0..CELLS * CELLS).map(|k| (-0.5 * distance(k).powi(2)).exp() as f32).collect();
        let mut label = vec![Complex32::ZERO; fourier.bins()];
        fourier.forward(&plane, &mut label, &mut FourierScratch::default());
        label.iter_mut().for_each(|v| *v = v.conj());
        // The angle is cyclic and needs no window.
        let along_radius = |k: usize| {
            let turns = ((k % CELLS) as f32 + 0.5) / CELLS as f32;
            0.5 - 0.5 * (turns * std::f32::consts::TAU).cos()
        };
        let window = (0..CELLS * CELLS).map(along_radius).collect();
        Self { fourier, label, window }
    }
}

impl RotationLearner {
    /// A filter that has learnt the target in this region.
    pub fn begin(
        &self,
        frame: &Frame<'_>,
        region: Region,
        scratch: &mut RotationScratch,
    ) -> SpectralFilter {
        let mut filter = SpectralFilter::default();
        self.learn(&mut filter, frame, region, 1.0, scratch);
        filter
    }

    /// Whether a filter is one that was learnt here.
    pub fn fits(&self, filter: &SpectralFilter) -> bool {
        filter.is_sound(CHANNELS, self.fourier.bins())
    }

    /// By how much the target in this region has turned since it was learnt.
    pub fn find(
        &self,
        learnt: &SpectralFilter,
        frame: &Frame<'_>,
        region: Region,
        scratch: &mut RotationScratch,
    ) -> RotationEstimate {
        self.sample(frame, region, scratch);
        let RotationScratch { sample, filter, response, .. } = scratch;
        filter.resize(learnt.numerator.len(), Complex32::ZERO);
        let bins = filter.chunks_exact_mut(CHANNELS).zip(learnt.numerator.chunks_exact(CHANNELS));
        for ((filter, numerator), b) in bins.zip(&learnt.denominator) {
            let scale = 1.0 / (b + LAMBDA);
            filter.iter_mut().zip(numerator).for_each(|(f, a)| *f = a * scale);
        }
        let peak = Response::new(&self.fourier, filter, sample, response).peak();
        RotationEstimate { rotation: peak.shift[1] * TAU / CELLS as f64, response: peak.value }
    }

    /// Has a filter learn the target in this region at this rate.
    pub fn learn(
        &self,
        filter: &mut SpectralFilter,
        frame: &Frame<'_>,
        region: Region,
        rate: f32,
        scratch: &mut RotationScratch,
    ) {
        self.sample(frame, region, scratch);
        filter.learn(&self.label, &scratch.sample, rate);
    }

    /// The spectra of the features on the log-polar grid around a region's centre.
    fn sample(&self, frame: &Frame<'_>, region: Region, scratch: &mut RotationScratch) {
        let RotationScratch { crop, patch, grid, fhog: buffers, features, sample, batch, .. } =
            scratch;
        let side = REACH * (region.size[0] + region.size[1]) / 2.0;
        let around = Region { size: [side; 2], rotation: 0.0, ..region };
        around.crop([CROP; 2]).cut(frame, 1, crop, patch);
        fill_grid(patch, region.rotation, grid);
        // The channels that the gradients leave stay zero.
        features.resize(CHANNELS * grid.samples.len() / (CELL * CELL), 0.0);
        fhog(grid, buffers, features, CHANNELS);
        sample.resize(CHANNELS * self.fourier.bins(), Complex32::ZERO);
        let cells = &features[CELLS * CHANNELS..][..CELLS * CELLS * CHANNELS];
        self.fourier.batch().forward(cells, &self.window, sample, batch);
    }
}

/// Samples the log-polar grid from a patch, bilinearly: a row for each angle, with one more cell at
/// both ends because the angle is cyclic, and a column for each radius.
fn fill_grid(patch: &Planes, rotation: f64, grid: &mut Planes) {
    grid.reshape([SIDE, SIDE + 2 * CELL], 1);
    let middle = (CROP as f64 - 1.0) / 2.0;
    let radii: [f32; SIDE] = std::array::from_fn(|x| {
        let outside = (x as f64 + 0.5) / SIDE as f64;
        (middle * RADII.powf(outside - 1.0)) as f32
    });
    for (y, row) in grid.samples.chunks_exact_mut(SIDE).enumerate() {
        let angle = (y as f64 - CELL as f64 + 0.5) * TAU / SIDE as f64 + rotation;
        let [cos, sin] = [angle.cos() as f32, angle.sin() as f32];
        for (out, radius) in row.iter_mut().zip(radii) {
            let [u, v] = [cos, sin].map(|direction| middle as f32 + radius * direction);
            let (column, line) = ((u as usize).min(CROP - 2), (v as usize).min(CROP - 2));
            let (fx, fy) = (u - column as f32, v - line as f32);
            let first = line * CROP + column;
            let pair = |at: usize| {
                let (left, right) = (patch.samples[at], patch.samples[at + 1]);
                left + fx * (right - left)
            };
            let (above, below) = (pair(first), pair(first + CROP));
            *out = above + fy * (below - above);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A pattern of blobs, turned by an angle around the middle of the frame and enlarged.
    fn pattern(side: usize, angle: f64, scale: f64) -> Vec<u8> {
        let middle = (side as f64 - 1.0) / 2.0;
        let (sin, cos) = (-angle).sin_cos();
        let value = |k: usize| {
            let x = ((k % side) as f64 - middle) / scale;
            let y = ((k / side) as f64 - middle) / scale;
            let (x, y) = (cos * x - sin * y, sin * x + cos * y);
            let wave = (x * 0.21).sin() * (y * 0.13 + 0.5).cos() + (x * 0.05 - y * 0.08).sin();
            (127.0 + 60.0 * wave) as u8
        };
        (0..side * side).map(value).collect()
    }

    #[test]
    fn it_measures_how_far_a_pattern_has_turned() {
        let side = 161;
        let region = Region { centre: [80.0; 2], size: [90.0, 70.0], rotation: 0.0 };
        let scratch = &mut RotationScratch::default();
        let first = pattern(side, 0.0, 1.0);
        let first = Frame::grey8(&first, side, side).unwrap();
        let learner = RotationLearner::default();
        let filter = learner.begin(&first, region, scratch);
        assert!(learner.fits(&filter));
        for (angle, scale) in [(0.0, 1.0), (0.1, 1.0), (-0.35, 1.0), (0.8, 1.05), (-2.5, 0.95)] {
            let turned = pattern(side, angle, scale);
            let turned = Frame::grey8(&turned, side, side).unwrap();
            let measured = learner.find(&filter, &turned, region, scratch).rotation;
            assert!((measured - angle).abs() < 0.03, "{angle} {scale}: {measured}");
            // In a region that is turned as well there is nothing left to measure.
            let region = Region { rotation: angle, ..region };
            let rest = learner.find(&filter, &turned, region, scratch);
            assert!(rest.rotation.abs() < 0.03, "{angle} {scale}: {rest:?}");
        }
    }
}
