//! Histograms of oriented gradients with 31 channels per cell, after Felzenszwalb, Girshick,
//! McAllester and Ramanan, "Object detection with discriminatively trained part-based models"
//! (2010), in the variant that correlation filter trackers use: each gradient votes for its nearest
//! orientation and for four cells.
//!
//! Plain loops over arrays of fixed lengths. With AVX2 they take 36 % of the plain instructions
//! (`benchmarks/record/speed.md`).

use crate::numeric::instructions::{Instructions, dispatch_eight};
use crate::vision::crop::Planes;
use std::array::from_fn;

/// Side of a cell in pixels.
pub const CELL: usize = 4;

/// Number of channels: 18 signed orientations, 9 unsigned ones, 4 texture energies.
///
/// They are in the order in which vectors hold them: the signed orientations 0 to 7 and those
/// opposite to them, 9 to 16; the unsigned orientations 0 to 7; the signed ones 8 and 17 and the
/// unsigned 8; the texture energies of the four corners.
pub const CHANNELS: usize = 31;

/// Number of unsigned orientations, half of the signed ones.
const UNSIGNED: usize = 9;

/// Normalised histograms are cut off here.
const CLIP: f32 = 0.2;

/// The weight of the texture channels, `1 / sqrt(18)`.
const TEXTURE: f32 = 0.2357;

/// Added to the energy of four cells.
const FLOOR: f32 = 1e-4 / (4 * CELL.pow(4)) as f32;

/// Orientations in a vector.
const LANES: usize = 8;

/// Eight values, for each of which the same is computed.
type Vector = [f32; LANES];

/// A histogram of the signed orientations: 0 to 7; 9 to 16; 8 and 17, followed by zeros.
type Histogram = [Vector; 3];

/// Pixels from the centre of a cell before the first one to the first pixel.
const AHEAD: usize = CELL / 2;

/// The shares in the votes of pixels between the centres of two cells that the second cell gets.
const SHARES: [f32; CELL] = [0.125, 0.375, 0.625, 0.875];

/// Buffers of [`fhog`].
#[derive(Debug, Default)]
pub struct FhogScratch {
    /// Of one row of pixels, with zeros before and behind: the gradients, their squared magnitudes,
    /// which become votes, and their places in a histogram.
    gradient_x: Vec<f32>,
    gradient_y: Vec<f32>,
    vote: Vec<f32>,
    place: Vec<i32>,
    /// Votes of one row of pixels, for a cell more at both ends.
    row: Vec<Histogram>,
    cells: Vec<Histogram>,
    energy: Vec<f32>,
    factors: Vec<f32>,
}

/// Writes the channels of a patch whose sides are multiples of [`CELL`], at least two cells each:
/// cell by cell, row by row, `CHANNELS` values every `stride`.
pub fn fhog(patch: &Planes, scratch: &mut FhogScratch, out: &mut [f32], stride: usize) {
    dispatch_eight!(Instructions::default(), |_| {
        let (columns, rows) = (patch.width / CELL, patch.height / CELL);
        scratch.cells.clear();
        scratch.cells.resize(columns * rows, [[0.0; LANES]; 3]);
        for y in 0..patch.height {
            gradients(patch, y, scratch);
            vote(scratch);
            collect_row(columns, scratch);
            add_row(y, (columns, rows), scratch);
        }
        weigh_border(columns, rows, &mut scratch.cells);
        block_factors(columns, rows, scratch);
        let mut out = out.chunks_mut(stride);
        for (y, row) in scratch.cells.chunks_exact(columns).enumerate() {
            let factors = &scratch.factors[y * (columns + 1)..][..2 * (columns + 1)];
            let (above, below) = factors.split_at(columns + 1);
            let corners = above.array_windows().zip(below.array_windows());
            for ((cell, (&[a, b], &[c, d])), out) in row.iter().zip(corners).zip(&mut out) {
                let Some(out) = out.first_chunk_mut() else { continue };
                normalise(cell, [a, b, c, d], out);
            }
        }
    });
}

