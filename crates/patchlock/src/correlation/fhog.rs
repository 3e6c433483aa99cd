//! Histograms of oriented gradients with 31 channels per cell, after Felzenszwalb, Girshick, McAllester and
//! Ramanan, "Object detection with discriminatively trained part-based models" (2010), in the variant that
//! correlation filter trackers use: each gradient votes for its nearest orientation and for four cells.

use crate::numeric::instructions::Instructions;
use crate::vision::crop::Planes;
use pulp::{Simd, WithSimd};

/// Side of a cell in pixels.
pub const CELL: usize = 4;

/// Number of channels: 18 signed orientations, 9 unsigned ones, 4 texture energies.
pub const CHANNELS: usize = 31;

/// Number of signed orientations.
const SIGNED: usize = 18;

/// Number of unsigned orientations.
const UNSIGNED: usize = 9;

/// Normalised histograms are cut off here.
const CLIP: f32 = 0.2;

/// The weight of the texture channels, `1 / sqrt(18)`.
const TEXTURE: f32 = 0.2357;

/// Orientations of a histogram, padded with zeros to whole vectors.
const LANES: usize = 24;

/// A histogram of signed orientations.
type Histogram = [f32; LANES];

/// Buffers of [`fhog`].
#[derive(Debug, Default)]
pub struct FhogScratch {
    gradient_x: Vec<f32>,
    gradient_y: Vec<f32>,
    magnitude: Vec<f32>,
    bin: Vec<i32>,
    /// Votes of one row of pixels, for a cell more at both ends.
    row: Vec<Histogram>,
    cells: Vec<Histogram>,
    energy: Vec<f32>,
    factors: Vec<f32>,
}

/// Writes the channels of a patch whose sides are multiples of [`CELL`], at least two cells each: `CHANNELS`
/// planes of cells, row by row.
pub fn fhog(patch: &Planes, scratch: &mut FhogScratch, out: &mut [f32]) {
    Instructions::default().dispatch(Compute { patch, scratch, out });
}

/// The computation, compiled for the instructions in use.
struct Compute<'a> {
    patch: &'a Planes,
    scratch: &'a mut FhogScratch,
    out: &'a mut [f32],
}

impl WithSimd for Compute<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        compute(self.patch, self.scratch, self.out);
    }
}

#[inline(always)]
fn compute(patch: &Planes, scratch: &mut FhogScratch, out: &mut [f32]) {
    let (columns, rows) = (patch.width / CELL, patch.height / CELL);
    let cells = columns * rows;
    scratch.cells.clear();
    scratch.cells.resize(cells, [0.0; LANES]);
    for y in 0..patch.height {
        gradients(patch, y, scratch);
        nearest_orientations(scratch);
        vote_row(y, (columns, rows), scratch);
    }
    weigh_border(columns, rows, &mut scratch.cells);
    block_factors(columns, rows, scratch);
    let out = &mut out[..CHANNELS * cells];
    for (y, row) in scratch.cells.chunks_exact(columns).enumerate() {
        let (above, below) = (y * (columns + 1), (y + 1) * (columns + 1));
        for (x, cell) in row.iter().enumerate() {
            let corner = |at: usize| scratch.factors[at];
            let corners = [
                corner(above + x),
                corner(above + x + 1),
                corner(below + x),
                corner(below + x + 1),
            ];
            let channels = normalised(cell, corners);
            let out = out[y * columns + x..].iter_mut().step_by(cells);
            out.zip(channels).for_each(|(out, v)| *out = v);
        }
    }
}

/// The gradient of each pixel of a row, of the colour channel where it is largest: central differences
/// inside, differences of neighbours at the border.
#[inline(always)]
fn gradients(patch: &Planes, y: usize, scratch: &mut FhogScratch) {
    let (width, height) = (patch.width, patch.height);
    let FhogScratch { gradient_x, gradient_y, magnitude, bin, .. } = scratch;
    for buffer in [&mut *gradient_x, gradient_y, magnitude] {
        buffer.clear();
        buffer.resize(width, 0.0);
    }
    bin.resize(width, 0);
    let (above, below) = (y.saturating_sub(1), (y + 1).min(height - 1));
    let half = if below - above == 2 { 0.5 } else { 1.0 };
    for channel in 0..patch.channels {
        let plane = patch.plane(channel);
        let row = |y: usize| &plane[y * width..][..width];
        let (above, this, below) = (row(above), row(y), row(below));
        let (gx, gy) = (&mut gradient_x[..width], &mut gradient_y[..width]);
        let magnitude = &mut magnitude[..width];
        let mut take = |x: usize, dx: f32| {
            let dy = (below[x] - above[x]) * half;
            let squared = dx * dx + dy * dy;
            let larger = squared > magnitude[x];
            gx[x] = if larger { dx } else { gx[x] };
            gy[x] = if larger { dy } else { gy[x] };
            magnitude[x] = if larger { squared } else { magnitude[x] };
        };
        take(0, this[1] - this[0]);
        take(width - 1, this[width - 1] - this[width - 2]);
        for x in 1..width - 1 {
            take(x, (this[x + 1] - this[x - 1]) * 0.5);
        }
    }
}

