//! Colour histograms of the target and of what is around it, and the map of where the target's
//! colours are: Bertinetto, Valmadre, Golodetz, Miksik and Torr, "Staple: complementary learners
//! for real-time tracking" (2016), Sec. 3.3 and 3.5. Unlike theirs, the histogram of the
//! surroundings learns much faster than that of the target: all of the surroundings are in sight on
//! every frame, and they change as camera and target move.

use super::fhog::CELL;
use crate::vision::crop::Planes;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Levels of each of red, green and blue.
const LEVELS: usize = 16;

/// Number of colours of a histogram.
const BINS: usize = LEVELS * LEVELS * LEVELS;

/// A strip along the border of the box, this share of its mean side wide, is left out of both
/// histograms: it often shows some of each.
const BORDER: f64 = 0.1;

/// The surroundings reach this far from the box, in mean sides of it.
const REACH: f64 = 1.0;

/// Added to the frequencies: a colour that was never seen is not attributed to the target.
const UNSEEN: f32 = 1e-3;

/// How often each colour occurs in the target and around it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Histograms {
    target: Vec<f32>,
    around: Vec<f32>,
    /// The mean likelihood over the target's pixels, less that over those around it: from -1 to 1.
    contrast: f32,
}

/// Learning rates of the histograms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rates {
    /// Of the target.
    pub target: f32,
    /// Of what is around it.
    pub around: f32,
}

/// Buffers of the histograms and the map.
#[derive(Debug, Default)]
pub struct MapScratch {
    target: Vec<f32>,
    around: Vec<f32>,
    likelihoods: Vec<f32>,
    /// Of the likelihoods in the rectangle from the first pixel to before this one.
    sums: Vec<f32>,
    map: Vec<f32>,
}

impl Histograms {
    /// Histograms that have learnt the target in the middle of a patch; `size` is its width and
    /// height there.
    pub fn begin(patch: &Planes, size: [f64; 2], scratch: &mut MapScratch) -> Self {
        let none = || vec![0.0; BINS];
        let mut histograms = Self { target: none(), around: none(), contrast: 0.0 };
        histograms.learn(patch, size, Rates { target: 1.0, around: 1.0 }, scratch);
        histograms
    }

    /// Whether every number is one that learning can lead to.
    pub fn is_sound(&self) -> bool {
        let sound = |counts: &[f32]| {
            counts.len() == BINS && counts.iter().all(|count| (0.0..=1.001).contains(count))
        };
        sound(&self.target) && sound(&self.around) && self.contrast.is_finite()
    }

    /// The mean likelihood over the target's pixels, less that over those around it: from -1,
    /// through 0 where colour tells nothing, to 1.
    pub fn contrast(&self) -> f32 {
        self.contrast
    }

    /// Learns the target in the middle of a patch.
    pub fn learn(
        &mut self,
        patch: &Planes,
        size: [f64; 2],
        rates: Rates,
        scratch: &mut MapScratch,
    ) {
        let MapScratch { target, around, .. } = scratch;
        let border = BORDER * (size[0] + size[1]) / 2.0;
        let reach = REACH * (size[0] + size[1]) / 2.0;
        count(patch, grown(patch, size, -border), None, target);
        count(patch, grown(patch, size, reach), Some(grown(patch, size, 0.0)), around);
        blend(&mut self.target, target, rates.target);
        blend(&mut self.around, around, rates.around);
        let bins = self.target.iter().zip(&self.around);
        self.contrast = bins.map(|(&t, &a)| likelihood(t, a) * (t - a)).sum();
    }

