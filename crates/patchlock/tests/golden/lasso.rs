//! Compares the reconstruction with trivial templates with scikit-learn and SPAMS.

use crate::{difference, golden};
use nalgebra::{DMatrix, DVector};
use patchlock::patch_model::sparse::lasso::Reconstruction;
use serde::Deserialize;

#[derive(Deserialize)]
struct File {
    rows: usize,
    columns: usize,
    lambda: f64,
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    y: Vec<f32>,
    u: Vec<Vec<f32>>,
    q: Vec<f64>,
    e: Vec<f64>,
    objective: f64,
}

#[test]
fn the_code_is_the_lasso_over_basis_and_trivial_templates() {
    let file: File = golden("lasso.json");
    assert_eq!(file.cases.len(), 6);
    for case in &file.cases {
        let y = DVector::from_iterator(file.rows, case.y.iter().map(|&v| f64::from(v)));
        let samples = case.u.iter().flatten().map(|&v| f64::from(v));
        let u = DMatrix::from_row_iterator(file.rows, file.columns, samples);
        let mut ours = Reconstruction::default();
        ours.solve(u.as_slice(), y.as_slice(), file.lambda);
        let [q, e] = [ours.coefficients(), ours.error()].map(DVector::from_column_slice);
        assert!(difference(q.iter(), &case.q) < 1e-6, "{q} {:?}", case.q);
        assert!(difference(e.iter(), &case.e) < 1e-6);
        let one_norm = |v: &DVector<f64>| v.iter().map(|v| v.abs()).sum::<f64>();
        let objective =
            (&y - &u * &q - &e).norm_squared() / 2.0 + file.lambda * (one_norm(&q) + one_norm(&e));
        assert!((objective - case.objective).abs() < 1e-9, "{objective} {}", case.objective);
    }
}
