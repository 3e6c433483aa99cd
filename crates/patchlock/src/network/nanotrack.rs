//! NanoTrack, versions 2 and 3 (HonglinChu, <https://github.com/HonglinChu/SiamTrackers>): a
//! backbone for template and window, and a head that correlates the two.
//!
//! The rules of [`Family::detect`] are those of SiamRPN (Li et al. 2018, Sec. 4.3) with the numbers
//! that were published with each version.

use super::family::Family;
use super::graph::CheckedGraph;
use super::predictions::{
    Buffers, CellPredictions, CentredBox, Detection, Window, change, hann, hann_over, largest,
};
use super::program::Program;
use super::recognise::{Part, Recogniser};
use super::runtime::Runtime;
use crate::network_error::NetworkError;
use crate::vision::frame::Frame;

/// Sides of the inputs in pixels.
const TEMPLATE: usize = 127;
const SEARCH: usize = 255;
/// Pixels of the window from one cell to the next.
const STRIDE: f64 = 16.0;
/// The part of the target's half perimeter that is added to its sides as context.
const CONTEXT: f64 = 0.5;
/// Rows and columns of the template's features that the head uses.
const KERNEL: usize = 8;

/// Numbers that differ between the versions.
#[derive(Debug, Clone, Copy)]
struct Version {
    name: &'static str,
    /// Cells on a side of the head's outputs, by which the version is recognised.
    cells: usize,
    /// How much the Hann window counts.
    window: f64,
    /// How strongly a change of size or aspect is punished.
    penalty: f64,
    /// How fast the size follows.
    rate: f64,
    /// Slope and offset of the certainty's logit over that of the score: fitted on 40 targets, one
    /// half tried with the numbers of the other (benchmarks/record/committee.md).
    certainty: [f64; 2],
}

const VERSIONS: [Version; 2] = [
    Version {
        name: "NanoTrack v2",
        cells: 16,
        window: 0.490,
        penalty: 0.150,
        rate: 0.385,
        certainty: [0.616, -2.154],
    },
    Version {
        name: "NanoTrack v3",
        cells: 15,
        window: 0.455,
        penalty: 0.138,
        rate: 0.348,
        certainty: [0.485, -1.607],
    },
];

/// How the files are recognised.
pub const RECOGNISER: Recogniser = Recogniser {
    parts: &[
        Part { family: "NanoTrack", name: "backbone" },
        Part { family: "NanoTrack", name: "head" },
    ],
    files: "NanoTrack (a backbone with an input [1, 3, 255, 255] and one output; a head with two \
            inputs [1, C, 8, 8] and [1, C, 16, 16] and outputs of 2 and 4 channels)",
    part,
    build,
};

/// A NanoTrack.
#[derive(Debug)]
struct NanoTrack {
    version: Version,
    template: Program,
    search: Program,
    head: Program,
    /// The Hann window over the cells.
    hann: Vec<f64>,
}

fn part(graph: &CheckedGraph) -> Option<usize> {
    let channels = |values: &[super::onnx::ValueInfo]| -> Vec<Option<i64>> {
        values.iter().map(|value| value.shape().get(1).copied().flatten()).collect()
    };
    match (&channels(&graph.inputs)[..], &channels(&graph.outputs)[..]) {
        ([Some(3)], [_]) => Some(0),
        ([template, search], [Some(2), Some(4)]) if template == search => Some(1),
        _ => None,
    }
}

fn build(graphs: &[CheckedGraph], runtime: &Runtime) -> Result<Box<dyn Family>, NetworkError> {
    let [backbone, head] = graphs else {
        return Err(crate::network_error::graph("it has another part"));
    };
    let damaged = |what: &str, shapes: &[Vec<usize>]| {
        crate::network_error::graph(format!("the outputs of its {what} have the shapes {shapes:?}"))
    };
    let image = |side| [1, 3, side, side];
    let template = Program::new(backbone, &[&image(TEMPLATE)], runtime)?;
    let search = Program::new(backbone, &[&image(SEARCH)], runtime)?;
    let ([small], [large]) = (template.output_shapes(), search.output_shapes()) else {
        return Err(damaged("backbone", search.output_shapes()));
    };
    if small.len() != 4 || small[2..] != [KERNEL; 2] {
        return Err(damaged("backbone", template.output_shapes()));
    }
    let head = Program::new(head, &[small, large], runtime)?;
    let [classes, boxes] = head.output_shapes() else {
        return Err(damaged("head", head.output_shapes()));
    };
    let of = |version: &&Version| {
        let cells = version.cells;
        *classes == [1, 2, cells, cells] && *boxes == [1, 4, cells, cells]
    };
    let version = VERSIONS.iter().find(of).ok_or_else(|| damaged("head", head.output_shapes()))?;
    let hann = hann_over(&hann(version.cells));
    Ok(Box::new(NanoTrack { version: *version, template, search, head, hann }))
}

