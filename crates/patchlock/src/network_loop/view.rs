//! What an observer is shown of a frame of the method `network`.

use crate::network::predictions::{CellPredictions, Detection};
use crate::vision::geometry::BoundingBox;

/// The intermediate results of the method `network` in one frame.
#[derive(Debug)]
#[non_exhaustive]
pub struct NetworkView<'a> {
    /// Cells on a side of the grid over the search window.
    pub cells: usize,
    /// The score of each cell, from 0 to 1, row by row from the top left; of PatchNet, a weighted
    /// mean of the network's and its classifier's.
    pub scores: &'a [f64],
    /// The logarithm of the odds that the network gives each cell.
    pub logits: &'a [f64],
    /// The cell that was chosen.
    pub chosen: usize,
    /// The box that the chosen cell saw, before the size was smoothed.
    pub seen: BoundingBox,
}

impl<'a> NetworkView<'a> {
    /// What was predicted, and the cell that was chosen.
    pub(super) fn of(predictions: &'a CellPredictions, detected: Detection) -> Self {
        Self {
            cells: predictions.scores.len().isqrt(),
            scores: &predictions.scores,
            logits: &predictions.logits,
            chosen: detected.cell,
            seen: predictions.places[detected.cell].bbox(),
        }
    }
}
