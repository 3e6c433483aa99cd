//! What a family of networks must be able to do. Each family is a file.

use super::predictions::{Buffers, CellPredictions, CentredBox, Detection};
use crate::network_error::NetworkError;
use crate::vision::frame::Frame;
use std::fmt::Debug;

/// How a template is updated: it is a mixture of that of the first frame and of a running mean over
/// the frames in which the target is found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TemplateUpdate {
    /// The share of the running mean in the mixture.
    pub share: f32,
    /// The rate of the running mean.
    pub rate: f32,
    /// A frame counts if the score of the chosen cell is above this.
    pub min_score: f64,
}

/// Features of the window that was read last, in cells as those of the predictions.
#[derive(Debug, Clone, Copy)]
pub struct FeatureMap<'a> {
    /// A plane for each channel, each with a row of cells after the other.
    pub planes: &'a [f32],
    /// Cells on a side; at least one.
    pub side: usize,
    /// Frame pixels from one cell to the next.
    pub spacing: f64,
}

/// A network of a family, ready to run.
pub trait Family: Debug + Send + Sync {
    /// The name, such as "NanoTrack v3".
    fn name(&self) -> &'static str;

    /// What it keeps of the target: numbers that only the same network understands.
    ///
    /// # Errors
    /// The runtime's own.
    fn template(
        &self,
        frame: &Frame<'_>,
        border: [f32; 3],
        place: CentredBox,
        buffers: &mut Buffers,
        out: &mut Vec<f32>,
    ) -> Result<(), NetworkError>;

    /// The length of a template.
    fn template_length(&self) -> usize;

    /// How a template is updated; `None` if that of the first frame is kept, as published.
    fn template_update(&self) -> Option<TemplateUpdate> {
        None
    }

    /// The number of channels of its features, if a classifier learns from them.
    fn channels(&self) -> Option<usize> {
        None
    }

    /// The features of the window around a place that was read last, if a classifier learns from them.
    fn features<'a>(&self, _buffers: &'a Buffers, _place: CentredBox) -> Option<FeatureMap<'a>> {
        None
    }

    /// Reads the window around a place into the buffers.
    ///
    /// # Errors
    /// The runtime's own.
    fn read_window(
        &self,
        frame: &Frame<'_>,
        border: [f32; 3],
        place: CentredBox,
        buffers: &mut Buffers,
    ) -> Result<(), NetworkError>;

    /// Compares a template with the window around a place that was read last; the result is in
    /// `buffers.predictions`.
    ///
    /// # Errors
    /// The runtime's own.
    fn compare(
        &self,
        template: &[f32],
        place: CentredBox,
        buffers: &mut Buffers,
    ) -> Result<(), NetworkError>;

    /// Looks for the target in the window around a place; the result is in `buffers.predictions`.
    ///
    /// # Errors
    /// The runtime's own.
    fn predict(
        &self,
        frame: &Frame<'_>,
        border: [f32; 3],
        template: &[f32],
        place: CentredBox,
        buffers: &mut Buffers,
    ) -> Result<(), NetworkError> {
        self.read_window(frame, border, place, buffers)?;
        self.compare(template, place, buffers)
    }

    /// The logarithm of the odds that the box overlaps the target by at least half, from the logit
    /// of its cell.
    fn odds(&self, logit: f64) -> f64;

    /// The new place, by the rules that were published with the network.
    fn detect(&self, predictions: &CellPredictions, last: CentredBox) -> Detection;
}
