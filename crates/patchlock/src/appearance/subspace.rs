//! The subspace of the tracked candidates (Sec. 2.5): incremental SVD with update of the mean (Ross, Lim, Lin, Yang, "Incremental
//! learning for robust visual tracking", 2008).
//!
//! After any number of batches, with nothing forgotten or cut off, mean, singular values and basis are those of all columns
//! together. For a batch `B` of `m` columns with mean `b`, and the `n` columns so far with mean `a`:
//!
//! ```text
//! B' = [B - b, sqrt(n m / (n + m)) (b - a)]       Q R' = B' - U U^T B'
//! svd [ f S  U^T B' ] = U' S' V'                  basis [U Q] U',  values S',  mean (f n a + m b) / (f n + m)
//!     [  0   Q^T B' ]
//! ```

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// Squared singular values below this are rounding: the vectors have norm 1, and `f32` resolves differences of 1e-8.
const NOISE: f64 = 1e-20;

/// A matrix of this size converges in some tens of iterations.
const MAX_SVD_ITERATIONS: usize = 10_000;

/// Nothing in the subspace of vectors of norm 1 is larger than this, rounding included.
const MAX_ENTRY: f64 = 1.001;

/// More vectors than any video has frames.
const MAX_WEIGHT: f64 = 1e15;

/// How the subspace forgets and what it keeps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SubspaceRules {
    /// Weight of the past when a batch comes in.
    pub forgetting: f64,
    /// Singular values are kept while their square is at least this share of the sum of squares.
    pub keep: f64,
    /// Most eigenvectors.
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

impl Subspace {
    /// The mean.
    pub fn mean(&self) -> DVector<f64> {
        DVector::from_column_slice(&self.mean)
    }

    /// The eigenvectors, as columns.
    pub fn basis(&self) -> DMatrix<f64> {
        DMatrix::from_column_slice(self.mean.len(), self.values.len(), &self.basis)
    }

    /// The singular values, the largest first.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Whether this could have come from vectors of length `dim`.
    pub fn fits(&self, dim: usize) -> bool {
        let entries = self.mean.iter().chain(&self.basis);
        // The squares of the values add to at most the number of vectors, which is the weight.
        let most = self.weight * MAX_ENTRY;
        self.mean.len() == dim
            && self.basis.len() == dim * self.values.len()
            && self.values.len() <= dim
            && (0.0..=MAX_WEIGHT).contains(&self.weight)
            && entries.into_iter().all(|v| v.abs() <= MAX_ENTRY)
            && self.values.iter().all(|v| (0.0..=most).contains(&(v * v)))
    }

    /// Takes in a batch of vectors of one length.
    pub fn add(&mut self, batch: &[Vec<f32>], rules: &SubspaceRules) {
        let Some(first) = batch.first() else { return };
        let (dim, count) = (first.len(), batch.len() as f64);
        let samples = batch.iter().flatten().map(|&v| f64::from(v));
        let columns = DMatrix::from_iterator(dim, batch.len(), samples);
        let batch_mean = columns.column_mean();
        let mut centred = columns;
        centred.column_iter_mut().for_each(|mut column| column -= &batch_mean);
        if self.weight == 0.0 {
            self.mean = vec![0.0; dim];
        } else {
            let shift =
                (&batch_mean - self.mean()) * (self.weight * count / (self.weight + count)).sqrt();
            centred = centred.insert_column(batch.len(), 0.0);
            centred.set_column(batch.len(), &shift);
        }
        self.rotate(&centred, rules);
        let past = rules.forgetting * self.weight;
        self.mean =
            ((self.mean() * past + batch_mean * count) / (past + count)).as_slice().to_vec();
        self.weight = past + count;
    }

