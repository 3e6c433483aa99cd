//! The correlations of signals with all atoms: a matrix product, shaped for few signals and a dictionary that stays in the cache.

use super::vectors::{TILE, mul_add, tiles, tiles_mut};
use crate::sparse::dictionary::{Dictionary, LANES};
use pulp::Simd;

/// The number of signals must be a multiple of this: their sums are kept in registers together.
pub const GROUP: usize = 6;

/// Of a group, as many as fit where there are only 16 registers.
const THIRD: usize = 2;

/// Writes the inner products of each signal (rows of `dim`, a multiple of [`GROUP`] of them) with each atom to `out`, in panels of
/// [`LANES`] atoms.
#[inline(always)]
pub fn correlate<S: Simd>(simd: S, signals: &[f32], dictionary: &Dictionary, out: &mut [f32]) {
    match S::REGISTER_COUNT >= 32 {
        true => by_groups::<S, GROUP>(simd, signals, dictionary, out),
        false => by_groups::<S, THIRD>(simd, signals, dictionary, out),
    }
}

/// Takes the signals `SIZE` at a time. A tile of atoms stays in the nearest cache meanwhile.
#[inline(always)]
fn by_groups<S: Simd, const SIZE: usize>(
    simd: S,
    signals: &[f32],
    dictionary: &Dictionary,
    out: &mut [f32],
) {
    let dim = dictionary.dim();
    let panels = dictionary.panels().chunks_exact(LANES * dim);
    let rows = signals.len() / dim;
    for (panel, out) in panels.zip(out.chunks_exact_mut(rows * LANES)) {
        for part in (0..LANES).step_by(TILE * S::F32_LANES) {
            let groups = signals.chunks_exact(SIZE * dim);
            for (group, out) in groups.zip(out.chunks_exact_mut(SIZE * LANES)) {
                products::<S, SIZE>(simd, group, &panel[part..], &mut out[part..]);
            }
        }
    }
}

/// The inner products of `SIZE` signals with a tile of atoms, of which every row of `panel` begins with a sample; each row of `out` begins with
/// where they go.
#[inline(always)]
fn products<S: Simd, const SIZE: usize>(simd: S, signals: &[f32], panel: &[f32], out: &mut [f32]) {
    let dim = signals.len() / SIZE;
    let mut each: [&[f32]; SIZE] = [&[]; SIZE];
    for g in 0..SIZE {
        each[g] = &signals[g * dim..][..dim];
    }
    let mut sums = [[simd.splat_f32s(0.0); TILE]; SIZE];
    for (s, row) in panel.chunks(LANES).take(dim).enumerate() {
        let tile = &tiles::<S>(&row[..TILE * S::F32_LANES])[0];
        for g in 0..SIZE {
            let sample = simd.splat_f32s(each[g][s]);
            for i in 0..TILE {
                sums[g][i] = mul_add(simd, sample, tile[i], sums[g][i]);
            }
        }
    }
    for g in 0..SIZE {
        let row = &mut out[g * LANES..][..TILE * S::F32_LANES];
        tiles_mut::<S>(row)[0] = sums[g];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparse::somp::vectors::place;
    use pulp::{Arch, WithSimd};

    struct Correlate<'a>(&'a [f32], &'a Dictionary, &'a mut [f32]);

    impl WithSimd for Correlate<'_> {
        type Output = ();

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) {
            correlate(simd, self.0, self.1, self.2);
        }
    }

    #[test]
    fn it_is_the_inner_products() {
        let value = |k: usize| (k * 7919 % 251) as f32 / 251.0 - 0.3;
        for (dim, atoms) in [(64, 169), (5, 3), (256, 64)] {
            let dictionary = Dictionary::new(dim, 1, (0..dim * atoms).map(value).collect());
            let signals: Vec<f32> = (0..2 * GROUP * dim).map(|k| value(k + 17)).collect();
            let mut out = vec![9.0; 2 * GROUP * dictionary.stride()];
            Arch::new().dispatch(Correlate(&signals, &dictionary, &mut out));
            for (row, signal) in signals.chunks_exact(dim).enumerate() {
                let at = |k: usize| out[place(k, row, 2 * GROUP)];
                for k in 0..atoms {
                    let pairs = signal.iter().zip(dictionary.atom(k));
                    let product: f64 = pairs.map(|(a, b)| f64::from(a * b)).sum();
                    assert!((f64::from(at(k)) - product).abs() < 1e-4, "{} {product}", at(k));
                }
                assert!((atoms..dictionary.stride()).all(|k| at(k) == 0.0));
            }
        }
    }
}
