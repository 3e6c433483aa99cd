//! Rows over all atoms as SIMD vectors of `f32`, and short vectors of `f64`.
//!
//! The `f64` loops give the same bits on every processor, as [`dot_wide`] does.
//!
//! With AVX2 the solver, which this module serves, takes 38 % of the plain instructions, and
//! preparing a location 29 % (`benchmarks/record/speed.md`).

use crate::numeric::instructions::is_plain;
use crate::numeric::{dot_wide, dots_wide};
use crate::patch_model::sparse::dictionary::LANES;
use pulp::Simd;

/// The unit roundoff of `f32`.
pub const U: f64 = 1.0 / 16_777_216.0;

/// Vectors that are processed together: enough to hide the latency of one operation.
pub const TILE: usize = 4;

/// [`TILE`] adjacent vectors of a row.
pub type Tile<S> = [<S as Simd>::f32s; TILE];

/// A row as tiles; its length must be a multiple of theirs.
#[inline(always)]
pub fn tiles<S: Simd>(row: &[f32]) -> &[Tile<S>] {
    S::as_simd_f32s(row).0.as_chunks().0
}

/// Like [`tiles`], but mutable.
#[inline(always)]
pub fn tiles_mut<S: Simd>(row: &mut [f32]) -> &mut [Tile<S>] {
    S::as_mut_simd_f32s(row).0.as_chunks_mut().0
}

/// Rows that are used together are stored interleaved, in panels of [`LANES`] atoms with one row
/// after another in each panel. Returns the index of tile `t` of row `row` of `rows`.
#[inline(always)]
pub fn tile_index<S: Simd>(t: usize, row: usize, rows: usize) -> usize {
    let (first, step) = panel::<S>(t, rows);
    first + row * step
}

/// The index of the entry of atom `k` in row `row`.
#[cfg(test)]
pub fn panel_index(k: usize, row: usize, rows: usize) -> usize {
    (k / LANES * rows + row) * LANES + k % LANES
}

/// The index of tile `t` of the first row, and the number of tiles from one row to the next.
#[inline(always)]
pub fn panel<S: Simd>(t: usize, rows: usize) -> (usize, usize) {
    let step = LANES / (TILE * S::F32_LANES);
    (t / step * rows * step + t % step, step)
}

/// `y -= weights * factor`.
#[inline(always)]
pub fn subtract_scaled<S: Simd>(simd: S, y: &mut Tile<S>, weights: &Tile<S>, factor: f32) {
    let factor = simd.splat_f32s(-factor);
    for i in 0..TILE {
        y[i] = mul_add(simd, weights[i], factor, y[i]);
    }
}

/// `tile += number`.
#[inline(always)]
pub fn add<S: Simd>(simd: S, tile: &mut Tile<S>, number: f32) {
    let number = simd.splat_f32s(number);
    for v in tile {
        *v = simd.add_f32s(*v, number);
    }
}

/// `squares += y^2`.
#[inline(always)]
pub fn add_squares<S: Simd>(simd: S, squares: &mut Tile<S>, y: &Tile<S>) {
    for i in 0..TILE {
        squares[i] = mul_add(simd, y[i], y[i], squares[i]);
    }
}

/// `a b + c`, fused where the processor supports it. A call for every fused operation would make
/// plain code twenty times slower.
#[inline(always)]
pub fn mul_add<S: Simd>(simd: S, a: S::f32s, b: S::f32s, c: S::f32s) -> S::f32s {
    if is_plain::<S>() {
        simd.add_f32s(simd.mul_f32s(a, b), c)
    } else {
        simd.mul_add_e_f32s(a, b, c)
    }
}

/// Converts `narrow` to `f64`.
#[inline(always)]
pub fn widen(wide: &mut Vec<f64>, narrow: &[f32]) {
    wide.resize(narrow.len(), 0.0);
    for (wide, &narrow) in wide.iter_mut().zip(narrow) {
        *wide = f64::from(narrow);
    }
}

/// Calls `take` with the index of each vector and its inner product with `wide`. As many products
/// are computed at once as have room for their sums in registers.
#[inline(always)]
pub fn dots_each<'a, S: Simd>(
    simd: S,
    wide: &[f64],
    vectors: impl Iterator<Item = &'a [f64]>,
    take: impl FnMut(usize, f64),
) {
    if S::REGISTER_COUNT >= 32 {
        dots_by::<S, 4>(simd, wide, vectors, take);
    } else {
        dots_by::<S, 2>(simd, wide, vectors, take);
    }
}

#[inline(always)]
fn dots_by<'a, S: Simd, const N: usize>(
    simd: S,
    wide: &[f64],
    mut vectors: impl Iterator<Item = &'a [f64]>,
    mut take: impl FnMut(usize, f64),
) {
    let mut number = 0;
    loop {
        let mut some: [&[f64]; N] = [&[]; N];
        let mut count = 0;
        for (slot, vector) in some.iter_mut().zip(&mut vectors) {
            *slot = vector;
            count += 1;
        }
        if count == N {
            for dot in dots_wide(simd, wide, some) {
                take(number, dot);
                number += 1;
            }
            continue;
        }
        for vector in &some[..count] {
            take(number, dot_wide(simd, wide, vector));
            number += 1;
        }
        return;
    }
}

/// Projects the unit vector `direction` out of `vector` and returns their inner product.
#[inline(always)]
pub fn project_out<S: Simd>(simd: S, vector: &mut [f64], direction: &[f64]) -> f64 {
    let projection = dot_wide(simd, vector, direction);
    subtract_scaled_wide(vector, direction, projection);
    projection
}

/// `vector -= direction * factor`.
#[inline(always)]
pub fn subtract_scaled_wide(vector: &mut [f64], direction: &[f64], factor: f64) {
    vector.iter_mut().zip(direction).for_each(|(v, d)| *v -= factor * d);
}
