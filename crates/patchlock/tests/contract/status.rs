//! Saved trackers and saved estimates keep the status.

use crate::methods::{all, complete, robust};
use crate::sequence::SIMPLE;
use patchlock::{Estimate, Frame, FrameView, Snapshot, Status, Tracker, TrackerConfig};

/// Frames 0 and 1 show the target, 2 to 21 are noise, and then the target is there again.
const FRAMES: usize = 32;

/// Tracks all frames. Before frame `saved` the tracker is replaced by one restored from text.
fn vanishing(config: &TrackerConfig, saved: Option<usize>) -> Vec<Estimate> {
    let mut tracker = SIMPLE.begin(config, 0);
    let step = |k| {
        if saved == Some(k) {
            let text = serde_json::to_string(&tracker.snapshot()).unwrap();
            tracker = restored(&text, config);
        }
        match k {
            2..22 => {
                let noise = noise(k as u64);
                let frame = Frame::rgb8(&noise, SIMPLE.width(), SIMPLE.height()).unwrap();
                tracker.update(&frame).unwrap().clone()
            }
            _ => tracker.update(&SIMPLE.frame(k)).unwrap().clone(),
        }
    };
    (1..FRAMES).map(step).collect()
}

fn restored(text: &str, config: &TrackerConfig) -> Tracker {
    let snapshot: Snapshot = serde_json::from_str(text).unwrap();
    Tracker::restore(complete(snapshot, config)).unwrap()
}

/// A frame of random bytes.
fn noise(seed: u64) -> Vec<u8> {
    let mut state = seed;
    let mut next = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 56) as u8
    };
    (0..3 * SIMPLE.width() * SIMPLE.height()).map(|_| next()).collect()
}

/// The same settings, under which the status changes.
fn noticing(mut config: TrackerConfig) -> TrackerConfig {
    if config.network.is_some() {
        // The scores of made-up weights mean nothing; half of them shall count as tracked.
        let mut scores: Vec<f64> = vanishing(&config, None).iter().map(|one| one.score).collect();
        scores.sort_by(f64::total_cmp);
        config.set("tracked_score", scores[scores.len() / 2]).unwrap();
    }
    config
}

#[test]
fn a_tracker_saved_while_the_target_is_gone_goes_on_with_the_same_statuses() {
    for config in all().into_iter().map(noticing) {
        let expected = vanishing(&config, None);
        let first = expected[0].status;
        assert!(
            expected.iter().any(|estimate| estimate.status != first),
            "{}",
            config.method.name()
        );
        for saved in [3, 10, 21, 24] {
            let restored = vanishing(&config, Some(saved));
            assert_eq!(restored, expected, "{}, saved before frame {saved}", config.method.name());
        }
    }
}

#[test]
fn the_phase_says_why_the_filters_call_a_target_lost() {
    let (mut tracker, mut phases) = (SIMPLE.begin(&robust(), 0), Vec::new());
    let grey = vec![128; 3 * SIMPLE.width() * SIMPLE.height()];
    let empty = Frame::rgb8(&grey, SIMPLE.width(), SIMPLE.height()).unwrap();
    for k in 1..FRAMES {
        let mut phase = "";
        let frame = if (2..22).contains(&k) { empty } else { SIMPLE.frame(k) };
        let mut observer = |view: &FrameView<'_>| {
            let FrameView::Robust(view) = view else { panic!("there are filters alone") };
            phase = view.phase;
        };
        let estimate = tracker.update_observed(&frame, &mut observer).unwrap();
        assert!(phase != "lost" || estimate.status == Status::Lost, "frame {k}");
        if phases.last() != Some(&phase) {
            phases.push(phase);
        }
    }
    assert_eq!(phases, ["tracking", "occluded", "lost", "verifying", "tracking"]);
}

#[test]
fn a_saved_estimate_has_the_status_by_its_name() {
    let [estimate, ..] = &vanishing(&all()[0], None)[..] else { panic!("there are estimates") };
    for (status, name) in
        [Status::Tracked, Status::Uncertain, Status::Lost].into_iter().zip(Status::NAMES)
    {
        let estimate = Estimate { status, visibility: None, ..estimate.clone() };
        let value = serde_json::to_value(&estimate).unwrap();
        assert_eq!((&value["status"], status.to_string().as_str()), (&name.into(), name));
        assert_eq!(serde_json::from_value::<Estimate>(value).unwrap(), estimate);
    }
}
