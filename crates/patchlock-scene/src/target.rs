//! The target: its outline, its pose in a frame and its truth.

use crate::badge::badge;
use crate::canvas::{Area, Canvas, Colour};
use crate::config::{Post, TargetTexture};
use crate::path::Pose;
use crate::post::covers;

/// Radius of the rounded corners relative to the shorter side.
const CORNER_RADIUS: f64 = 0.13;

/// Sample points along each axis for the shares.
const SHARE_SAMPLES: i32 = 96;

/// The truth of the target in one frame.
///
/// The [crate documentation](crate) describes the coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truth {
    /// `[x, y, w, h]`: an upright box with the width and height of the target
    /// around its centre, which is `x + (w - 1) / 2`, `y + (h - 1) / 2`.
    ///
    /// It scales with the target but does not grow when the target turns.
    pub bbox: [f64; 4],
    /// Outer corners of the rotated target: top left, top right, bottom right,
    /// bottom left of the unrotated target.
    ///
    /// They are the intersections of the edges, before the corners are
    /// rounded. Without rotation, the top left one is half a pixel above and to
    /// the left of the centre of `bbox`'s first pixel.
    pub corners: [[f64; 2]; 4],
    /// Size relative to the configured size.
    pub scale: f64,
    /// Rotation in radians, clockwise as seen on the screen.
    pub rotation: f64,
    /// Share of the target's area behind the tree trunk, `0..=1`, whether in
    /// the frame or not.
    pub hidden: f64,
    /// Share of the target's area outside the frame, `0..=1`.
    pub outside: f64,
    /// Share of the target's area that the frame shows: neither hidden nor
    /// outside, `0..=1`.
    pub visible: f64,
}

impl Truth {
    /// Whether nothing of the target is visible: it is behind the trunk, or
    /// has left the frame.
    pub fn is_absent(&self) -> bool {
        self.visible == 0.0
    }
}

/// The target with its pose in one frame.
pub(crate) struct PosedTarget {
    pose: Pose,
    /// Width and height in pixels, including the scale.
    size: [f64; 2],
    /// Cosine and sine of the rotation.
    turn: [f64; 2],
}

impl PosedTarget {
    pub(crate) fn new(base_size: [f64; 2], pose: Pose) -> Self {
        PosedTarget {
            pose,
            size: base_size.map(|side| side * pose.scale),
            turn: [pose.rotation.cos(), pose.rotation.sin()],
        }
    }

    /// Converts a point of the target, relative to its centre, to frame coordinates.
    fn to_frame(&self, [a, b]: [f64; 2]) -> [f64; 2] {
        let [cos, sin] = self.turn;
        let [cx, cy] = self.pose.centre;
        [cx + cos * a - sin * b, cy + sin * a + cos * b]
    }

    /// The inverse of [`PosedTarget::to_frame`].
    fn to_card(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [cos, sin] = self.turn;
        let (dx, dy) = (x - self.pose.centre[0], y - self.pose.centre[1]);
        [cos * dx + sin * dy, cos * dy - sin * dx]
    }

    /// Whether a point relative to the centre is on the card with rounded corners.
    fn contains(&self, [a, b]: [f64; 2]) -> bool {
        let [w, h] = self.size;
        let radius = CORNER_RADIUS * w.min(h);
        let past_x = a.abs() - (w / 2.0 - radius);
        let past_y = b.abs() - (h / 2.0 - radius);
        if past_x <= 0.0 || past_y <= 0.0 {
            return past_x <= radius && past_y <= radius;
        }
        past_x * past_x + past_y * past_y <= radius * radius
    }

    /// Colour at a point of the frame; `None` outside the target.
    pub(crate) fn colour_at(&self, texture: TargetTexture, point: [f64; 2]) -> Option<Colour> {
        let [a, b] = self.to_card(point);
        if !self.contains([a, b]) {
            return None;
        }
        Some(match texture {
            TargetTexture::Flat(colour) => colour.map(f32::from),
            TargetTexture::Badge => badge([a / self.size[0] + 0.5, b / self.size[1] + 0.5]),
        })
    }

    pub(crate) fn paint_on(&self, canvas: &mut Canvas, texture: TargetTexture) {
        let reach = self.size[0].hypot(self.size[1]) / 2.0;
        let area = Area::around(self.pose.centre, reach);
        canvas.paint(area, |point| self.colour_at(texture, point));
    }

    /// The truth in a frame of this width and height.
    pub(crate) fn truth(&self, frame: [usize; 2], post: Option<(Post, u64)>) -> Truth {
        let [w, h] = self.size;
        let [cx, cy] = self.pose.centre;
        let corner = |right: f64, down: f64| self.to_frame([right * w / 2.0, down * h / 2.0]);
        let [hidden, outside, visible] = self.shares(frame, post);
        Truth {
            bbox: [cx - (w - 1.0) / 2.0, cy - (h - 1.0) / 2.0, w, h],
            corners: [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
            scale: self.pose.scale,
            rotation: self.pose.rotation,
            hidden,
            outside,
            visible,
        }
    }

    /// The hidden share, the share outside the frame, and the visible share.
    fn shares(&self, frame: [usize; 2], post: Option<(Post, u64)>) -> [f64; 3] {
        let place = |i: i32| (f64::from(i) + 0.5) / f64::from(SHARE_SAMPLES) - 0.5;
        let is_behind = |point| post.is_some_and(|(post, seed)| covers(post, seed, point));
        let [right, bottom] = frame.map(|side| side as f64 - 0.5);
        let is_outside =
            |[x, y]: [f64; 2]| !((-0.5..right).contains(&x) && (-0.5..bottom).contains(&y));
        let (mut on_target, mut counts) = (0u32, [0u32; 3]);
        for j in 0..SHARE_SAMPLES {
            for i in 0..SHARE_SAMPLES {
                let point = [place(i) * self.size[0], place(j) * self.size[1]];
                if self.contains(point) {
                    let point = self.to_frame(point);
                    let (behind, outside) = (is_behind(point), is_outside(point));
                    on_target += 1;
                    let kinds = [behind, outside, !behind && !outside];
                    counts.iter_mut().zip(kinds).for_each(|(count, is)| *count += u32::from(is));
                }
            }
        }
        counts.map(|count| f64::from(count) / f64::from(on_target))
    }
}
