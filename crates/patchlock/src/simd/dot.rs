//! The inner product of samples.

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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn it_is_the_sum_of_products_at_every_length(pairs in prop::collection::vec((-1.0..1.0f32, -1.0..1.0f32), 0..80)) {
            let (a, b): (Vec<f32>, Vec<f32>) = pairs.iter().copied().unzip();
            let plain: f64 = pairs.iter().map(|&(a, b)| f64::from(a) * f64::from(b)).sum();
            prop_assert!((dot(&a, &b) - plain).abs() < 1e-13);
        }
    }
}
