//! Snapshots of version 0.1 continue with the boxes of version 0.1.
//!
//! The program named in the field `made_by` wrote `version_0_1.json`.

use crate::sequence::SIMPLE;
use patchlock::{Estimate, Method, MultiSnapshot, MultiTracker, Snapshot, Tracker};
use serde::Deserialize;

/// x, y, w, h, the corners and the score.
type Numbers = Vec<f64>;

#[derive(Deserialize)]
struct Golden {
    single: Snapshot,
    later: Vec<Numbers>,
    multi: MultiSnapshot,
    later_multi: Vec<Vec<(u64, Numbers)>>,
    empty: Snapshot,
}

const FILE: &str = include_str!("version_0_1.json");

fn golden() -> Golden {
    serde_json::from_str(FILE).unwrap()
}

fn numbers(estimate: &Estimate) -> Numbers {
    let Estimate { bbox, corners, score, .. } = estimate;
    let mut all = vec![bbox.x, bbox.y, bbox.w, bbox.h];
    all.extend(corners.as_flattened());
    all.push(*score);
    all
}

#[test]
fn a_tracker_continues() {
    let golden = golden();
    let mut tracker = Tracker::restore(golden.single).unwrap();
    assert_eq!(tracker.config().patchwise.particles, 12);
    assert_eq!(tracker.config().method, Method::Patchwise);
    for (k, expected) in (5..).zip(&golden.later) {
        assert_eq!(numbers(&tracker.update(&SIMPLE.frame(k)).unwrap()), *expected, "frame {k}");
    }
}

#[test]
fn a_multi_tracker_continues() {
    let golden = golden();
    let mut tracker = MultiTracker::restore(golden.multi).unwrap();
    for (k, expected) in (5..).zip(&golden.later_multi) {
        let found = tracker.update(&SIMPLE.frame(k)).unwrap();
        let found: Vec<_> = found.iter().map(|(id, e)| (id.number(), numbers(e))).collect();
        assert_eq!(found, *expected, "frame {k}");
    }
}

#[test]
fn a_tracker_without_a_target_waits_for_one() {
    let mut tracker = Tracker::restore(golden().empty).unwrap();
    assert!(tracker.update(&SIMPLE.frame(0)).is_err());
    tracker.init(&SIMPLE.frame(0), SIMPLE.truth(0)).unwrap();
}

#[test]
fn an_option_that_no_longer_exists_is_named() {
    let text = FILE.replacen(r#""outside":"zero""#, r#""outside":"reject""#, 1);
    assert_ne!(text, FILE);
    let error = serde_json::from_str::<Golden>(&text).err().unwrap().to_string();
    assert!(error.contains("`outside` no longer exists"), "{error}");
    let text = FILE.replacen(r#""rng":"#, r#""dice":"#, 1);
    let error = serde_json::from_str::<Golden>(&text).err().unwrap().to_string();
    assert!(error.contains("`rng` is missing"), "{error}");
}
