//! Boxes in pixels and their coordinates.
//!
//! Pixel centres lie at whole numbers, the first at 0. A box `x, y, w, h` covers the pixels from
//! `x` to `x + w - 1`, so its centre is `x + (w - 1) / 2`. A benchmark that counts from 1 stores
//! the same box with 1 added to `x` and `y`.

use crate::Error;
use serde::{Deserialize, Serialize};

/// The maximum length of a side of a box, in pixels.
pub const MAX_SIDE: f64 = 100_000.0;

/// A point in the frame, in pixels: x to the right, y downwards.
pub type Point = [f64; 2];

/// An axis-aligned box in pixels, counted from 0; fractions are allowed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BoundingBox {
    /// Column of the first pixel.
    pub x: f64,
    /// Row of the first pixel.
    pub y: f64,
    /// Width in pixels.
    pub w: f64,
    /// Height in pixels.
    pub h: f64,
}

/// Left, top, width, height in pixels.
///
/// ```
/// use patchlock::BoundingBox;
///
/// let bbox = BoundingBox::from([120.0, 80.0, 64.0, 48.0]);
/// assert_eq!((bbox.x, bbox.y, bbox.w, bbox.h), (120.0, 80.0, 64.0, 48.0));
/// ```
impl From<[f64; 4]> for BoundingBox {
    fn from([x, y, w, h]: [f64; 4]) -> Self {
        Self { x, y, w, h }
    }
}

/// Left, top, width, height in pixels.
impl From<(f64, f64, f64, f64)> for BoundingBox {
    fn from((x, y, w, h): (f64, f64, f64, f64)) -> Self {
        Self { x, y, w, h }
    }
}

impl BoundingBox {
    /// The box of `w` by `h` pixels around a centre.
    pub fn around(centre: Point, w: f64, h: f64) -> Self {
        Self { x: centre[0] - (w - 1.0) / 2.0, y: centre[1] - (h - 1.0) / 2.0, w, h }
    }

    /// The centre.
    pub fn centre(&self) -> Point {
        [self.x + (self.w - 1.0) / 2.0, self.y + (self.h - 1.0) / 2.0]
    }

    /// Intersection over union, from 0 to 1.
    pub fn overlap(&self, other: &Self) -> f64 {
        let shared = |a: f64, la: f64, b: f64, lb: f64| ((a + la).min(b + lb) - a.max(b)).max(0.0);
        let both =
            shared(self.x, self.w, other.x, other.w) * shared(self.y, self.h, other.y, other.h);
        let union = self.w * self.h + other.w * other.h - both;
        if union > 0.0 { both / union } else { 0.0 }
    }

    /// Checks that tracking can begin on this box in a frame of this size.
    ///
    /// # Errors
    /// [`Error::BoxShape`] if a number is not finite or a side is below 1 or above 100,000;
    /// [`Error::BoxOutside`] if the box covers no part of the frame.
    pub fn check_in(&self, width: usize, height: usize) -> Result<(), Error> {
        let Self { x, y, w, h } = *self;
        let side = 1.0..=MAX_SIDE;
        if !(x.is_finite() && y.is_finite() && side.contains(&w) && side.contains(&h)) {
            return Err(Error::BoxShape { x, y, w, h, max: MAX_SIDE });
        }
        // Pixel k covers k - 0.5 to k + 0.5, but comparing the first and last pixels needs no
        // halves.
        if x + w <= 0.0 || y + h <= 0.0 || x >= width as f64 || y >= height as f64 {
            return Err(Error::BoxOutside { x, y, w, h, width, height });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn centre_and_box_are_each_others_inverse() {
        let bbox = BoundingBox { x: 3.25, y: -1.5, w: 7.5, h: 1.0 };
        assert_eq!(bbox.centre(), [6.5, -1.5]);
        assert_eq!(BoundingBox::around(bbox.centre(), bbox.w, bbox.h), bbox);
    }

    #[test]
    fn overlap_of_known_boxes() {
        let a = BoundingBox { x: 0.0, y: 0.0, w: 10.0, h: 10.0 };
        let b = BoundingBox { x: 5.0, y: 0.0, w: 10.0, h: 10.0 };
        assert_eq!(a.overlap(&a), 1.0);
        assert!((a.overlap(&b) - 1.0 / 3.0).abs() < 1e-12);
        assert_eq!(a.overlap(&BoundingBox { x: 20.0, ..a }), 0.0);
    }

    #[test]
    fn boxes_that_cannot_be_tracked_are_refused() {
        let good = BoundingBox { x: -3.0, y: 2.0, w: 4.0, h: 1.0 };
        good.check_in(10, 10).unwrap();
        for bad in [0.0, -1.0, 0.5, f64::NAN, f64::INFINITY, 1e9] {
            let error = BoundingBox { w: bad, ..good }.check_in(10, 10).unwrap_err();
            assert!(matches!(error, Error::BoxShape { .. }), "{bad}");
        }
        for (x, y) in [(-4.0, 2.0), (10.0, 2.0), (0.0, -1.0), (0.0, 10.0)] {
            let error = BoundingBox { x, y, ..good }.check_in(10, 10).unwrap_err();
            assert!(matches!(error, Error::BoxOutside { .. }), "{x}, {y}");
        }
    }
}
