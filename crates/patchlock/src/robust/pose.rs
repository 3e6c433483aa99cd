//! Where the target is.

use crate::vision::crop::Region;
use crate::vision::frame::FrameSize;
use crate::vision::geometry::{BoundingBox, Point};
use serde::{Deserialize, Serialize};

/// Where the target is: position, size and rotation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Pose {
    /// The centre in the frame.
    pub centre: Point,
    /// The target's size, relative to the first frame.
    pub scale: f64,
    /// By how much the target has turned since the first frame, in radians: from x towards y,
    /// clockwise on screen.
    pub rotation: f64,
}

impl Pose {
    /// The place in the first frame.
    pub fn first(bbox: BoundingBox) -> Self {
        Self { centre: bbox.centre(), scale: 1.0, rotation: 0.0 }
    }

    /// Width and height of a target with this size in the first frame.
    pub fn size(self, base: [f64; 2]) -> [f64; 2] {
        base.map(|side| side * self.scale)
    }

    /// The upright box, for a target with this width and height in the first frame.
    pub fn bbox(self, base: [f64; 2]) -> BoundingBox {
        let [w, h] = self.size(base);
        BoundingBox::around(self.centre, w, h)
    }

    /// The target's region, if it had this size in the first frame.
    pub fn region(self, base: [f64; 2]) -> Region {
        Region { centre: self.centre, size: self.size(base), rotation: self.rotation }
    }

    /// The place with its centre moved by this many frame pixels along the target's own axes.
    pub fn shifted(mut self, [dx, dy]: [f64; 2]) -> Self {
        let (sin, cos) = self.rotation.sin_cos();
        self.centre[0] += cos * dx - sin * dy;
        self.centre[1] += sin * dx + cos * dy;
        self
    }

    /// Whether its centre is within half of another place's width and height from that.
    pub fn is_within(self, other: Self, base: [f64; 2]) -> bool {
        let size = other.size(base);
        (0..2).all(|axis| (self.centre[axis] - other.centre[axis]).abs() < size[axis] / 2.0)
    }

    /// The place with its centre moved into the frame, and its size limited: no side of the target
    /// becomes shorter than `least_side` pixels, nor longer than that of the frame.
    pub fn kept_within(mut self, frame: FrameSize, base: [f64; 2], least_side: f64) -> Self {
        let size = [frame.width as f64, frame.height as f64];
        for (centre, side) in self.centre.iter_mut().zip(size) {
            *centre = centre.clamp(0.0, side - 1.0);
        }
        let least = (least_side / base[0].min(base[1])).min(1.0);
        let most = (size[0] / base[0]).min(size[1] / base[1]).max(1.0);
        self.scale = self.scale.clamp(least, most);
        self
    }

    /// Whether all numbers are finite, and the scale positive.
    pub fn is_sound(self) -> bool {
        let Self { centre: [x, y], scale, rotation } = self;
        [x, y, scale, rotation].iter().all(|v| v.is_finite()) && scale > 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    const FRAME: FrameSize = FrameSize { width: 100, height: 60 };
    const POSE: Pose = Pose { centre: [30.0, 20.0], scale: 1.0, rotation: 0.0 };

    #[test]
    fn a_shift_is_along_the_targets_own_axes() {
        assert_eq!(POSE.shifted([3.0, -2.0]).centre, [33.0, 18.0]);
        let turned = Pose { rotation: FRAC_PI_2, ..POSE }.shifted([3.0, -2.0]);
        // The target's x axis points down, and its y axis to the left.
        let [x, y] = [turned.centre[0] - 32.0, turned.centre[1] - 23.0];
        assert!(x.abs() < 1e-12 && y.abs() < 1e-12, "{turned:?}");
        assert_eq!((turned.scale, turned.rotation), (1.0, FRAC_PI_2));
    }

    #[test]
    fn a_place_is_within_half_of_anothers_size_or_not() {
        let base = [20.0, 10.0];
        for (dx, dy, scale, within) in [
            (9.9, 4.9, 1.0, true),
            (10.1, 0.0, 1.0, false),
            (0.0, -5.1, 1.0, false),
            (-10.1, 5.1, 1.1, true),
        ] {
            let other = Pose { scale, ..POSE };
            assert_eq!(POSE.shifted([dx, dy]).is_within(other, base), within, "{dx} {dy}");
        }
    }

    #[test]
    fn a_place_within_the_frame_stays() {
        assert_eq!(POSE.kept_within(FRAME, [20.0, 10.0], 5.0), POSE);
    }

    #[test]
    fn the_centre_is_kept_on_the_pixels_of_the_frame() {
        for (centre, kept) in
            [([-3.0, 80.0], [0.0, 59.0]), ([99.5, -0.1], [99.0, 0.0]), ([1e9, 5.0], [99.0, 5.0])]
        {
            assert_eq!(Pose { centre, ..POSE }.kept_within(FRAME, [20.0, 10.0], 5.0).centre, kept);
        }
    }

    #[test]
    fn the_scale_is_limited() {
        let scale = |scale, base| Pose { scale, ..POSE }.kept_within(FRAME, base, 5.0).scale;
        // The shorter side has at least 5 pixels, and no side is longer than the frame's.
        assert_eq!(scale(0.1, [20.0, 10.0]), 0.5);
        assert_eq!(scale(9.0, [20.0, 10.0]), 5.0);
        assert_eq!(scale(9.0, [10.0, 20.0]), 3.0);
        // A target that begins smaller or larger than that may keep its size.
        assert_eq!(scale(0.1, [4.0, 10.0]), 1.0);
        assert_eq!(scale(9.0, [200.0, 10.0]), 1.0);
    }

    #[test]
    fn a_region_has_the_targets_size() {
        let pose = Pose { scale: 1.5, rotation: 0.3, ..POSE };
        let region = pose.region([20.0, 10.0]);
        assert_eq!(region, Region { centre: POSE.centre, size: [30.0, 15.0], rotation: 0.3 });
    }
}
