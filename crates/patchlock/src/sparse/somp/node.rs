//! What is known in `f64` once some atoms are chosen, of everything that does not depend on the candidate: this decides.

use super::vectors::{dots_each, subtract_scaled_wide, widen};
use crate::numeric::dot_wide;
use crate::sparse::codes::MAX_ATOMS;
use crate::sparse::dictionary::Dictionary;
use pulp::Simd;

/// A point in the tree of chosen atoms: the root has none, and each node one more than its parent.
#[derive(Debug, Clone, Default)]
pub struct Node {
    /// The atom that was chosen last.
    pub atom: usize,
    /// `q_t`: what the earlier atoms leave of it, normalised.
    pub direction: Vec<f64>,
    /// `q_s^T d` of the atom for each earlier `s`, then what is left of its norm.
    pub triangle: [f64; MAX_ATOMS],
    /// What the atoms leave of the shared columns.
    pub residuals: Vec<f64>,
    /// The energy of that.
    pub energy: f64,
    /// `p = q_t^T r` of each shared column.
    pub projections: Vec<f64>,
}

/// The root and the nodes below it that lead to a node.
#[derive(Debug, Clone, Copy)]
pub struct Path<'a> {
    /// The root.
    pub root: &'a Node,
    /// The others, in the order of their atoms.
    pub nodes: &'a [Node],
}

impl<'a> Path<'a> {
    /// The node that it leads to.
    #[inline(always)]
    pub fn end(&self) -> &'a Node {
        self.nodes.last().unwrap_or(self.root)
    }

    /// Whether this atom is chosen.
    #[inline(always)]
    pub fn contains(&self, atom: usize) -> bool {
        self.nodes.iter().any(|node| node.atom == atom)
    }
}

impl Node {
    /// Becomes the root for these shared columns.
    #[inline(always)]
    pub fn fill_root<S: Simd>(&mut self, simd: S, shared: &[f32]) {
        widen(&mut self.residuals, shared);
        self.energy = dot_wide(simd, &self.residuals, &self.residuals);
    }

    /// Becomes the child of the node at the path's end with one more atom.
    #[inline(always)]
    pub fn fill<S: Simd>(&mut self, simd: S, dictionary: &Dictionary, path: Path<'_>, atom: usize) {
        self.atom = atom;
        let direction = &mut self.direction;
        widen(direction, dictionary.atom(atom));
        self.triangle = [0.0; MAX_ATOMS];
        // Twice, so that the directions are orthogonal to rounding also where little is left of the atom.
        for _ in 0..2 {
            let mut projections = [0.0; MAX_ATOMS];
            let directions = path.nodes.iter().map(|node| &*node.direction);
            dots_each(simd, direction, directions, |s, dot| projections[s] = dot);
            for ((sum, projection), node) in
                self.triangle.iter_mut().zip(projections).zip(path.nodes)
            {
                subtract_scaled_wide(direction, &node.direction, projection);
                *sum += projection;
            }
        }
        let norm = dot_wide(simd, direction, direction).sqrt();
        let inverse = 1.0 / norm;
        direction.iter_mut().for_each(|v| *v *= inverse);
        self.triangle[path.nodes.len()] = norm;

        let parent = path.end();
        self.residuals.clone_from(&parent.residuals);
        self.projections.clear();
        let Self { projections, direction, .. } = self;
        let columns = parent.residuals.chunks_exact(dictionary.dim());
        dots_each(simd, direction, columns, |_, dot| projections.push(dot));
        self.energy = parent.energy;
        for (residual, projection) in
            self.residuals.chunks_exact_mut(dictionary.dim()).zip(&self.projections)
        {
            subtract_scaled_wide(residual, &self.direction, *projection);
            self.energy -= projection * projection;
        }
    }
}
