//! What a family of networks must be able to do. Each family is a file.

use super::predictions::{Buffers, CellPredictions, CentredBox, Detection};
use crate::network_error::NetworkError;
use crate::vision::frame::Frame;
use std::fmt::Debug;

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
    ) -> Result<Vec<f32>, NetworkError>;

    /// The length of a template.
    fn template_length(&self) -> usize;

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
    ) -> Result<(), NetworkError>;

    /// The logarithm of the odds that the box overlaps the target by at least half, from the logit
    /// of its cell.
    fn odds(&self, logit: f64) -> f64;

    /// The new place, by the rules that were published with the network.
    fn detect(&self, predictions: &CellPredictions, last: CentredBox) -> Detection;
}
