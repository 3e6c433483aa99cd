//! The affine warp of a candidate (Sec. 2): bilinear samples of the frame on a square grid.
//!
//! A grid of side `n` has the coordinates `-(n-1)/2 .. (n-1)/2` in both directions (for 32: -15.5 .. 15.5). The affine map
//! `[[m00, m01, x], [m10, m11, y]]` takes grid coordinates `(a, b)` to the frame's pixels. What lies outside the frame
//! is 0, so a sample between the last pixel and the outside fades to 0 (OpenCV's `BORDER_CONSTANT`).

use crate::vision::frame::GreyImage;

/// An affine map from grid coordinates to pixels: two rows of three.
pub type Affine = [[f64; 3]; 2];

/// Warps the grid of side `side` into `out`, row-major, `side * side` samples.
pub fn warp(image: &GreyImage, map: &Affine, side: usize, out: &mut [f32]) {
    let half = (side as f64 - 1.0) / 2.0;
    let inside = grid_is_inside(image, map, half);
    for (row, line) in out.chunks_exact_mut(side).take(side).enumerate() {
        let b = row as f64 - half;
        let (x, y) = (map[0][1] * b + map[0][2], map[1][1] * b + map[1][2]);
        for (column, sample) in line.iter_mut().enumerate() {
            let a = column as f64 - half;
            let (x, y) = (map[0][0] * a + x, map[1][0] * a + y);
            *sample =
                if inside { sample_inside(image, x, y) } else { sample_anywhere(image, x, y) };
        }
    }
}

/// Whether every sample of the grid has all its four neighbours in the frame. The grid is convex, so its corners tell.
fn grid_is_inside(image: &GreyImage, map: &Affine, half: f64) -> bool {
    // A little less than the last pixel, so that rounding along a row can't step over it.
    let margin = 1e-6;
    let (right, bottom) =
        (image.width() as f64 - 1.0 - margin, image.height() as f64 - 1.0 - margin);
    corners(map, half).iter().all(|&[x, y]| x >= margin && y >= margin && x < right && y < bottom)
}

/// The map's images of the square's corners `(-half, -half)`, `(half, -half)`, `(half, half)`, `(-half, half)`.
pub fn corners(map: &Affine, half: f64) -> [[f64; 2]; 4] {
    [(-half, -half), (half, -half), (half, half), (-half, half)].map(|(a, b)| {
        [map[0][0] * a + map[0][1] * b + map[0][2], map[1][0] * a + map[1][1] * b + map[1][2]]
    })
}

#[inline]
fn sample_inside(image: &GreyImage, x: f64, y: f64) -> f32 {
    // Both are at least 0 here, so truncation is the floor.
    let (column, row) = (x as usize, y as usize);
    let (fx, fy) = ((x - column as f64) as f32, (y - row as f64) as f32);
    let (upper, lower) =
        (&image.row(row)[column..column + 2], &image.row(row + 1)[column..column + 2]);
    let top = upper[0] + fx * (upper[1] - upper[0]);
    let bottom = lower[0] + fx * (lower[1] - lower[0]);
    top + fy * (bottom - top)
}

fn sample_anywhere(image: &GreyImage, x: f64, y: f64) -> f32 {
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
        /// The path for grids inside the frame gives to the bit what the path for any grid gives.
        #[test]
        fn inside_and_anywhere_agree(x in 10.0..30.0f64, y in 10.0..20.0f64, s in 0.01..0.6f64, t in -3.0..3.0f64) {
            let image = image(40, 30);
            let map = [[s * t.cos(), -s * t.sin(), x], [s * t.sin(), s * t.cos(), y]];
            let mut out = vec![0.0; 1024];
            warp(&image, &map, 32, &mut out);
            for (k, &got) in out.iter().enumerate() {
                let (a, b) = ((k % 32) as f64 - 15.5, (k / 32) as f64 - 15.5);
                let px = map[0][0] * a + (map[0][1] * b + map[0][2]);
                let py = map[1][0] * a + (map[1][1] * b + map[1][2]);
                prop_assert_eq!(got.to_bits(), sample_anywhere(&image, px, py).to_bits());
            }
        }

        /// Any map, also an absurd one, gives finite samples.
        #[test]
        fn no_map_breaks_it(m in prop::array::uniform6(prop::num::f64::ANY)) {
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
