//! The correlations of signals with all atoms: a matrix product for few signals and a dictionary
//! that fits in the cache.

use super::vectors::{TILE, Tile, mul_add, tile_index, tiles};
use crate::patch_model::sparse::dictionary::LANES;
use pulp::Simd;

/// Writes the inner products of each signal (rows of `dim` samples) with the atoms of tile `t` of a
/// dictionary's panels, plus that atom's entry of `base`, to this tile's entries of `out`.
#[inline(always)]
pub fn correlate<S: Simd>(
    simd: S,
    signals: &[f32],
    (panels, dim): (&[f32], usize),
    (t, base): (usize, &Tile<S>),
    out: &mut [Tile<S>],
) {
    let width = TILE * S::F32_LANES;
    let rows = signals.len() / dim;
    let panel = &panels[t * width / LANES * LANES * dim..][..LANES * dim];
    let panel = &panel[t * width % LANES..];
    let mut row = 0;
    while row < rows {
        let (signals, first) = (&signals[row * dim..], tile_index::<S>(t, row, rows));
        let parts = LANES / width;
        // As many signals at once as have room for their sums in registers.
        row += match rows - row {
            6.. if S::REGISTER_COUNT >= 32 => {
                products::<S, 6>(simd, signals, panel, base, (&mut out[first..], parts))
            }
            4.. if S::REGISTER_COUNT >= 32 => {
                products::<S, 4>(simd, signals, panel, base, (&mut out[first..], parts))
            }
            2.. => products::<S, 2>(simd, signals, panel, base, (&mut out[first..], parts)),
            _ => products::<S, 1>(simd, signals, panel, base, (&mut out[first..], parts)),
        }
    }
}

/// The products of the first `SIZE` signals; returns `SIZE`. Each row of `panel` begins with one
/// sample of each of the tile's atoms. The results are written to every `step`th tile of `out`.
#[inline(always)]
fn products<S: Simd, const SIZE: usize>(
    simd: S,
    signals: &[f32],
    panel: &[f32],
    base: &Tile<S>,
    (out, step): (&mut [Tile<S>], usize),
) -> usize {
    let dim = panel.len().div_ceil(LANES);
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
        for i in 0..TILE {
            out[g * step][i] = simd.add_f32s(sums[g][i], base[i]);
        }
    }
    SIZE
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::aligned::AlignedVec;
    use crate::numeric::instructions::{Instructions, dispatch};
    use crate::patch_model::sparse::dictionary::Dictionary;
    use crate::patch_model::sparse::somp::vectors::{panel_index, tiles_mut};

    #[inline(always)]
    fn correlate_all<S: Simd>(simd: S, signals: &[f32], dictionary: &Dictionary, out: &mut [f32]) {
        let (base, out) = ([simd.splat_f32s(0.5); TILE], tiles_mut::<S>(out));
        let panels = (&*dictionary.products().unwrap().panels, dictionary.dim());
        for t in 0..dictionary.stride() / (TILE * S::F32_LANES) {
            correlate(simd, signals, panels, (t, &base), out);
        }
    }

    /// Large enough to use every group size.
    const ROWS: usize = 13;

    #[test]
    fn correlations_are_inner_products() {
        let value = |k: usize| (k * 7919 % 251) as f32 / 251.0 - 0.3;
        for (dim, atoms) in [(64, 169), (5, 3), (256, 64)] {
            let dictionary = Dictionary::new(dim, 1, (0..dim * atoms).map(value).collect());
            let signals: Vec<f32> = (0..ROWS * dim).map(|k| value(k + 17)).collect();
            let mut out = AlignedVec::default();
            out.resize(ROWS * dictionary.stride());
            let (rows, all, correlations) = (&signals[..], &dictionary, &mut out[..]);
            dispatch!(Instructions::default(), |simd| correlate_all(simd, rows, all, correlations));
            for (row, signal) in signals.chunks_exact(dim).enumerate() {
                let at = |k: usize| out[panel_index(k, row, ROWS)] - 0.5;
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
