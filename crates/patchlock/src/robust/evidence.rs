//! What memory, patch model and colours say of a place.

use super::memory::Recognition;
use super::occlusion::VisibleShares;

/// Everything that the models say of a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Evidence {
    /// How sure the memory is: its response, relative to its mean over sure frames.
    pub certainty: f64,
    /// The memory's strongest response outside half the target's size around the place, relative to
    /// that at the place, at least 0 and at most `elsewhere_most`.
    pub elsewhere: f64,
    /// How sure the memory was when it had seen no more than the first sure frames.
    pub early: f64,
    /// The visible share of the target by the strict limit, from 0 to 1; 0 where that is unknown.
    pub strictly_visible: f64,
    /// The visible share as it is reported, by the milder limit.
    pub visible: f64,
    /// How well colour tells the target from what is around it: from -1, through 0, not at all, to
    /// 1.
    pub contrast: f64,
}

impl Evidence {
    pub fn new(
        Recognition { certainty, elsewhere, early }: Recognition,
        VisibleShares { strict, reported }: VisibleShares,
        contrast: f64,
    ) -> Self {
        Self { certainty, elsewhere, early, strictly_visible: strict, visible: reported, contrast }
    }

    /// How much the memory's response elsewhere exceeds what the patch model sees here.
    pub fn distraction(&self) -> f64 {
        self.elsewhere - self.strictly_visible
    }
}
