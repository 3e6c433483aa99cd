//! Compares the incremental subspace with a single SVD of all columns so far, by numpy.

use crate::{difference, golden};
use nalgebra::{DMatrix, DVector};
use patchlock::patch_model::subspace::{Subspace, SubspaceParams, SubspaceScratch};
use serde::Deserialize;

#[derive(Deserialize)]
struct File {
    dimension: usize,
    probes: Vec<Vec<f32>>,
    sequences: Vec<Sequence>,
}

#[derive(Deserialize)]
struct Sequence {
    name: String,
    max_rank: usize,
    batches: Vec<Batch>,
}

#[derive(Deserialize)]
struct Batch {
    columns: Vec<Vec<f32>>,
    mean: Vec<f64>,
    singular_values: Vec<f64>,
    projections: Vec<Vec<f64>>,
}

/// Adds the batches of a sequence, and compares after each.
fn check(sequence: &Sequence, probes: &[Vec<f32>]) {
    let Sequence { name, max_rank, batches } = sequence;
    let params = SubspaceParams { forgetting: 1.0, keep: 1e-12, vectors: *max_rank };
    let (mut subspace, mut scratch) = (Subspace::default(), SubspaceScratch::default());
    for (k, batch) in batches.iter().enumerate() {
        subspace.add(&batch.columns, &params, &mut scratch);
        assert!(difference(subspace.mean().iter(), &batch.mean) < 1e-8, "{name} {k}: mean");
        let values = subspace.values();
        assert_eq!(values.len(), batch.singular_values.len(), "{name} {k}: {values:?}");
        assert!(difference(values, &batch.singular_values) < 1e-8, "{name} {k}: {values:?}");
        let dim = subspace.mean().len();
        let basis = DMatrix::from_column_slice(dim, values.len(), subspace.basis());
        for (probe, want) in probes.iter().zip(&batch.projections) {
            let probe = DVector::from_iterator(probe.len(), probe.iter().map(|&v| f64::from(v)));
            let got = &basis * basis.tr_mul(&probe);
            assert!(difference(got.iter(), want) < 1e-8, "{name} {k}: projection");
        }
    }
}

#[test]
fn every_update_matches_the_svd_of_all_columns() {
    let file: File = golden("subspace.json");
    assert_eq!((file.dimension, file.sequences.len()), (60, 5));
    file.sequences.iter().for_each(|sequence| check(sequence, &file.probes));
}