    /// The map of where the target's colours are, for a target of this width and height in pixels
    /// of the patch: for each displacement in cells, in the order of a response, the mean
    /// likelihood of the box there, from 0 to 1.
    pub fn map<'a>(
        &self,
        patch: &Planes,
        size: [f64; 2],
        scratch: &'a mut MapScratch,
    ) -> &'a [f32] {
        let MapScratch { likelihoods, sums, map, .. } = scratch;
        likelihoods.clear();
        likelihoods.extend(self.target.iter().zip(&self.around).map(|(&t, &a)| likelihood(t, a)));
        fill_sums(patch, likelihoods, sums);
        let (columns, rows) = (patch.width / CELL, patch.height / CELL);
        map.clear();
        for row in 0..rows {
            let y = span(row, rows, patch.height, size[1]);
            for column in 0..columns {
                let x = span(column, columns, patch.width, size[0]);
                let at = |y: usize, x: usize| sums[y * (patch.width + 1) + x];
                let sum = at(y.end, x.end) - at(y.start, x.end) - at(y.end, x.start)
                    + at(y.start, x.start);
                map.push(sum / (y.len() * x.len()) as f32);
            }
        }
        map
    }
}

/// How likely a colour is the target's, from how often it occurs in the target and around it.
fn likelihood(target: f32, around: f32) -> f32 {
    target / (target + around + UNSEEN)
}

/// The columns and rows of a box of this size in the middle of a patch, grown by this much on each
/// side.
fn grown(patch: &Planes, size: [f64; 2], by: f64) -> [Range<usize>; 2] {
    let range = |side: usize, length: f64| {
        let (middle, reach) = ((side as f64 - 1.0) / 2.0, (length / 2.0 + by).max(1.0));
        let first = (middle - reach).ceil().max(0.0) as usize;
        first..side - first
    };
    [range(patch.width, size[0]), range(patch.height, size[1])]
}

/// The share of each colour among the pixels of a box that do not lie in the other.
fn count(
    patch: &Planes,
    [x, y]: [Range<usize>; 2],
    without: Option<[Range<usize>; 2]>,
    out: &mut Vec<f32>,
) {
    out.clear();
    out.resize(BINS, 0.0);
    let planes = patch.rgb();
    let mut total = 0;
    for row in y {
        let hole = match &without {
            Some([x, y]) if y.contains(&row) => x.clone(),
            _ => x.end..x.end,
        };
        for column in (x.start..hole.start).chain(hole.end..x.end) {
            out[bin(planes, row * patch.width + column)] += 1.0;
            total += 1;
        }
    }
    let share = 1.0 / total.max(1) as f32;
    out.iter_mut().for_each(|count| *count *= share);
}

fn blend(learnt: &mut [f32], new: &[f32], rate: f32) {
    learnt.iter_mut().zip(new).for_each(|(learnt, new)| *learnt += rate * (new - *learnt));
}

/// Sums of the likelihoods over all rectangles that begin at the first pixel.
fn fill_sums(patch: &Planes, likelihoods: &[f32], sums: &mut Vec<f32>) {
    let (width, planes) = (patch.width, patch.rgb());
    sums.clear();
    sums.resize((width + 1) * (patch.height + 1), 0.0);
    for y in 0..patch.height {
        let (above, below) = sums[y * (width + 1)..][..2 * (width + 1)].split_at_mut(width + 1);
        let mut row = 0.0;
        for x in 0..width {
            row += likelihoods[bin(planes, y * width + x)];
            below[x + 1] = above[x + 1] + row;
        }
    }
}

/// The pixels along one axis of a box of this length that is displaced by this cell of a response.
fn span(cell: usize, cells: usize, side: usize, length: f64) -> Range<usize> {
    let cell = if cell < cells.div_ceil(2) { cell as f64 } else { cell as f64 - cells as f64 };
    let middle = side as f64 / 2.0 + cell * CELL as f64;
    let edge = |at: f64| at.round().clamp(0.0, side as f64) as usize;
    let start = edge(middle - length / 2.0).min(side - 1);
    start..edge(middle + length / 2.0).max(start + 1)
}

