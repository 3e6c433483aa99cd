//! The estimate of a frame: box and outline follow from the place, status and score from the
//! decision.

use super::pose::Pose;
use super::status::FrameResult;
use crate::estimate::{Estimate, Status};

/// Fills in all but the visibility, which is taken away while the target is lost. `base` is the
/// target's width and height in the first frame.
pub(crate) fn fill(pose: Pose, base: [f64; 2], result: FrameResult, out: &mut Estimate) {
    let [w, h] = pose.size(base);
    out.bbox = pose.bbox(base);
    out.corners = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]]
        .map(|[dx, dy]| pose.shifted([dx * (w - 1.0), dy * (h - 1.0)]).centre);
    (out.status, out.score) = (result.status, result.score);
    if result.status == Status::Lost {
        out.visibility = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vision::geometry::BoundingBox;
    use std::f64::consts::FRAC_PI_2;

    const VERDICT: FrameResult = FrameResult { status: Status::Uncertain, score: 0.7 };

    fn estimate(pose: Pose, result: FrameResult) -> Estimate {
        let mut estimate = Estimate::empty();
        estimate.visibility.get_or_insert_default();
        fill(pose, [11.0, 5.0], result, &mut estimate);
        estimate
    }

    #[test]
    fn the_outline_is_that_of_the_pixels_in_the_box() {
        let estimate = estimate(Pose { centre: [20.0, 30.0], scale: 1.0, rotation: 0.0 }, VERDICT);
        assert_eq!(estimate.bbox, BoundingBox { x: 15.0, y: 28.0, w: 11.0, h: 5.0 });
        assert_eq!(estimate.corners, [[15.0, 28.0], [25.0, 28.0], [25.0, 32.0], [15.0, 32.0]]);
        assert_eq!((estimate.status, estimate.score), (Status::Uncertain, 0.7));
        assert!(estimate.visibility.is_some());
    }

    #[test]
    fn the_outline_turns_and_the_box_stays_upright() {
        let estimate =
            estimate(Pose { centre: [20.0, 30.0], scale: 1.0, rotation: FRAC_PI_2 }, VERDICT);
        assert_eq!(estimate.bbox, BoundingBox { x: 15.0, y: 28.0, w: 11.0, h: 5.0 });
        let turned = [[22.0, 25.0], [22.0, 35.0], [18.0, 35.0], [18.0, 25.0]];
        for (corner, expected) in estimate.corners.iter().zip(turned) {
            let [dx, dy] = [0, 1].map(|axis| corner[axis] - expected[axis]);
            assert!(dx.hypot(dy) < 1e-12, "{:?}", estimate.corners);
        }
    }

    #[test]
    fn nothing_is_visible_of_a_lost_target() {
        let result = FrameResult { status: Status::Lost, score: 0.2 };
        let pose = Pose { centre: [20.0, 30.0], scale: 1.0, rotation: 0.0 };
        assert_eq!(estimate(pose, result).visibility, None);
    }
}
