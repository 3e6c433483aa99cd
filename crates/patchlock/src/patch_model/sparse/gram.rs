//! The inner products of all atoms with each other, minus 1: a matrix product in `f64`, rounded to
//! `f32` once. The inner products of patches with little texture are all near 1; only the
//! difference from 1 distinguishes them.
//!
//! The product of two `f32` numbers is exact in `f64`, so fusing it with the addition changes
//! nothing: the bits are the same with all instructions.
//!
//! With AVX2 it takes 31 % of the plain instructions (`benchmarks/record/speed.md`).

use super::dictionary::LANES;
use crate::numeric::instructions::{Instructions, dispatch, is_plain};
use crate::numeric::parallel::*;
use pulp::{Simd, bytemuck};
use std::array;

/// Signals, and vectors of atoms, whose sums are kept in registers together.
pub const SIGNALS: usize = 4;
const VECTORS: usize = 2;
/// Vectors of atoms for a signal alone.
const VECTORS_ALONE: usize = 8;

/// Fills the rows of `out`, one per atom and with one entry per atom in `panels`. These are the
/// panels of a [`Dictionary`](super::dictionary::Dictionary): `dim` rows of [`LANES`] atoms each.
/// The padding holds -1, as for zero atoms.
pub fn fill(panels: &[f64], dim: usize, out: &mut [f32]) {
    let stride = panels.len() / dim.max(1);
    let rows = out.par_chunks_mut((LANES * stride).max(1));
    rows.zip(panels.par_chunks_exact((LANES * dim).max(1))).for_each(|(out, own)| {
        dispatch!(Instructions::default(), |simd| fill_rows(simd, own, (panels, dim), out));
    });
}

/// Fills `out` with the entries of this signal in place of an atom.
#[inline(always)]
pub fn fill_row<S: Simd>(simd: S, signal: &[f64], panels: &[f64], out: &mut [f32]) {
    let panels = panels.chunks_exact(LANES * signal.len());
    for (panel, out) in panels.zip(out.chunks_exact_mut(LANES)) {
        for column in (0..LANES).step_by(VECTORS_ALONE * S::F64_LANES) {
            let samples = signal.iter().map(|&sample| [sample]);
            let [sums] = products::<S, 1, VECTORS_ALONE>(simd, samples, panel, column);
            less_one::<S>(&sums, &mut out[column..]);
        }
    }
}

/// The same for many signals (rows of `dim` samples). `out` has panels, too: [`LANES`] entries for
/// each signal.
#[inline(always)]
pub fn fill_columns<S: Simd>(
    simd: S,
    signals: &[f64],
    (panels, dim): (&[f64], usize),
    samples: &mut Vec<[f64; SIGNALS]>,
    out: &mut [f32],
) {
    let size = (signals.len() / dim * LANES).max(1);
    for (group, signals) in signals.chunks(SIGNALS * dim).enumerate() {
        samples.clear();
        samples.resize(dim, [0.0; SIGNALS]);
        for (k, signal) in signals.chunks_exact(dim).enumerate() {
            samples.iter_mut().zip(signal).for_each(|(samples, &sample)| samples[k] = sample);
        }
        for (panel, out) in panels.chunks_exact(LANES * dim).zip(out.chunks_exact_mut(size)) {
            let out = &mut out[group * SIGNALS * LANES..];
            for column in (0..LANES).step_by(VECTORS * S::F64_LANES) {
                let samples = samples.iter().copied();
                let sums = products::<S, SIGNALS, VECTORS>(simd, samples, panel, column);
                for (out, sums) in out.chunks_exact_mut(LANES).zip(&sums) {
                    less_one::<S>(sums, &mut out[column..]);
                }
            }
        }
    }
}