/// The gradient of each pixel of a row, of the colour channel where it is largest: central
/// differences inside, differences of neighbours at the border.
#[inline(always)]
fn gradients(patch: &Planes, y: usize, scratch: &mut FhogScratch) {
    let (width, height) = (patch.width, patch.height);
    let FhogScratch { gradient_x, gradient_y, vote, place, .. } = scratch;
    let whole = (width + 2 * AHEAD).next_multiple_of(LANES);
    for buffer in [&mut *gradient_x, gradient_y, vote] {
        buffer.clear();
        buffer.resize(whole, 0.0);
    }
    place.resize(whole, 0);
    let (above, below) = (y.saturating_sub(1), (y + 1).min(height - 1));
    let half = if below - above == 2 { 0.5 } else { 1.0 };
    for channel in 0..patch.channels {
        let plane = patch.plane(channel);
        let row = |y: usize| &plane[y * width..][..width];
        let (above, this, below) = (row(above), row(y), row(below));
        let (gx, gy) = (&mut gradient_x[AHEAD..][..width], &mut gradient_y[AHEAD..][..width]);
        let squared = &mut vote[AHEAD..][..width];
        let mut take = |x: usize, dx: f32| {
            let dy = (below[x] - above[x]) * half;
            let sum = dx * dx + dy * dy;
            let larger = sum > squared[x];
            gx[x] = if larger { dx } else { gx[x] };
            gy[x] = if larger { dy } else { gy[x] };
            squared[x] = if larger { sum } else { squared[x] };
        };
        take(0, this[1] - this[0]);
        take(width - 1, this[width - 1] - this[width - 2]);
        for x in 1..width - 1 {
            take(x, (this[x + 1] - this[x - 1]) * 0.5);
        }
    }
}

/// The magnitudes as votes, and the places of the nearest orientations.
#[inline(always)]
fn vote(scratch: &mut FhogScratch) {
    let FhogScratch { gradient_x, gradient_y, vote, place, .. } = scratch;
    let gradients = gradient_x.as_chunks::<LANES>().0.iter().zip(gradient_y.as_chunks().0);
    let votes = vote.as_chunks_mut::<LANES>().0.iter_mut().zip(place.as_chunks_mut().0);
    for ((dx, dy), (vote, place)) in gradients.zip(votes) {
        *place = places(dx, dy);
        vote.iter_mut().for_each(|v| *v = v.sqrt() / (CELL * CELL) as f32);
    }
}

/// The places in a histogram of the orientations nearest to gradients.
#[inline(always)]
fn places(dx: &Vector, dy: &Vector) -> [i32; LANES] {
    let mut out = [0; LANES];
    for k in 0..LANES {
        // How many of the borders at 10, 30, 50 and 70 degrees lie below the angle to the x axis.
        let (x, y) = (dx[k].abs(), dy[k].abs());
        let mut steps = 0;
        for [cos, sin] in BORDERS {
            steps += i32::from(y * cos > x * sin);
        }
        // Vertical gradients count as 80 or as 260 degrees.
        let (left, up) = (dx[k] < 0.0 || (dx[k] == 0.0 && dy[k] < 0.0), dy[k] < 0.0);
        let nine = UNSIGNED as i32;
        let turned = if left != up { nine - steps } else { steps };
        let orientation = turned + if up { nine } else { 0 };
        let orientation = if orientation == 2 * nine { 0 } else { orientation };
        // The order of [`Histogram`].
        out[k] = match orientation {
            8 => 16,
            17 => 17,
            o => o - i32::from(o > 8),
        };
    }
    out
}

