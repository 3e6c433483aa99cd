//! Singular vectors and values of a few long columns, in place: the one-sided Jacobi method
//! (Hestenes, 1958; Demmel, Veselic, 1992).
//!
//! Each step rotates two columns in their common plane so that they become orthogonal. When all
//! pairs are orthogonal, the columns are the left singular vectors times the singular values. Even
//! the smallest singular values have full relative accuracy.
//!
//! With AVX2 it takes 49 % of the plain instructions (`benchmarks/record/speed.md`).

use crate::numeric::dot_wide;
use crate::numeric::instructions::{Instructions, dispatch_eight};
use pulp::Simd;

/// About ten suffice in practice.
const MAX_SWEEPS: usize = 60;

/// Rotates the columns, stored one after the other with `dim` samples each, until all pairs are
/// orthogonal.
pub fn orthogonalise(columns: &mut [f64], dim: usize) {
    orthogonalise_with(Instructions::default(), columns, dim);
}

fn orthogonalise_with(instructions: Instructions, columns: &mut [f64], dim: usize) {
    dispatch_eight!(instructions, |simd| {
        for _ in 0..MAX_SWEEPS {
            let (mut rotated, mut rest) = (false, &mut *columns);
            while let Some((first, others)) = rest.split_at_mut_checked(dim) {
                for other in others.chunks_exact_mut(dim) {
                    rotated |= rotate(simd, first, other);
                }
                rest = others;
            }
            if !rotated {
                return;
            }
        }
    });
}

/// Makes two columns orthogonal by a rotation; returns whether one was needed.
#[inline(always)]
fn rotate<S: Simd>(simd: S, a: &mut [f64], b: &mut [f64]) -> bool {
    let (aa, bb, ab) = (dot_wide(simd, a, a), dot_wide(simd, b, b), dot_wide(simd, a, b));
    // The rounding error of an inner product of this many terms.
    let tolerance = f64::EPSILON * (a.len() as f64).sqrt();
    let oblique = ab.abs() > tolerance * aa.sqrt() * bb.sqrt();
    if !oblique {
        return false;
    }
    let slope = (bb - aa) / (2.0 * ab);
    let tangent = 1.0f64.copysign(slope) / (slope.abs() + (1.0 + slope * slope).sqrt());
    let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
    let sine = cosine * tangent;
    for (a, b) in a.iter_mut().zip(b) {
        (*a, *b) = (cosine * *a - sine * *b, sine * *a + cosine * *b);
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;
    use proptest::prelude::*;

    /// Compares the columns with those of `U S`, where `U S V^T` is the singular value
    /// decomposition by another library.
    fn check(dim: usize, columns: &[f64]) -> Result<(), TestCaseError> {
        let before = DMatrix::from_column_slice(dim, columns.len() / dim, columns);
        let mut rotated = columns.to_vec();
        orthogonalise(&mut rotated, dim);
        let after = DMatrix::from_vec(dim, before.ncols(), rotated);
        let mut values: Vec<f64> = after.column_iter().map(|column| column.norm()).collect();
        values.sort_by(|a, b| b.total_cmp(a));
        let svd = before.clone().svd(false, false);
        let largest = svd.singular_values.amax();
        for (got, want) in values.iter().zip(svd.singular_values.iter()) {
            prop_assert!((got - want).abs() <= 1e-13 * largest, "{got} {want}");
        }
        // `U S S U^T = A A^T`: the columns span the same space, and they are orthogonal.
        let product = &before * before.transpose() - &after * after.transpose();
        prop_assert!(product.amax() <= 1e-13 * largest * largest);
        let mut gram = after.tr_mul(&after);
        gram.fill_diagonal(0.0);
        prop_assert!(gram.amax() <= 1e-13 * largest * largest);
        Ok(())
    }

    proptest! {
        #[test]
        fn orthogonalised_columns_match_the_svd(
            samples in prop::collection::vec(-1.0..1.0f64, 33 * 7),
            likeness in 0.0..1.0f64,
        ) {
            check(33, &samples)?;
            check(7, &samples[..21])?;
            // Nearly equal columns, a repeated column and a zero column.
            let mut alike = samples.clone();
            for k in 33..33 * 5 {
                alike[k] = samples[k % 33] + likeness.powi(20) * samples[k];
            }
            alike.copy_within(..33, 33 * 5);
            alike[33 * 6..].fill(0.0);
            check(33, &alike)?;
        }
    }

    #[test]
    fn empty_and_zero_columns_stay_as_they_are() {
        orthogonalise(&mut [], 5);
        let mut zeros = [0.0; 15];
        orthogonalise(&mut zeros, 5);
        assert_eq!(zeros, [0.0; 15]);
    }

    #[test]
    fn all_instructions_give_the_same_bits() {
        let samples: Vec<f64> = (0..70 * 9).map(|k| f64::from(k * 7919 % 251) / 251.0).collect();
        let rotated = |instructions: Instructions| {
            let mut columns = samples.clone();
            orthogonalise_with(instructions, &mut columns, 70);
            columns
        };
        let plain = rotated(Instructions::Plain);
        for (name, instructions) in Instructions::available() {
            assert_eq!(rotated(instructions), plain, "{name}");
        }
    }
}
