//! An atom in `f64`: whether it is eligible, and its score.

use super::node::Path;
use super::vectors::widen;
use crate::config::{MAX_ATOMS, Selection};
use crate::simd::dot_wide;
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
        if self.path.holds(atom) {
            return None;
        }
        widen(self.wide, self.dictionary.atom(atom));
        let mut triangle = [0.0; MAX_ATOMS];
        let mut left = self.dictionary.squared_norm(atom);
        for (along, node) in triangle.iter_mut().zip(self.path.nodes) {
            *along = dot_wide(simd, self.wide, &node.direction);
            left -= *along * *along;
        }
        if left < self.rules.min_residual {
            return None;
        }
        let norm = left.sqrt();
        triangle[self.path.nodes.len()] = norm;
        let own = dot_wide(simd, self.wide, residual);
        Some(Choice { atom, score: 0.0, left, own, triangle, along: own / norm })
    }

    /// The same with its score, if that is positive.
    #[inline(always)]
    pub fn weigh<S: Simd>(&mut self, simd: S, atom: usize, residual: &[f64]) -> Option<Choice> {
        let choice = self.place(simd, atom, residual)?;
        let mut squares = choice.own * choice.own;
        for residual in self.path.end().residuals.chunks_exact(self.wide.len()) {
            squares += dot_wide(simd, self.wide, residual).powi(2);
        }
        let score = match self.rules.selection {
            Selection::OrderRecursive => squares / choice.left,
            Selection::Textbook => squares,
        };
        (score > 0.0).then_some(Choice { score, ..choice })
    }
}