/// The votes of one row of pixels, linear along x.
#[inline(always)]
fn collect_row(columns: usize, scratch: &mut FhogScratch) {
    let FhogScratch { vote, place, row, .. } = scratch;
    row.clear();
    row.resize(columns + 2, [[0.0; LANES]; 3]);
    // Four pixels at a time lie between the same two cells.
    let (votes, places) = (vote.as_chunks::<CELL>().0, place.as_chunks::<CELL>().0);
    let votes = &votes[..=columns];
    for (left, (votes, places)) in votes.iter().zip(places).enumerate() {
        let Some(cells) = row[left..].first_chunk_mut::<2>() else { continue };
        let cells = cells.as_flattened_mut().as_flattened_mut();
        for k in 0..CELL {
            let after = votes[k] * SHARES[k];
            // The place is below 24; this spares its check.
            let place = (places[k] as usize).min(LANES * 3 - 1);
            cells[place] += votes[k] - after;
            cells[place + LANES * 3] += after;
        }
    }
}

/// Adds the votes of one row of pixels to the cells above and below it; votes for cells outside are
/// dropped.
#[inline(always)]
fn add_row(y: usize, (columns, rows): (usize, usize), scratch: &mut FhogScratch) {
    let FhogScratch { row, cells, .. } = scratch;
    let (above, share) = ((y + AHEAD) / CELL, SHARES[(y + AHEAD) % CELL]);
    for (cell_row, share) in [(above, 1.0 - share), (above + 1, share)] {
        if !(1..=rows).contains(&cell_row) {
            continue;
        }
        let cells = cells[(cell_row - 1) * columns..][..columns].as_flattened_mut();
        for (cell, votes) in cells.iter_mut().zip(row[1..].as_flattened()) {
            *cell = from_fn(|k| cell[k] + share * votes[k]);
        }
    }
}

/// Cosine and sine of the borders between orientations in the first quadrant: 10, 30, 50 and 70
/// degrees.
const BORDERS: [[f32; 2]; 4] = [
    [0.984_807_7, 0.173_648_18],
    [0.866_025_4, 0.5],
    [0.642_787_6, 0.766_044_44],
    [0.342_020_14, 0.939_692_6],
];

/// Cells at the border miss votes of a half cell.
fn weigh_border(columns: usize, rows: usize, cells: &mut [Histogram]) {
    let mut raise = |k: usize| cells[k].as_flattened_mut().iter_mut().for_each(|v| *v *= 8.0 / 7.0);
    for x in 0..columns {
        raise(x);
        raise((rows - 1) * columns + x);
    }
    for y in 0..rows {
        raise(y * columns);
        raise(y * columns + columns - 1);
    }
}

/// One over the root of the energy of the four cells around each corner between cells; corners at
/// the border repeat the nearest inside.
#[inline(always)]
fn block_factors(columns: usize, rows: usize, scratch: &mut FhogScratch) {
    let FhogScratch { cells, energy, factors, .. } = scratch;
    energy.resize(cells.len(), 0.0);
    for (energy, [a, b, last]) in energy.iter_mut().zip(cells.iter()) {
        let both = from_fn(|k| (a[k] + b[k]) * (a[k] + b[k]));
        *energy = sum(both) + (last[0] + last[1]).powi(2);
    }
    factors.resize((columns + 1) * (rows + 1), 0.0);
    for (y, factors) in factors.chunks_exact_mut(columns + 1).enumerate() {
        let y = y.clamp(1, rows - 1);
        let (above, below) = energy[(y - 1) * columns..][..2 * columns].split_at(columns);
        for x in 1..columns {
            let sum = above[x - 1] + above[x] + below[x - 1] + below[x];
            factors[x] = 1.0 / (sum + FLOOR).sqrt();
        }
        (factors[0], factors[columns]) = (factors[1], factors[columns - 1]);
    }
}

