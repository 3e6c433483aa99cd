//! Error bounds of the rows at a node, as the head of [`batched`](super::batched) derives them.

use super::node::Path;
use super::vectors::U;
use crate::patch_model::sparse::codes::MAX_ATOMS;

/// Covers the products of two errors in the bounds.
pub const SECOND_ORDER: f64 = 1.01;

/// Error bound of adding 1 to a correlation.
pub const ADD_ONE_ERROR: f64 = 2.0 * U;

/// Error bounds of the rows of a node.
#[derive(Debug, Clone, Default)]
pub struct Errors {
    /// Of an entry of the weights.
    pub weights: f64,
    /// Of an entry of each column.
    pub columns: Vec<f64>,
    /// How much a divisor may be below `||d_res||^2`.
    pub divisors: f64,
    /// Upper bound of the magnitude of a weight.
    max_weight: f64,
    /// Upper bound of `||d_res||^2` over all atoms.
    pub max_residual: f64,
    /// At the root: upper bound of the columns' `|y'|`.
    pub spread: f64,
    /// `||d_res||^2` decreases by `w^2`. With the screen's `w`, this is at most
    /// `|w| (|w| + loss.0) + loss.1`; at a first node, where `w` is stored minus 1, it is at most
    /// `w (w + loss.0) + loss.1`.
    pub loss: (f64, f64),
}

/// The part of [`Errors`] that a step needs.
#[derive(Debug, Clone, Copy)]
pub struct Margins {
    /// Error bound of a weight, and upper bound of its magnitude.
    weights: (f64, f64),
    /// Whether the node is a first node.
    first: bool,
    /// The sum of the squared error bounds of the columns.
    pub squared: f64,
    /// How much a divisor may be too small, rounded up.
    pub gap: f32,
}

impl Margins {
    /// The error that a correlation gains when `projection` times the weight is subtracted. At the
    /// root its `|y'|` was at most `spread`.
    #[inline(always)]
    pub fn projection_error(&self, projection: f64, spread: f64) -> f64 {
        let (p, (off, max_weight)) = (projection.abs(), self.weights);
        let sums = if self.first {
            2.0 * (spread + p * max_weight + (1.0 - projection).abs())
        } else {
            max_weight
        };
        SECOND_ORDER * (p * (off + 2.0 * U * max_weight) + U * sums)
    }
}

impl Errors {
    /// The margins of a step at the root, where 1 is added to all correlations.
    #[inline(always)]
    pub fn at_root(&self) -> Margins {
        let squared = self.columns.iter().map(|e| (e + ADD_ONE_ERROR).powi(2)).sum();
        Margins { squared, ..self.margins(false) }
    }

    /// The margins of a step below the root.
    #[inline(always)]
    fn margins(&self, first: bool) -> Margins {
        Margins {
            weights: (self.weights, self.max_weight),
            first,
            squared: self.columns.iter().map(|e| e * e).sum(),
            gap: (self.divisors * (1.0 + 4.0 * U)) as f32,
        }
    }

    /// Sets the bounds of the node at the end of the path, a child of `parent`, and returns the
    /// margins of its step. Those of the nodes above are given from the first one on.
    #[inline(always)]
    pub fn set_child<'a, const FIRST: bool>(
        &mut self,
        path: Path<'_>,
        above: impl ExactSizeIterator<Item = &'a Self> + Clone,
        parent: &Self,
        spread: f64,
    ) -> Margins {
        if FIRST {
            self.set_first(path.end().triangle[0], spread);
        } else {
            self.set_deeper(&path.end().triangle, above, spread);
            self.divisors += parent.divisors;
        }
        // The residual of an atom can only shrink.
        self.max_residual = parent.max_residual;
        let margins = self.margins(FIRST);
        self.columns.clone_from(&parent.columns);
        for (error, &p) in self.columns.iter_mut().zip(&path.end().projections) {
            *error += margins.projection_error(p, parent.spread);
        }
        self.margins(FIRST)
    }

    /// Sets the bounds of a first node whose atom has this norm.
    #[inline(always)]
    fn set_first(&mut self, norm: f64, spread: f64) {
        let max_weight = spread / norm + (1.0 / norm - 1.0).abs();
        self.max_weight = SECOND_ORDER * max_weight;
        self.weights = SECOND_ORDER * 5.0 * U * max_weight;
        let square = max_weight * (2.0 + max_weight);
        let second = self.weights * (2.0 + 2.0 * max_weight) + U * (4.0 * square + 2.0 * spread);
        self.loss = (2.0, SECOND_ORDER * second);
        self.divisors = 2.0 * self.loss.1;
    }

    /// Sets the bounds of a deeper node; `divisors` becomes the increase over the parent's.
    #[inline(always)]
    fn set_deeper<'a>(
        &mut self,
        triangle: &[f64; MAX_ATOMS],
        above: impl ExactSizeIterator<Item = &'a Self> + Clone,
        spread: f64,
    ) {
        let earlier = above.len();
        let mut numerator = U * spread;
        let mut sums = spread + (1.0 - triangle[0]).abs();
        let max_norm = above.clone().next().map_or(0.0, |first| first.max_residual.sqrt());
        for (&Self { weights, max_weight, .. }, projection) in above.zip(triangle) {
            numerator += projection.abs() * (weights + 2.0 * U * max_weight);
            sums += projection.abs() * max_weight;
        }
        numerator += U * ((earlier + 1) as f64 * sums + (1.0 - triangle[0]).abs());
        self.weights = SECOND_ORDER * (numerator / triangle[earlier] + 3.0 * U * max_norm);
        self.max_weight = max_norm + self.weights;
        let rounding = 5.0 * U * self.max_weight.powi(2);
        self.loss =
            (2.0 * SECOND_ORDER * self.weights, SECOND_ORDER * (self.weights.powi(2) + rounding));
        // At most, `2 o |w|` is subtracted twice too often, and so is the allowance for rounding.
        self.divisors = SECOND_ORDER * (4.0 * self.weights * self.max_weight + 2.0 * rounding);
    }
}
