//! The definition of a joint code, written to be obviously correct: in `f64`, and with every
//! projection of every step solved anew as a least-squares problem. It is far too slow for
//! tracking.

use nalgebra::DMatrix;
use patchlock::patch_model::sparse::codes::{Code, CodeParams, final_energy};
use patchlock::patch_model::sparse::dictionary::Dictionary;

/// Codes `candidate` jointly with the `shared` signals (rows of `dim` samples).
pub fn solve(
    dictionary: &Dictionary,
    shared: &[f32],
    candidate: &[f32],
    params: &CodeParams,
) -> Code {
    let dim = dictionary.dim();
    let atoms = matrix(dim, (0..dictionary.len()).map(|k| dictionary.atom(k)));
    let signals = matrix(dim, shared.chunks_exact(dim).chain([candidate]));
    let final_energy = final_energy(signals.norm_squared());

    let mut support: Vec<usize> = Vec::new();
    while support.len() < params.atoms {
        let chosen = atoms.select_columns(&support);
        let signal_residuals = &signals - &chosen * least_squares(&chosen, &signals);
        if signal_residuals.norm_squared() <= final_energy {
            break;
        }
        let atom_residuals = &atoms - &chosen * least_squares(&chosen, &atoms);
        match best_atom(&support, &signal_residuals, &atom_residuals, params) {
            Some(atom) => support.push(atom),
            None => break,
        }
    }
    let coefficients = least_squares(&atoms.select_columns(&support), &signals);
    let of_candidate = coefficients.column(signals.ncols() - 1);
    Code::new(&support, &of_candidate.iter().copied().collect::<Vec<_>>())
}

/// The eligible atom with the largest positive score; in a tie, the first.
fn best_atom(
    support: &[usize],
    signal_residuals: &DMatrix<f64>,
    atom_residuals: &DMatrix<f64>,
    params: &CodeParams,
) -> Option<usize> {
    let mut best = (None, 0.0);
    for (k, atom) in atom_residuals.column_iter().enumerate() {
        let residual_energy = atom.norm_squared();
        if residual_energy < params.min_residual || support.contains(&k) {
            continue;
        }
        let score = signal_residuals.tr_mul(&atom).norm_squared() / residual_energy;
        if score > best.1 {
            best = (Some(k), score);
        }
    }
    best.0
}

/// The coefficients `x` that minimise `||right - left x||` for every column of `right`.
fn least_squares(left: &DMatrix<f64>, right: &DMatrix<f64>) -> DMatrix<f64> {
    let qr = left.clone().qr();
    let projected = qr.q().tr_mul(right);
    // Eligible atoms are linearly independent, so the triangular factor is regular, unless it is
    // empty.
    qr.r()
        .solve_upper_triangular(&projected)
        .unwrap_or_else(|| DMatrix::zeros(left.ncols(), right.ncols()))
}

fn matrix<'a>(dim: usize, columns: impl Iterator<Item = &'a [f32]>) -> DMatrix<f64> {
    let samples: Vec<f64> = columns.flatten().map(|&v| f64::from(v)).collect();
    DMatrix::from_vec(dim, samples.len() / dim, samples)
}
