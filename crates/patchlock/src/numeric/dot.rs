//! Inner products that give the same bits on every processor.
//!
//! With AVX2, `singular`, which uses [`dot_wide`], takes 49 % of the plain instructions
//! (`benchmarks/record/speed.md`).

use pulp::{Simd, bytemuck};

/// The inner product, summed in `f64`. The order of the sums does not depend on the vector width
/// and nothing is fused, so the bits are the same on every processor. It uses the instructions that
/// the caller is compiled for.
#[inline(always)]
pub fn dot(a: &[f32], b: &[f32]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<16>(), b.as_chunks::<16>());
    // Two independent sums hide the latency of an addition.
    let (mut low, mut high) = ([0.0; 8], [0.0; 8]);
    for (a, b) in a.iter().zip(b) {
        for lane in 0..8 {
            low[lane] += f64::from(a[lane]) * f64::from(b[lane]);
        }
        for lane in 0..8 {
            high[lane] += f64::from(a[8 + lane]) * f64::from(b[8 + lane]);
        }
    }
    let mut rest = 0.0;
    for (&a, &b) in a_rest.iter().zip(b_rest) {
        rest += f64::from(a) * f64::from(b);
    }
    for lane in 0..8 {
        low[lane] += high[lane];
    }
    ((low[0] + low[4]) + (low[2] + low[6])) + ((low[1] + low[5]) + (low[3] + low[7])) + rest
}

/// Number of the shortest `f64` vectors that hold 16 numbers.
const MAX_PARTS: usize = 16;

/// The same for numbers that are already `f64`; the bits are the same.
#[inline(always)]
pub fn dot_wide<S: Simd>(simd: S, a: &[f64], b: &[f64]) -> f64 {
    dots_wide(simd, a, [b])[0]
}

/// The same for several vectors at once. It takes little longer than for one, because the additions
/// are independent.
#[inline(always)]
pub fn dots_wide<S: Simd, const N: usize>(simd: S, a: &[f64], others: [&[f64]; N]) -> [f64; N] {
    let parts = 16 / S::F64_LANES;
    let length = others.iter().fold(a.len(), |length, b| length.min(b.len()));
    let (a, a_rest) = a[..length].as_chunks::<16>();
    let others = others.map(|b| b[..length].as_chunks::<16>());
    let mut sums = [[simd.splat_f64s(0.0); MAX_PARTS]; N];
    for (k, a) in a.iter().enumerate() {
        let a = S::as_simd_f64s(a).0;
        for (sums, (b, _)) in sums.iter_mut().zip(&others) {
            let b = S::as_simd_f64s(&b[k]).0;
            for part in 0..parts {
                sums[part] = simd.add_f64s(sums[part], simd.mul_f64s(a[part], b[part]));
            }
        }
    }
    let mut out = [0.0; N];
    for ((out, sums), (_, b_rest)) in out.iter_mut().zip(&mut sums).zip(&others) {
        for part in 0..parts / 2 {
            sums[part] = simd.add_f64s(sums[part], sums[part + parts / 2]);
        }
        let s: &[f64] = bytemuck::cast_slice(&sums[..parts / 2]);
        let mut rest = 0.0;
        for (&a, &b) in a_rest.iter().zip(*b_rest) {
            rest += a * b;
        }
        *out = ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7])) + rest;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::instructions::{Instructions, dispatch};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn dot_is_the_sum_of_products_at_every_length(
            pairs in prop::collection::vec((-1.0..1.0f32, -1.0..1.0f32), 0..80),
        ) {
            let (a, b): (Vec<f32>, Vec<f32>) = pairs.iter().copied().unzip();
            let plain: f64 = pairs.iter().map(|&(a, b)| f64::from(a) * f64::from(b)).sum();
            prop_assert!((dot(&a, &b) - plain).abs() < 1e-13);
            let wide = pairs.iter().map(|&(a, b)| (f64::from(a), f64::from(b)));
            let (wide_a, wide_b): (Vec<f64>, Vec<f64>) = wide.unzip();
            let (wide_a, wide_b) = (&wide_a[..], &wide_b[..]);
            for (name, instructions) in Instructions::available() {
                let wide = dispatch!(instructions, |simd| {
                    let [first, second] = dots_wide(simd, wide_a, [wide_b, wide_a]);
                    [first, second, dot_wide(simd, wide_a, wide_b)]
                });
                prop_assert!(wide[0].to_bits() == dot(&a, &b).to_bits(), "{name}");
                prop_assert!(wide[1].to_bits() == dot(&a, &a).to_bits(), "{name}");
                prop_assert!(wide[2].to_bits() == wide[0].to_bits(), "{name}");
            }
        }
    }
}
