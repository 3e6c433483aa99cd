//! One candidate on its way from the first atom to its code.
//! The exact part (basis, triangle, residuals) is `f64`; the rows over all atoms are the screen's.

use super::prefix::Prefix;
use super::screen::{
    Bound, U, WIDEN, best_exactly, dot, project_out, screen, subtract, widened_square,
};
use crate::config::MAX_ATOMS;
use crate::sparse::codes::{Code, CodeRules};
use crate::sparse::dictionary::Dictionary;

/// One candidate on its way; keep it for the next one, so that nothing is allocated.
#[derive(Debug, Default)]
pub struct Pursuit {
    support: Vec<usize>,
    /// `q_j`, one after the other.
    basis: Vec<f64>,
    /// `d_s = sum_j q_j triangle[j][s]`.
    triangle: [[f64; MAX_ATOMS]; MAX_ATOMS],
    /// `q_j^T r` of the candidate.
    along: [f64; MAX_ATOMS],
    /// Energy of all signals before any atom was chosen, and what remains of it.
    whole_energy: f64,
    energy: f64,
    /// What remains of the shared columns, then of the candidate.
    residuals: Vec<f64>,
    /// Of each residual its inner product with the newest `q`, and the error bound of its row.
    projections: Vec<f64>,
    errors: Vec<f64>,
    /// Error bounds of `w_j`.
    weight_errors: [f64; MAX_ATOMS],
    /// `w_2, w_3, ..`, a row each.
    weights: Vec<f32>,
    /// The shared columns' correlations with the atoms, from the third atom on.
    correlations: Vec<f32>,
    /// The candidate's correlations with the atoms.
    own: Vec<f32>,
    /// Lower bounds of `||d_res||^2`, from the third atom on.
    left: Vec<f32>,
    /// For each atom the sum of the squared correlations.
    squares: Vec<f32>,
}

impl Pursuit {
    /// Puts the candidate behind the prefix's atom.
    #[inline(always)]
    pub fn begin(&mut self, dictionary: &Dictionary, prefix: &Prefix, candidate: &[f32]) {
        let (dim, stride) = (dictionary.dim(), dictionary.stride());
        self.support.clear();
        self.support.push(prefix.atom);
        self.basis.clear();
        self.basis.extend_from_slice(&prefix.direction);
        self.triangle[0][0] = prefix.norm;
        self.weight_errors[0] = U;

        self.residuals.clear();
        self.residuals.extend_from_slice(&prefix.columns);
        self.residuals.extend(candidate.iter().map(|&v| f64::from(v)));
        let own = &mut self.residuals[prefix.columns.len()..];
        self.whole_energy = prefix.whole_energy + dot(own, own);
        self.along[0] = project_out(own, &prefix.direction);
        self.energy = prefix.energy + dot(own, own);

        let columns = self.residuals.len() / dim;
        self.projections.resize(columns, 0.0);
        self.errors.clear();
        self.errors.resize(columns, 0.0);
        self.errors[columns - 1] = dim as f64 * U + self.along[0].abs() * 4.0 * U;
        for row in [&mut self.own, &mut self.left, &mut self.squares] {
            row.resize(stride, 0.0);
        }
        self.correlations.resize(prefix.correlations.len(), 0.0);
        self.weights.resize((MAX_ATOMS - 1) * stride, 0.0);
    }

    /// Chooses the atoms after the first, and gives the code. `correlations` are the candidate's with all atoms.
    #[inline(always)]
    pub fn run(
        &mut self,
        dictionary: &Dictionary,
        prefix: &Prefix,
        correlations: &[f32],
        rules: &CodeRules,
    ) -> Code {
        let final_energy = rules.final_energy(self.errors.len(), self.whole_energy);
        while self.support.len() < rules.atoms && self.energy > final_energy {
            let bound = Bound::new(self.errors.iter().map(|e| e * e).sum(), rules.selection);
            let best = if self.support.len() == 1 {
                self.own.copy_from_slice(correlations);
                subtract(&mut self.own, &prefix.weights, self.along[0] as f32);
                self.squares.copy_from_slice(&prefix.squares);
                let look = screen(&mut self.squares, &self.own, &prefix.left, rules.selection);
                let exact = |k| self.exact(dictionary, k, rules);
                best_exactly(look, &self.squares, &prefix.left, &bound, exact)
            } else {
                self.advance(dictionary, prefix);
                sum_squares(&self.correlations, dictionary.stride(), &mut self.squares);
                let look = screen(&mut self.squares, &self.own, &self.left, rules.selection);
                let exact = |k| self.exact(dictionary, k, rules);
                best_exactly(look, &self.squares, &self.left, &bound, exact)
            };
            match best {
                Some(atom) => self.take(dictionary, atom),
                None => break,
            }
        }
        self.code()
    }

