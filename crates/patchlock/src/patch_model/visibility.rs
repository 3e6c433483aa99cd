//! The visibility of a candidate's patches at both scales (Eq. 12, 18).

use serde::{Deserialize, Serialize};

/// Which patches of the target are visible at each scale.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Visibility {
    /// The large patches (3 x 3 in the paper).
    pub large: VisibilityMap,
    /// The small patches (13 x 13 in the paper).
    pub small: VisibilityMap,
}

impl Visibility {
    /// The visible share of the target, from 0 to 1: the mean of both scales' shares. Not part of
    /// the paper.
    pub fn share(&self) -> f64 {
        (self.large.share() + self.small.share()) / 2.0
    }

    /// Whether the maps have as many values as rows and columns say.
    pub(crate) fn is_sound(&self) -> bool {
        [&self.large, &self.small]
            .iter()
            .all(|map| map.rows.checked_mul(map.columns) == Some(map.visible.len()))
    }
}

/// Which patches of one scale are visible, row by row in the target's own frame of reference.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct VisibilityMap {
    /// Number of rows of patches.
    pub rows: usize,
    /// Number of patches in a row.
    pub columns: usize,
    /// `rows * columns` values.
    pub visible: Vec<bool>,
}

impl VisibilityMap {
    /// Fills in the map of a square grid, reusing the buffer.
    pub(crate) fn fill(&mut self, per_side: usize, visible: impl Iterator<Item = bool>) {
        (self.rows, self.columns) = (per_side, per_side);
        self.visible.clear();
        self.visible.extend(visible);
    }

    /// The share of visible patches, from 0 to 1.
    pub fn share(&self) -> f64 {
        let visible = self.visible.iter().filter(|&&visible| visible).count();
        visible as f64 / self.visible.len().max(1) as f64
    }
}
