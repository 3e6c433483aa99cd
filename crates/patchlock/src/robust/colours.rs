//! The target's colours: a map of where they are supports the tracking filter.

use super::window::Sample;
use crate::config::RobustConfig;
use crate::correlation::histogram::{Histograms, MapScratch, Rates};

/// The colours of the target and of what is around it.
#[derive(Debug)]
pub(crate) struct ColourModel {
    histograms: Histograms,
}

/// Where the target's colours are.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ColourMap<'a> {
    /// For each displacement in cells, in the order of a response, the mean likelihood of the box
    /// there, from 0 to 1.
    pub cells: &'a [f32],
    /// The weight of a cell, in units of the tracking filter's response.
    pub weight: f32,
}

impl ColourModel {
    /// The colours of the target in the middle of a sample.
    pub fn begin(sample: &Sample<'_>, scratch: &mut MapScratch) -> Self {
        Self { histograms: Histograms::begin(sample.patch, sample.window.pixels(), scratch) }
    }

    /// As a snapshot holds them.
    pub fn saved(&self) -> Histograms {
        self.histograms.clone()
    }

    /// From a snapshot.
    ///
    /// # Errors
    /// What is damaged.
    pub fn restore(histograms: Histograms) -> Result<Self, &'static str> {
        if !histograms.is_sound() {
            return Err("the histograms of colours are damaged");
        }
        Ok(Self { histograms })
    }

    /// How well colour tells the target from what is around it: from -1, through 0, not at all, to
    /// 1.
    pub fn contrast(&self) -> f64 {
        self.histograms.contrast().into()
    }

    /// Where the colours are in a sample, unless they tell too little. `mean` is the memory's mean
    /// response.
    pub fn map<'a>(
        &self,
        sample: &Sample<'_>,
        mean: f64,
        config: &RobustConfig,
        scratch: &'a mut MapScratch,
    ) -> Option<ColourMap<'a>> {
        if config.colour_weight <= 0.0 || self.contrast() < config.colour_contrast {
            return None;
        }
        let cells = self.histograms.map(sample.patch, sample.window.pixels(), scratch);
        Some(ColourMap { cells, weight: (config.colour_weight * mean) as f32 })
    }

    /// Learns the colours of the target in the middle of a sample.
    pub fn learn(&mut self, sample: &Sample<'_>, config: &RobustConfig, scratch: &mut MapScratch) {
        let (target, around) = (config.colour_rate as f32, config.around_rate as f32);
        let (size, rates) = (sample.window.pixels(), Rates { target, around });
        self.histograms.learn(sample.patch, size, rates, scratch);
    }
}
