//! Many targets tracked together get the same boxes as with separate trackers.

use crate::methods::{all, complete_many};
use crate::sequence::{SIMPLE, bits};
use crate::snapshot::number_outside;
use patchlock::{
    BoundingBox, Error, Estimate, Frame, FrameView, MultiSnapshot, MultiTracker, TargetEstimate,
    TargetId, Tracker, TrackerConfig,
};
use std::collections::BTreeMap;

/// The boxes of the card and of parts of the background.
fn boxes(count: usize) -> Vec<BoundingBox> {
    let card = SIMPLE.truth(0);
    let piece = |k: usize| BoundingBox {
        x: (17 * k % (SIMPLE.width() - 30)) as f64,
        y: (29 * k % (SIMPLE.height() - 30)) as f64 + 0.25,
        w: 18.0 + k as f64,
        h: 26.0 - k as f64,
    };
    std::iter::once(card).chain((1..count).map(piece)).collect()
}

/// The estimates of each target, in the order of frames.
type Tracks = BTreeMap<u64, Vec<Estimate>>;

fn keep(tracks: &mut Tracks, tracked: &[TargetEstimate]) {
    for TargetEstimate { id, estimate } in tracked {
        tracks.entry(id.number()).or_default().push(estimate.clone());
    }
}

/// Tracks targets together. Target k is added on frame k (counted from 0), and the second one is
/// removed before frame 6.
fn track_together(config: &TrackerConfig, threads: usize, count: usize, frames: usize) -> Tracks {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let mut tracker = MultiTracker::new(config.clone()).unwrap();
    let mut tracks = Tracks::new();
    for k in 0..frames {
        let frame = SIMPLE.frame(k);
        if k == 6 {
            tracker.remove(TargetId::from(2)).unwrap();
        }
        let tracked = pool.install(|| tracker.update(&frame)).unwrap().to_vec();
        assert_eq!(tracker.tracked(), tracked);
        keep(&mut tracks, &tracked);
        if let Some(&bbox) = boxes(count).get(k) {
            let added = pool.install(|| tracker.add(&frame, bbox)).unwrap();
            keep(&mut tracks, std::slice::from_ref(added));
        }
    }
    tracks
}

/// The same with one tracker per target.
fn track_separately(config: &TrackerConfig, count: usize, frames: usize) -> Tracks {
    let track = |(k, &bbox): (usize, &BoundingBox)| {
        let mut tracker = Tracker::start(config.clone(), &SIMPLE.frame(k), bbox).unwrap();
        let first = tracker.estimate().clone();
        let end = if k == 1 { 6 } else { frames };
        let rest = SIMPLE.resume(&mut tracker, k + 1..end);
        (k as u64 + 1, std::iter::once(first).chain(rest).collect())
    };
    boxes(count).iter().enumerate().map(track).collect()
}

#[test]
fn the_boxes_are_those_of_separate_trackers() {
    for config in all() {
        for count in [1, 2, 7] {
            let alone = track_separately(&config, count, 14);
            for threads in [1, 2, 5] {
                let together = track_together(&config, threads, count.max(2), 14);
                for (id, alone) in &alone {
                    let name = format!("{id} of {count}, {threads} threads");
                    assert_eq!(bits(alone), bits(&together[id]), "{name}");
                    assert_eq!(alone, &together[id]);
                }
            }
        }
    }
}

#[test]
fn a_target_that_begins_again_keeps_its_id_and_leaves_the_others_alone() {
    all().into_iter().for_each(check_restart);
}

fn check_restart(config: TrackerConfig) {
    let mut tracker = MultiTracker::new(config.clone()).unwrap();
    let all = boxes(2);
    let ids = add(&mut tracker, &all);
    tracker.update(&SIMPLE.frame(1)).unwrap();
    let again = tracker.restart(ids[0], &SIMPLE.frame(1), SIMPLE.truth(1)).unwrap().clone();
    assert_eq!(tracker.ids().collect::<Vec<_>>(), ids);
    assert_eq!(tracker.tracked()[0].estimate, again);
    let mut fresh = SIMPLE.begin(&config, 1);
    assert_eq!(*fresh.estimate(), again);
    let mut other = Tracker::start(config, &SIMPLE.frame(0), all[1]).unwrap();
    other.update(&SIMPLE.frame(1)).unwrap();
    for k in 2..8 {
        let frame = SIMPLE.frame(k);
        let expected = [(ids[0], &mut fresh), (ids[1], &mut other)].map(|(id, tracker)| {
            TargetEstimate { id, estimate: tracker.update(&frame).unwrap().clone() }
        });
        assert_eq!(tracker.update(&frame).unwrap(), expected);
    }
}

