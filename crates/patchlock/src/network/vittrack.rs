//! VitTrack (OpenCV Zoo, `object_tracking_vittrack`): one small vision transformer that reads the
//! template's and the window's pixels together.

use super::family::Family;
use super::graph::CheckedGraph;
use super::predictions::{
    Buffers, CellPredictions, CentredBox, Detection, Window, hann, hann_over, largest,
};
use super::program::Program;
use super::recognise::{Part, Recogniser};
use super::runtime::Runtime;
use crate::network_error::NetworkError;
use crate::vision::frame::Frame;

/// Sides of the inputs in pixels, and of the windows in roots of the target's area.
const TEMPLATE: usize = 128;
const TEMPLATE_SIDE: f64 = 2.0;
const SEARCH: usize = 256;
const SEARCH_SIDE: f64 = 4.0;
/// Mean and standard deviation of ImageNet's red, green and blue.
const MEAN: [f32; 3] = [0.485, 0.456, 0.406];
const DEVIATION: [f32; 3] = [0.229, 0.224, 0.225];
/// The colour beyond the frame's border: black.
const BORDER: [f32; 3] = [0.0; 3];
/// Cells on a side of the outputs.
const CELLS: usize = 16;
/// Slope and offset of the certainty's logit over that of the score: fitted as NanoTrack's.
const CERTAINTY: [f64; 2] = [3.034, 0.934];
/// Below this score, the box stays where it was.
const KEPT_BELOW: f64 = 0.2;

/// How the file is recognised.
pub const RECOGNISER: Recogniser = Recogniser {
    parts: &[Part { family: "VitTrack", name: "network" }],
    files: "VitTrack (one file with the inputs [1, 3, 128, 128] and [1, 3, 256, 256] and outputs \
            of 1, 2 and 2 channels)",
    part,
    build,
};

/// A VitTrack.
#[derive(Debug)]
struct VitTrack {
    network: Program,
    /// The Hann window over the cells.
    hann: Vec<f64>,
}

fn part(graph: &CheckedGraph) -> Option<usize> {
    let shapes = |values: &[super::onnx::ValueInfo]| -> Vec<Vec<Option<i64>>> {
        values.iter().map(super::onnx::ValueInfo::shape).collect()
    };
    let image = |side: usize| [1, 3, side as i64, side as i64].map(Some).to_vec();
    let map = |channels| [1, channels, CELLS as i64, CELLS as i64].map(Some).to_vec();
    let inputs = shapes(&graph.inputs) == [image(TEMPLATE), image(SEARCH)];
    (inputs && shapes(&graph.outputs) == [map(1), map(2), map(2)]).then_some(0)
}

fn build(graphs: &[CheckedGraph], runtime: &Runtime) -> Result<Box<dyn Family>, NetworkError> {
    let image = |side| [1, 3, side, side];
    let network = Program::new(&graphs[0], &[&image(TEMPLATE), &image(SEARCH)], runtime)?;
    let map = |channels| vec![1, channels, CELLS, CELLS];
    if network.output_shapes() != [map(1), map(2), map(2)] {
        let shapes = network.output_shapes();
        return Err(crate::network_error::graph(format!("its outputs have the shapes {shapes:?}")));
    }
    Ok(Box::new(VitTrack { network, hann: window() }))
}

/// The Hann window over the cells, without its ends, which are 0.
fn window() -> Vec<f64> {
    hann_over(&hann(CELLS + 2)[1..=CELLS])
}

/// Scales samples as the network was trained.
fn normalise(samples: &mut [f32]) {
    let plane = samples.len() / 3;
    for (samples, (mean, deviation)) in
        samples.chunks_exact_mut(plane.max(1)).zip(MEAN.iter().zip(&DEVIATION))
    {
        samples.iter_mut().for_each(|sample| *sample = (*sample / 255.0 - mean) / deviation);
    }
}

fn root([w, h]: [f64; 2]) -> f64 {
    (w * h).sqrt()
}

impl Family for VitTrack {
    fn name(&self) -> &'static str {
        "VitTrack"
    }

    fn template(
        &self,
        frame: &Frame<'_>,
        _: [f32; 3],
        place: CentredBox,
        buffers: &mut Buffers,
        out: &mut Vec<f32>,
    ) -> Result<(), NetworkError> {
        let side = TEMPLATE_SIDE * root(place.size);
        Window { centre: place.centre, side, pixels: TEMPLATE }.cut(frame, BORDER, buffers);
        normalise(&mut buffers.planes.samples);
        out.clone_from(&buffers.planes.samples);
        Ok(())
    }

    fn template_length(&self) -> usize {
        3 * TEMPLATE * TEMPLATE
    }

    fn read_window(
        &self,
        frame: &Frame<'_>,
        _: [f32; 3],
        place: CentredBox,
        buffers: &mut Buffers,
    ) -> Result<(), NetworkError> {
        search_window(place).cut(frame, BORDER, buffers);
        normalise(&mut buffers.planes.samples);
        Ok(())
    }

    fn compare(
        &self,
        template: &[f32],
        place: CentredBox,
        buffers: &mut Buffers,
    ) -> Result<(), NetworkError> {
        let Buffers { planes, program, outputs, predictions, .. } = buffers;
        outputs.resize_with(3, Vec::new);
        self.network.run(&[template, &planes.samples], program, outputs)?;
        decode(outputs, &search_window(place), place, predictions);
        Ok(())
    }

    fn odds(&self, logit: f64) -> f64 {
        CERTAINTY[0] * logit + CERTAINTY[1]
    }

    fn detect(&self, predictions: &CellPredictions, last: CentredBox) -> Detection {
        detect(&self.hann, predictions, last)
    }
}

