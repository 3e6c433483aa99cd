//! VitTrack (OpenCV Zoo, `object_tracking_vittrack`): one small vision transformer that reads the
//! template's and the window's pixels together.

use super::error::NetworkError;
use super::family::{Family, Part, Recogniser};
use super::graph::CheckedGraph;
use super::look::{Buffers, Look, Place, Settled, Window, hann, largest, logistic};
use super::program::Program;
use super::runtime::Runtime;
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
        return Err(super::error::graph(format!("its outputs have the shapes {shapes:?}")));
    }
    // The window without its ends, which are 0.
    let line = hann(CELLS + 2);
    let line = &line[1..=CELLS];
    let hann = line.iter().flat_map(|y| line.iter().map(move |x| y * x)).collect();
    Ok(Box::new(VitTrack { network, hann }))
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
        place: Place,
        buffers: &mut Buffers,
    ) -> Result<Vec<f32>, NetworkError> {
        let side = TEMPLATE_SIDE * root(place.size);
        Window { centre: place.centre, side, pixels: TEMPLATE }.cut(frame, BORDER, buffers);
        normalise(&mut buffers.planes.samples);
        Ok(buffers.planes.samples.clone())
    }

    fn template_length(&self) -> usize {
        3 * TEMPLATE * TEMPLATE
    }

    fn look(
        &self,
        frame: &Frame<'_>,
        _: [f32; 3],
        template: &[f32],
        place: Place,
        buffers: &mut Buffers,
    ) -> Result<(), NetworkError> {
        let side = SEARCH_SIDE * root(place.size);
        let window = Window { centre: place.centre, side, pixels: SEARCH };
        window.cut(frame, BORDER, buffers);
        let Buffers { planes, program, outputs, look, .. } = buffers;
        normalise(&mut planes.samples);
        outputs.resize_with(3, Vec::new);
        self.network.run(&[template, &planes.samples], program, outputs)?;
        decode(outputs, &window, place, look);
        Ok(())
    }

    fn certainty(&self, logit: f64) -> f64 {
        logistic(CERTAINTY[0] * logit + CERTAINTY[1])
    }

    fn settle(&self, look: &Look, last: Place) -> Settled {
        let cell = largest(look.scores.iter().zip(&self.hann).map(|(score, hann)| score * hann));
        let score = look.scores[cell];
        let place = if score < KEPT_BELOW { last } else { look.places[cell] };
        Settled { place, score, cell }
    }
}

/// The cells of the outputs: scores, sizes and offsets, relative to the window.
fn decode(outputs: &[Vec<f32>], window: &Window, last: Place, look: &mut Look) {
    look.clear();
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
        let place = Place { centre, size: size.map(|side| side * window.side) };
        let score = f64::from(scores[k]);
        look.push((score / (1.0 - score)).ln(), place, last);
    }
}
