//! The inner product of samples.

use pulp::{Simd, bytemuck};

/// The inner product in `f64`, added in an order that does not depend on the width of the vectors and never fused, so that it gives the same bits
/// on every processor. It is as fast as the instructions that the caller is compiled for.
#[inline(always)]
pub fn dot(a: &[f32], b: &[f32]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<16>(), b.as_chunks::<16>());
    // Two sums, so that an addition need not wait for the one before.
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

/// Vectors of `f64` that hold 16 numbers, where they are shortest.
const MOST_PARTS: usize = 16;

/// The same of numbers that are `f64` already, to the same bits.
#[inline(always)]
pub fn dot_wide<S: Simd>(simd: S, a: &[f64], b: &[f64]) -> f64 {
    let parts = 16 / S::F64_LANES;
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<16>(), b.as_chunks::<16>());
    let mut sums = [simd.splat_f64s(0.0); MOST_PARTS];
    for (a, b) in a.iter().zip(b) {
        let (a, b) = (S::as_simd_f64s(a).0, S::as_simd_f64s(b).0);
        for part in 0..parts {
            sums[part] = simd.add_f64s(sums[part], simd.mul_f64s(a[part], b[part]));
        }
    }
    for part in 0..parts / 2 {
        sums[part] = simd.add_f64s(sums[part], sums[part + parts / 2]);
    }
    let s: &[f64] = bytemuck::cast_slice(&sums[..parts / 2]);
    let mut rest = 0.0;
    for (&a, &b) in a_rest.iter().zip(b_rest) {
        rest += a * b;
    }
    ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7])) + rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::instructions::Instructions;
    use proptest::prelude::*;
    use pulp::WithSimd;

    struct Wide<'a>(&'a [f64], &'a [f64]);

    impl WithSimd for Wide<'_> {
        type Output = f64;

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> f64 {
            dot_wide(simd, self.0, self.1)
        }
    }

    proptest! {
        #[test]
        fn it_is_the_sum_of_products_at_every_length(pairs in prop::collection::vec((-1.0..1.0f32, -1.0..1.0f32), 0..80)) {
            let (a, b): (Vec<f32>, Vec<f32>) = pairs.iter().copied().unzip();
            let plain: f64 = pairs.iter().map(|&(a, b)| f64::from(a) * f64::from(b)).sum();
            prop_assert!((dot(&a, &b) - plain).abs() < 1e-13);
            let (wide_a, wide_b): (Vec<f64>, Vec<f64>) = pairs.iter().map(|&(a, b)| (f64::from(a), f64::from(b))).unzip();
            for (name, instructions) in Instructions::available() {
                let wide = instructions.dispatch(Wide(&wide_a, &wide_b));
                prop_assert!(wide.to_bits() == dot(&a, &b).to_bits(), "{name}");
            }
        }
    }
}
