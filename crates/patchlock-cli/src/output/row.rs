//! The rows of the tables.

use clap::ValueEnum;
use patchlock::{BoundingBox, Status};
use serde_json::{Value, json};

use super::{TargetResult, TrackedFrame};

/// What a table has as the position of a lost target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum LostPosition {
    /// What is still followed, or the last known box and outline
    Keep,
    /// No position: empty cells in .csv, null in .jsonl, NaN in .txt
    Blank,
}

/// The columns of a target with their values, in order. With [`LostPosition::Blank`], all positions of
/// a lost target are null. A single target has no `id`, one whose id is a number no `name`, and a
/// source without times no `time`. The shares of visible patches are null if the method does not know
/// them. Positions are 0-based with pixel centres at integers; the corners of the rotated and skewed
/// outline are clockwise from the upper left one. `ms` is for the frame, all targets together.
pub fn row(
    tracked: &TrackedFrame<'_>,
    target: &TargetResult,
    lost: LostPosition,
) -> Vec<(&'static str, Value)> {
    let TrackedFrame { frame, ms, picture, .. } = *tracked;
    let TargetResult { id, name, bbox: BoundingBox { x, y, w, h }, estimate } = target;
    let known = lost == LostPosition::Keep || estimate.status != Status::Lost;
    let position = |value: &f64| json!(known.then(|| rounded(*value)));
    let shares = estimate.visibility.as_ref();
    let shares = shares.map(|map| [&map.large, &map.small].map(|map| rounded(map.share())));
    let [large, small] = shares.map_or([None; 2], |shares| shares.map(Some));
    let mut row = vec![("frame", json!(frame))];
    row.extend(id.map(|id| ("id", json!(id))));
    row.extend(name.as_deref().map(|name| ("name", json!(name))));
    row.extend(["x", "y", "w", "h"].into_iter().zip([x, y, w, h].map(position)));
    row.push(("score", json!(rounded(estimate.score))));
    row.extend([("visible_large", json!(large)), ("visible_small", json!(small))]);
    let corners = estimate.corners.as_flattened().iter().map(position);
    row.extend(["x1", "y1", "x2", "y2", "x3", "y3", "x4", "y4"].into_iter().zip(corners));
    row.extend([("ms", json!((ms * 1e3).round() / 1e3)), ("status", json!(estimate.status))]);
    row.extend([("frame_w", json!(picture.width)), ("frame_h", json!(picture.height))]);
    row.extend(picture.time.map(|time| ("time", json!(rounded(time)))));
    row
}

/// Rounds to six decimal places: no tracker is more precise, and more digits make tables hard to
/// read.
fn rounded(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}
