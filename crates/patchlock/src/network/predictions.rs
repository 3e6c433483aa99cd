//! What a network says of a window of the frame: for each cell of a grid, whether the target is
//! there, and its box.

#[cfg(feature = "network")]
use super::program::ProgramScratch;
use crate::vision::bilinear::{Bilinear, BilinearScratch};
use crate::vision::crop::Planes;
use crate::vision::frame::Frame;
use crate::vision::geometry::{BoundingBox, Point};

/// Where the target is, in pixels of the frame.
///
/// The networks were trained with `x + w / 2` as the centre of a box and as a column of the frame,
/// half a pixel to the right of where the box is. So it is here; see `benchmarks/record/committee.md`.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct CentredBox {
    /// The centre.
    pub centre: Point,
    /// Width and height.
    pub size: [f64; 2],
}

impl CentredBox {
    /// The place of a box.
    pub fn of(bbox: BoundingBox) -> Self {
        let BoundingBox { x, y, w, h } = bbox;
        Self { centre: [x + w / 2.0, y + h / 2.0], size: [w, h] }
    }

    /// The box of a place.
    pub fn bbox(&self) -> BoundingBox {
        let ([x, y], [w, h]) = (self.centre, self.size);
        BoundingBox { x: x - w / 2.0, y: y - h / 2.0, w, h }
    }

    /// Whether all numbers are finite and the size positive.
    pub fn is_sound(&self) -> bool {
        let [w, h] = self.size;
        self.centre.iter().chain(&self.size).all(|number| number.is_finite()) && w > 0.0 && h > 0.0
    }
}

/// A square window of the frame.
#[derive(Debug, Clone, Copy)]
pub struct Window {
    /// The centre in the frame.
    pub centre: Point,
    /// The side in frame pixels.
    pub side: f64,
    /// The side of the network's input in pixels.
    pub pixels: usize,
}

impl Window {
    /// Frame pixels per pixel of the input.
    pub fn scale(&self) -> f64 {
        self.side / self.pixels as f64
    }

    /// Cuts the window out of the frame: planes of red, green and blue, white at 255. What lies
    /// outside the frame has the colour `border`.
    pub fn cut(&self, frame: &Frame<'_>, border: [f32; 3], scratch: &mut Buffers) {
        let Buffers { window, planes, .. } = scratch;
        let sampled = Bilinear { centre: self.centre, scale: self.scale(), size: self.pixels };
        sampled.sample(frame, border, window, planes);
    }
}

/// What a network says of a window. The cells are in rows, from the top left.
#[derive(Debug, Clone, Default)]
pub struct CellPredictions {
    /// The score of each cell: how sure the network is that the target's centre is there, from 0
    /// to 1.
    pub scores: Vec<f64>,
    /// The logarithm of the odds that belong to each score.
    pub logits: Vec<f64>,
    /// The target's box in the frame, as each cell sees it.
    pub places: Vec<CentredBox>,
}

impl CellPredictions {
    /// The largest logit among the cells in the middle.
    pub fn centre_logit(&self) -> f64 {
        let side = self.logits.len().isqrt();
        self.logit_near(side / 2 * side + side / 2)
    }

    /// The largest logit among a cell and its neighbours.
    pub fn logit_near(&self, cell: usize) -> f64 {
        let side = self.logits.len().isqrt();
        let near = |at: usize| at.saturating_sub(1)..=(at + 1).min(side.saturating_sub(1));
        let (x, y) = (cell % side.max(1), cell / side.max(1));
        let cells = near(y).flat_map(|y| near(x).map(move |x| y * side + x));
        cells.filter_map(|cell| self.logits.get(cell)).copied().fold(f64::NEG_INFINITY, f64::max)
    }

    /// Empties the lists.
    pub(super) fn clear(&mut self) {
        self.scores.clear();
        self.logits.clear();
        self.places.clear();
    }

    /// Adds a cell. A number that is not finite counts as the smallest score and the old place.
    pub(super) fn push(&mut self, logit: f64, place: CentredBox, last: CentredBox) {
        let logit = if logit.is_finite() { logit } else { -1e3 };
        self.logits.push(logit);
        self.scores.push(logistic(logit));
        self.places.push(if place.is_sound() { place } else { last });
    }
}

