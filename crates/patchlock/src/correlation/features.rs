//! The features of a patch: gradients, luma and colour per cell, under a window, and their spectra. The
//! channels of a cell lie side by side, and so do those of a bin.

use super::batch::{BatchScratch, GROUP};
use super::colour::{self, ColourScratch, colour, luma};
use super::fhog::{self, CELL, FhogScratch, fhog};
use super::fourier::{Complex32, Fourier};
use crate::vision::crop::Planes;

/// Which features a patch has, and their window.
#[derive(Debug, Clone)]
pub struct Features {
    fourier: Fourier,
    colour: bool,
    window: Vec<f32>,
}

/// Buffers of [`Features::spectra`].
#[derive(Debug, Default)]
pub struct FeatureScratch {
    fhog: FhogScratch,
    colour: ColourScratch,
    cells: Vec<f32>,
    batch: BatchScratch,
}

impl Features {
    /// Features of square patches with `n` cells on a side; colour too if the patches have three planes.
    pub fn new(n: usize, colour: bool) -> Self {
        let hann = |k: usize| {
            let turns = (k as f32 + 0.5) / n as f32;
            0.5 - 0.5 * (std::f32::consts::TAU * turns).cos()
        };
        let window = (0..n * n).map(|k| hann(k % n) * hann(k / n)).collect();
        Self { fourier: Fourier::new(n), colour, window }
    }

    /// The transforms of a plane of cells.
    pub fn fourier(&self) -> &Fourier {
        &self.fourier
    }

    /// Whether there are colour channels; the patches must then have three planes, otherwise one.
    pub fn colour(&self) -> bool {
        self.colour
    }

    /// Side of a patch in pixels.
    pub fn side(&self) -> usize {
        self.fourier.side() * CELL
    }

    /// Number of channels. It is rounded up to whole groups; the last channels may be zero.
    pub fn channels(&self) -> usize {
        self.used().next_multiple_of(GROUP)
    }

    fn used(&self) -> usize {
        fhog::CHANNELS + 1 + if self.colour { colour::CHANNELS } else { 0 }
    }

    /// The spectra of all channels of a patch, bin by bin.
    pub fn spectra(&self, patch: &Planes, scratch: &mut FeatureScratch, out: &mut Vec<Complex32>) {
        let FeatureScratch { fhog: fhog_scratch, colour: colour_scratch, cells, batch } = scratch;
        let channels = self.channels();
        cells.resize(self.window.len() * channels, 0.0);
        for cell in cells.chunks_exact_mut(channels) {
            cell[self.used()..].fill(0.0);
        }
        fhog(patch, fhog_scratch, cells, channels);
        luma(patch, colour_scratch, &mut cells[fhog::CHANNELS..], channels);
        if self.colour {
            colour(patch, colour_scratch, &mut cells[fhog::CHANNELS + 1..], channels);
        }
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
            Features::new(n, colour).spectra(&patch(planes), scratch, &mut out);
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
