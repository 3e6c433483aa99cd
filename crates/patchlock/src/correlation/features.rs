//! The features of a patch: gradients, luma and colour per cell, under a window, and their spectra.

use super::fhog::{self, CELL, FhogScratch, fhog};
use super::fourier::{Complex32, Fourier, FourierScratch};
use super::{colour, colour::luma};
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
    planes: Vec<f32>,
    fourier: FourierScratch,
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

    /// Number of channels.
    pub fn channels(&self) -> usize {
        fhog::CHANNELS + 1 + if self.colour { colour::CHANNELS } else { 0 }
    }

    /// The spectra of all channels of a patch, one after the other.
    pub fn spectra(&self, patch: &Planes, scratch: &mut FeatureScratch, out: &mut Vec<Complex32>) {
        let cells = self.window.len();
        let FeatureScratch { fhog: fhog_scratch, planes, fourier } = scratch;
        planes.resize(self.channels() * cells, 0.0);
        let (gradients, rest) = planes.split_at_mut(fhog::CHANNELS * cells);
        let (grey, colours) = rest.split_at_mut(cells);
        fhog(patch, fhog_scratch, gradients);
        luma(patch, grey);
        if self.colour {
            colour::colour(patch, colours);
        }
        out.resize(self.channels() * self.fourier.bins(), Complex32::ZERO);
        let spectra = out.chunks_exact_mut(self.fourier.bins());
        for (plane, spectrum) in planes.chunks_exact_mut(cells).zip(spectra) {
            plane.iter_mut().zip(&self.window).for_each(|(v, w)| *v *= w);
            self.fourier.forward(plane, spectrum, fourier);
        }
    }
}
