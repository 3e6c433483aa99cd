//! One trajectory against the truth, frame by frame.

use patchlock::BoundingBox;

/// What was measured of each frame. `None` where the frame does not count, because it has no truth.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Comparison {
    /// Intersection over union, 0 to 1.
    pub overlaps: Vec<Option<f64>>,
    /// Distance of the centres in pixels; infinite where the tracker has not given any box yet.
    pub distances: Vec<Option<f64>>,
    /// The same with x in widths and y in heights of the truth.
    pub normalised: Vec<Option<f64>>,
}

/// The boxes with each one that was not given replaced by the last one that was; `None` before the first.
pub fn last_given(boxes: &[Option<BoundingBox>]) -> Vec<Option<BoundingBox>> {
    let mut last = None;
    boxes
        .iter()
        .map(|given| {
            last = given.or(last);
            last
        })
        .collect()
}

/// Compares boxes with the truth of the same frames; both of one length. Boxes that were not given are filled in first.
pub fn compare(boxes: &[Option<BoundingBox>], truth: &[Option<BoundingBox>]) -> Comparison {
    let mut comparison = Comparison::default();
    for (bbox, truth) in last_given(boxes).iter().zip(truth) {
        let truth = truth.filter(|truth| truth.w > 0.0 && truth.h > 0.0);
        let pair = truth.map(|truth| (bbox.as_ref(), truth));
        comparison.overlaps.push(pair.map(|(b, t)| b.map_or(0.0, |b| b.overlap(&t))));
        let apart = pair.map(|(b, t)| (b.map(|b| difference(b, &t)), t));
        let length = |d: Option<[f64; 2]>| d.map_or(f64::INFINITY, |[dx, dy]| dx.hypot(dy));
        comparison.distances.push(apart.map(|(d, _)| length(d)));
        comparison
            .normalised
            .push(apart.map(|(d, t)| length(d.map(|[dx, dy]| [dx / t.w, dy / t.h]))));
    }
    comparison
}

fn difference(a: &BoundingBox, b: &BoundingBox) -> [f64; 2] {
    let ([ax, ay], [bx, by]) = (a.centre(), b.centre());
    [ax - bx, ay - by]
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: BoundingBox = BoundingBox { x: 10.0, y: 20.0, w: 30.0, h: 40.0 };

    #[test]
    fn a_box_not_given_is_the_last_one() {
        let other = BoundingBox { x: 0.0, ..UNIT };
        let filled = last_given(&[None, Some(UNIT), None, Some(other), None]);
        assert_eq!(filled, [None, Some(UNIT), Some(UNIT), Some(other), Some(other)]);
    }

    #[test]
    fn distances_are_those_of_the_centres() {
        let moved = BoundingBox { x: 13.0, y: 24.0, ..UNIT };
        let wider = BoundingBox { w: 32.0, ..UNIT };
        let c = compare(&[Some(UNIT), Some(moved), Some(wider)], &[Some(UNIT); 3]);
        assert_eq!(c.distances, [Some(0.0), Some(5.0), Some(1.0)]);
        assert_eq!(c.overlaps[0], Some(1.0));
        let expected = f64::hypot(3.0 / 30.0, 4.0 / 40.0);
        assert!((c.normalised[1].unwrap() - expected).abs() < 1e-15);
    }

    #[test]
    fn frames_without_truth_do_not_count_and_frames_without_a_box_fail() {
        let flat = BoundingBox { h: 0.0, ..UNIT };
        let c = compare(&[None, None, Some(UNIT)], &[Some(UNIT), None, Some(flat)]);
        assert_eq!(c.overlaps, [Some(0.0), None, None]);
        assert_eq!(c.distances, [Some(f64::INFINITY), None, None]);
        assert_eq!(c.normalised, [Some(f64::INFINITY), None, None]);
    }
}