/// What a family makes of the predictions, by the rules that were published with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detection {
    /// The new place.
    pub place: CentredBox,
    /// The score of the chosen cell, from 0 to 1.
    pub score: f64,
    /// The chosen cell.
    pub cell: usize,
}

/// Buffers of a thread.
#[derive(Debug, Default)]
pub struct Buffers {
    pub(super) window: BilinearScratch,
    /// The window that was cut.
    pub(super) planes: Planes,
    #[cfg(feature = "network")]
    pub(super) program: ProgramScratch,
    pub(super) features: [Vec<f32>; 1],
    pub(super) outputs: Vec<Vec<f32>>,
    pub(crate) predictions: CellPredictions,
}

/// The probability with these logarithmic odds.
pub fn logistic(logit: f64) -> f64 {
    1.0 / (1.0 + (-logit).exp())
}

/// `r` or its inverse, whichever is larger.
pub(super) fn change(r: f64) -> f64 {
    r.max(1.0 / r)
}

/// The weights of a Hann window of `n` points, whose ends are 0.
pub(super) fn hann(n: usize) -> Vec<f64> {
    let step = std::f64::consts::TAU / (n.max(2) - 1) as f64;
    (0..n).map(|k| 0.5 - 0.5 * (k as f64 * step).cos()).collect()
}

/// Weights of a line, in both directions.
pub(super) fn hann_over(line: &[f64]) -> Vec<f64> {
    line.iter().flat_map(|y| line.iter().map(move |x| y * x)).collect()
}

/// The number of the largest value; 0 if there is none.
pub(super) fn largest(values: impl Iterator<Item = f64>) -> usize {
    let best = |best: (usize, f64), (k, value)| if value > best.1 { (k, value) } else { best };
    values.enumerate().fold((0, f64::NEG_INFINITY), best).0
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAST: CentredBox = CentredBox { centre: [5.0, 4.0], size: [3.0, 2.0] };

    #[test]
    fn a_place_is_a_box() {
        let bbox = BoundingBox { x: 3.5, y: -2.0, w: 3.0, h: 8.0 };
        let place = CentredBox::of(bbox);
        assert_eq!(place, CentredBox { centre: [5.0, 2.0], size: [3.0, 8.0] });
        assert_eq!(place.bbox(), bbox);
        assert!(place.is_sound());
        for size in [[0.0, 1.0], [1.0, -1.0], [f64::NAN, 1.0], [1.0, f64::INFINITY]] {
            assert!(!CentredBox { size, ..place }.is_sound(), "{size:?}");
        }
        assert!(!CentredBox { centre: [f64::NAN, 0.0], ..place }.is_sound());
    }

    #[test]
    fn what_is_not_finite_has_no_score_and_the_last_place() {
        let place = CentredBox { centre: [0.0; 2], size: [1.0; 2] };
        let unsound = CentredBox { size: [-1.0; 2], ..place };
        for (logit, given, score, kept) in [
            (0.0, place, 0.5, place),
            (1e9, place, 1.0, place),
            (-1e9, place, 0.0, place),
            (f64::NAN, place, 0.0, place),
            (f64::INFINITY, place, 0.0, place),
            (0.0, unsound, 0.5, LAST),
        ] {
            let mut predictions = CellPredictions::default();
            predictions.push(logit, given, LAST);
            assert_eq!(
                (predictions.scores[0], predictions.places[0]),
                (score, kept),
                "{logit} {given:?}"
            );
            assert!(predictions.logits[0].is_finite());
        }
    }

    #[test]
    fn the_largest_is_the_first_of_equals_and_a_number() {
        for (values, number) in [
            (&[][..], 0),
            (&[f64::NAN], 0),
            (&[1.0, 3.0, 3.0, 2.0], 1),
            (&[f64::NAN, -1.0, f64::NAN, -0.5], 3),
        ] {
            assert_eq!(largest(values.iter().copied()), number, "{values:?}");
        }
    }

    #[test]
    fn a_window_falls_to_its_ends() {
        assert_eq!(hann(3), [0.0, 1.0, 0.0]);
        let line = hann(15);
        assert!(line[0] == 0.0 && line[14].abs() < 1e-15 && (line[7] - 1.0).abs() < 1e-15);
        assert_eq!(hann_over(&[1.0, 2.0]), [1.0, 2.0, 2.0, 4.0]);
        assert_eq!((change(0.25), change(4.0), change(0.0)), (4.0, 4.0, f64::INFINITY));
    }
}