/// The part of the frame in which the target is searched.
fn search_window(place: CentredBox) -> Window {
    Window { centre: place.centre, side: SEARCH_SIDE * root(place.size), pixels: SEARCH }
}

fn detect(hann: &[f64], predictions: &CellPredictions, last: CentredBox) -> Detection {
    let cell = largest(predictions.scores.iter().zip(hann).map(|(score, hann)| score * hann));
    let score = predictions.scores[cell];
    let place = if score < KEPT_BELOW { last } else { predictions.places[cell] };
    Detection { place, score, cell }
}

/// The cells of the outputs: scores, sizes and offsets, relative to the window.
fn decode(
    outputs: &[Vec<f32>],
    window: &Window,
    last: CentredBox,
    predictions: &mut CellPredictions,
) {
    predictions.clear();
    let count = CELLS * CELLS;
    let [scores, sizes, offsets] = outputs else { return };
    for k in 0..count {
        let pair = |map: &[f32]| [0, count].map(|plane| f64::from(map[plane + k]));
        let (size, offset) = (pair(sizes), pair(offsets));
        let cell = [k % CELLS, k / CELLS];
        let centre = [0, 1].map(|axis| {
            let at = (cell[axis] as f64 + offset[axis]) / CELLS as f64 - 0.5;
            window.centre[axis] + at * window.side
        });
        let place = CentredBox { centre, size: size.map(|side| side * window.side) };
        let score = f64::from(scores[k]);
        predictions.push((score / (1.0 - score)).ln(), place, last);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WINDOW: Window = Window { centre: [50.0, 40.0], side: 160.0, pixels: SEARCH };
    const LAST: CentredBox = CentredBox { centre: [50.0, 40.0], size: [20.0, 30.0] };
    /// A cell in the middle of 16 x 16, and a corner.
    const MIDDLE: usize = 8 * 16 + 8;
    const CORNER: usize = 0;

    /// A look in which these cells have these scores, sizes and offsets, and all others little.
    fn predict(cells: &[(usize, f32, [f32; 2], [f32; 2])]) -> CellPredictions {
        let count = CELLS * CELLS;
        let (mut scores, mut sizes, mut offsets) =
            (vec![1e-4; count], vec![0.1; 2 * count], vec![0.0; 2 * count]);
        for &(cell, score, size, offset) in cells {
            scores[cell] = score;
            for axis in [0, 1] {
                sizes[axis * count + cell] = size[axis];
                offsets[axis * count + cell] = offset[axis];
            }
        }
        let mut predictions = CellPredictions::default();
        decode(&[scores, sizes, offsets], &WINDOW, LAST, &mut predictions);
        predictions
    }

    #[test]
    fn cells_are_decoded_into_the_frame() {
        let predictions = predict(&[(MIDDLE + 1, 0.75, [0.25, 0.125], [0.5, -1.0])]);
        assert_eq!(
            (predictions.places.len(), predictions.scores.len(), predictions.logits.len()),
            (256, 256, 256)
        );
        // A cell is 10 pixels of the frame; cell (8, 8) begins in the centre.
        assert_eq!(predictions.places[MIDDLE].centre, [50.0, 40.0]);
        let place = predictions.places[MIDDLE + 1];
        assert_eq!((place.centre, place.size), ([65.0, 30.0], [40.0, 20.0]));
        assert!((predictions.scores[MIDDLE + 1] - 0.75).abs() < 1e-12);
        assert!((predictions.logits[MIDDLE + 1] - 3.0_f64.ln()).abs() < 1e-12);
    }

    #[test]
    fn the_chosen_cell_has_the_best_score_under_the_window() {
        let seen = |cell, score| (cell, score, [0.25, 0.125], [0.0; 2]);
        for (cells, chosen, moves, why) in [
            (&[seen(MIDDLE, 0.9)][..], MIDDLE, true, "the best score"),
            (&[seen(MIDDLE, 0.3), seen(CORNER, 0.9)], MIDDLE, true, "the window in the corner"),
            (&[seen(CORNER, 0.9)], CORNER, true, "the only score"),
            (&[seen(MIDDLE, 0.19)], MIDDLE, false, "below .2 the box stays"),
            (&[seen(MIDDLE, 0.21)], MIDDLE, true, "above .2 it moves"),
        ] {
            let predictions = predict(cells);
            let detected = detect(&window(), &predictions, LAST);
            assert_eq!(
                (detected.cell, detected.score),
                (chosen, predictions.scores[chosen]),
                "{why}"
            );
            assert_eq!(
                detected.place,
                if moves { predictions.places[chosen] } else { LAST },
                "{why}"
            );
        }
    }

    #[test]
    fn damaged_outputs_are_the_old_place_with_no_score() {
        let bad = [f32::NAN, f32::INFINITY, -1.0, 2.0];
        let cells = bad.map(|bad| (MIDDLE, bad, [bad, -bad], [f32::NAN; 2]));
        for cell in cells {
            let predictions = predict(&[cell]);
            assert_eq!(
                (predictions.places[MIDDLE], predictions.scores[MIDDLE]),
                (LAST, 0.0),
                "{cell:?}"
            );
        }
    }
}