/// The side of the square with the target and its context, in frame pixels.
fn context([w, h]: [f64; 2]) -> f64 {
    let context = CONTEXT * (w + h);
    ((w + context) * (h + context)).sqrt()
}

impl Family for NanoTrack {
    fn name(&self) -> &'static str {
        self.version.name
    }

    fn template(
        &self,
        frame: &Frame<'_>,
        border: [f32; 3],
        place: CentredBox,
        buffers: &mut Buffers,
    ) -> Result<Vec<f32>, NetworkError> {
        let side = context(place.size);
        Window { centre: place.centre, side, pixels: TEMPLATE }.cut(frame, border, buffers);
        let Buffers { planes, program, features, .. } = buffers;
        self.template.run(&[&planes.samples], program, features)?;
        Ok(features[0].clone())
    }

    fn template_length(&self) -> usize {
        self.template.output_shapes()[0].iter().product()
    }

    fn predict(
        &self,
        frame: &Frame<'_>,
        border: [f32; 3],
        template: &[f32],
        place: CentredBox,
        buffers: &mut Buffers,
    ) -> Result<(), NetworkError> {
        let side = context(place.size) * SEARCH as f64 / TEMPLATE as f64;
        let window = Window { centre: place.centre, side, pixels: SEARCH };
        window.cut(frame, border, buffers);
        let Buffers { planes, program, features, outputs, predictions, .. } = buffers;
        self.search.run(&[&planes.samples], program, features)?;
        outputs.resize_with(2, Vec::new);
        self.head.run(&[template, &features[0]], program, outputs)?;
        decode(&outputs[0], &outputs[1], self.version.cells, &window, place, predictions);
        Ok(())
    }

    fn odds(&self, logit: f64) -> f64 {
        let [slope, offset] = self.version.certainty;
        slope * logit + offset
    }

    fn detect(&self, predictions: &CellPredictions, last: CentredBox) -> Detection {
        self.version.detect(&self.hann, predictions, last)
    }
}

impl Version {
    fn detect(&self, hann: &[f64], predictions: &CellPredictions, last: CentredBox) -> Detection {
        let Self { window, penalty, rate, .. } = *self;
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
        Detection { place: CentredBox { centre: best.centre, size }, score, cell, rate }
    }
}

