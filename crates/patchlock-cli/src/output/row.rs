//! A row of the tables.

use patchlock::{Visibility, VisibilityMap};
use serde::Serialize;

use super::Seen;

/// The columns, in order. Positions are 0-based with pixel centres at integers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// Number of the frame in the source.
    pub frame: usize,
    /// The target's id; with a single target there is no such column.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub id: Option<u64>,
    /// Left side of the box.
    pub x: f64,
    /// Upper side of the box.
    pub y: f64,
    /// Width of the box.
    pub w: f64,
    /// Height of the box.
    pub h: f64,
    /// How certain the tracker is, 0 to 1.
    pub score: f64,
    /// Share of the large patches that are visible; empty if the method does not know.
    pub visible_large: Option<f64>,
    /// Share of the small patches that are visible; empty if the method does not know.
    pub visible_small: Option<f64>,
    /// Corners of the rotated and skewed outline: x of the upper left corner.
    pub x1: f64,
    /// y of the upper left corner.
    pub y1: f64,
    /// x of the upper right corner.
    pub x2: f64,
    /// y of the upper right corner.
    pub y2: f64,
    /// x of the lower right corner.
    pub x3: f64,
    /// y of the lower right corner.
    pub y3: f64,
    /// x of the lower left corner.
    pub x4: f64,
    /// y of the lower left corner.
    pub y4: f64,
    /// Milliseconds that the tracker took for the frame, all targets together.
    pub ms: f64,
}

impl Row {
    /// The row of a target in the frame with this number, which took `ms` milliseconds.
    pub fn new(frame: usize, ms: f64, seen: &Seen) -> Self {
        let Seen { id, bbox, estimate } = seen;
        let [[x1, y1], [x2, y2], [x3, y3], [x4, y4]] =
            estimate.corners.map(|corner| corner.map(rounded));
        let share = |map: fn(&Visibility) -> &VisibilityMap| {
            estimate.visibility.as_ref().map(|visibility| rounded(map(visibility).share()))
        };
        Self {
            frame,
            id: *id,
            x: rounded(bbox.x),
            y: rounded(bbox.y),
            w: rounded(bbox.w),
            h: rounded(bbox.h),
            score: rounded(estimate.score),
            visible_large: share(|visibility| &visibility.large),
            visible_small: share(|visibility| &visibility.small),
            x1,
            y1,
            x2,
            y2,
            x3,
            y3,
            x4,
            y4,
            ms: (ms * 1e3).round() / 1e3,
        }
    }
}

/// Rounds to six decimal places: no tracker is more precise, and more digits make tables hard to read.
fn rounded(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}
