//! Eligibility and score of an atom, computed in `f64`.

use super::node::{Node, Path};
use super::vectors::{U, dots_each, widen};
use crate::numeric::dot_wide;
use crate::patch_model::sparse::codes::{Code, CodeParams, MAX_ATOMS};
use crate::patch_model::sparse::dictionary::Dictionary;
use pulp::Simd;

/// An atom that can be chosen.
#[derive(Debug, Clone, Copy, Default)]
pub struct Choice {
    /// The atom.
    pub atom: usize,
    /// Its score.
    pub score: f64,
    /// `q_s^T d` for each `s`, then the norm of the atom's residual.
    pub triangle: [f64; MAX_ATOMS],
    /// `p` of the candidate for this atom.
    pub projection: f64,
}

/// Computes atoms in `f64` at a node.
#[derive(Debug)]
pub struct ExactAtoms<'a> {
    /// The dictionary.
    pub dictionary: &'a Dictionary,
    /// The atoms chosen so far.
    pub path: Path<'a>,
    /// How atoms are chosen.
    pub params: &'a CodeParams,
    /// Limits for the screen's lower bound `l` and upper bound of `||d_res||^2`: the atom is
    /// certainly eligible if `l` is at least the first, and certainly not if the upper bound is
    /// below the second.
    pub eligible: (f32, f32),
    /// Scratch space for one atom.
    pub wide: &'a mut Vec<f64>,
    /// Results for atoms at this node.
    pub cache: &'a mut AtomCache,
}

/// Results that depend on the node and the atom, but not on the candidate. Where patches have
/// little texture, many candidates need the same atoms.
#[derive(Debug, Default)]
pub struct AtomCache {
    /// Incremented at each node. Entries of an older generation are invalid.
    generation: u64,
    atoms: Vec<CachedAtom>,
}

/// The result for one atom.
#[derive(Debug, Clone, Copy, Default)]
struct CachedAtom {
    generation: u64,
    /// `||d_res||^2`.
    residual_energy: f64,
    /// `q_s^T d` for each `s`.
    triangle: [f64; MAX_ATOMS],
    /// The sum of the squared inner products with the residuals of the shared columns.
    squares: f64,
}

impl AtomCache {
    /// Invalidates all entries, for a node of a dictionary with this many atoms.
    #[inline(always)]
    pub fn begin(&mut self, atoms: usize) {
        self.generation += 1;
        self.atoms.resize(atoms, CachedAtom::default());
    }
}

/// The value of [`ExactAtoms::eligible`].
pub fn eligible(params: &CodeParams) -> (f32, f32) {
    // Exceeds the `f32` rounding errors of both limits.
    let slack = 16.0 * U;
    let least = params.min_residual;
    ((least * (1.0 + slack)) as f32, (least * (1.0 - slack)) as f32)
}

impl ExactAtoms<'_> {
    /// The atom as a choice without a score, if it is eligible. Used for the last atom of a code,
    /// whose score is not needed. `residual` is the candidate's residual.
    #[inline(always)]
    pub fn choice_without_score<S: Simd>(
        &mut self,
        simd: S,
        atom: usize,
        residual: &[f64],
    ) -> Option<Choice> {
        let (known, own) = self.compute(simd, atom, residual, &[]);
        self.eligible_choice(atom, &known, own)
    }

    /// The atom as a choice with its score, if it is eligible and the score is positive.
    #[inline(always)]
    pub fn choice_with_score<S: Simd>(
        &mut self,
        simd: S,
        atom: usize,
        residual: &[f64],
    ) -> Option<Choice> {
        let (known, own) = if self.cache.atoms[atom].generation == self.cache.generation {
            widen(self.wide, self.dictionary.atom(atom));
            (self.cache.atoms[atom], dot_wide(simd, self.wide, residual))
        } else {
            let shared = &self.path.end().residuals;
            let (known, own) = self.compute(simd, atom, residual, shared);
            self.cache.atoms[atom] = known;
            (known, own)
        };
        let choice = self.eligible_choice(atom, &known, own)?;
        let squares = own * own + known.squares;
        let score = squares / known.residual_energy;
        (score > 0.0).then_some(Choice { score, ..choice })
    }

    /// The result for the atom with these shared columns, and its inner product with the
    /// candidate's residual.
    #[inline(always)]
    fn compute<S: Simd>(
        &mut self,
        simd: S,
        atom: usize,
        residual: &[f64],
        shared: &[f64],
    ) -> (CachedAtom, f64) {
        let (wide, depth) = (&mut *self.wide, self.path.nodes.len());
        widen(wide, self.dictionary.atom(atom));
        let residual_energy = self.dictionary.squared_norm(atom);
        let mut known = CachedAtom {
            generation: self.cache.generation,
            residual_energy,
            ..CachedAtom::default()
        };
        let mut own = 0.0;
        let directions = self.path.nodes.iter().map(|node| &*node.direction);
        let signals = std::iter::once(residual).chain(shared.chunks_exact(wide.len()));
        dots_each(simd, wide, directions.chain(signals), |number, dot| match number {
            _ if number < depth => {
                known.triangle[number] = dot;
                known.residual_energy -= dot * dot;
            }
            _ if number == depth => own = dot,
            _ => known.squares += dot * dot,
        });
        (known, own)
    }

    /// The atom as a choice without a score, if it is eligible.
    #[inline(always)]
    fn eligible_choice(&self, atom: usize, known: &CachedAtom, own: f64) -> Option<Choice> {
        if self.path.contains(atom) || known.residual_energy < self.params.min_residual {
            return None;
        }
        let norm = known.residual_energy.sqrt();
        let mut triangle = known.triangle;
        triangle[self.path.nodes.len()] = norm;
        Some(Choice { atom, score: 0.0, triangle, projection: own / norm })
    }
}

/// A candidate's code from its projections: the least-squares coefficients for the atoms of the nodes and of the last
/// choice, by back substitution in the triangular factor.
pub fn code(nodes: &[Node], mut projections: [f64; MAX_ATOMS], last: Option<&Choice>) -> Code {
    let mut support = [0; MAX_ATOMS];
    let mut triangle = [[0.0; MAX_ATOMS]; MAX_ATOMS];
    let mut length = nodes.len();
    for (k, node) in nodes.iter().enumerate() {
        (support[k], triangle[k]) = (node.atom, node.triangle);
    }
    if let Some(choice) = last {
        (support[length], triangle[length], projections[length]) =
            (choice.atom, choice.triangle, choice.projection);
        length += 1;
    }
    let mut coefficients = [0.0; MAX_ATOMS];
    for j in (0..length).rev() {
        let known: f64 = (j + 1..length).map(|s| triangle[s][j] * coefficients[s]).sum();
        coefficients[j] = (projections[j] - known) / triangle[j][j];
    }
    Code::new(&support[..length], &coefficients[..length])
}
