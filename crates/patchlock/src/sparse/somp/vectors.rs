//! Rows over all atoms as wide vectors of `f32`, and short vectors of `f64`.
//!
//! The `f64` loops add in an order that does not depend on the width of the vectors and never fuse a product with a sum, so that they
//! give the same bits on every processor.

use crate::sparse::dictionary::LANES;
use pulp::{Scalar256b, Simd};
use std::any::TypeId;

/// The unit roundoff of `f32`.
pub const U: f64 = 1.0 / 16_777_216.0;

/// Vectors that are worked on together: enough to hide the latency of one.
pub const TILE: usize = 4;

/// Neighbouring vectors of a row.
pub type Tile<S> = [<S as Simd>::f32s; TILE];

/// A row as tiles; its length is a multiple of theirs.
#[inline(always)]
pub fn tiles<S: Simd>(row: &[f32]) -> &[Tile<S>] {
    S::as_simd_f32s(row).0.as_chunks().0
}

/// As [`tiles`], to write to.
#[inline(always)]
pub fn tiles_mut<S: Simd>(row: &mut [f32]) -> &mut [Tile<S>] {
    S::as_mut_simd_f32s(row).0.as_chunks_mut().0
}

/// Rows that are used together are kept together: in panels of [`LANES`] atoms, row after row within a panel. This is where atom `k` of a row
/// stands.
#[inline(always)]
pub fn place(k: usize, row: usize, rows: usize) -> usize {
    (k / LANES * rows + row) * LANES + k % LANES
}

/// The same in tiles, for tile `t` of a row.
#[inline(always)]
pub fn tile_place<S: Simd>(t: usize, row: usize, rows: usize) -> usize {
    let parts = LANES / (TILE * S::F32_LANES);
    (t / parts * rows + row) * parts + t % parts
}

/// `y -= weights * along`.
#[inline(always)]
pub fn take_off<S: Simd>(simd: S, y: &mut Tile<S>, weights: &Tile<S>, along: f32) {
    let along = simd.splat_f32s(-along);
    for i in 0..TILE {
        y[i] = mul_add(simd, weights[i], along, y[i]);
    }
}

/// `a b + c`, fused where the processor can. Plain code would call a function for each number to fuse them, which makes it twenty times as slow.
#[inline(always)]
pub fn mul_add<S: Simd>(simd: S, a: S::f32s, b: S::f32s, c: S::f32s) -> S::f32s {
    if TypeId::of::<S>() == TypeId::of::<Scalar256b>() {
        simd.add_f32s(simd.mul_f32s(a, b), c)
    } else {
        simd.mul_add_e_f32s(a, b, c)
    }
}

/// The inner product in `f64`.
#[inline(always)]
pub fn dot<A: Copy + Into<f64>, B: Copy + Into<f64>>(a: &[A], b: &[B]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<16>(), b.as_chunks::<16>());
    // Two sums, so that an addition need not wait for the one before.
    let (mut low, mut high) = ([0.0; 8], [0.0; 8]);
    for (a, b) in a.iter().zip(b) {
        for lane in 0..8 {
            low[lane] += a[lane].into() * b[lane].into();
        }
        for lane in 0..8 {
            high[lane] += a[8 + lane].into() * b[8 + lane].into();
        }
    }
    let mut rest = 0.0;
    for (&a, &b) in a_rest.iter().zip(b_rest) {
        rest += a.into() * b.into();
    }
    for lane in 0..8 {
        low[lane] += high[lane];
    }
    ((low[0] + low[4]) + (low[2] + low[6])) + ((low[1] + low[5]) + (low[3] + low[7])) + rest
}

/// Projects the unit vector `direction` out of `vector` and returns their inner product.
#[inline(always)]
pub fn project_out(vector: &mut [f64], direction: &[f64]) -> f64 {
    let along = dot(vector, direction);
    vector.iter_mut().zip(direction).for_each(|(v, d)| *v -= along * d);
    along
}
