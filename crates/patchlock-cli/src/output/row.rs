//! A row of the tables.

use clap::ValueEnum;
use patchlock::{BoundingBox, Status, Visibility, VisibilityMap};
use serde::Serialize;

use super::{TargetResult, TrackedFrame};

/// What a table has as the position of a lost target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum LostPosition {
    /// What is still followed, or the last known box and outline
    Keep,
    /// No position: empty cells in .csv, null in .jsonl, NaN in .txt
    Blank,
}

/// The columns, in order. Positions are 0-based with pixel centres at integers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    pub frame: usize,
    /// The target's id; with a single target there is no such column.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub id: Option<u64>,
    /// The name of the target in `--boxes`; if its ids are numbers, there is no such column.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Left side of the box; with [`LostPosition::Blank`], all positions of a lost target are empty.
    pub x: Option<f64>,
    pub y: Option<f64>,
    pub w: Option<f64>,
    pub h: Option<f64>,
    /// How certain the tracker is, 0 to 1.
    pub score: f64,
    /// Share of the large patches that are visible; empty if the method does not know.
    pub visible_large: Option<f64>,
    /// Share of the small patches that are visible; empty if the method does not know.
    pub visible_small: Option<f64>,
    /// Corners of the rotated and skewed outline, clockwise from the upper left one.
    pub x1: Option<f64>,
    pub y1: Option<f64>,
    pub x2: Option<f64>,
    pub y2: Option<f64>,
    pub x3: Option<f64>,
    pub y3: Option<f64>,
    pub x4: Option<f64>,
    pub y4: Option<f64>,
    /// Milliseconds that the tracker took for the frame, all targets together.
    pub ms: f64,
    pub status: Status,
    pub frame_w: usize,
    pub frame_h: usize,
    /// When the frame is shown, in seconds from the first frame of the source; a source without
    /// times has no such column.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time: Option<f64>,
}

impl Row {
    pub fn new(tracked: &TrackedFrame<'_>, target: &TargetResult, lost: LostPosition) -> Self {
        let TrackedFrame { frame, ms, picture, .. } = *tracked;
        let TargetResult { id, name, bbox, estimate } = target;
        let known = lost == LostPosition::Keep || estimate.status != Status::Lost;
        let position = |value: f64| known.then(|| rounded(value));
        let BoundingBox { x, y, w, h } = *bbox;
        let [x, y, w, h] = [x, y, w, h].map(position);
        let [[x1, y1], [x2, y2], [x3, y3], [x4, y4]] =
            estimate.corners.map(|corner| corner.map(position));
        let share = |map: fn(&Visibility) -> &VisibilityMap| {
            estimate.visibility.as_ref().map(|visibility| rounded(map(visibility).share()))
        };
        Self {
            frame,
            id: *id,
            name: name.as_deref().map(str::to_owned),
            x,
            y,
            w,
            h,
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
            status: estimate.status,
            frame_w: picture.width,
            frame_h: picture.height,
            time: picture.time.map(rounded),
        }
    }
}

/// Rounds to six decimal places: no tracker is more precise, and more digits make tables hard to
/// read.
fn rounded(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}
