//! Compares one trajectory with the ground truth, frame by frame.

use patchlock::BoundingBox;

/// The measures of each frame; `None` for frames without ground truth, which do not count.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FrameMeasures {
    /// Intersection over union, 0 to 1.
    pub overlaps: Vec<Option<f64>>,
    /// Distance of the centres in pixels; infinite before the first box reported by the tracker.
    pub distances: Vec<Option<f64>>,
    /// The same with x divided by the width and y by the height of the true box.
    pub normalised: Vec<Option<f64>>,
}

/// Replaces each missing box by the last one before it; `None` before the first box.
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

/// Compares boxes with the ground truth of the same frames; both slices have the same length.
/// Missing boxes are replaced as by [`last_given`].
pub fn compare(boxes: &[Option<BoundingBox>], truth: &[Option<BoundingBox>]) -> FrameMeasures {
    let mut measures = FrameMeasures::default();
    for (bbox, truth) in last_given(boxes).iter().zip(truth) {
        let truth = truth.filter(|truth| truth.w > 0.0 && truth.h > 0.0);
        let pair = truth.map(|truth| (bbox.as_ref(), truth));
        measures.overlaps.push(pair.map(|(b, t)| b.map_or(0.0, |b| b.overlap(&t))));
        let apart = pair.map(|(b, t)| (b.map(|b| difference(b, &t)), t));
        let length = |d: Option<[f64; 2]>| d.map_or(f64::INFINITY, |[dx, dy]| dx.hypot(dy));
        measures.distances.push(apart.map(|(d, _)| length(d)));
        measures
            .normalised
            .push(apart.map(|(d, t)| length(d.map(|[dx, dy]| [dx / t.w, dy / t.h]))));
    }
    measures
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
    fn a_missing_box_is_replaced_by_the_last_one() {
        let other = BoundingBox { x: 0.0, ..UNIT };
        let filled = last_given(&[None, Some(UNIT), None, Some(other), None]);
        assert_eq!(filled, [None, Some(UNIT), Some(UNIT), Some(other), Some(other)]);
    }

    #[test]
    fn distances_are_between_the_centres() {
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
