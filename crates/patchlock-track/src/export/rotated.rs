//! Rotated boxes: the upright box before it is turned around its centre, and the angle.

use patchlock::BoundingBox;

use super::round;
use super::track::{Entry, Track};
use crate::outline::{Outline, Point, mean};

/// A box before it is turned clockwise around its centre, and by how many degrees, 0 to 360.
pub type RotatedBox = (BoundingBox, f64);

/// The box of an entry: that of the outline that a person has drawn; with `tracked`, otherwise that of
/// the tracker's outline.
pub fn rotated_box(track: &Track, entry: &Entry, tracked: bool) -> Option<RotatedBox> {
    let (bbox, degrees) = match track.outline(entry) {
        Some(outline) => outline.rotated_box(),
        None => (entry.bbox?, if tracked { rotation(entry) } else { 0.0 }),
    };
    Some((bbox, round(degrees) % 360.0))
}

/// By how many degrees the tracker's outline is turned clockwise; 0 without one.
fn rotation(entry: &Entry) -> f64 {
    let Some([a, b, c, d]) = entry.corners else { return 0.0 };
    // The mean of the upper and the lower side: the outline may be not quite a rectangle.
    let [x, y] = [0, 1].map(|k| b[k] - a[k] + c[k] - d[k]);
    y.atan2(x).to_degrees().rem_euclid(360.0)
}

/// The overlap (IoU) of a rotated box with the one between two others, as CVAT interpolates it.
pub fn overlap([a, b]: [RotatedBox; 2], share: f64, own: RotatedBox) -> f64 {
    let (between, degrees) = mean(a, b, share);
    let (between, own) = (Outline::of_box(between, degrees), Outline::of_box(own.0, own.1));
    let mut shared = between.0.clone();
    for (k, &from) in own.0.iter().enumerate() {
        shared = clipped(&shared, from, own.0[(k + 1) % own.0.len()]);
    }
    let both = Outline(shared).area();
    both / (between.area() + own.area() - both)
}

/// The part of a convex polygon on the inner side of an edge of another one, which is clockwise.
fn clipped(polygon: &[Point], from: Point, to: Point) -> Vec<Point> {
    let side =
        |[x, y]: Point| (to[0] - from[0]) * (y - from[1]) - (to[1] - from[1]) * (x - from[0]);
    let mut inside = Vec::new();
    for (k, &point) in polygon.iter().enumerate() {
        let next = polygon[(k + 1) % polygon.len()];
        let (here, there) = (side(point), side(next));
        if here >= 0.0 {
            inside.push(point);
        }
        if (here > 0.0 && there < 0.0) || (here < 0.0 && there > 0.0) {
            let share = here / (here - there);
            inside.push([0, 1].map(|k| point[k] + share * (next[k] - point[k])));
        }
    }
    inside
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_overlap_as_they_are_turned() {
        let bbox = BoundingBox { x: 0.0, y: 0.0, w: 20.0, h: 10.0 };
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-3, "{a} {b}");
        let of = |a: f64, b: f64, c: f64| overlap([(bbox, a), (bbox, b)], 0.5, (bbox, c));
        near(of(20.0, 40.0, 30.0), 1.0);
        near(of(350.0, 10.0, 0.0), 1.0);
        // A cross: 10 x 10 are in both.
        near(of(0.0, 0.0, 90.0), 100.0 / 300.0);
        // A square and the same one on a corner: an octagon, 2 (sqrt 2 - 1) of the square.
        let square = BoundingBox { w: 10.0, ..bbox };
        let octagon = 2.0 * (2.0_f64.sqrt() - 1.0);
        let found = overlap([(square, 0.0), (square, 0.0)], 0.5, (square, 45.0));
        near(found, octagon / (2.0 - octagon));
    }
}