/// The bin of a pixel's colour.
fn bin(planes: [&[f32]; 3], pixel: usize) -> usize {
    let level = |plane: &[f32]| ((plane[pixel] * (LEVELS as f32 / 256.0)) as usize).min(LEVELS - 1);
    let [red, green, blue] = planes.map(level);
    (red * LEVELS + green) * LEVELS + blue
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: usize = 64;

    /// A patch that is blue but for a red box, whose middle is displaced by this many pixels.
    fn patch(size: [f64; 2], shift: [f64; 2]) -> Planes {
        let middle = (SIDE as f64 - 1.0) / 2.0;
        let inside = |k: usize| {
            let at = [(k % SIDE) as f64, (k / SIDE) as f64];
            (0..2).all(|axis| (at[axis] - middle - shift[axis]).abs() < size[axis] / 2.0)
        };
        let plane =
            |red: bool| (0..SIDE * SIDE).map(move |k| if inside(k) == red { 250.0 } else { 5.0 });
        let samples = plane(true).chain((0..SIDE * SIDE).map(|_| 0.0)).chain(plane(false));
        Planes { width: SIDE, height: SIDE, channels: 3, samples: samples.collect() }
    }

    #[test]
    fn the_map_is_largest_where_the_colours_are() {
        let (size, scratch) = ([16.0, 8.0], &mut MapScratch::default());
        let histograms = Histograms::begin(&patch(size, [0.0; 2]), size, scratch);
        assert!(histograms.contrast() > 0.99);
        let map = histograms.map(&patch(size, [12.0, -8.0]), size, scratch);
        let cells = SIDE / CELL;
        let best = (0..cells * cells).max_by(|&a, &b| map[a].total_cmp(&map[b]));
        // Three cells to the right and two up.
        assert_eq!(best, Some((cells - 2) * cells + 3));
        assert!(map[best.unwrap()] > 0.99);
        assert!(map[0] < 0.2);
    }

    #[test]
    fn the_map_holds_the_means_over_boxes() {
        let (size, scratch) = ([10.0, 14.0], &mut MapScratch::default());
        let seen = patch([20.0, 6.0], [3.0, 5.0]);
        let histograms = Histograms::begin(&seen, size, scratch);
        let map = histograms.map(&seen, size, scratch);
        let (cells, planes) = (SIDE / CELL, seen.rgb());
        assert_eq!(map.len(), cells * cells);
        for (cell, value) in map.iter().enumerate() {
            let (x, y) = (
                span(cell % cells, cells, SIDE, size[0]),
                span(cell / cells, cells, SIDE, size[1]),
            );
            let pixels = y.flat_map(|y| x.clone().map(move |x| y * SIDE + x));
            let values: Vec<f32> = pixels
                .map(|k| bin(planes, k))
                .map(|k| likelihood(histograms.target[k], histograms.around[k]))
                .collect();
            let mean = values.iter().sum::<f32>() / values.len() as f32;
            assert!((value - mean).abs() < 1e-3, "{cell}");
        }
    }

    #[test]
    fn a_colour_that_comes_into_the_surroundings_is_no_longer_the_targets() {
        let (size, scratch) = ([16.0, 16.0], &mut MapScratch::default());
        let mut histograms = Histograms::begin(&patch(size, [0.0; 2]), size, scratch);
        let all_red = patch([1000.0; 2], [0.0; 2]);
        for _ in 0..10 {
            histograms.learn(&all_red, size, Rates { target: 0.04, around: 0.3 }, scratch);
        }
        assert!(histograms.contrast().abs() < 0.05, "{}", histograms.contrast());
        assert!(histograms.is_sound());
    }

    #[test]
    fn grey_has_histograms_too() {
        let (size, scratch) = ([16.0, 16.0], &mut MapScratch::default());
        let grey = Planes {
            channels: 1,
            samples: patch(size, [0.0; 2]).plane(0).to_vec(),
            ..patch(size, [0.0; 2])
        };
        assert!(Histograms::begin(&grey, size, scratch).contrast() > 0.99);
    }
}
