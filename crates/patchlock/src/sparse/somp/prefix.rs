//! What the candidates of a location share: before any atom is chosen, and after the first one.

use super::screen::{DEAD, alive, dot, project_out};
use crate::sparse::codes::CodeRules;
use crate::sparse::dictionary::Dictionary;

/// The location before any atom is chosen. Rows run over all atoms and are padded to `stride`.
#[derive(Debug, Default)]
pub struct Shared {
    /// The shared columns.
    pub columns: Vec<f64>,
    /// Their energy.
    pub energy: f64,
    /// Their correlations with the atoms, a row for each column.
    pub correlations: Vec<f64>,
    /// For each atom the sum of their squared correlations.
    pub squares: Vec<f64>,
    /// The same for the screen.
    pub squares_rounded: Vec<f32>,
    /// `||d||^2` of each atom, or [`DEAD`].
    pub left: Vec<f32>,
    dim: usize,
}

impl Shared {
    /// Number of shared columns.
    pub fn count(&self) -> usize {
        self.columns.len() / self.dim.max(1)
    }

    /// Fills in everything for these shared columns.
    #[inline(always)]
    pub fn fill(&mut self, dictionary: &Dictionary, shared: &[f32], rules: &CodeRules) {
        let (dim, stride, count) = (dictionary.dim(), dictionary.stride(), dictionary.len());
        self.dim = dim;
        self.columns.clear();
        self.columns.extend(shared.iter().map(|&v| f64::from(v)));
        self.energy = dot(&self.columns, &self.columns);
        self.correlations.clear();
        self.correlations.resize(self.count() * stride, 0.0);
        self.squares.clear();
        self.squares.resize(stride, 0.0);
        let rows = self.correlations.chunks_exact_mut(stride);
        for (column, row) in self.columns.chunks_exact(dim).zip(rows) {
            for (k, (x, square)) in row.iter_mut().zip(&mut self.squares).take(count).enumerate() {
                *x = dot(dictionary.atom(k), column);
                *square += *x * *x;
            }
        }
        self.squares_rounded.clear();
        self.squares_rounded.extend(self.squares.iter().map(|&s| s as f32));
        self.left.clear();
        let left = (0..count).map(|k| alive(dictionary.squared_norm(k), rules.min_residual));
        self.left.extend(left);
        self.left.resize(stride, DEAD);
    }
}

/// The location after one atom.
#[derive(Debug, Default)]
pub struct Prefix {
    /// The atom.
    pub atom: usize,
    /// `q_1`, the atom's direction.
    pub direction: Vec<f64>,
    /// The atom's norm.
    pub norm: f64,
    /// The energy of the shared columns before the atom was projected out.
    pub whole_energy: f64,
    /// The shared columns with the atom projected out, and their energy.
    pub columns: Vec<f64>,
    /// Their energy.
    pub energy: f64,
    /// `w_1`, the inner products of `q_1` with all atoms.
    pub weights: Vec<f32>,
    /// The columns' correlations with the atoms, a row for each column.
    pub correlations: Vec<f32>,
    /// For each atom the sum of the squared correlations.
    pub squares: Vec<f32>,
    /// `||d_res||^2` of each atom, or [`DEAD`].
    pub left: Vec<f32>,
    exact_weights: Vec<f64>,
    exact_squares: Vec<f64>,
}

impl Prefix {
    /// Fills in everything for `atom` as the first one.
    #[inline(always)]
    pub fn fill(
        &mut self,
        dictionary: &Dictionary,
        shared: &Shared,
        atom: usize,
        rules: &CodeRules,
    ) {
        let (dim, stride, count) = (dictionary.dim(), dictionary.stride(), dictionary.len());
        self.atom = atom;
        self.norm = dictionary.squared_norm(atom).sqrt();
        self.direction.clear();
        self.direction.extend(dictionary.atom(atom).iter().map(|&v| f64::from(v) / self.norm));
        self.exact_weights.clear();
        self.exact_weights.extend((0..count).map(|k| dot(dictionary.atom(k), &self.direction)));
        self.exact_weights.resize(stride, 0.0);
        self.weights.clear();
        self.weights.extend(self.exact_weights.iter().map(|&w| w as f32));
        self.left.clear();
        self.left.extend((0..count).map(|k| {
            alive(dictionary.squared_norm(k) - self.exact_weights[k].powi(2), rules.min_residual)
        }));
        self.left.resize(stride, DEAD);
        self.left[atom] = DEAD;
        self.project_columns(shared, dim, stride);
    }

    #[inline(always)]
    fn project_columns(&mut self, shared: &Shared, dim: usize, stride: usize) {
        self.whole_energy = shared.energy;
        self.columns.clone_from(&shared.columns);
        self.correlations.resize(shared.correlations.len(), 0.0);
        self.exact_squares.clear();
        self.exact_squares.resize(stride, 0.0);
        let rows = self.correlations.chunks_exact_mut(stride);
        let rows = rows.zip(shared.correlations.chunks_exact(stride));
        for (column, (to, from)) in self.columns.chunks_exact_mut(dim).zip(rows) {
            let along = project_out(column, &self.direction);
            for k in 0..stride {
                let x = from[k] - self.exact_weights[k] * along;
                to[k] = x as f32;
                self.exact_squares[k] += x * x;
            }
        }
        self.energy = dot(&self.columns, &self.columns);
        self.squares.clear();
        self.squares.extend(self.exact_squares.iter().map(|&s| s as f32));
    }
}
