//! What a tracker says of a frame.

use crate::error::{self, Error};
use crate::patch_model::visibility::Visibility;
use crate::vision::geometry::{BoundingBox, Point};
use serde::{Deserialize, Serialize};
use std::fmt;

/// Where the target is in a frame, and how sure that is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The upright box of the target's width and height around its centre, in pixels with
    /// fractions.
    pub bbox: BoundingBox,
    /// The corners of the target's outline, which may be turned. For the first box: top left, top
    /// right, bottom right, bottom left.
    pub corners: [Point; 4],
    /// How sure the tracker is, from 0 to 1. With the methods `robust` and `network` it is an
    /// estimate of the probability that the box overlaps the target by at least half; that of a
    /// network is often too sure of what looks like the target. With the method `paper` it is the
    /// visible share of the target, [`Visibility::share`]: it falls when the target is hidden,
    /// changes faster than it is learned, or is lost.
    pub score: f64,
    /// Whether the target is followed.
    pub status: Status,
    /// Which parts of the target are visible, where the method knows. `robust` does not while
    /// the target is lost, while its filters are not part of the committee's decision, or while it is
    /// sure of a target whose patches it hardly recognises.
    pub visibility: Option<Visibility>,
}

/// Whether the target is followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// The target is in the box.
    Tracked,
    /// The target may be hidden or lost. With the method `paper`: no more of it is visible than the
    /// share `delta`, at or below which no template is replaced (Eq. 20 of the paper).
    Uncertain,
    /// The target is lost: what the box shows is most likely something else, or the target was
    /// given up and the box is the last one that was known. The method `paper` never says so.
    Lost,
}

impl Status {
    /// All values, as [`Status::name`] writes them.
    pub const NAMES: [&'static str; 3] = ["tracked", "uncertain", "lost"];

    /// The name, in lower case.
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl Estimate {
    /// An estimate without content, for a method to fill.
    pub(crate) fn empty() -> Self {
        Self {
            bbox: BoundingBox { x: 0.0, y: 0.0, w: 0.0, h: 0.0 },
            corners: [[0.0; 2]; 4],
            score: 0.0,
            status: Status::Uncertain,
            visibility: None,
        }
    }

    /// The outline of this estimate, at the same angle, moved and stretched into another box.
    pub(crate) fn outline_in(&self, bbox: BoundingBox) -> [Point; 4] {
        let ([x, y], corners) = (self.bbox.centre(), &self.corners);
        let side = [corners[1][0] - corners[0][0], corners[1][1] - corners[0][1]];
        let angle = side[1].atan2(side[0]);
        let ((sin, cos), [cx, cy]) = (angle.sin_cos(), bbox.centre());
        let stretch = [(bbox.w, self.bbox.w), (bbox.h, self.bbox.h)].map(|(new, old)| new / old);
        corners.map(|[px, py]| {
            let (dx, dy) = (px - x, py - y);
            let along = stretch[0] * (cos * dx + sin * dy);
            let across = stretch[1] * (cos * dy - sin * dx);
            [cx + cos * along - sin * across, cy + sin * along + cos * across]
        })
    }

    /// Checks an estimate that was read.
    ///
    /// # Errors
    /// [`Error::Snapshot`] if a number is not finite or out of range.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let BoundingBox { x, y, w, h } = self.bbox;
        let corners = self.corners.as_flattened();
        let finite = [x, y, w, h].iter().chain(corners).all(|number| number.is_finite());
        let sound = finite && w > 0.0 && h > 0.0 && (0.0..=1.0).contains(&self.score);
        let visible = self.visibility.as_ref().is_none_or(Visibility::is_sound);
        let reason = "a number of its latest estimate is out of range";
        (sound && visible).then_some(()).ok_or_else(|| error::snapshot(reason))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_outline_keeps_its_angle_in_another_box() {
        let bbox = BoundingBox::around([20.0, 30.0], 11.0, 5.0);
        let (sin, cos) = 0.3f64.sin_cos();
        let turned = |centre: Point, [w, h]: [f64; 2]| {
            [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]].map(|[x, y]| {
                let (x, y) = (x * w, y * h);
                [centre[0] + cos * x - sin * y, centre[1] + sin * x + cos * y]
            })
        };
        let estimate =
            Estimate { bbox, corners: turned([20.0, 30.0], [10.0, 4.0]), ..Estimate::empty() };
        let moved = estimate.outline_in(BoundingBox::around([50.0, 10.0], 22.0, 2.5));
        let expected = turned([50.0, 10.0], [20.0, 2.0]);
        for (corner, expected) in moved.as_flattened().iter().zip(expected.as_flattened()) {
            assert!((corner - expected).abs() < 1e-12, "{moved:?}");
        }
    }
}