/// The channels of a cell with this histogram, normalised by the factors of its corners.
#[inline(always)]
fn normalise([a, b, last]: &Histogram, corners: [f32; 4], out: &mut [f32; CHANNELS]) {
    let mut last = *last;
    last[2] = last[0] + last[1];
    let both: Vector = from_fn(|k| a[k] + b[k]);
    let clipped = |v: &Vector, factor: f32| -> Vector { v.map(|v| at_most(v * factor, CLIP)) };
    let add = |sum: &mut Vector, v: Vector| *sum = from_fn(|k| sum[k] + v[k]);
    let mut sums = [[0.0; LANES]; 4];
    for (k, factor) in corners.into_iter().enumerate() {
        let (a, b, rest) = (clipped(a, factor), clipped(b, factor), clipped(&last, factor));
        add(&mut sums[0], a);
        add(&mut sums[1], b);
        add(&mut sums[2], clipped(&both, factor));
        add(&mut sums[3], rest);
        let texture = sum(from_fn(|k| a[k] + b[k])) + (rest[0] + rest[1]);
        out[27 + k] = TEXTURE * texture;
    }
    for (out, sum) in out.iter_mut().zip(sums.as_flattened()).take(27) {
        *out = 0.5 * sum;
    }
}

/// The smaller of two numbers, `min` without NaN handling.
#[inline(always)]
fn at_most(v: f32, limit: f32) -> f32 {
    if v < limit { v } else { limit }
}

#[inline(always)]
fn sum(v: Vector) -> f32 {
    let four: [f32; 4] = from_fn(|k| v[k] + v[k + 4]);
    (four[0] + four[2]) + (four[1] + four[3])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The place of a signed orientation in a histogram.
    const PLACES: [u8; 2 * UNSIGNED] =
        [0, 1, 2, 3, 4, 5, 6, 7, 16, 8, 9, 10, 11, 12, 13, 14, 15, 17];

    fn of(width: usize, height: usize, at: impl Fn(usize, usize) -> f32) -> Vec<f32> {
        let samples = (0..width * height).map(|k| at(k % width, k / width)).collect();
        let patch = Planes { width, height, channels: 1, samples };
        let cells = (width / CELL) * (height / CELL);
        let mut out = vec![-1.0; CHANNELS * cells];
        fhog(&patch, &mut FhogScratch::default(), &mut out, CHANNELS);
        // The tests look at one channel after the other: signed, unsigned, texture.
        let unsigned = (0..UNSIGNED).map(|o| if o < 8 { 16 + o } else { 26 });
        let signed = PLACES.map(|place| usize::from(place) + if place < 16 { 0 } else { 8 });
        let order: Vec<usize> = signed.into_iter().chain(unsigned).chain(27..31).collect();
        (0..out.len()).map(|k| out[k % cells * CHANNELS + order[k / cells]]).collect()
    }

    #[test]
    fn orientations_are_the_nearest() {
        for degrees in 0..360 {
            // Half a degree off: no direction lies half way between two.
            let angle = (degrees as f32 + 0.5).to_radians();
            let nearest = ((degrees as f32 + 0.5) / 20.0).round() as usize % (2 * UNSIGNED);
            let found = places(&[3.0 * angle.cos(); LANES], &[3.0 * angle.sin(); LANES]);
            assert_eq!(found, [i32::from(PLACES[nearest]); LANES], "{degrees}");
        }
        let of = |x: f32, y: f32| places(&[x; LANES], &[y; LANES])[0];
        let axes = [of(1.0, 0.0), of(0.0, 1.0), of(-1.0, 0.0), of(0.0, -1.0)];
        assert_eq!(axes, [0, 4, 9, 13].map(|o| i32::from(PLACES[o])));
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
        for (channel, &value) in largest.iter().enumerate().take(3 * UNSIGNED) {
            assert_eq!(value > 0.0, channel == 0 || channel == 2 * UNSIGNED, "{channel}: {value}");
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
        for o in 0..2 * UNSIGNED {
            let turned = (o + UNSIGNED) % (2 * UNSIGNED);
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
        let mut histogram = vec![[0.0; 2 * UNSIGNED]; columns * rows];
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
            let bin =
                (angle * 18.0 / std::f64::consts::TAU + 0.5).floor() as usize % (2 * UNSIGNED);
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
