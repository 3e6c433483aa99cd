//! The `f64` data of a node: everything that follows from its atoms and the shared columns alone.
//! Unlike the screen's `f32` data, it decides.

use super::vectors::{dots_each, subtract_scaled_wide, widen};
use crate::numeric::dot_wide;
use crate::patch_model::sparse::codes::MAX_ATOMS;
use crate::patch_model::sparse::dictionary::Dictionary;
use pulp::Simd;

/// A node in the tree of chosen atoms. The root has no atoms; each node has one more than its
/// parent.
#[derive(Debug, Clone, Default)]
pub struct Node {
    /// The atom that was chosen last.
    pub atom: usize,
    /// `q_t`: the normalised residual of this atom after projecting out the earlier ones.
    pub direction: Vec<f64>,
    /// `q_s^T d` of the atom for each earlier `s`, then the norm of its residual.
    pub triangle: [f64; MAX_ATOMS],
    /// The residuals of the shared columns, one after the other.
    pub residuals: Vec<f64>,
    /// The energy of the residuals.
    pub energy: f64,
    /// `p = q_t^T r` of each shared column.
    pub projections: Vec<f64>,
}

/// The nodes from the root to one node.
#[derive(Debug, Clone, Copy)]
pub struct Path<'a> {
    /// The root.
    pub root: &'a Node,
    /// The nodes below the root, in the order in which their atoms were chosen.
    pub nodes: &'a [Node],
}

impl<'a> Path<'a> {
    /// The last node of the path.
    #[inline(always)]
    pub fn end(&self) -> &'a Node {
        self.nodes.last().unwrap_or(self.root)
    }

    /// Whether this atom has been chosen.
    #[inline(always)]
    pub fn contains(&self, atom: usize) -> bool {
        self.nodes.iter().any(|node| node.atom == atom)
    }
}

impl Node {
    /// Fills in the root for these shared columns.
    #[inline(always)]
    pub fn fill_root<S: Simd>(&mut self, simd: S, shared: &[f32]) {
        widen(&mut self.residuals, shared);
        self.energy = dot_wide(simd, &self.residuals, &self.residuals);
    }

    /// Fills in the child of the path's last node that adds this atom.
    #[inline(always)]
    pub fn fill<S: Simd>(&mut self, simd: S, dictionary: &Dictionary, path: Path<'_>, atom: usize) {
        self.atom = atom;
        let direction = &mut self.direction;
        widen(direction, dictionary.atom(atom));
        self.triangle = [0.0; MAX_ATOMS];
        // Twice, so that the directions are orthogonal up to rounding even if the atom's residual
        // is small.
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
