//! Boxes of every kind can be tracked or are refused, and no box corrupts the tracker.

use crate::methods::{all, complete, learning_early};
use crate::sequence::{SIMPLE, numbers};
use patchlock::{BoundingBox, Error, Tracker, TrackerConfig};

fn bbox([x, y, w, h]: [f64; 4]) -> BoundingBox {
    BoundingBox { x, y, w, h }
}

#[test]
fn invalid_boxes_are_refused_and_change_nothing() {
    all().iter().for_each(refuse_boxes);
}

fn refuse_boxes(config: &TrackerConfig) {
    let undisturbed = SIMPLE.track(config, 0..5);
    let mut tracker = SIMPLE.begin(config, 0);
    let bad_shapes = [
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
    for bad in bad_shapes {
        let again = tracker.restart(&SIMPLE.frame(0), bbox(bad)).unwrap_err();
        let begun = Tracker::start(config.clone(), &SIMPLE.frame(0), bbox(bad)).unwrap_err();
        for error in [again, begun] {
            assert!(matches!(error, Error::BoxShape { .. }), "{bad:?}: {error}");
        }
    }
    for outside in [
        [-48.0, 70.0, 48.0, 40.0],
        [240.0, 70.0, 48.0, 40.0],
        [70.0, -40.0, 48.0, 40.0],
        [70.0, 180.0, 48.0, 40.0],
        [1e9, -1e9, 48.0, 40.0],
    ] {
        let again = tracker.restart(&SIMPLE.frame(0), bbox(outside)).unwrap_err();
        let begun = Tracker::start(config.clone(), &SIMPLE.frame(0), bbox(outside)).unwrap_err();
        for error in [again, begun] {
            assert!(matches!(error, Error::BoxOutside { .. }), "{outside:?}: {error}");
        }
    }
    assert_eq!(SIMPLE.resume(&mut tracker, 1..5), undisturbed);
}

#[test]
fn a_box_of_a_few_pixels_is_tracked_or_refused_with_a_reason() {
    for config in all() {
        for (w, h) in [(1.0, 1.0), (3.9, 4.0), (1.0, 15.9)] {
            let given = bbox([80.0, 80.0, w, h]);
            match Tracker::start(config.clone(), &SIMPLE.frame(0), given) {
                Ok(mut tracker) => {
                    assert_ne!(config.method.name(), "paper");
                    let found = tracker.update(&SIMPLE.frame(1)).unwrap().bbox;
                    assert!([found.x, found.y, found.w, found.h].iter().all(|v| v.is_finite()));
                }
                Err(error) => {
                    assert!(matches!(error, Error::BoxTooSmall { .. }), "{error}");
                    assert_eq!(config.method.name(), "paper");
                    assert!(error.to_string().contains("at least 16 pixels"), "{error}");
                }
            }
        }
    }
}

#[test]
fn boxes_of_any_shape_and_position_can_be_tracked() {
    let boxes = [
        [80.0, 80.0, 4.0, 4.0],
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
    for config in all().into_iter().map(learning_early) {
        for numbers_of_box in boxes {
            let given = bbox(numbers_of_box);
            let mut tracker = Tracker::start(config.clone(), &SIMPLE.frame(0), given).unwrap();
            let got = tracker.estimate().bbox;
            for (got, want) in [got.x, got.y, got.w, got.h].iter().zip(numbers_of_box) {
                assert!((got - want).abs() < 1e-9 * want.abs().max(1.0), "{got} {want}");
            }
            for estimate in SIMPLE.resume(&mut tracker, 1..9) {
                let all = numbers(&estimate);
                assert!(all.iter().all(|v| v.is_finite()), "{numbers_of_box:?}: {all:?}");
                assert!(estimate.bbox.w > 0.0 && estimate.bbox.h > 0.0);
                assert!((0.0..=1.0).contains(&estimate.score));
            }
        }
    }
}

/// Data of an earlier frame or another target must not replace what is outside the frame.
#[test]
fn a_target_outside_the_frame_does_not_depend_on_what_was_tracked_before() {
    let outside = bbox([-30.0, 60.0, 31.0, 40.0]);
    for config in all() {
        let mut tracker = SIMPLE.begin(&config, 0);
        SIMPLE.resume(&mut tracker, 1..4);
        let mut fresh = Tracker::start(config.clone(), &SIMPLE.frame(0), outside).unwrap();
        let again = tracker.restart(&SIMPLE.frame(0), outside).unwrap();
        assert_eq!(again, fresh.estimate());
        let mut restored = Tracker::restore(complete(tracker.snapshot(), &config)).unwrap();
        let later = SIMPLE.resume(&mut tracker, 1..9);
        assert_eq!(SIMPLE.resume(&mut fresh, 1..9), later);
        assert_eq!(SIMPLE.resume(&mut restored, 1..9), later);
    }
}
