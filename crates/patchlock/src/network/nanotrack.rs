//! NanoTrack, versions 2 and 3 (HonglinChu, <https://github.com/HonglinChu/SiamTrackers>), and
//! PatchNet, our own network, which `training/` makes: a backbone for template and window, and a head
//! that correlates the two.
//!
//! The numbers of [`Selection`] are those that were published with each version of NanoTrack. Those
//! of PatchNet were chosen on development targets.

use super::family::{Family, FeatureMap, TemplateUpdate};
use super::graph::CheckedGraph;
use super::predictions::{
    Buffers, CellPredictions, CentredBox, Detection, Window, hann, hann_over,
};
use super::program::Program;
use super::recognise::{Part, Recogniser};
use super::runtime::Runtime;
use super::selection::{Selection, context};
use crate::network_error::NetworkError;
use crate::vision::frame::Frame;
use crate::vision::geometry::Point;

/// Rows and columns of the template's features that the head uses.
const KERNEL: usize = 8;

/// What pictures a network reads, and how its cells lie in them.
#[derive(Debug)]
struct Layout {
    /// Side of the template in pixels: the square with the target and its context.
    template: usize,
    /// Side of the window in pixels, at the scale of the template.
    search: usize,
    /// Pixels of the window from one cell to the next.
    stride: f64,
    /// Channels of the score: those of background and target, or one logit.
    classes: usize,
    /// Whether the middle of the window is between its cells, if their number is even, and a window
    /// is centred on the target's centre and not half a pixel beyond it.
    symmetric: bool,
}

const NANOTRACK: Layout =
    Layout { template: 127, search: 255, stride: 16.0, classes: 2, symmetric: false };
const PATCHNET: Layout =
    Layout { template: 64, search: 128, stride: 8.0, classes: 1, symmetric: true };

/// Numbers that differ between the versions.
#[derive(Debug, Clone, Copy)]
struct Version {
    name: &'static str,
    /// What pictures it reads.
    layout: &'static Layout,
    /// Cells on a side of the head's outputs, by which the version is recognised.
    cells: usize,
    /// How a cell is chosen.
    selection: Selection,
    /// Slope and offset of the certainty's logit over that of the score: fitted on development
    /// targets, one half tried with the numbers of the other (benchmarks/record/committee.md).
    certainty: [f64; 2],
    /// How its template is updated. With it, a classifier learns from its features; without, it is used
    /// as published.
    update: Option<TemplateUpdate>,
}

const VERSIONS: [Version; 3] = [
    Version {
        name: "NanoTrack v2",
        layout: &NANOTRACK,
        cells: 16,
        selection: Selection { window: 0.490, penalty: 0.150, rate: 0.385 },
        certainty: [0.616, -2.154],
        update: None,
    },
    Version {
        name: "NanoTrack v3",
        layout: &NANOTRACK,
        cells: 15,
        selection: Selection { window: 0.455, penalty: 0.138, rate: 0.348 },
        certainty: [0.485, -1.607],
        update: None,
    },
    Version {
        name: "PatchNet",
        layout: &PATCHNET,
        cells: 16,
        selection: Selection { window: 0.3, penalty: 0.2, rate: 0.1 },
        certainty: [2.06, 2.53],
        update: Some(TemplateUpdate { share: 0.3, rate: 0.05, min_score: 0.3 }),
    },
];

