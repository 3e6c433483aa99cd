//! The affine warp of a candidate (Sec. 2): bilinear samples of the frame on a square grid.
//!
//! A grid of side `n` has the coordinates `-(n-1)/2 .. (n-1)/2` in both directions (for 32: -15.5
//! .. 15.5). The affine map `[[m00, m01, x], [m10, m11, y]]` takes grid coordinates `(a, b)` to
//! pixels. Pixels outside the frame are 0, so samples just beyond the last pixel fade to 0
//! (OpenCV's `BORDER_CONSTANT`).
//!
//! Plain loops over sixteen samples. With AVX2 they take 75 % of the plain instructions and 83 % of
//! the time (`benchmarks/record/speed.md`).

use crate::numeric::instructions::{Instructions, dispatch_eight};
use crate::vision::frame::GreyImage;

/// An affine map from grid coordinates to pixels: two rows of three.
pub type Affine = [[f64; 3]; 2];

/// Adjacent samples of a row that are computed together.
const LANES: usize = 16;

/// Warps the grid of side `side` into `out`: row-major, `side * side` samples. The bits are the
/// same with all instructions.
pub fn warp(image: &GreyImage, map: &Affine, side: usize, out: &mut [f32]) {
    warp_with(Instructions::default(), image, map, side, out);
}

fn warp_with(
    instructions: Instructions,
    image: &GreyImage,
    map: &Affine,
    side: usize,
    out: &mut [f32],
) {
    dispatch_eight!(instructions, |_| {
        let half = (side as f64 - 1.0) / 2.0;
        for (row, line) in out.chunks_exact_mut(side).take(side).enumerate() {
            let b = row as f64 - half;
            let (x, y) = (map[0][1] * b + map[0][2], map[1][1] * b + map[1][2]);
            let at = |column: usize| {
                let a = column as f64 - half;
                [map[0][0] * a + x, map[1][0] * a + y]
            };
            let (wide, rest) = line.as_chunks_mut::<LANES>();
            let first_of_rest = wide.len() * LANES;
            for (k, samples) in wide.iter_mut().enumerate() {
                sample_lanes(image, |lane| at(k * LANES + lane), samples);
            }
            for (k, sample) in rest.iter_mut().enumerate() {
                *sample = sample_anywhere(image, at(first_of_rest + k));
            }
        }
    });
}

/// The images of the corners `(-half, -half)`, `(half, -half)`, `(half, half)` and `(-half, half)`
/// of a square.
pub fn corners(map: &Affine, half: f64) -> [[f64; 2]; 4] {
    [(-half, -half), (half, -half), (half, half), (-half, half)].map(|(a, b)| {
        [map[0][0] * a + map[0][1] * b + map[0][2], map[1][0] * a + map[1][1] * b + map[1][2]]
    })
}

/// Samples adjacent positions of a row of the grid; `at` gives each position in pixels.
#[inline(always)]
fn sample_lanes(image: &GreyImage, at: impl Fn(usize) -> [f64; 2], out: &mut [f32; LANES]) {
    // Rounding preserves the order of positions along a row, so if both ends are inside, all are.
    if !(is_inside(image, at(0)) && is_inside(image, at(LANES - 1))) {
        for (lane, sample) in out.iter_mut().enumerate() {
            *sample = sample_anywhere(image, at(lane));
        }
        return;
    }
    // All loops but the second compile to vector instructions. The second is limited by its two
    // loads of pairs.
    let (mut columns, mut rows) = ([0u32; LANES], [0u32; LANES]);
    let (mut fx, mut fy) = ([0.0f32; LANES], [0.0f32; LANES]);
    for lane in 0..LANES {
        let [x, y] = at(lane);
        let (column, row) = (floor(x), floor(y));
        (columns[lane], rows[lane]) = (to_u32(column), to_u32(row));
        (fx[lane], fy[lane]) = ((x - column) as f32, (y - row) as f32);
    }
    let (mut upper, mut lower) = ([[0.0f32; 2]; LANES], [[0.0f32; 2]; LANES]);
    for lane in 0..LANES {
        // Never breaks, since all positions are inside. But without it the compiler would make
        // gathers of this loop, and a warp would take twice as long.
        let Some(found) = image.neighbours(columns[lane] as usize, rows[lane] as usize) else {
            break;
        };
        (upper[lane], lower[lane]) = found;
    }
    for lane in 0..LANES {
        let ([a, b], [c, d]) = (upper[lane], lower[lane]);
        let (top, bottom) = (a + fx[lane] * (b - a), c + fx[lane] * (d - c));
        out[lane] = top + fy[lane] * (bottom - top);
    }
}

/// Adding this to a number from 0 to `2^51` rounds it to an integer, which is in the low bits of
/// the sum.
const ROUND: f64 = (1u64 << 52) as f64;

