//! The choice of a cell by score, Hann window and penalty of changed sizes, and the size that follows
//! in part: SiamRPN (Li et al. 2018, Sec. 4.3).

use super::predictions::{CellPredictions, CentredBox, Detection, change, largest};

/// The part of the target's half perimeter that is added to its sides as context.
const CONTEXT: f64 = 0.5;

/// The numbers of a network.
#[derive(Debug, Clone, Copy)]
pub struct Selection {
    /// The share of the Hann window in the rank of a cell; the rest is that of its score.
    pub window: f64,
    /// How strongly a change of size or aspect lowers a score.
    pub penalty: f64,
    /// The share of the way to the size of the chosen cell, at a score of 1 without a penalty.
    pub rate: f64,
}

/// The side of the square with the target and its context, in frame pixels.
pub fn context([w, h]: [f64; 2]) -> f64 {
    let context = CONTEXT * (w + h);
    ((w + context) * (h + context)).sqrt()
}

impl Selection {
    /// The new place: that of the best cell, with a size between the last one and that of the cell.
    pub fn detect(
        &self,
        hann: &[f64],
        predictions: &CellPredictions,
        last: CentredBox,
    ) -> Detection {
        let Self { window, penalty, rate } = *self;
        let penalties = |place: &CentredBox| {
            let [w, h] = place.size;
            let aspect = change((last.size[0] / last.size[1]) / (w / h));
            let size = change(context(place.size) / context(last.size));
            (-(aspect * size - 1.0) * penalty).exp()
        };
        let ranked = predictions.places.iter().zip(&predictions.scores).zip(hann).map(
            |((place, score), hann)| penalties(place) * score * (1.0 - window) + hann * window,
        );
        let cell = largest(ranked);
        let (best, score) = (predictions.places[cell], predictions.scores[cell]);
        let rate = penalties(&best) * score * rate;
        let size = [0, 1].map(|k| last.size[k] + rate * (best.size[k] - last.size[k]));
        Detection { place: CentredBox { centre: best.centre, size }, score, cell }
    }
}