/// How the files are recognised.
pub const RECOGNISER: Recogniser = Recogniser {
    parts: &[
        Part { family: "NanoTrack", name: "backbone" },
        Part { family: "NanoTrack", name: "head" },
    ],
    files: "NanoTrack (a backbone with an input [1, 3, 255, 255] and one output; a head with two \
            inputs [1, C, 8, 8] and [1, C, 16, 16] and outputs of 2 and 4 channels), or PatchNet, \
            whose head has outputs of 1 and 4 channels",
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
        ([template, search], [Some(1 | 2), Some(4)]) if template == search => Some(1),
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
    let classes = head.outputs.first().and_then(|output| output.shape().get(1).copied().flatten());
    let layout = if classes == Some(1) { &PATCHNET } else { &NANOTRACK };
    let image = |side| [1, 3, side, side];
    let template = Program::new(backbone, &[&image(layout.template)], runtime)?;
    let search = Program::new(backbone, &[&image(layout.search)], runtime)?;
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
        let Version { layout, cells, .. } = **version;
        *classes == [1, layout.classes, cells, cells] && *boxes == [1, 4, cells, cells]
    };
    let version = VERSIONS.iter().find(of).ok_or_else(|| damaged("head", head.output_shapes()))?;
    let hann = hann_over(&version.window());
    Ok(Box::new(NanoTrack { version: *version, template, search, head, hann }))
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
        out: &mut Vec<f32>,
    ) -> Result<(), NetworkError> {
        self.version.layout.template_window(place).cut(frame, border, buffers);
        let Buffers { planes, program, features, .. } = buffers;
        self.template.run(&[&planes.samples], program, features)?;
        out.clone_from(&features[0]);
        Ok(())
    }

    fn template_length(&self) -> usize {
        self.template.output_shapes()[0].iter().product()
    }

    fn template_update(&self) -> Option<TemplateUpdate> {
        self.version.update
    }

    fn channels(&self) -> Option<usize> {
        let cells = self.version.cells;
        match self.search.output_shapes()[0][..] {
            [1, channels, rows, columns] if rows == cells && columns == cells => {
                self.version.update.map(|_| channels)
            }
            _ => None,
        }
    }

    fn features<'a>(&self, buffers: &'a Buffers, place: CentredBox) -> Option<FeatureMap<'a>> {
        let Version { layout, cells: side, .. } = self.version;
        let spacing = layout.stride * layout.search_window(place).scale();
        self.channels().map(|_| FeatureMap { planes: &buffers.features[0], side, spacing })
    }

    fn read_window(
        &self,
        frame: &Frame<'_>,
        border: [f32; 3],
        place: CentredBox,
        buffers: &mut Buffers,
    ) -> Result<(), NetworkError> {
        self.version.layout.search_window(place).cut(frame, border, buffers);
        let Buffers { planes, program, features, .. } = buffers;
        self.search.run(&[&planes.samples], program, features)
    }

    fn compare(
        &self,
        template: &[f32],
        place: CentredBox,
        buffers: &mut Buffers,
    ) -> Result<(), NetworkError> {
        let Buffers { program, features, outputs, predictions, .. } = buffers;
        outputs.resize_with(2, Vec::new);
        self.head.run(&[template, &features[0]], program, outputs)?;
        let [classes, boxes] = [0, 1].map(|k| outputs[k].as_slice());
        self.version.decode(classes, boxes, place, predictions);
        Ok(())
    }

    fn odds(&self, logit: f64) -> f64 {
        let [slope, offset] = self.version.certainty;
        slope * logit + offset
    }

    fn detect(&self, predictions: &CellPredictions, last: CentredBox) -> Detection {
        self.version.selection.detect(&self.hann, predictions, last)
    }
}

impl Layout {
    /// The part of the frame that the template shows.
    fn template_window(&self, place: CentredBox) -> Window {
        let (centre, side) = (self.column_of(place), context(place.size));
        Window { centre, side, pixels: self.template }
    }

    /// The part of the frame in which the target is searched.
    fn search_window(&self, place: CentredBox) -> Window {
        let side = context(place.size) * self.search as f64 / self.template as f64;
        Window { centre: self.column_of(place), side, pixels: self.search }
    }

    /// Column and row of the frame on which the window of a place is centred.
    fn column_of(&self, place: CentredBox) -> Point {
        let shift = if self.symmetric { 0.5 } else { 0.0 };
        place.centre.map(|at| at - shift)
    }
}