/// The nearest of the orientations, and the magnitude as a vote.
#[inline(always)]
fn nearest_orientations(scratch: &mut FhogScratch) {
    let FhogScratch { gradient_x, gradient_y, magnitude, bin, .. } = scratch;
    let width = bin.len();
    let (gradient_x, gradient_y) = (&gradient_x[..width], &gradient_y[..width]);
    let (magnitude, bin) = (&mut magnitude[..width], &mut bin[..width]);
    for x in 0..width {
        let (dx, dy) = (gradient_x[x], gradient_y[x]);
        let (mut best, mut nearest) = (0.0f32, 0i32);
        for (o, [cos, sin]) in DIRECTIONS.into_iter().enumerate() {
            let along = dx * cos + dy * sin;
            let orientation = o as i32 + if along < 0.0 { UNSIGNED as i32 } else { 0 };
            let better = along.abs() > best;
            nearest = if better { orientation } else { nearest };
            best = if better { along.abs() } else { best };
        }
        bin[x] = nearest;
        magnitude[x] = magnitude[x].sqrt() / (CELL * CELL) as f32;
    }
}

/// Cosine and sine of the unsigned orientations, `o * 20` degrees.
const DIRECTIONS: [[f32; 2]; UNSIGNED] = [
    [1.0, 0.0],
    [0.939_692_6, 0.342_020_14],
    [0.766_044_44, 0.642_787_6],
    [0.5, 0.866_025_4],
    [0.173_648_18, 0.984_807_7],
    [-0.173_648_18, 0.984_807_7],
    [-0.5, 0.866_025_4],
    [-0.766_044_44, 0.642_787_6],
    [-0.939_692_6, 0.342_020_14],
];

/// The votes of one row of pixels, bilinear in both directions; votes for cells outside are dropped.
#[inline(always)]
fn vote_row(y: usize, (columns, rows): (usize, usize), scratch: &mut FhogScratch) {
    let FhogScratch { magnitude, bin, row, cells, .. } = scratch;
    row.clear();
    row.resize(columns + 2, [0.0; LANES]);
    for (x, (&vote, &bin)) in magnitude.iter().zip(bin.iter()).enumerate() {
        let (left, share) = neighbour(x);
        // The bin is below LANES; this spares its check.
        let bin = (bin as usize).min(LANES - 1);
        let [before, after] = &mut row[left..left + 2] else { continue };
        before[bin] += vote * (1.0 - share);
        after[bin] += vote * share;
    }
    let (above, share) = neighbour(y);
    for (cell_row, share) in [(above, 1.0 - share), (above + 1, share)] {
        if !(1..=rows).contains(&cell_row) {
            continue;
        }
        let cells = &mut cells[(cell_row - 1) * columns..][..columns];
        for (cell, votes) in cells.iter_mut().zip(&row[1..]) {
            for o in 0..LANES {
                cell[o] += share * votes[o];
            }
        }
    }
}

/// The cell before a pixel, counted from one before the first, and the share of the cell after it.
#[inline(always)]
fn neighbour(pixel: usize) -> (usize, f32) {
    // The centre of cell c lies at pixel 4 c + 1.5.
    let cell = (pixel + CELL / 2) / CELL;
    let share = ((pixel + CELL / 2) % CELL) as f32 / CELL as f32 + 0.5 / CELL as f32;
    (cell, share)
}

/// Cells at the border miss votes of a half cell.
fn weigh_border(columns: usize, rows: usize, cells: &mut [Histogram]) {
    let mut raise = |k: usize| cells[k].iter_mut().for_each(|v| *v *= 8.0 / 7.0);
    for x in 0..columns {
        raise(x);
        raise((rows - 1) * columns + x);
    }
    for y in 0..rows {
        raise(y * columns);
        raise(y * columns + columns - 1);
    }
}

