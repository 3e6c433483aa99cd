//! One line of the tables.

use patchlock::{BoundingBox, Estimate, Visibility, VisibilityMap};
use serde::Serialize;

/// The columns, in their order. Positions are 0-based with pixel centres at integers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// Number of the frame in the source.
    pub frame: usize,
    /// The target, where there can be several: else there is no such column.
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
    /// How much the tracker trusts itself, 0 to 1.
    pub score: f64,
    /// Share of the large patches that are visible; empty where the method does not know.
    pub visible_large: Option<f64>,
    /// Share of the small patches that are visible; empty where the method does not know.
    pub visible_small: Option<f64>,
    /// Corners of the turned and slanted box: upper left ...
    pub x1: f64,
    /// ... and its y.
    pub y1: f64,
    /// Upper right.
    pub x2: f64,
    /// Its y.
    pub y2: f64,
    /// Lower right.
    pub x3: f64,
    /// Its y.
    pub y3: f64,
    /// Lower left.
    pub x4: f64,
    /// Its y.
    pub y4: f64,
    /// Milliseconds that the tracker took for the frame, with all its targets.
    pub ms: f64,
}

impl Row {
    /// A line from an estimate. `bbox` is apart because the first line holds the box as given.
    pub fn new(frame: usize, bbox: &BoundingBox, estimate: &Estimate, ms: f64) -> Self {
        let [[x1, y1], [x2, y2], [x3, y3], [x4, y4]] =
            estimate.corners.map(|corner| corner.map(tidy));
        let share = |map: fn(&Visibility) -> &VisibilityMap| {
            estimate.visibility.as_ref().map(|visibility| tidy(map(visibility).share()))
        };
        Self {
            frame,
            id: None,
            x: tidy(bbox.x),
            y: tidy(bbox.y),
            w: tidy(bbox.w),
            h: tidy(bbox.h),
            score: tidy(estimate.score),
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

    /// The same as it stands in a picture whose upper left corner is elsewhere.
    pub fn shifted(&self, dx: f64, dy: f64) -> Self {
        let mut row = self.clone();
        [&mut row.x, &mut row.x1, &mut row.x2, &mut row.x3, &mut row.x4]
            .into_iter()
            .for_each(|x| *x += dx);
        [&mut row.y, &mut row.y1, &mut row.y2, &mut row.y3, &mut row.y4]
            .into_iter()
            .for_each(|y| *y += dy);
        row
    }
}

/// A millionth of a pixel is more than any tracker means; the rest would only make the tables hard to read.
fn tidy(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}