impl Version {
    /// The Hann window along a line of cells; a symmetric one without its ends, which are 0.
    fn window(&self) -> Vec<f64> {
        match self.layout.symmetric {
            true => hann(self.cells + 2)[1..=self.cells].to_vec(),
            false => hann(self.cells),
        }
    }

    /// The cells of the head's outputs for the window around the last place: the score, and the
    /// distances from a cell to the left, top, right and bottom of the box.
    fn decode(
        &self,
        classes: &[f32],
        boxes: &[f32],
        last: CentredBox,
        predictions: &mut CellPredictions,
    ) {
        predictions.clear();
        let Self { layout, cells, .. } = *self;
        let count = cells * cells;
        let (Some(classes), Some(boxes)) =
            (classes.get(..layout.classes * count), boxes.get(..4 * count))
        else {
            return;
        };
        let scale = layout.search_window(last).scale();
        let middle = if layout.symmetric { (cells - 1) as f64 / 2.0 } else { (cells / 2) as f64 };
        for k in 0..count {
            let value = |plane: usize| f64::from(boxes[plane * count + k]);
            let cell = [k % cells, k / cells].map(|at| (at as f64 - middle) * layout.stride);
            let [left, top, right, bottom] = [0, 1, 2, 3].map(value);
            let offset = [cell[0] + (right - left) / 2.0, cell[1] + (bottom - top) / 2.0];
            let centre = [0, 1].map(|axis| last.centre[axis] + scale * offset[axis]);
            let size = [(left + right) * scale, (top + bottom) * scale];
            let logit = match layout.classes {
                1 => f64::from(classes[k]),
                _ => f64::from(classes[count + k]) - f64::from(classes[k]),
            };
            predictions.push(logit, CentredBox { centre, size }, last);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAST: CentredBox = CentredBox { centre: [50.0, 40.0], size: [20.0, 30.0] };
    /// A pixel of the template is two of the frame.
    const LARGE: CentredBox = CentredBox { centre: [50.0, 40.0], size: [127.0, 127.0] };

    fn predict(logit: impl Fn(usize) -> f32, sides: [f32; 4]) -> CellPredictions {
        let count = 15 * 15;
        let classes: Vec<f32> =
            (0..2 * count).map(|k| if k < count { 0.0 } else { logit(k - count) }).collect();
        let boxes: Vec<f32> = (0..4 * count).map(|k| sides[k / count]).collect();
        let mut predictions = CellPredictions::default();
        VERSIONS[1].decode(&classes, &boxes, LARGE, &mut predictions);
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
        VERSIONS[1].selection.detect(&hann_over(&hann(15)), &predictions, LAST)
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
        assert!(predictions.places.iter().all(|place| *place == LARGE));
        assert!(predictions.scores.iter().all(|&score| score == 0.0));
    }

    #[test]
    fn the_cells_of_patchnet_lie_around_the_middle_of_its_window() {
        let boxes: Vec<f32> = (0..4 * 256).map(|k| [5.0, 7.0, 5.0, 9.0][k / 256]).collect();
        let last = CentredBox { size: [64.0, 64.0], ..LARGE };
        let mut predictions = CellPredictions::default();
        VERSIONS[2].decode(&[2.0; 256], &boxes, last, &mut predictions);
        let place = |row: usize, column: usize| predictions.places[row * 16 + column];
        // A pixel of the window is two of the frame, and a cell 8 pixels of the window.
        let expected = CentredBox { centre: [58.0, 50.0], size: [20.0, 32.0] };
        assert_eq!((place(8, 8), predictions.logits[0]), (expected, 2.0));
        assert_eq!((place(7, 7).centre, place(8, 10).centre), ([42.0, 34.0], [90.0, 50.0]));
        let window = PATCHNET.search_window(last);
        assert_eq!((window.centre, window.scale()), ([49.5, 39.5], 2.0));
    }
}