/// Adds targets on the first frame.
fn add(tracker: &mut MultiTracker, boxes: &[BoundingBox]) -> Vec<TargetId> {
    boxes.iter().map(|&bbox| tracker.add(&SIMPLE.frame(0), bbox).unwrap().id).collect()
}

/// Estimates and views are those of separate trackers, and the views come in the order of targets.
#[test]
fn an_observer_sees_what_those_of_separate_trackers_see() {
    for config in all() {
        let boxes = boxes(3);
        let mut together = MultiTracker::new(config.clone()).unwrap();
        let ids = add(&mut together, &boxes);
        let start =
            |&bbox: &BoundingBox| Tracker::start(config.clone(), &SIMPLE.frame(0), bbox).unwrap();
        let mut alone: Vec<Tracker> = boxes.iter().map(start).collect();
        for k in 1..12 {
            let frame = SIMPLE.frame(k);
            let (mut expected, mut expected_views) = (Vec::new(), Vec::new());
            for (&id, tracker) in ids.iter().zip(&mut alone) {
                let mut observer =
                    |view: &FrameView<'_>| expected_views.push((id, format!("{view:?}")));
                let estimate = tracker.update_observed(&frame, &mut observer).unwrap().clone();
                expected.push(TargetEstimate { id, estimate });
            }
            let mut views = Vec::new();
            let mut observer =
                |id: TargetId, view: &FrameView<'_>| views.push((id, format!("{view:?}")));
            let mut twin =
                MultiTracker::restore(complete_many(together.snapshot(), &config)).unwrap();
            let tracked = together.update_observed(&frame, &mut observer).unwrap();
            assert_eq!(tracked, expected, "frame {k}");
            assert_eq!(twin.update(&frame).unwrap(), expected, "frame {k}");
            assert_eq!(views, expected_views, "frame {k}");
        }
    }
}

#[test]
fn ids_are_never_reused() {
    all().into_iter().for_each(check_ids);
}

fn check_ids(config: TrackerConfig) {
    let mut tracker = MultiTracker::new(config).unwrap();
    let (frame, bbox) = (SIMPLE.frame(0), SIMPLE.truth(0));
    let first = tracker.add(&frame, bbox).unwrap().id;
    tracker.remove(first).unwrap();
    assert_eq!(tracker.update(&frame).unwrap(), []);
    let second = tracker.add(&frame, bbox).unwrap().id;
    assert_eq!((first.to_string(), second.to_string()), ("1".to_string(), "2".to_string()));
    for missing in [tracker.remove(first), tracker.restart(first, &frame, bbox).map(drop)] {
        let message = missing.unwrap_err().to_string();
        assert_eq!(message, "unknown target 1; known: 2");
    }
    tracker.remove(second).unwrap();
    let message = tracker.remove(second).unwrap_err().to_string();
    assert_eq!(message, "unknown target 2; known: none");
}

#[test]
fn failed_calls_change_nothing() {
    all().into_iter().for_each(check_failed_calls);
}

