//! The target's colours: a map of where they are supports the tracking filter.

use super::locate::FrameContext;
use super::window::Sample;
use crate::correlation::histogram::{Histograms, MapScratch};

/// Where the target's colours are.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ColourMap<'a> {
    /// For each displacement in cells, in the order of a response, the mean likelihood of the box
    /// there, from 0 to 1.
    pub cells: &'a [f32],
    /// The weight of a cell, in units of the tracking filter's response.
    pub weight: f32,
}

/// Where the colours are in a sample, unless they tell too little.
pub(crate) fn map<'a>(
    colours: &Histograms,
    sample: &Sample<'_>,
    context: FrameContext<'_>,
    scratch: &'a mut MapScratch,
) -> Option<ColourMap<'a>> {
    let FrameContext { memory, config, .. } = context;
    if config.colour_weight <= 0.0 || f64::from(colours.contrast()) < config.colour_contrast {
        return None;
    }
    let cells = colours.map(sample.patch, sample.window.pixels(), scratch);
    Some(ColourMap { cells, weight: (config.colour_weight * memory.mean()) as f32 })
}