    /// Takes centred columns into basis and singular values.
    fn rotate(&mut self, columns: &DMatrix<f64>, rules: &SubspaceRules) {
        let basis = self.basis();
        let inside = basis.tr_mul(columns);
        let outside = columns - &basis * &inside;
        let mut fresh = outside.qr().q();
        // Where nearly nothing lies outside, its directions are noise; a second pass keeps them orthogonal to the basis.
        fresh -= &basis * basis.tr_mul(&fresh);
        let old = self.values.len();
        let mut joint = DMatrix::zeros(old + fresh.ncols(), old + columns.ncols());
        for (k, value) in self.values.iter().enumerate() {
            joint[(k, k)] = rules.forgetting * value;
        }
        joint.view_mut((0, old), (old, columns.ncols())).copy_from(&inside);
        let below = fresh.tr_mul(columns);
        joint.view_mut((old, old), (fresh.ncols(), columns.ncols())).copy_from(&below);

        // Where it does not converge (nothing of norm 1 makes it so), the subspace stays as it was.
        let svd = joint.try_svd(true, false, f64::EPSILON, MAX_SVD_ITERATIONS);
        let Some((turn, values)) = svd.and_then(|svd| svd.u.map(|u| (u, svd.singular_values)))
        else {
            return;
        };
        let least = (values.norm_squared() * rules.keep).max(NOISE);
        let mut order: Vec<usize> = (0..values.len()).collect();
        order.sort_by(|&a, &b| values[b].total_cmp(&values[a]));
        order.retain(|&k| values[k] > 0.0 && values[k] * values[k] >= least);
        order.truncate(rules.vectors);
        let turn = turn.select_columns(&order);
        let next = basis * turn.rows(0, old) + fresh * turn.rows(old, turn.nrows() - old);
        self.basis = next.as_slice().to_vec();
        self.values = order.iter().map(|&k| values[k]).collect();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: SubspaceRules = SubspaceRules { forgetting: 1.0, keep: 1e-12, vectors: 64 };

    fn vectors(count: usize, dim: usize, seed: usize) -> Vec<Vec<f32>> {
        let mut rng = rand_pcg::Pcg64::new(seed as u128, 1);
        let mut value = || rand_distr::Distribution::sample(&rand_distr::StandardUniform, &mut rng);
        (0..count).map(|_| (0..dim).map(|_| value()).collect()).collect()
    }

    #[test]
    fn batches_give_what_all_columns_together_give() {
        let all = vectors(22, 30, 3);
        let mut subspace = Subspace::default();
        for batch in [&all[..10], &all[10..15], &all[15..16], &all[16..22]] {
            subspace.add(batch, &ALL);
        }
        let whole = DMatrix::from_iterator(30, 22, all.iter().flatten().map(|&v| f64::from(v)));
        let mean = whole.column_mean();
        let mut centred = whole;
        centred.column_iter_mut().for_each(|mut c| c -= &mean);
        let svd = centred.clone().svd(true, false);
        assert!((subspace.mean() - &mean).amax() < 1e-12);
        for (got, want) in subspace.values().iter().zip(svd.singular_values.iter()) {
            assert!((got - want).abs() < 1e-10, "{got} {want}");
        }
        let basis = subspace.basis();
        assert!(
            (basis.tr_mul(&basis) - DMatrix::identity(basis.ncols(), basis.ncols())).amax() < 1e-10
        );
        let left = (&basis * basis.tr_mul(&centred) - &centred).amax();
        assert!(left < 1e-9, "{left} {:?}", subspace.values());
    }

    #[test]
    fn repeated_vectors_and_limits() {
        let mut subspace = Subspace::default();
        let one = vectors(1, 30, 1);
        subspace.add(&[one[0].clone(), one[0].clone()], &ALL);
        assert!(subspace.values().is_empty() && subspace.fits(30));
        subspace.add(&vectors(12, 30, 2), &SubspaceRules { vectors: 4, ..ALL });
        assert_eq!(subspace.values().len(), 4);
        let before = subspace.values().to_vec();
        subspace.add(&one, &SubspaceRules { forgetting: 0.5, ..ALL });
        assert!(subspace.values()[0] < before[0]);
        assert!(!subspace.fits(29));
    }
}
