//! A saved tracker goes on to the same boxes; a damaged one is refused.

use crate::film::{SIMPLE, bits, numbers, quick};
use patchlock::config::FirstTemplates;
use patchlock::{Error, Snapshot, Tracker, TrackerConfig};
use serde_json::{Value, json};

const MODES: [FirstTemplates; 3] =
    [FirstTemplates::Shifts, FirstTemplates::WarmUp, FirstTemplates::Nearest];

/// The tracker after these many frames.
fn after(frames: usize, config: &TrackerConfig) -> Tracker {
    let mut tracker = SIMPLE.begin(config, 0);
    SIMPLE.go_on(&mut tracker, 1..1 + frames);
    tracker
}

/// Stands for the random number generator: its integers of 128 bits have no place in a [`Value`].
const RNG: &str = "the random number generator";

/// A saved tracker, taken apart so that it can be damaged.
#[derive(Clone)]
struct Saved {
    value: Value,
    rng: String,
}

impl Saved {
    fn new(tracker: &Tracker) -> Self {
        let text = serde_json::to_string(&tracker.snapshot()).unwrap();
        let (before, rest) = text.split_once(r#""rng":"#).unwrap();
        let (rng, after) = rest.split_once('}').unwrap();
        let rng = format!("{rng}}}");
        let value = serde_json::from_str(&format!(r#"{before}"rng":"{RNG}"{after}"#)).unwrap();
        Self { value, rng }
    }

    /// Replaces what stands at a pointer.
    fn with(&self, at: &str, value: Value) -> Self {
        let mut damaged = self.clone();
        *damaged.value.pointer_mut(at).unwrap_or_else(|| panic!("no {at}")) = value;
        damaged
    }

    /// Changes an array or an object at a pointer.
    fn changed(&self, at: &str, change: impl FnOnce(&mut Value)) -> Self {
        let mut damaged = self.clone();
        change(damaged.value.pointer_mut(at).unwrap());
        damaged
    }

    fn without(&self, object: &str, key: &str) -> Self {
        self.changed(object, |object| drop(object.as_object_mut().unwrap().remove(key).unwrap()))
    }

    /// The tracker, or why it is none.
    fn restore(&self) -> Result<Tracker, String> {
        let text = self.value.to_string().replace(&format!("\"{RNG}\""), &self.rng);
        let snapshot: Snapshot = serde_json::from_str(&text).map_err(|e| e.to_string())?;
        Tracker::restore(snapshot).map_err(|e| e.to_string())
    }
}

#[test]
fn a_restored_tracker_goes_on_to_the_same_boxes() {
    for first_templates in MODES {
        let config = TrackerConfig { first_templates, ..quick() };
        // Before the first frame, while templates are gathered, at an update, between updates.
        for frames in [0, 1, 4, 9, 10, 13] {
            let mut tracker = after(frames, &config);
            let text = serde_json::to_string(&tracker.snapshot()).unwrap();
            let snapshot: Snapshot = serde_json::from_str(&text).unwrap();
            assert_eq!(snapshot, tracker.snapshot());
            let mut restored = Tracker::restore(snapshot).unwrap();
            assert_eq!(restored.config(), tracker.config());
            let goes_on = 1 + frames..16 + frames;
            let (a, b) =
                (SIMPLE.go_on(&mut tracker, goes_on.clone()), SIMPLE.go_on(&mut restored, goes_on));
            assert_eq!(bits(&a), bits(&b), "{first_templates:?}, saved after {frames}");
            assert_eq!(a, b);
        }
    }
}

#[test]
fn a_snapshot_without_a_target_waits_for_one() {
    let empty = Tracker::new(quick()).unwrap().snapshot();
    let mut restored = Tracker::restore(empty).unwrap();
    assert_eq!(restored.update(&SIMPLE.frame(0)), Err(Error::NotInitialised));
    restored.init(&SIMPLE.frame(0), SIMPLE.truth(0)).unwrap();
    let fresh = SIMPLE.track(&quick(), 0..6);
    assert_eq!(SIMPLE.go_on(&mut restored, 1..6), fresh);
}

#[test]
fn a_restored_tracker_wants_frames_of_the_same_size() {
    let mut restored = Saved::new(&after(3, &quick())).restore().unwrap();
    let other = [0; 12];
    let error = restored.update(&patchlock::Frame::grey8(&other, 4, 3).unwrap()).unwrap_err();
    assert!(matches!(error, Error::FrameSize { width: 4, height: 3, .. }));
}

fn shorten(array: &mut Value) {
    array.as_array_mut().unwrap().pop().unwrap();
}

/// Repeats the last element.
fn lengthen(array: &mut Value) {
    let array = array.as_array_mut().unwrap();
    array.push(array.last().unwrap().clone());
}

#[test]
fn a_damaged_snapshot_is_refused() {
    let good = Saved::new(&after(12, &quick()));
    good.restore().unwrap();
    let replaced = [
        ("/version", json!(0)),
        ("/version", json!(2)),
        ("/config/particles", json!(0)),
        ("/config/template_side", json!(24)),
        ("/config/templates", json!(9)),
        ("/config/buffer", json!(3)),
        ("/config/update_interval", json!(1)),
        ("/config/outside", json!("sideways")),
        ("/memory/width", json!(0)),
        ("/memory/height", json!(0)),
        ("/memory/height", json!(-1)),
        ("/memory/state/scale", json!(0.0)),
        ("/memory/state/scale", json!(-1.5)),
        ("/memory/state/aspect", json!(-0.5)),
        ("/memory/state/x", Value::Null),
        ("/memory/state", json!({})),
        ("/memory/templates", json!([])),
        ("/memory/templates/3", json!([])),
        ("/memory/templates/3/7", json!(1000.0)),
        ("/memory/templates/3/7", Value::Null),
        ("/memory/small_templates", json!([])),
        ("/memory/large_buffer/1", json!([0.5])),
        ("/memory/small_buffer/0/0", json!(-3.0)),
        ("/memory/batch/0", json!([1.0])),
        ("/memory/subspace/mean", json!([])),
        ("/memory/subspace/weight", json!(-1.0)),
        ("/memory/subspace/mean", json!(vec![1e300; 1024])),
        ("/memory/subspace/basis/0", json!(1e300)),
        ("/memory/frames", json!(u64::MAX - 2)),
        ("/memory/steps", json!(u64::MAX - 2)),
        ("/memory/rng", json!(5)),
    ];
    for (at, value) in replaced {
        let said = good.with(at, value.clone()).restore().err();
        assert!(said.is_some(), "{at} = {value} was taken");
    }
    let arrays = [
        "/memory/templates",
        "/memory/templates/0",
        "/memory/small_templates",
        "/memory/small_templates/9",
        "/memory/large_buffer",
        "/memory/large_buffer/3",
        "/memory/small_buffer",
        "/memory/small_buffer/2",
        "/memory/batch/1",
        "/memory/subspace/mean",
        "/memory/subspace/basis",
        "/memory/subspace/values",
    ];
    for at in arrays {
        assert!(good.changed(at, shorten).restore().is_err(), "{at} too short");
        assert!(good.changed(at, lengthen).restore().is_err(), "{at} too long");
    }
    for key in good.value["memory"].as_object().unwrap().keys() {
        assert!(good.without("/memory", key).restore().is_err(), "without {key}");
    }
    for key in ["version", "config"] {
        assert!(good.without("", key).restore().is_err(), "without {key}");
    }
    assert!(good.with("", json!("a tracker")).restore().is_err());
}

#[test]
fn a_refusal_says_what_does_not_fit() {
    let good = Saved::new(&after(12, &quick()));
    let said = |at: &str, value: Value| good.with(at, value).restore().unwrap_err();
    assert!(said("/version", json!(7)).contains("version is 7"));
    assert!(said("/memory/templates", json!([])).contains("templates"));
    assert!(said("/memory/small_buffer", json!([])).contains("buffers"));
    assert!(said("/memory/subspace/mean", json!([])).contains("subspace"));
    assert!(said("/config/particles", json!(0)).contains("particles"));
}

/// What can't be told from a good snapshot may track nothing, but must not break anything.
#[test]
fn an_odd_snapshot_never_panics() {
    let odd = [
        ("/memory/frames", json!(0)),
        ("/memory/steps", json!(0)),
        ("/memory/gathering", json!(true)),
        ("/memory/width", json!(100_000_000_000u64)),
        ("/memory/state/x", json!(1e300)),
        ("/memory/state/y", json!(-1e9)),
        ("/memory/state/scale", json!(1e-300)),
        ("/memory/state/rotation", json!(1e18)),
        ("/memory/templates/0", json!(vec![0.0; 1024])),
        ("/memory/subspace/weight", json!(0.0)),
        ("/memory/subspace/mean", json!(vec![0.0; 1024])),
        ("/memory/subspace/values/0", json!(1e300)),
        ("/memory/subspace/weight", json!(1e300)),
    ];
    for first_templates in MODES {
        let config = TrackerConfig { first_templates, update_interval: 2, ..quick() };
        for frames in [3, 13] {
            let good = Saved::new(&after(frames, &config));
            for (at, value) in &odd {
                if good.value.pointer(at).is_none_or(|v| v.as_array().is_some_and(Vec::is_empty)) {
                    continue;
                }
                let Ok(mut tracker) = good.with(at, value.clone()).restore() else {
                    continue;
                };
                for k in 14..20 {
                    if let Ok(estimate) = tracker.update(&SIMPLE.frame(k)) {
                        let box_numbers = &numbers(&estimate)[..4];
                        assert!(box_numbers.iter().all(|v| v.is_finite()), "{at} {value}");
                    }
                }
            }
        }
    }
}
