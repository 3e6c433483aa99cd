//! The subspace of the tracked candidates (Sec. 2.5): incremental SVD with mean update (Ross, Lim,
//! Lin, Yang, "Incremental learning for robust visual tracking", 2008).
//!
//! Without forgetting and truncation, the mean, singular values and basis after any number of
//! batches are those of all columns together. For a batch `B` of `m` columns with mean `b`, and `n`
//! earlier columns with mean `a`:
//!
//! ```text
//! B' = [B - b, sqrt(n m / (n + m)) (b - a)]
//! svd [f U S  B'] = U' S' V'                  basis U',  values S',  mean (f n a + m b) / (f n + m)
//! ```

use crate::numeric::singular::orthogonalise;
use serde::{Deserialize, Serialize};

/// Smaller squared singular values are rounding errors: the vectors have norm 1, and `f32` resolves
/// differences of 1e-8.
const NOISE: f64 = 1e-20;

/// No entry of the mean or the basis is larger, because the vectors have norm 1; includes rounding
/// errors.
const MAX_ENTRY: f64 = 1.001;

/// The squared singular values sum to at most this many times the weight. A batch of `m` unit
/// vectors adds at most `m` around its mean, and `n m / (n + m) < m` times the squared distance of
/// the means, which is at most 4; both sums then decay at least as fast as the weight.
const MAX_SQUARE_PER_WEIGHT: f64 = 5.0;

/// More vectors than any video has frames.
const MAX_WEIGHT: f64 = 1e15;

/// Maximum number of vectors that are added at once, because the time grows with its square. Longer
/// batches are split.
const MAX_BATCH: usize = 64;

/// How the subspace weights the past, and what it keeps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SubspaceParams {
    /// Weight of the past when a batch is added.
    pub forgetting: f64,
    /// A singular value is kept if its square is at least this share of the sum of squares.
    pub keep: f64,
    /// Maximum number of eigenvectors.
    pub vectors: usize,
}

/// Mean and principal directions of all vectors so far.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Subspace {
    mean: Vec<f64>,
    /// Orthonormal columns, one after the other.
    basis: Vec<f64>,
    values: Vec<f64>,
    weight: f64,
}

/// Working memory for adding a batch.
#[derive(Debug, Default)]
pub struct SubspaceScratch {
    columns: Vec<f64>,
    mean: Vec<f64>,
    /// Singular values with the indices of their columns.
    values: Vec<(f64, usize)>,
}

impl Subspace {
    /// The mean.
    pub fn mean(&self) -> &[f64] {
        &self.mean
    }

    /// The eigenvectors, one after the other, each as long as the mean.
    pub fn basis(&self) -> &[f64] {
        &self.basis
    }

    /// The singular values in descending order.
    #[cfg(feature = "internals")]
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Whether this can be the subspace of vectors of length `dim`.
    pub fn fits(&self, dim: usize) -> bool {
        let entries = self.mean.iter().chain(&self.basis);
        let max_square = self.weight * MAX_SQUARE_PER_WEIGHT * MAX_ENTRY;
        self.mean.len() == dim
            && self.basis.len() == dim * self.values.len()
            && self.values.len() <= dim
            && (0.0..=MAX_WEIGHT).contains(&self.weight)
            && entries.into_iter().all(|v| v.abs() <= MAX_ENTRY)
            && self.values.iter().all(|v| (0.0..=max_square).contains(&(v * v)))
    }

    /// Adds a batch of vectors of equal length.
    pub fn add(
        &mut self,
        batch: &[Vec<f32>],
        params: &SubspaceParams,
        scratch: &mut SubspaceScratch,
    ) {
        let mut forgetting = params.forgetting;
        for part in batch.chunks(MAX_BATCH) {
            self.add_part(part, &SubspaceParams { forgetting, ..*params }, scratch);
            // Forgetting applies once per batch, not once per part.
            forgetting = 1.0;
        }
    }

    fn add_part(
        &mut self,
        batch: &[Vec<f32>],
        params: &SubspaceParams,
        scratch: &mut SubspaceScratch,
    ) {
        let Some(dim) = batch.first().map(Vec::len) else { return };
        let count = batch.len() as f64;
        self.mean.resize(dim, 0.0);
        scratch.set_mean(batch, dim);
        scratch.columns.clear();
        for (value, direction) in self.values.iter().zip(self.basis.chunks_exact(dim)) {
            let scale = params.forgetting * value;
            scratch.columns.extend(direction.iter().map(|v| scale * v));
        }
        for vector in batch {
            let centred = vector.iter().zip(&scratch.mean).map(|(&v, mean)| f64::from(v) - mean);
            scratch.columns.extend(centred);
        }
        if self.weight > 0.0 {
            let scale = (self.weight * count / (self.weight + count)).sqrt();
            let shift = scratch.mean.iter().zip(&self.mean).map(|(new, old)| (new - old) * scale);
            scratch.columns.extend(shift);
        }
        orthogonalise(&mut scratch.columns, dim);
        self.keep(params, scratch);
        let past = params.forgetting * self.weight;
        for (old, new) in self.mean.iter_mut().zip(&scratch.mean) {
            *old = (*old * past + new * count) / (past + count);
        }
        self.weight = past + count;
    }

