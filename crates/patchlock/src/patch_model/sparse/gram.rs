//! The inner products of all atoms with each other, minus 1: a matrix product in `f64`, rounded to
//! `f32` once. The inner products of patches with little texture are all near 1; only the
//! difference from 1 distinguishes them.
//!
//! The product of two `f32` numbers is exact in `f64`, so fusing it with the addition changes
//! nothing: the bits are the same with all instructions.
//!
//! With AVX2 it takes 31 % of the plain instructions (`benchmarks/record/2026-11-25-vectors.md`).

use super::dictionary::LANES;
use crate::numeric::instructions::{Instructions, is_plain};
use crate::numeric::parallel::*;
use pulp::{Simd, WithSimd, bytemuck};

/// Rows, and vectors per row, whose sums are kept in registers together.
const ROWS: usize = 4;
const VECTORS: usize = 2;

/// Fills the rows of `out`, one per atom and with one entry per atom in `panels`. These are the
/// panels of a [`Dictionary`](super::dictionary::Dictionary): `dim` rows of [`LANES`] atoms each.
pub fn fill(panels: &[f64], dim: usize, out: &mut [f32]) {
    let stride = panels.len() / dim.max(1);
    let rows = out.par_chunks_mut((LANES * stride).max(1));
    rows.zip(panels.par_chunks_exact((LANES * dim).max(1))).for_each(|(out, own)| {
        Instructions::default().dispatch(Rows { own, panels, dim, out });
    });
}

/// The inner products of the atoms of one panel with all atoms.
struct Rows<'a> {
    own: &'a [f64],
    panels: &'a [f64],
    dim: usize,
    out: &'a mut [f32],
}

impl WithSimd for Rows<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { own, panels, dim, out } = self;
        let stride = panels.len() / dim;
        for (k, panel) in panels.chunks_exact(LANES * dim).enumerate() {
            // A few columns of the panel stay in the first-level cache while all rows are
            // multiplied by them.
            for column in (0..LANES).step_by(VECTORS * S::F64_LANES) {
                for (first, rows) in out.chunks_mut(ROWS * stride).enumerate() {
                    let sums = products(simd, &own[first * ROWS..], &panel[column..]);
                    for (row, sums) in rows.chunks_exact_mut(stride).zip(&sums) {
                        let sums: &[f64] = bytemuck::cast_slice(sums);
                        let entries = &mut row[k * LANES + column..][..sums.len()];
                        entries
                            .iter_mut()
                            .zip(sums)
                            .for_each(|(out, &sum)| *out = (sum - 1.0) as f32);
                    }
                }
            }
        }
    }
}

/// The inner products of the first atoms of two panels; the slices begin at these atoms.
#[inline(always)]
fn products<S: Simd>(simd: S, rows: &[f64], columns: &[f64]) -> [[S::f64s; VECTORS]; ROWS] {
    let mut sums = [[simd.splat_f64s(0.0); VECTORS]; ROWS];
    for (rows, columns) in rows.chunks(LANES).zip(columns.chunks(LANES)) {
        let columns = &S::as_simd_f64s(columns).0[..VECTORS];
        for (sums, &sample) in sums.iter_mut().zip(&rows[..ROWS]) {
            let sample = simd.splat_f64s(sample);
            for (sum, &column) in sums.iter_mut().zip(columns) {
                *sum = mul_add(simd, sample, column, *sum);
            }
        }
    }
    sums
}

/// `a b + c`, fused where the processor supports it.
#[inline(always)]
fn mul_add<S: Simd>(simd: S, a: S::f64s, b: S::f64s, c: S::f64s) -> S::f64s {
    if is_plain::<S>() {
        simd.add_f64s(simd.mul_f64s(a, b), c)
    } else {
        simd.mul_add_e_f64s(a, b, c)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_instructions_give_the_same_bits() {
        let dim = 7;
        let value = |k: usize| f64::from((k * 7919 % 251) as f32 / 251.0 - 0.3);
        let panels: Vec<f64> = (0..3 * LANES * dim).map(value).collect();
        let rows = |instructions: Instructions| {
            let mut out = vec![9.0; LANES * 3 * LANES];
            let own = &panels[LANES * dim..][..LANES * dim];
            instructions.dispatch(Rows { own, panels: &panels, dim, out: &mut out });
            out
        };
        let plain = rows(Instructions::Plain);
        for (name, instructions) in Instructions::available() {
            assert_eq!(rows(instructions), plain, "{name}");
        }
        // Atom 2 of panel 1 with atom 4 of panel 2, counted from 0.
        let at = |panel: usize, k: usize, s: usize| panels[(panel * dim + s) * LANES + k];
        let product: f64 = (0..dim).map(|s| at(1, 2, s) * at(2, 4, s)).sum();
        assert_eq!(plain[2 * 3 * LANES + 2 * LANES + 4], (product - 1.0) as f32);
    }
}