/// The cells of the head's outputs: two classes, and the distances from a cell to the left, top,
/// right and bottom of the box.
fn decode(
    classes: &[f32],
    boxes: &[f32],
    cells: usize,
    window: &Window,
    last: CentredBox,
    predictions: &mut CellPredictions,
) {
    predictions.clear();
    let count = cells * cells;
    let (Some(classes), Some(boxes)) = (classes.get(..2 * count), boxes.get(..4 * count)) else {
        return;
    };
    let scale = window.scale();
    for k in 0..count {
        let value = |plane: usize| f64::from(boxes[plane * count + k]);
        let cell = [k % cells, k / cells].map(|at| (at as f64 - (cells / 2) as f64) * STRIDE);
        let [left, top, right, bottom] = [value(0), value(1), value(2), value(3)];
        let offset = [cell[0] + (right - left) / 2.0, cell[1] + (bottom - top) / 2.0];
        let centre = [0, 1].map(|axis| window.centre[axis] + scale * offset[axis]);
        let place = CentredBox { centre, size: [(left + right) * scale, (top + bottom) * scale] };
        let logit = f64::from(classes[count + k]) - f64::from(classes[k]);
        predictions.push(logit, place, last);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WINDOW: Window = Window { centre: [50.0, 40.0], side: 510.0, pixels: 255 };
    const LAST: CentredBox = CentredBox { centre: [50.0, 40.0], size: [20.0, 30.0] };

    fn predict(logit: impl Fn(usize) -> f32, sides: [f32; 4]) -> CellPredictions {
        let count = 15 * 15;
        let classes: Vec<f32> =
            (0..2 * count).map(|k| if k < count { 0.0 } else { logit(k - count) }).collect();
        let boxes: Vec<f32> = (0..4 * count).map(|k| sides[k / count]).collect();
        let mut predictions = CellPredictions::default();
        decode(&classes, &boxes, 15, &WINDOW, LAST, &mut predictions);
        predictions
    }

    #[test]
    fn cells_are_decoded_into_the_frame() {
        let predictions = predict(|_| 0.0, [5.0, 7.0, 5.0, 9.0]);
        assert_eq!(predictions.places.len(), 225);
        assert_eq!(predictions.scores[0], 0.5);
        let middle = predictions.places[7 * 15 + 7];
        assert_eq!(middle, CentredBox { centre: [50.0, 42.0], size: [20.0, 32.0] });
        assert_eq!(predictions.places[7 * 15 + 9].centre, [50.0 + 2.0 * 16.0 * 2.0, 42.0]);
    }

    /// The cell in the middle of 15 x 15, one in its row near the border, and a corner.
    const MIDDLE: usize = 112;
    const SIDE: usize = 118;
    const CORNER: usize = 0;

    /// What NanoTrack v3 makes of a look in which all cells see the last place with no score, but
    /// for these.
    fn detected(cells: &[(usize, f64, CentredBox)]) -> Detection {
        let (mut places, mut scores) = (vec![LAST; 225], vec![0.0; 225]);
        for &(cell, score, place) in cells {
            (scores[cell], places[cell]) = (score, place);
        }
        let predictions = CellPredictions { scores, logits: vec![0.0; 225], places };
        VERSIONS[1].detect(&hann_over(&hann(15)), &predictions, LAST)
    }

    fn sized(w: f64, h: f64) -> CentredBox {
        CentredBox { centre: [90.0, 10.0], size: [w, h] }
    }

    #[test]
    fn the_chosen_cell_follows_from_score_window_and_penalty() {
        let same = sized(20.0, 30.0);
        for (cells, chosen, why) in [
            (&[][..], MIDDLE, "the window alone decides"),
            (&[(CORNER, 0.8, same)], MIDDLE, ".8 x .545 is below .455"),
            (&[(CORNER, 0.9, same)], CORNER, ".9 x .545 is above .455"),
            (&[(CORNER, 0.9, same), (MIDDLE, 0.2, same)], MIDDLE, "the window and some score"),
            (&[(CORNER, 0.9, sized(40.0, 60.0))], MIDDLE, "twice the size is punished"),
            (&[(CORNER, 0.9, sized(30.0, 20.0))], MIDDLE, "another aspect is punished"),
            (&[(SIDE, 0.9, same), (CORNER, 0.9, same)], SIDE, "the window between equals"),
            (&[(1, 0.9, same), (CORNER, 0.9, same)], CORNER, "the first of equals"),
        ] {
            assert_eq!(detected(cells).cell, chosen, "{why}");
        }
    }

    #[test]
    fn the_place_moves_fully_and_the_size_in_part() {
        let same = detected(&[(MIDDLE, 1.0, sized(20.0, 30.0))]);
        assert_eq!((same.place, same.score), (sized(20.0, 30.0), 1.0));
        // Twice the size: the penalty is exp(-.138).
        let twice = detected(&[(MIDDLE, 0.5, sized(40.0, 60.0))]);
        let rate = (-0.138_f64).exp() * 0.5 * 0.348;
        let [w, h] = twice.place.size;
        assert!(
            (w - (20.0 + 20.0 * rate)).abs() < 1e-12 && (h - (30.0 + 30.0 * rate)).abs() < 1e-12
        );
        assert_eq!((twice.place.centre, twice.score), ([90.0, 10.0], 0.5));
        // Half of it is punished as much.
        let half = detected(&[(MIDDLE, 0.5, sized(10.0, 15.0))]);
        assert!((half.place.size[0] - (20.0 - 10.0 * rate)).abs() < 1e-12);
    }

    #[test]
    fn sizes_of_every_magnitude_give_finite_places() {
        for side in [f64::MIN_POSITIVE, 1e-300, 1e-12, 1e12, 1e300, f64::MAX] {
            for place in [sized(side, side), sized(side, 1.0), sized(1.0, side)] {
                let detected = detected(&[(MIDDLE, 1.0, place)]);
                assert!(detected.place.size.iter().all(|side| side.is_finite()), "{place:?}");
                assert!(detected.cell < 225 && detected.score.is_finite());
            }
        }
    }

    #[test]
    fn damaged_outputs_are_the_old_place_with_no_score() {
        let predictions = predict(|_| f32::NAN, [f32::INFINITY, 7.0, 5.0, -9.0]);
        assert!(predictions.places.iter().all(|place| *place == LAST));
        assert!(predictions.scores.iter().all(|&score| score == 0.0));
    }
}