    /// Keeps the largest of the orthogonal columns, as unit vectors with their singular values.
    fn keep(&mut self, params: &SubspaceParams, scratch: &mut SubspaceScratch) {
        let SubspaceScratch { columns, values, .. } = scratch;
        let dim = self.mean.len();
        let norm = |column: &[f64]| column.iter().map(|v| v * v).sum::<f64>().sqrt();
        values.clear();
        values.extend(columns.chunks_exact(dim).map(norm).zip(0..));
        let energy: f64 = values.iter().map(|(value, _)| value * value).sum();
        let threshold = (energy * params.keep).max(NOISE);
        values.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        values.retain(|(value, _)| *value > 0.0 && value * value >= threshold);
        values.truncate(params.vectors.min(dim));
        self.basis.clear();
        self.values.clear();
        for &(value, index) in values.iter() {
            let column = &columns[index * dim..][..dim];
            self.basis.extend(column.iter().map(|v| v / value));
            self.values.push(value);
        }
    }
}

impl SubspaceScratch {
    fn set_mean(&mut self, batch: &[Vec<f32>], dim: usize) {
        self.mean.clear();
        self.mean.resize(dim, 0.0);
        for vector in batch {
            self.mean.iter_mut().zip(vector).for_each(|(sum, &v)| *sum += f64::from(v));
        }
        self.mean.iter_mut().for_each(|sum| *sum /= batch.len() as f64);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    const ALL: SubspaceParams = SubspaceParams { forgetting: 1.0, keep: 1e-12, vectors: 64 };

    fn vectors(count: usize, dim: usize, seed: usize) -> Vec<Vec<f32>> {
        let mut rng = rand_pcg::Pcg64::new(seed as u128, 1);
        let mut value = || rand_distr::Distribution::sample(&rand_distr::StandardUniform, &mut rng);
        (0..count).map(|_| (0..dim).map(|_| value()).collect()).collect()
    }

    #[test]
    fn batches_give_what_all_columns_together_give() {
        let all = vectors(22, 30, 3);
        let (mut subspace, mut scratch) = (Subspace::default(), SubspaceScratch::default());
        for batch in [&all[..10], &all[10..15], &all[15..16], &all[16..22]] {
            subspace.add(batch, &ALL, &mut scratch);
        }
        let whole = DMatrix::from_iterator(30, 22, all.iter().flatten().map(|&v| f64::from(v)));
        let mean = whole.column_mean();
        let mut centred = whole;
        centred.column_iter_mut().for_each(|mut c| c -= &mean);
        let svd = centred.clone().svd(true, false);
        assert!((DVector::from_column_slice(subspace.mean()) - &mean).amax() < 1e-12);
        for (got, want) in subspace.values().iter().zip(svd.singular_values.iter()) {
            assert!((got - want).abs() < 1e-10, "{got} {want}");
        }
        let basis = DMatrix::from_column_slice(30, subspace.values().len(), subspace.basis());
        assert!(
            (basis.tr_mul(&basis) - DMatrix::identity(basis.ncols(), basis.ncols())).amax() < 1e-10
        );
        let left = (&basis * basis.tr_mul(&centred) - &centred).amax();
        assert!(left < 1e-9, "{left} {:?}", subspace.values());
    }

    #[test]
    fn repeated_vectors_and_limits() {
        let (mut subspace, mut scratch) = (Subspace::default(), SubspaceScratch::default());
        let one = vectors(1, 30, 1);
        subspace.add(&[one[0].clone(), one[0].clone()], &ALL, &mut scratch);
        assert!(subspace.values().is_empty() && subspace.fits(30));
        subspace.add(&vectors(12, 30, 2), &SubspaceParams { vectors: 4, ..ALL }, &mut scratch);
        assert_eq!(subspace.values().len(), 4);
        let before = subspace.values().to_vec();
        subspace.add(&one, &SubspaceParams { forgetting: 0.5, ..ALL }, &mut scratch);
        assert!(subspace.values()[0] < before[0]);
        assert!(!subspace.fits(29));
    }

    #[test]
    fn a_jump_of_the_mean_fits_whatever_is_forgotten() {
        let unit = |k: usize| (0..30).map(|i| f32::from(u8::from(i == k))).collect::<Vec<f32>>();
        let opposite: Vec<f32> = unit(0).into_iter().map(|v| -v).collect();
        for next in [unit(1), opposite] {
            for forgetting in [0.01, 0.1, 0.5, 0.8, 1.0] {
                let (mut subspace, mut scratch) = (Subspace::default(), SubspaceScratch::default());
                let params = SubspaceParams { forgetting, ..ALL };
                subspace.add(&vec![unit(0); 10], &params, &mut scratch);
                for _ in 0..5 {
                    subspace.add(std::slice::from_ref(&next), &params, &mut scratch);
                    assert!(subspace.fits(30), "{forgetting}: {:?}", subspace.values());
                }
            }
        }
    }

    #[test]
    fn a_long_batch_is_added_in_parts_and_decays_the_past_once() {
        let all = vectors(3 * MAX_BATCH + 5, 20, 4);
        let (mut long, mut scratch) = (Subspace::default(), SubspaceScratch::default());
        long.add(&all, &ALL, &mut scratch);
        let mut parts = Subspace::default();
        all.chunks(30).for_each(|part| parts.add(part, &ALL, &mut scratch));
        let pairs = long.values().iter().zip(parts.values());
        for (a, b) in pairs.chain(long.mean().iter().zip(parts.mean())) {
            assert!((a - b).abs() < 1e-10, "{a} {b}");
        }
        assert_eq!((long.values().len(), parts.values().len()), (20, 20));
        long.add(&all, &SubspaceParams { forgetting: 0.5, ..ALL }, &mut scratch);
        assert_eq!(long.weight, 1.5 * all.len() as f64);
    }
}