/// One over the root of the energy of the four cells around each corner between cells; corners at the border
/// repeat the nearest inside.
fn block_factors(columns: usize, rows: usize, scratch: &mut FhogScratch) {
    let FhogScratch { cells, energy, factors, .. } = scratch;
    energy.clear();
    energy.extend(
        cells
            .iter()
            .map(|cell| (0..UNSIGNED).map(|o| (cell[o] + cell[o + UNSIGNED]).powi(2)).sum::<f32>()),
    );
    let floor = 1e-4 / (4 * CELL.pow(4)) as f32;
    factors.clear();
    for y in 0..=rows {
        for x in 0..=columns {
            let (x, y) = (x.clamp(1, columns - 1), y.clamp(1, rows - 1));
            let at = |dy: usize, dx: usize| energy[(y - dy) * columns + x - dx];
            let sum = at(1, 1) + at(1, 0) + at(0, 1) + at(0, 0);
            factors.push(1.0 / (sum + floor).sqrt());
        }
    }
}

/// The channels of a cell with this histogram, normalised by the factors of its corners.
#[inline(always)]
fn normalised(cell: &Histogram, corners: [f32; 4]) -> [f32; CHANNELS] {
    let mut unsigned = [0.0; UNSIGNED];
    (0..UNSIGNED).for_each(|o| unsigned[o] = cell[o] + cell[o + UNSIGNED]);
    let (mut signed_sum, mut unsigned_sum) = ([0.0; LANES], [0.0; UNSIGNED]);
    let mut out = [0.0; CHANNELS];
    for (k, factor) in corners.into_iter().enumerate() {
        let mut clipped = [0.0; LANES];
        for o in 0..LANES {
            clipped[o] = (cell[o] * factor).min(CLIP);
            signed_sum[o] += clipped[o];
        }
        for o in 0..UNSIGNED {
            unsigned_sum[o] += (unsigned[o] * factor).min(CLIP);
        }
        // Sums of eight lanes each, so that vectors can be added.
        let mut eight = [0.0; 8];
        (0..LANES).for_each(|o| eight[o % 8] += clipped[o]);
        let texture: f32 = eight.iter().sum();
        out[SIGNED + UNSIGNED + k] = TEXTURE * texture;
    }
    (0..SIGNED).for_each(|o| out[o] = 0.5 * signed_sum[o]);
    (0..UNSIGNED).for_each(|o| out[SIGNED + o] = 0.5 * unsigned_sum[o]);
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::TAU;

    fn of(width: usize, height: usize, at: impl Fn(usize, usize) -> f32) -> Vec<f32> {
        let samples = (0..width * height).map(|k| at(k % width, k / width)).collect();
        let patch = Planes { width, height, channels: 1, samples };
        let mut out = vec![-1.0; CHANNELS * (width / CELL) * (height / CELL)];
        fhog(&patch, &mut FhogScratch::default(), &mut out);
        out
    }

    #[test]
    fn directions_are_multiples_of_20_degrees() {
        for (o, [cos, sin]) in DIRECTIONS.into_iter().enumerate() {
            let angle = o as f32 * TAU / SIGNED as f32;
            assert!((cos - angle.cos()).abs() < 1e-6 && (sin - angle.sin()).abs() < 1e-6, "{o}");
        }
    }

    #[test]
    fn a_constant_patch_has_no_gradients() {
        assert!(of(16, 24, |_, _| 77.0).iter().all(|&v| v == 0.0));
    }

    #[test]
    fn a_vertical_edge_has_only_horizontal_gradients() {
        let out = of(32, 16, |x, _| if x < 15 { 10.0 } else { 200.0 });
        let largest: Vec<f32> =
            out.chunks(8 * 4).map(|plane| plane.iter().copied().fold(0.0, f32::max)).collect();
        for (channel, &value) in largest.iter().enumerate().take(SIGNED + UNSIGNED) {
            assert_eq!(value > 0.0, channel == 0 || channel == SIGNED, "{channel}: {value}");
        }
        // Four corners, each at the clip.
        assert!((largest[0] - 0.4).abs() < 1e-6);
    }

    #[test]
    fn turning_the_patch_around_turns_orientations_around() {
        let (w, h) = (40, 24);
        let noise = |x: usize, y: usize| ((x * 131 + y * 71 + x * y * 13) % 251) as f32;
        let one = of(w, h, noise);
        let other = of(w, h, |x, y| noise(w - 1 - x, h - 1 - y));
        let cells = (w / CELL) * (h / CELL);
        for o in 0..SIGNED {
            let turned = (o + UNSIGNED) % SIGNED;
            for k in 0..cells {
                let (a, b) = (one[o * cells + k], other[turned * cells + cells - 1 - k]);
                assert!((a - b).abs() < 1e-5, "{o} {k}: {a} {b}");
            }
        }
    }

    /// The same from the definition, in `f64`, one pixel at a time.
    fn defined(width: usize, height: usize, at: impl Fn(usize, usize) -> f32) -> Vec<f64> {
        let (columns, rows) = (width / CELL, height / CELL);
        let at = |x: usize, y: usize| f64::from(at(x, y));
        let mut histogram = vec![[0.0; SIGNED]; columns * rows];
        for k in 0..width * height {
            let (x, y) = (k % width, k / width);
            let difference =
                |a: f64, b: f64, inside: bool| if inside { (b - a) / 2.0 } else { b - a };
            let dx = difference(
                at(x.saturating_sub(1), y),
                at((x + 1).min(width - 1), y),
                x > 0 && x + 1 < width,
            );
            let dy = difference(
                at(x, y.saturating_sub(1)),
                at(x, (y + 1).min(height - 1)),
                y > 0 && y + 1 < height,
            );
            let angle = dy.atan2(dx).rem_euclid(std::f64::consts::TAU);
            let bin = (angle * 18.0 / std::f64::consts::TAU + 0.5).floor() as usize % SIGNED;
            for (c, cell) in histogram.iter_mut().enumerate() {
                let (cx, cy) = ((c % columns) as f64 * 4.0 + 1.5, (c / columns) as f64 * 4.0 + 1.5);
                let share = |d: f64| (1.0 - d.abs() / 4.0).max(0.0);
                cell[bin] += dx.hypot(dy) / 16.0 * share(x as f64 - cx) * share(y as f64 - cy);
            }
        }
        for (c, cell) in histogram.iter_mut().enumerate() {
            let at_border = |k: usize, n: usize| k == 0 || k == n - 1;
            let sides = usize::from(at_border(c % columns, columns))
                + usize::from(at_border(c / columns, rows));
            cell.iter_mut().for_each(|v| *v *= (8.0f64 / 7.0).powi(sides as i32));
        }
        let energy = |x: usize, y: usize| {
            let cell = &histogram[y * columns + x];
            (0..9).map(|o| (cell[o] + cell[o + 9]).powi(2)).sum::<f64>()
        };
        let mut out = vec![0.0; CHANNELS * columns * rows];
        for c in 0..columns * rows {
            for k in 0..4 {
                let x = (c % columns + k % 2).clamp(1, columns - 1);
                let y = (c / columns + k / 2).clamp(1, rows - 1);
                let sum = energy(x, y) + energy(x - 1, y) + energy(x, y - 1) + energy(x - 1, y - 1);
                let factor = 1.0 / (sum + 1e-4 / 1024.0).sqrt();
                for o in 0..18 {
                    let value = (histogram[c][o] * factor).min(0.2);
                    out[o * columns * rows + c] += 0.5 * value;
                    out[(27 + k) * columns * rows + c] += 0.2357 * value;
                }
                for o in 0..9 {
                    let both = histogram[c][o] + histogram[c][o + 9];
                    out[(18 + o) * columns * rows + c] += 0.5 * (both * factor).min(0.2);
                }
            }
        }
        out
    }

    #[test]
    fn it_is_what_the_definition_says() {
        // Gradients never lie half way between two orientations here, so both choose the same.
        let noise =
            |x: usize, y: usize| ((x * 7919 + y * 104_729 + x * y * 37) % 1009) as f32 * 0.2533;
        for (w, h) in [(8, 8), (24, 16), (40, 44)] {
            let (fast, slow) = (of(w, h, noise), defined(w, h, noise));
            for (k, (a, b)) in fast.iter().zip(&slow).enumerate() {
                assert!((f64::from(*a) - b).abs() < 2e-5, "{w}x{h} {k}: {a} {b}");
            }
        }
    }
}