    /// The sum of squared correlations of an atom with the residuals, and its `||d_res||^2`; none where it is not eligible.
    #[inline(always)]
    fn exact(&self, dictionary: &Dictionary, k: usize, rules: &CodeRules) -> Option<(f64, f64)> {
        let (dim, atom) = (dictionary.dim(), dictionary.atom(k));
        let explained: f64 = self.basis.chunks_exact(dim).map(|q| dot(atom, q).powi(2)).sum();
        let left = dictionary.squared_norm(k) - explained;
        if left < rules.min_residual || self.support.contains(&k) {
            return None;
        }
        Some((self.residuals.chunks_exact(dim).map(|r| dot(atom, r).powi(2)).sum(), left))
    }

    /// Adds an atom: extends basis and triangle, and projects its direction out of the residuals.
    #[inline(always)]
    fn take(&mut self, dictionary: &Dictionary, atom: usize) {
        let (dim, step) = (dictionary.dim(), self.support.len());
        let start = self.basis.len();
        self.basis.extend(dictionary.atom(atom).iter().map(|&v| f64::from(v)));
        let (basis, direction) = self.basis.split_at_mut(start);
        let mut along = [0.0; MAX_ATOMS];
        // Twice, so that the basis is orthonormal to rounding also where little is left of the atom.
        for _ in 0..2 {
            for (along, q) in along.iter_mut().zip(basis.chunks_exact(dim)) {
                *along += project_out(direction, q);
            }
        }
        let norm = dot(direction, direction).sqrt();
        direction.iter_mut().for_each(|v| *v /= norm);
        for (row, along) in self.triangle.iter_mut().zip(along).take(step) {
            row[step] = along;
        }
        self.triangle[step][step] = norm;
        let carried: f64 =
            along.iter().zip(&self.weight_errors).take(step).map(|(a, e)| a.abs() * e).sum();
        let weight_error = ((2 * step + 6) as f64 * U + carried) / norm;
        self.weight_errors[step] = weight_error;

        let columns = self.projections.iter_mut().zip(&mut self.errors);
        for (residual, (projection, error)) in self.residuals.chunks_exact_mut(dim).zip(columns) {
            *projection = project_out(residual, direction);
            *error += projection.abs() * (weight_error + 4.0 * U);
        }
        self.energy = dot(&self.residuals, &self.residuals);
        // The candidate is the last column.
        self.along[step] = self.projections.last().copied().unwrap_or_default();
        self.support.push(atom);
    }

    /// Projects the newest atom out of the screen's rows.
    #[inline(always)]
    fn advance(&mut self, dictionary: &Dictionary, prefix: &Prefix) {
        let stride = dictionary.stride();
        let newest = self.support.len() - 1;
        if newest == 1 {
            self.correlations.copy_from_slice(&prefix.correlations);
            self.left.copy_from_slice(&prefix.left);
        }
        let (older, weights) = self.weights.split_at_mut((newest - 1) * stride);
        let weights = &mut weights[..stride];
        weights.copy_from_slice(dictionary.gram_row(self.support[newest]));
        subtract(weights, &prefix.weights, self.triangle[0][newest] as f32);
        for (row, along) in older.chunks_exact(stride).zip(&self.triangle[1..]) {
            subtract(weights, row, along[newest] as f32);
        }
        let inverse = (1.0 / self.triangle[newest][newest]) as f32;
        let loss = widened_square(self.weight_errors[newest]);
        for (w, left) in weights.iter_mut().zip(&mut self.left) {
            *w *= inverse;
            *left -= WIDEN * *w * *w + loss;
        }
        for (row, &along) in self.correlations.chunks_exact_mut(stride).zip(&self.projections) {
            subtract(row, weights, along as f32);
        }
        subtract(&mut self.own, weights, self.along[newest] as f32);
    }

    /// The refitted coefficients of the candidate: back substitution in the triangle.
    fn code(&self) -> Code {
        let length = self.support.len();
        let mut coefficients = [0.0; MAX_ATOMS];
        for j in (0..length).rev() {
            let known: f64 = (j + 1..length).map(|s| self.triangle[j][s] * coefficients[s]).sum();
            coefficients[j] = (self.along[j] - known) / self.triangle[j][j];
        }
        Code::new(&self.support, &coefficients[..length])
    }
}

/// For each atom the sum of the squares of all rows.
#[inline(always)]
fn sum_squares(rows: &[f32], stride: usize, squares: &mut [f32]) {
    squares.fill(0.0);
    for row in rows.chunks_exact(stride) {
        squares.iter_mut().zip(row).for_each(|(s, x)| *s += x * x);
    }
}
