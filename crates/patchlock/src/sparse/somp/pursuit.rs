//! One candidate on its way from the first atom to its code.
//! The exact part (basis, triangle, residuals) is `f64`; the rows over all atoms are the screen's.

use super::prefix::Prefix;
use super::screen::{Bound, Exact, Screened, Step, U, dot, project_out};
use crate::config::MAX_ATOMS;
use crate::sparse::codes::{Code, CodeRules};
use crate::sparse::dictionary::Dictionary;
use pulp::Simd;

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
    /// Error bounds of their correlations.
    errors: Vec<f64>,
    /// `w_2, w_3, ..`, a row each; the same for the screen.
    weights: Vec<f64>,
    weights_rounded: Vec<f32>,
    /// `q_j^T r` from `q_2` on, for the screen: of the candidate, and of each shared column.
    along_rounded: [f32; MAX_ATOMS],
    columns_along: Vec<[f32; MAX_ATOMS]>,
    screened: Screened,
}

/// What the chosen atoms leave, in `f64`.
struct Remainder<'a> {
    dictionary: &'a Dictionary,
    support: &'a [usize],
    basis: &'a [f64],
    residuals: &'a [f64],
    min_residual: f64,
}

impl Exact for Remainder<'_> {
    #[inline(always)]
    fn squares_and_left(&self, k: usize) -> Option<(f64, f64)> {
        if self.support.contains(&k) {
            return None;
        }
        let (dim, atom) = (self.dictionary.dim(), self.dictionary.atom(k));
        let mut left = self.dictionary.squared_norm(k);
        for q in self.basis.chunks_exact(dim) {
            left -= dot(atom, q).powi(2);
        }
        if left < self.min_residual {
            return None;
        }
        let mut squares = 0.0;
        for residual in self.residuals.chunks_exact(dim) {
            squares += dot(atom, residual).powi(2);
        }
        Some((squares, left))
    }
}

impl Pursuit {
    /// Puts the candidate, whose correlations err by at most `error`, behind the prefix's atom.
    #[inline(always)]
    pub fn begin(
        &mut self,
        dictionary: &Dictionary,
        prefix: &Prefix,
        candidate: &[f32],
        error: f64,
    ) {
        let (dim, stride) = (dictionary.dim(), dictionary.stride());
        self.support.clear();
        self.support.push(prefix.atom);
        self.basis.clear();
        self.basis.extend_from_slice(&prefix.direction);
        self.triangle[0][0] = prefix.norm;

        self.residuals.clear();
        self.residuals.extend_from_slice(&prefix.columns);
        self.residuals.extend(candidate.iter().map(|&v| f64::from(v)));
        let own = &mut self.residuals[prefix.columns.len()..];
        self.whole_energy = prefix.whole_energy + dot(own, own);
        self.along[0] = project_out(own, &prefix.direction);
        self.energy = prefix.energy + dot(own, own);

        let columns = self.residuals.len() / dim;
        self.columns_along.resize(columns - 1, [0.0; MAX_ATOMS]);
        self.errors.clear();
        self.errors.resize(columns, 0.0);
        self.errors[columns - 1] = error + self.along[0].abs() * 3.0 * U;
        self.weights.resize((MAX_ATOMS - 1) * stride, 0.0);
        self.weights_rounded.resize((MAX_ATOMS - 1) * stride, 0.0);
    }

    /// Chooses the atoms after the first, and gives the code. `correlations` are the candidate's with all atoms.
    #[inline(always)]
    pub fn run<S: Simd>(
        &mut self,
        simd: S,
        dictionary: &Dictionary,
        prefix: &Prefix,
        correlations: &[f32],
        rules: &CodeRules,
    ) -> Code {
        let final_energy = rules.final_energy(self.errors.len(), self.whole_energy);
        while self.support.len() < rules.atoms && self.energy > final_energy {
            let deep = self.support.len() - 1;
            if deep > 0 {
                self.find_weights(dictionary, prefix);
            }
            let step = Step {
                own: correlations,
                first: Some((&prefix.weights_rounded, self.along[0] as f32)),
                weights: &self.weights_rounded,
                along: &self.along_rounded[..deep],
                columns: &prefix.correlations,
                columns_along: &self.columns_along,
                columns_squared: &prefix.squares,
                left: &prefix.left,
            };
            let bound = Bound::new(self.errors.iter().map(|e| e * e).sum(), rules.selection);
            step.screen(simd, &bound, &mut self.screened);
            let exact = Remainder {
                dictionary,
                support: &self.support,
                basis: &self.basis,
                residuals: &self.residuals,
                min_residual: rules.min_residual,
            };
            match self.screened.best_exactly(simd, &bound, &exact) {
                Some(atom) => self.take(dictionary, atom, rules),
                None => break,
            }
        }
        self.code()
    }

    /// Adds an atom: extends basis and triangle, and projects its direction out of the residuals.
    #[inline(always)]
    fn take(&mut self, dictionary: &Dictionary, atom: usize, rules: &CodeRules) {
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
        self.support.push(atom);
        // The candidate is the last column. Once the code is complete, nobody asks for the shared ones.
        let (shared, own) = self.residuals.split_at_mut(self.columns_along.len() * dim);
        let (own_error, errors) = match self.errors.split_last_mut() {
            Some(split) => split,
            None => return,
        };
        let p = project_out(own, direction);
        self.along[step] = p;
        self.along_rounded[step - 1] = p as f32;
        *own_error += p.abs() * 3.0 * U;
        self.energy -= p * p;
        if self.support.len() < rules.atoms {
            let columns = self.columns_along.iter_mut().zip(errors);
            for (residual, (along, error)) in shared.chunks_exact_mut(dim).zip(columns) {
                let p = project_out(residual, direction);
                along[step - 1] = p as f32;
                *error += p.abs() * 3.0 * U;
                self.energy -= p * p;
            }
        }
    }

    /// `w` of the newest atom, from its row of the Gram matrix.
    #[inline(always)]
    fn find_weights(&mut self, dictionary: &Dictionary, prefix: &Prefix) {
        let (stride, newest) = (dictionary.stride(), self.support.len() - 1);
        let (older, weights) = self.weights.split_at_mut((newest - 1) * stride);
        let weights = &mut weights[..stride];
        let rounded = &mut self.weights_rounded[(newest - 1) * stride..][..stride];
        let gram = dictionary.gram_row(self.support[newest]);
        let inverse = 1.0 / self.triangle[newest][newest];
        let first_along = self.triangle[0][newest];
        for ((w, g), first) in weights.iter_mut().zip(gram).zip(&prefix.weights) {
            *w = g - first * first_along;
        }
        for (row, along) in older.chunks_exact(stride).zip(&self.triangle[1..]) {
            let along = along[newest];
            weights.iter_mut().zip(row).for_each(|(w, other)| *w -= other * along);
        }
        for (w, rounded) in weights.iter_mut().zip(rounded) {
            *w *= inverse;
            *rounded = *w as f32;
        }
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
