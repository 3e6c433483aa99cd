//! An atom in `f64`: whether it is eligible, and its score.

use super::node::Path;
use super::vectors::dot;
use crate::config::{MAX_ATOMS, Selection};
use crate::sparse::codes::CodeRules;
use crate::sparse::dictionary::Dictionary;

/// An atom that can be chosen.
#[derive(Debug, Clone, Copy, Default)]
pub struct Choice {
    /// The atom.
    pub atom: usize,
    /// Its score.
    pub score: f64,
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
    /// Room for an atom.
    pub wide: &'a mut Vec<f64>,
}

impl Exact<'_> {
    /// Whether an atom is eligible of which at least `over` is left, according to the screen. The textbook's score divides by nothing, and
    /// so the screen has no `||d_res||^2`.
    #[inline(always)]
    pub fn surely_eligible(&self, over: f32) -> bool {
        self.rules.selection == Selection::OrderRecursive
            && f64::from(over) >= self.rules.min_residual
    }

    /// The atom as a choice, if it is eligible. `residual` is what the chosen atoms leave of the candidate.
    #[inline(always)]
    pub fn weigh(&mut self, atom: usize, residual: &[f64]) -> Option<Choice> {
        if self.path.holds(atom) {
            return None;
        }
        self.wide.clear();
        self.wide.extend(self.dictionary.atom(atom).iter().map(|&v| f64::from(v)));
        let mut triangle = [0.0; MAX_ATOMS];
        let mut left = self.dictionary.squared_norm(atom);
        for (along, node) in triangle.iter_mut().zip(self.path.nodes) {
            *along = dot(self.wide, &node.direction);
            left -= *along * *along;
        }
        if left < self.rules.min_residual {
            return None;
        }
        let own = dot(self.wide, residual);
        let mut squares = own * own;
        for residual in self.path.end().residuals.chunks_exact(self.wide.len()) {
            squares += dot(self.wide, residual).powi(2);
        }
        let norm = left.sqrt();
        triangle[self.path.nodes.len()] = norm;
        let score = match self.rules.selection {
            Selection::OrderRecursive => squares / left,
            Selection::Textbook => squares,
        };
        (score > 0.0).then_some(Choice { atom, score, triangle, along: own / norm })
    }
}
