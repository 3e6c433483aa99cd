//! Rotated boxes: the upright box before it is turned around its centre, and the angle.

use patchlock::BoundingBox;

use super::key_frames::mean;
use super::round;
use super::track::Entry;

/// By how many degrees the outline of an entry is turned clockwise, from 0 to 360; 0 without one.
pub fn rotation(entry: &Entry) -> f64 {
    let Some([a, b, c, d]) = entry.corners else { return 0.0 };
    // The mean of the upper and the lower side: the outline may be not quite a rectangle.
    let [x, y] = [0, 1].map(|k| b[k] - a[k] + c[k] - d[k]);
    round(y.atan2(x).to_degrees().rem_euclid(360.0)) % 360.0
}

/// The overlap (IoU) of the rotated box of an entry with the one between two others, as CVAT
/// interpolates it: the angle takes the shorter way.
pub fn overlap([a, b]: [&Entry; 2], share: f64, entry: &Entry) -> f64 {
    let (Some(first), Some(second), Some(own)) = (a.bbox, b.bbox, entry.bbox) else { return 0.0 };
    let by = (rotation(b) - rotation(a) + 180.0).rem_euclid(360.0) - 180.0;
    let between = corners(mean(first, second, share), rotation(a) + share * by);
    let own = corners(own, rotation(entry));
    let mut shared = between.to_vec();
    for k in 0..own.len() {
        shared = clipped(&shared, own[k], own[(k + 1) % own.len()]);
    }
    let both = area(&shared);
    both / (area(&between) + area(&own) - both)
}

/// The corners of a box that is turned clockwise, in that order.
fn corners(bbox: BoundingBox, degrees: f64) -> [[f64; 2]; 4] {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let (w, h) = (bbox.w / 2.0, bbox.h / 2.0);
    let (x, y) = (bbox.x + w, bbox.y + h);
    [[-w, -h], [w, -h], [w, h], [-w, h]]
        .map(|[u, v]| [x + u * cos - v * sin, y + u * sin + v * cos])
}

/// The part of a convex polygon on the inner side of an edge of another one, which is clockwise.
fn clipped(polygon: &[[f64; 2]], from: [f64; 2], to: [f64; 2]) -> Vec<[f64; 2]> {
    let side =
        |[x, y]: [f64; 2]| (to[0] - from[0]) * (y - from[1]) - (to[1] - from[1]) * (x - from[0]);
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

/// The area of a polygon, by the shoelace formula.
pub fn area(corners: &[[f64; 2]]) -> f64 {
    let next = |k: usize| corners[(k + 1) % corners.len()];
    let cross = |(k, [x, y]): (usize, &[f64; 2])| x * next(k)[1] - next(k)[0] * y;
    corners.iter().enumerate().map(cross).sum::<f64>().abs() / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_overlap_as_they_are_turned() {
        let bbox = BoundingBox { x: 0.0, y: 0.0, w: 20.0, h: 10.0 };
        let entry = |degrees: f64| Entry {
            frame: 0,
            id: 1,
            bbox: Some(bbox),
            score: None,
            corners: Some(corners(bbox, degrees)),
            status: None,
            manual: None,
        };
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-3, "{a} {b}");
        let of = |a: f64, b: f64, c: f64| overlap([&entry(a), &entry(b)], 0.5, &entry(c));
        near(of(20.0, 40.0, 30.0), 1.0);
        near(of(350.0, 10.0, 0.0), 1.0);
        // A cross: 10 x 10 are in both.
        near(of(0.0, 0.0, 90.0), 100.0 / 300.0);
        // A square and the same one on a corner: an octagon, 2 (sqrt 2 - 1) of the square.
        let square = BoundingBox { w: 10.0, ..bbox };
        let turned = |degrees| Entry {
            bbox: Some(square),
            corners: Some(corners(square, degrees)),
            ..entry(0.0)
        };
        let octagon = 2.0 * (2.0_f64.sqrt() - 1.0);
        let found = overlap([&turned(0.0), &turned(0.0)], 0.5, &turned(45.0));
        near(found, octagon / (2.0 - octagon));
    }
}