/// The floor of a number from 0 to `2^51`. Casts to integers would not compile to vector
/// instructions, nor would `f64::floor` on old processors.
#[inline(always)]
fn floor(x: f64) -> f64 {
    let near = (x + ROUND) - ROUND;
    if near > x { near - 1.0 } else { near }
}

/// Converts an integer from 0 to `2^32 - 1`.
#[inline(always)]
fn to_u32(x: f64) -> u32 {
    (x + ROUND).to_bits() as u32
}

/// Whether all four neighbours of a position are in the frame, and their columns and rows fit in
/// `u32`.
#[inline(always)]
fn is_inside(image: &GreyImage, [x, y]: [f64; 2]) -> bool {
    let last = |side: usize| side.saturating_sub(1).min(u32::MAX as usize) as f64;
    x >= 0.0 && y >= 0.0 && x < last(image.width()) && y < last(image.height())
}

/// A sample at any position. Not inlined, so that the fast loop around the call stays small.
#[inline(never)]
fn sample_anywhere(image: &GreyImage, [x, y]: [f64; 2]) -> f32 {
    let (column, row) = (x.floor(), y.floor());
    let pixel = |dx: f64, dy: f64| pixel_or_zero(image, column + dx, row + dy);
    let (fx, fy) = ((x - column) as f32, (y - row) as f32);
    let top = pixel(0.0, 0.0) + fx * (pixel(1.0, 0.0) - pixel(0.0, 0.0));
    let bottom = pixel(0.0, 1.0) + fx * (pixel(1.0, 1.0) - pixel(0.0, 1.0));
    top + fy * (bottom - top)
}

fn pixel_or_zero(image: &GreyImage, x: f64, y: f64) -> f32 {
    let inside =
        (0.0..image.width() as f64).contains(&x) && (0.0..image.height() as f64).contains(&y);
    if inside { image.row(y as usize)[x as usize] } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vision::frame::Frame;
    use proptest::prelude::*;

    fn image(width: usize, height: usize) -> GreyImage {
        let samples: Vec<u8> = (0..width * height).map(|k| (k * 7919 % 251) as u8).collect();
        let mut image = GreyImage::default();
        image.fill(&Frame::grey8(&samples, width, height).unwrap()).unwrap();
        image
    }

    proptest! {
        /// The fast path and the general one give the same bits inside, outside and across the
        /// border, with all instructions and for every side.
        #[test]
        fn fast_and_general_sampling_agree(
            x in -10.0..50.0f64,
            y in -10.0..40.0f64,
            s in 0.01..1.2f64,
            t in -3.0..3.0f64,
            side in 2usize..36,
        ) {
            let image = image(40, 30);
            let map = [[s * t.cos(), -s * t.sin(), x], [s * t.sin(), s * t.cos(), y]];
            let half = (side as f64 - 1.0) / 2.0;
            for (name, instructions) in Instructions::available() {
                let mut out = vec![0.0; side * side];
                warp_with(instructions, &image, &map, side, &mut out);
                for (k, &got) in out.iter().enumerate() {
                    let (a, b) = ((k % side) as f64 - half, (k / side) as f64 - half);
                    let px = map[0][0] * a + (map[0][1] * b + map[0][2]);
                    let py = map[1][0] * a + (map[1][1] * b + map[1][2]);
                    prop_assert_eq!(got.to_bits(), sample_anywhere(&image, [px, py]).to_bits(), "{}", name);
                }
            }
        }

        /// Any map gives finite samples, even one that no target can have.
        #[test]
        fn any_map_gives_finite_samples(m in prop::array::uniform6(prop::num::f64::ANY)) {
            let mut out = vec![0.0; 64];
            warp(&image(5, 4), &[[m[0], m[1], m[2]], [m[3], m[4], m[5]]], 8, &mut out);
            prop_assume!(m.iter().all(|v| v.abs() < 1e300));
            prop_assert!(out.iter().all(|v| v.is_finite()));
        }
    }

    #[test]
    fn whole_pixels_are_copied() {
        let image = image(40, 40);
        let mut out = vec![0.0; 1024];
        warp(&image, &[[1.0, 0.0, 19.5], [0.0, 1.0, 19.5]], 32, &mut out);
        for (k, &got) in out.iter().enumerate() {
            assert_eq!(got, image.row(4 + k / 32)[4 + k % 32]);
        }
    }

    #[test]
    fn one_pixel_frames_work() {
        let mut out = vec![0.0; 16];
        warp(&image(1, 1), &[[0.1, 0.0, 0.0], [0.0, 0.1, 0.0]], 4, &mut out);
        assert!(out.iter().all(|v| v.is_finite()));
    }
}