/// The inner products of the atoms of one panel with all atoms.
#[inline(always)]
fn fill_rows<S: Simd>(simd: S, own: &[f64], (panels, dim): (&[f64], usize), out: &mut [f32]) {
    let stride = panels.len() / dim;
    for (k, panel) in panels.chunks_exact(LANES * dim).enumerate() {
        // A few columns of the panel stay in the first-level cache while all rows are
        // multiplied by them.
        for column in (0..LANES).step_by(VECTORS * S::F64_LANES) {
            for (first, rows) in out.chunks_mut(SIGNALS * stride).enumerate() {
                let own = own[first * SIGNALS..].chunks(LANES);
                let samples = own.map(|own| array::from_fn(|k| own[..SIGNALS][k]));
                let sums = products::<S, SIGNALS, VECTORS>(simd, samples, panel, column);
                for (row, sums) in rows.chunks_exact_mut(stride).zip(&sums) {
                    less_one::<S>(sums, &mut row[k * LANES + column..]);
                }
            }
        }
    }
}

/// Subtracts 1 and rounds.
#[inline(always)]
fn less_one<S: Simd>(sums: &[S::f64s], out: &mut [f32]) {
    let sums: &[f64] = bytemuck::cast_slice(sums);
    out.iter_mut().zip(sums).for_each(|(out, &sum)| *out = (sum - 1.0) as f32);
}

/// The inner products of some signals with some vectors of a panel's atoms, beginning at a column.
#[inline(always)]
fn products<S: Simd, const N: usize, const V: usize>(
    simd: S,
    samples: impl Iterator<Item = [f64; N]>,
    panel: &[f64],
    column: usize,
) -> [[S::f64s; V]; N] {
    let mut sums = [[simd.splat_f64s(0.0); V]; N];
    for (samples, row) in samples.zip(panel.as_chunks::<LANES>().0) {
        let columns = &S::as_simd_f64s(row).0[column / S::F64_LANES..][..V];
        for (sums, sample) in sums.iter_mut().zip(samples) {
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

    const DIM: usize = 7;

    /// The first atoms of the second panel as signals, together and alone.
    #[inline(always)]
    fn fill_both<S: Simd>(simd: S, panels: &[f64], out: &mut [f32], alone: &mut [f32]) {
        let at = |k: usize, s: usize| panels[(DIM + s) * LANES + k];
        let signals: Vec<f64> = (0..7 * DIM).map(|k| at(k / DIM, k % DIM)).collect();
        fill_columns(simd, &signals, (panels, DIM), &mut Vec::new(), out);
        let each = signals.chunks_exact(DIM).zip(alone.chunks_exact_mut(3 * LANES));
        each.for_each(|(signal, out)| fill_row(simd, signal, panels, out));
    }

    #[test]
    fn all_instructions_give_the_same_bits() {
        let dim = DIM;
        let value = |k: usize| f64::from((k * 7919 % 251) as f32 / 251.0 - 0.3);
        let panels: Vec<f64> = (0..3 * LANES * dim).map(value).collect();
        let rows = |instructions: Instructions| {
            let mut out = vec![9.0; LANES * 3 * LANES];
            let (panels, rows) = (&panels[..], &mut out[..]);
            let own = &panels[LANES * dim..][..LANES * dim];
            dispatch!(instructions, |simd| fill_rows(simd, own, (panels, dim), rows));
            out
        };
        let plain = rows(Instructions::Plain);
        for (name, instructions) in Instructions::available() {
            assert_eq!(rows(instructions), plain, "{name}");
            // Seven are a whole group and a part of one.
            let (mut columns, mut alone) = (vec![9.0; 7 * 3 * LANES], vec![9.0; 7 * 3 * LANES]);
            let (panels, out, alone_out) = (&panels[..], &mut columns[..], &mut alone[..]);
            dispatch!(instructions, |simd| fill_both(simd, panels, out, alone_out));
            assert_eq!(alone, plain[..7 * 3 * LANES], "{name}");
            for (k, entry) in columns.iter().enumerate() {
                let (panel, signal, lane) = (k / (7 * LANES), k / LANES % 7, k % LANES);
                assert_eq!(*entry, plain[signal * 3 * LANES + panel * LANES + lane], "{name}");
            }
        }
        // Atom 2 of panel 1 with atom 4 of panel 2, counted from 0.
        let at = |panel: usize, k: usize, s: usize| panels[(panel * dim + s) * LANES + k];
        let product: f64 = (0..dim).map(|s| at(1, 2, s) * at(2, 4, s)).sum();
        assert_eq!(plain[2 * 3 * LANES + 2 * LANES + 4], (product - 1.0) as f32);
    }
}
