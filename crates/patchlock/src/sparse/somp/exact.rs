//! An atom in `f64`: whether it is eligible, and its score.

use super::node::Path;
use super::vectors::{dots_each, widen};
use crate::config::{MAX_ATOMS, Selection};
use crate::sparse::codes::CodeRules;
use crate::sparse::dictionary::Dictionary;
use pulp::Simd;

/// An atom that can be chosen.
#[derive(Debug, Clone, Copy, Default)]
pub struct Choice {
    /// The atom.
    pub atom: usize,
    /// Its score.
    pub score: f64,
    /// `||d_res||^2`.
    left: f64,
    /// The inner product with what is left of the candidate.
    own: f64,
    /// `q_s^T d` for each `s`, then the norm that is left of it.
    pub triangle: [f64; MAX_ATOMS],
    /// `p` of the candidate along it.
    pub along: f64,
}

/// Computes atoms at a node.
#[derive(Debug)]
pub struct Exact<'a> {
    /// The dictionary.
    pub dictionary: &'a Dictionary,
    /// The atoms chosen so far.
    pub path: Path<'a>,
    /// How atoms are chosen.
    pub rules: &'a CodeRules,
    /// An atom is eligible for sure if the screen leaves this of its `||d_res||^2`.
    pub eligible_from: f32,
    /// Room for an atom.
    pub wide: &'a mut Vec<f64>,
}

/// What [`Exact::eligible_from`] is. The textbook's score divides by nothing, and so the screen has no `||d_res||^2` to tell by: none is enough.
pub fn eligible_from(rules: &CodeRules) -> f32 {
    let rounded = rules.min_residual as f32;
    match rules.selection {
        Selection::OrderRecursive if f64::from(rounded) < rules.min_residual => rounded.next_up(),
        Selection::OrderRecursive => rounded,
        Selection::Textbook => f32::INFINITY,
    }
}

impl Exact<'_> {
    /// The atom as a choice, if it is eligible, and where it is the last one: nothing asks for its score then, and it has none. `residual` is
    /// what the chosen atoms leave of the candidate.
    #[inline(always)]
    pub fn place<S: Simd>(&mut self, simd: S, atom: usize, residual: &[f64]) -> Option<Choice> {
        self.compute(simd, atom, residual, &[]).map(|(choice, _)| choice)
    }

    /// The same with its score, if that is positive.
    #[inline(always)]
    pub fn weigh<S: Simd>(&mut self, simd: S, atom: usize, residual: &[f64]) -> Option<Choice> {
        let shared = &self.path.end().residuals;
        let (choice, squares) = self.compute(simd, atom, residual, shared)?;
        let score = match self.rules.selection {
            Selection::OrderRecursive => squares / choice.left,
            Selection::Textbook => squares,
        };
        (score > 0.0).then_some(Choice { score, ..choice })
    }

    /// The atom as a choice, if it is eligible, and the sum of its squared inner products with what is left of the candidate and with these vectors.
    #[inline(always)]
    fn compute<S: Simd>(
        &mut self,
        simd: S,
        atom: usize,
        residual: &[f64],
        shared: &[f64],
    ) -> Option<(Choice, f64)> {
        if self.path.holds(atom) {
            return None;
        }
        let (wide, depth) = (&mut *self.wide, self.path.nodes.len());
        widen(wide, self.dictionary.atom(atom));
        let mut choice =
            Choice { atom, left: self.dictionary.squared_norm(atom), ..Choice::default() };
        let mut squares = 0.0;
        let directions = self.path.nodes.iter().map(|node| &*node.direction);
        let signals = std::iter::once(residual).chain(shared.chunks_exact(wide.len()));
        dots_each(simd, wide, directions.chain(signals), |number, dot| {
            if number < depth {
                choice.triangle[number] = dot;
                choice.left -= dot * dot;
                return;
            }
            if number == depth {
                choice.own = dot;
            }
            squares += dot * dot;
        });
        if choice.left < self.rules.min_residual {
            return None;
        }
        let norm = choice.left.sqrt();
        choice.triangle[depth] = norm;
        choice.along = choice.own / norm;
        Some((choice, squares))
    }
}
