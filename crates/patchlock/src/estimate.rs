//! What the tracker says of a frame.

use crate::vision::geometry::{BoundingBox, Point};
use serde::{Deserialize, Serialize};

/// Where the target is, how much of it is seen, and how sure that is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The axis-aligned box of the target's width and height around its centre, sub-pixel.
    pub bbox: BoundingBox,
    /// The corners of the affine shape's outline: of the first box its top left, top right, bottom right, bottom left.
    pub corners: [Point; 4],
    /// The likelihood `p` of Eq. 24; larger is better, with no fixed scale.
    pub likelihood: f64,
    /// One visibility score in `[0, 1]`: the mean of the shares of visible patches at both scales. It falls when the target is
    /// hidden, changes faster than it is learned, or is lost.
    pub score: f64,
    /// Share of the large patches that are visible.
    pub visible_large: f64,
    /// Share of the small patches that are visible.
    pub visible_small: f64,
    /// Which large patches are visible (3x3 in the paper).
    pub large: VisibilityMap,
    /// Which small patches are visible (13x13 in the paper).
    pub small: VisibilityMap,
}

impl Estimate {
    /// One of nothing, to be filled.
    pub(crate) fn empty() -> Self {
        Self {
            bbox: BoundingBox { x: 0.0, y: 0.0, w: 0.0, h: 0.0 },
            corners: [[0.0; 2]; 4],
            likelihood: 0.0,
            score: 0.0,
            visible_large: 0.0,
            visible_small: 0.0,
            large: VisibilityMap::default(),
            small: VisibilityMap::default(),
        }
    }
}

/// Which patches of a scale are visible, row by row in the target's own frame of reference.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct VisibilityMap {
    /// Rows of patches.
    pub rows: usize,
    /// Patches in a row.
    pub columns: usize,
    /// `rows * columns` values.
    pub visible: Vec<bool>,
}

impl VisibilityMap {
    /// Becomes the map of a square grid; its buffer is used again.
    pub(crate) fn fill(&mut self, per_side: usize, visible: impl Iterator<Item = bool>) {
        (self.rows, self.columns) = (per_side, per_side);
        self.visible.clear();
        self.visible.extend(visible);
    }

    /// The share of visible patches.
    pub fn share(&self) -> f64 {
        let visible = self.visible.iter().filter(|&&visible| visible).count();
        visible as f64 / self.visible.len().max(1) as f64
    }
}
