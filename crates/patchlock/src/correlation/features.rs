//! The features of a patch: gradients, luma and colour of each cell, under a window, and their
//! spectra. The channels of a cell lie side by side, and so do those of a bin.

use super::batch::{BatchScratch, GROUP};
use super::colour::{self, ColourScratch, colour, luma};
use super::fhog::{self, CELL, FhogScratch, fhog};
use super::fourier::{Complex32, Fourier};
use crate::vision::crop::Planes;

/// The features of square patches of one size, and their window.
#[derive(Debug, Clone)]
pub struct Features {
    fourier: Fourier,
    window: Vec<f32>,
}

/// Number of channels that are not always zero.
const USED: usize = fhog::CHANNELS + 1 + colour::CHANNELS;

/// Buffers of [`Features::spectra`].
#[derive(Debug, Default)]
pub struct FeatureScratch {
    fhog: FhogScratch,
    colour: ColourScratch,
    cells: Vec<f32>,
    batch: BatchScratch,
}

impl Features {
    /// Features of square patches with `n` cells on a side, in colour (three planes) or grey (one).
    pub fn new(n: usize) -> Self {
        let hann = |k: usize| {
            let turns = (k as f32 + 0.5) / n as f32;
            0.5 - 0.5 * (std::f32::consts::TAU * turns).cos()
        };
        let window = (0..n * n).map(|k| hann(k % n) * hann(k / n)).collect();
        Self { fourier: Fourier::new(n), window }
    }

    /// The transforms of a plane of cells.
    pub fn fourier(&self) -> &Fourier {
        &self.fourier
    }

    /// Side of a patch in pixels.
    pub fn side(&self) -> usize {
        self.fourier.side() * CELL
    }

    /// Number of channels. It is rounded up to whole groups; the last channels may be zero.
    pub fn channels(&self) -> usize {
        USED.next_multiple_of(GROUP)
    }

    /// The spectra of all channels of a patch, bin by bin.
    pub fn spectra(&self, patch: &Planes, scratch: &mut FeatureScratch, out: &mut Vec<Complex32>) {
        let FeatureScratch { fhog: fhog_scratch, colour: colour_scratch, cells, batch } = scratch;
        let channels = self.channels();
        cells.resize(self.window.len() * channels, 0.0);
        for cell in cells.chunks_exact_mut(channels) {
            cell[USED..].fill(0.0);
        }
        fhog(patch, fhog_scratch, cells, channels);
        luma(patch, colour_scratch, &mut cells[fhog::CHANNELS..], channels);
        colour(patch, colour_scratch, &mut cells[fhog::CHANNELS + 1..], channels);
        out.resize(self.fourier.bins() * channels, Complex32::ZERO);
        self.fourier.batch().forward(cells, &self.window, out, batch);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_buffers_held_does_not_matter() {
        let n = 6;
        let patch = |channels: usize| {
            let noise = |k: usize| ((k * 7919 + k * k * 31) % 255) as f32;
            let (side, samples) = (n * CELL, (0..channels * (n * CELL).pow(2)).map(noise));
            Planes { width: side, height: side, channels, samples: samples.collect() }
        };
        let spectra = |colour: bool, scratch: &mut FeatureScratch| {
            let mut out = Vec::new();
            let planes = if colour { 3 } else { 1 };
            Features::new(n).spectra(&patch(planes), scratch, &mut out);
            out
        };
        let mut scratch = FeatureScratch::default();
        for colour in [false, true, false] {
            assert_eq!(
                spectra(colour, &mut scratch),
                spectra(colour, &mut FeatureScratch::default())
            );
        }
    }
}
