//! A tracked frame for the tests of the outputs.

use std::sync::{Arc, OnceLock};

use patchlock::{BoundingBox, Estimate, Status, Visibility, VisibilityMap};
use patchlock_media::Picture;

use super::{TargetResult, TrackedFrame};

/// A target with this status.
pub fn target(status: Status) -> TargetResult {
    let bbox = BoundingBox { x: 10.5, y: 0.0, w: 30.0, h: 20.25 };
    let map = |visible: &[bool]| VisibilityMap {
        rows: 1,
        columns: visible.len(),
        visible: visible.to_vec(),
    };
    let visibility = Visibility { large: map(&[true]), small: map(&[true, false, false, false]) };
    let estimate = Estimate {
        bbox,
        corners: [[1.0, 2.0], [3.0, 4.0], [5.0, 6.0], [7.0, 8.0]],
        score: 0.5,
        status,
        visibility: Some(visibility),
    };
    TargetResult { id: None, name: None, bbox, estimate }
}

/// A grey frame of 1280 x 960 pixels with these targets.
pub fn tracked(frame: usize, targets: &[TargetResult]) -> TrackedFrame<'_> {
    static PICTURE: OnceLock<Arc<Picture>> = OnceLock::new();
    let grey = || Arc::new(Picture::rgb(1280, 960, vec![100; 1280 * 960 * 3]));
    let picture = PICTURE.get_or_init(grey);
    TrackedFrame { frame, ms: 12.5, targets, picture }
}
