//! Boxes of every kind work or are refused; none breaks anything.

use crate::film::{SIMPLE, numbers, quick};
use patchlock::config::Outside;
use patchlock::{BoundingBox, Error, FrameView, Tracker, TrackerConfig};

fn bbox([x, y, w, h]: [f64; 4]) -> BoundingBox {
    BoundingBox { x, y, w, h }
}

#[test]
fn boxes_that_are_none_are_refused_and_change_nothing() {
    let undisturbed = SIMPLE.track(&quick(), 0..5);
    let mut tracker = SIMPLE.begin(&quick(), 0);
    let no_shape = [
        [70.0, 70.0, 0.0, 40.0],
        [70.0, 70.0, 40.0, 0.0],
        [70.0, 70.0, -40.0, 40.0],
        [70.0, 70.0, 40.0, -1.0],
        [70.0, 70.0, 0.5, 40.0],
        [f64::NAN, 70.0, 40.0, 40.0],
        [70.0, f64::INFINITY, 40.0, 40.0],
        [70.0, 70.0, f64::NAN, 40.0],
        [70.0, 70.0, 40.0, f64::INFINITY],
        [0.0, 0.0, 1e300, 10.0],
    ];
    for no_box in no_shape {
        let error = tracker.init(&SIMPLE.frame(0), bbox(no_box)).unwrap_err();
        assert!(matches!(error, Error::BoxShape { .. }), "{no_box:?}: {error}");
    }
    for outside in [
        [-48.0, 70.0, 48.0, 40.0],
        [240.0, 70.0, 48.0, 40.0],
        [70.0, -40.0, 48.0, 40.0],
        [70.0, 180.0, 48.0, 40.0],
        [1e9, -1e9, 48.0, 40.0],
    ] {
        let error = tracker.reinit(&SIMPLE.frame(0), bbox(outside)).unwrap_err();
        assert!(matches!(error, Error::BoxOutside { .. }), "{outside:?}: {error}");
    }
    assert_eq!(SIMPLE.go_on(&mut tracker, 1..5), undisturbed);
}

#[test]
fn boxes_of_any_shape_and_place_can_be_tracked() {
    let boxes = [
        [80.0, 80.0, 1.0, 1.0],
        [80.0, 60.0, 2.0, 80.0],
        [40.0, 80.0, 80.0, 2.0],
        [70.375, 58.125, 48.7, 39.1],
        [-30.0, 60.0, 48.0, 40.0],
        [-47.5, 60.0, 48.0, 40.0],
        [225.5, 60.0, 48.0, 40.0],
        [70.0, -35.0, 48.0, 40.0],
        [239.0, 179.0, 48.0, 40.0],
        [0.0, 0.0, 240.0, 180.0],
        [-60.0, -60.0, 360.0, 300.0],
        [-40_000.0, -40_000.0, 100_000.0, 100_000.0],
    ];
    for outside in [Outside::Zero, Outside::Reject] {
        let config = TrackerConfig { outside, update_interval: 2, ..quick() };
        for numbers_of_box in boxes {
            let mut tracker = Tracker::new(config.clone()).unwrap();
            let begun = tracker.init(&SIMPLE.frame(0), bbox(numbers_of_box)).unwrap();
            let got = begun.bbox;
            for (got, want) in [got.x, got.y, got.w, got.h].iter().zip(numbers_of_box) {
                assert!((got - want).abs() < 1e-9 * want.abs().max(1.0), "{got} {want}");
            }
            for estimate in SIMPLE.go_on(&mut tracker, 1..9) {
                let all = numbers(&estimate);
                assert!(all[..12].iter().all(|v| v.is_finite()), "{numbers_of_box:?}: {all:?}");
                assert!(estimate.bbox.w > 0.0 && estimate.bbox.h > 0.0);
                assert!((0.0..=1.0).contains(&estimate.score));
                // Where every candidate leaves the frame, none has a likelihood.
                assert!(estimate.likelihood.is_finite() || outside == Outside::Reject);
            }
        }
    }
}

#[test]
fn candidates_that_leave_the_frame_can_be_rejected() {
    let config = TrackerConfig { outside: Outside::Reject, sigma_x: 10.0, ..quick() };
    let mut tracker = Tracker::new(config).unwrap();
    tracker.init(&SIMPLE.frame(0), bbox([2.0, 120.0, 48.0, 40.0])).unwrap();
    let mut rejected = 0;
    for k in 1..20 {
        let mut observer = |view: &FrameView<'_>| {
            rejected += view.likelihoods.iter().filter(|&&l| l == f64::NEG_INFINITY).count();
        };
        let estimate = tracker.update_observed(&SIMPLE.frame(k), &mut observer).unwrap();
        assert!(estimate.likelihood.is_finite());
        let [cx, cy] = estimate.bbox.centre();
        for [x, y] in estimate.corners {
            // The outermost samples: half a sample within the outline.
            let (x, y) = (cx + (x - cx) * 31.0 / 32.0, cy + (y - cy) * 31.0 / 32.0);
            let (right, bottom) = (SIMPLE.width() as f64 - 1.0, SIMPLE.height() as f64 - 1.0);
            assert!(x > -1e-9 && x < right + 1e-9 && y > -1e-9 && y < bottom + 1e-9, "{x} {y}");
        }
    }
    assert!(rejected > 0);
}

/// There is nothing to code then, and nothing of an earlier frame or another target may stand in for it.
#[test]
fn where_every_candidate_is_refused_all_is_hidden() {
    let config = TrackerConfig { outside: Outside::Reject, ..quick() };
    let outside = bbox([-30.0, 60.0, 48.0, 40.0]);
    let mut tracker = SIMPLE.begin(&config, 0);
    SIMPLE.go_on(&mut tracker, 1..4);
    let mut fresh = Tracker::new(config).unwrap();
    let begun = fresh.init(&SIMPLE.frame(0), outside).unwrap();
    assert_eq!(tracker.reinit(&SIMPLE.frame(0), outside).unwrap(), begun);
    let mut restored = Tracker::restore(tracker.snapshot()).unwrap();
    let later = SIMPLE.go_on(&mut tracker, 1..9);
    assert_eq!(SIMPLE.go_on(&mut fresh, 1..9), later);
    assert_eq!(SIMPLE.go_on(&mut restored, 1..9), later);
    for estimate in later.iter().chain([&begun]) {
        assert_eq!((estimate.likelihood, estimate.score), (f64::NEG_INFINITY, 0.0));
    }
}