fn check_failed_calls(config: TrackerConfig) {
    let mut tracker = MultiTracker::new(config).unwrap();
    let id = tracker.add(&SIMPLE.frame(0), SIMPLE.truth(0)).unwrap().id;
    let before = tracker.snapshot();
    let pixels = [0.5; 96 * 72];
    let other = Frame::grey32f(&pixels, 96, 72).unwrap();
    let bbox = BoundingBox { x: 5.0, y: 5.0, w: 20.0, h: 20.0 };
    assert!(matches!(tracker.update(&other), Err(Error::FrameSize { width: 96, .. })));
    let observed = tracker.update_observed(&other, &mut |_, _| panic!("shown"));
    assert!(matches!(observed, Err(Error::FrameSize { width: 96, .. })));
    assert!(matches!(tracker.add(&other, bbox), Err(Error::FrameSize { .. })));
    let outside = BoundingBox { x: 5e3, ..bbox };
    let frame = SIMPLE.frame(1);
    assert!(matches!(tracker.add(&frame, outside), Err(Error::BoxOutside { .. })));
    assert!(matches!(tracker.restart(id, &frame, outside), Err(Error::BoxOutside { .. })));
    assert_eq!(tracker.snapshot(), before);
    // Without targets, any frame size is accepted.
    tracker.remove(id).unwrap();
    tracker.add(&other, bbox).unwrap();
}

/// A tracker with three targets, one of which has been removed, and its snapshot as text.
fn saved(config: TrackerConfig) -> (MultiTracker, String) {
    let mut tracker = MultiTracker::new(config).unwrap();
    let ids = add(&mut tracker, &boxes(3));
    for k in 1..8 {
        tracker.update(&SIMPLE.frame(k)).unwrap();
    }
    tracker.remove(ids[1]).unwrap();
    let text = serde_json::to_string(&tracker.snapshot()).unwrap();
    (tracker, text)
}

fn restore(text: &str, config: &TrackerConfig) -> Result<MultiTracker, String> {
    let snapshot: MultiSnapshot = serde_json::from_str(text).map_err(|error| error.to_string())?;
    MultiTracker::restore(complete_many(snapshot, config)).map_err(|error| error.to_string())
}

#[test]
fn a_restored_tracker_continues_with_the_same_boxes() {
    for config in all() {
        let (mut tracker, text) = saved(config.clone());
        let mut restored = restore(&text, &config).unwrap();
        assert_eq!(restored.config(), tracker.config());
        assert_eq!(restored.tracked(), tracker.tracked());
        for k in 8..14 {
            let frame = SIMPLE.frame(k);
            assert_eq!(tracker.update(&frame).unwrap(), restored.update(&frame).unwrap());
            if k == 10 {
                let bbox = boxes(4)[3];
                assert_eq!(tracker.add(&frame, bbox), restored.add(&frame, bbox));
            }
        }
        assert_eq!(restored.ids().map(TargetId::number).collect::<Vec<_>>(), [1, 3, 4]);
    }
}

#[test]
fn a_tracker_without_targets_can_be_saved() {
    for config in all() {
        let empty = MultiTracker::new(config.clone()).unwrap();
        let text = serde_json::to_string(&empty.snapshot()).unwrap();
        let mut restored = restore(&text, &config).unwrap();
        assert_eq!(restored.update(&SIMPLE.frame(0)).unwrap(), []);
        let added = restored.add(&SIMPLE.frame(0), SIMPLE.truth(0)).unwrap();
        assert_eq!(added.estimate, *SIMPLE.begin(&config, 0).estimate());
    }
}

#[test]
fn a_damaged_snapshot_is_refused() {
    for config in all() {
        let (_, text) = saved(config.clone());
        let [setting, outside, named] = number_outside(&config);
        let damaged = [
            (text.replacen(r#""version":11"#, r#""version":8"#, 1), "version is 8"),
            (text.replacen(r#""next":4"#, r#""next":3"#, 1), "[1, 3, 3] do not rise"),
            (text.replacen("[[1,", "[[3,", 1), "[3, 3, 4] do not rise"),
            (text.replacen("[[1,", "[[0,", 1), "[0, 3, 4] do not rise"),
            (text.replacen(&setting, &outside, 1), &*named),
            (text.replacen(r#""frame_size":{"#, r#""frame":{"#, 1), "no frame size"),
            (text.replacen(r#""width":240"#, r#""width":0"#, 1), "frame size is 0"),
        ];
        for (k, (damaged, words)) in damaged.iter().enumerate() {
            assert_ne!(damaged, &text, "damage {k} changes nothing");
            let message = restore(damaged, &config)
                .err()
                .unwrap_or_else(|| panic!("damage {k} was accepted"));
            assert!(message.contains(words), "{message}");
        }
    }
}
