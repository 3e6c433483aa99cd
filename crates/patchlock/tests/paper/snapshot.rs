//! Damaged snapshots of the paper's tracker are refused. Damage that cannot be detected never
//! causes a panic.

use crate::methods::paper;
use crate::sequence::{SIMPLE, numbers};
use patchlock::{Snapshot, Tracker, TrackerConfig};
use serde_json::{Value, json};

/// A tracker after this many frames.
fn after(frames: usize, config: &TrackerConfig) -> Tracker {
    let mut tracker = SIMPLE.begin(config, 0);
    SIMPLE.resume(&mut tracker, 1..1 + frames);
    tracker
}

/// Placeholder for the random number generator, whose 128-bit integers do not fit in a [`Value`].
const RNG: &str = "the random number generator";

/// A snapshot in a form that can be damaged.
#[derive(Clone)]
struct EditableSnapshot {
    value: Value,
    rng: String,
}

impl EditableSnapshot {
    fn new(tracker: &Tracker) -> Self {
        let text = serde_json::to_string(&tracker.snapshot()).unwrap();
        let (before, rest) = text.split_once(r#""rng":"#).unwrap();
        let (rng, after) = rest.split_once('}').unwrap();
        let rng = format!("{rng}}}");
        let value = serde_json::from_str(&format!(r#"{before}"rng":"{RNG}"{after}"#)).unwrap();
        Self { value, rng }
    }

    /// Replaces the value at a JSON pointer.
    fn with(&self, at: &str, value: Value) -> Self {
        let mut damaged = self.clone();
        *damaged.value.pointer_mut(at).unwrap_or_else(|| panic!("no {at}")) = value;
        damaged
    }

    /// Changes the array or object at a JSON pointer.
    fn changed(&self, at: &str, change: impl FnOnce(&mut Value)) -> Self {
        let mut damaged = self.clone();
        change(damaged.value.pointer_mut(at).unwrap());
        damaged
    }

    fn without(&self, object: &str, key: &str) -> Self {
        self.changed(object, |object| drop(object.as_object_mut().unwrap().remove(key).unwrap()))
    }

    /// The restored tracker, or the error message.
    fn restore(&self) -> Result<Tracker, String> {
        let text = self.value.to_string().replace(&format!("\"{RNG}\""), &self.rng);
        let snapshot: Snapshot = serde_json::from_str(&text).map_err(|e| e.to_string())?;
        Tracker::restore(snapshot).map_err(|e| e.to_string())
    }
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
    let good = EditableSnapshot::new(&after(12, &paper()));
    good.restore().unwrap();
    let replaced = [
        ("/config/paper/particles", json!(0)),
        ("/config/paper/patches/template_side", json!(24)),
        ("/config/paper/patches/templates", json!(9)),
        ("/config/paper/patches/buffer", json!(3)),
        ("/config/paper/patches/update_interval", json!(1)),
        ("/track/target/paper/state/scale", json!(0.0)),
        ("/track/target/paper/state/scale", json!(-1.5)),
        ("/track/target/paper/state/aspect", json!(-0.5)),
        ("/track/target/paper/state/aspect", json!(1e308)),
        ("/track/target/paper/state/x", Value::Null),
        ("/track/target/paper/state", json!({})),
        ("/track/target/paper/model/templates", json!([])),
        ("/track/target/paper/model/templates/3", json!([])),
        ("/track/target/paper/model/templates/3/7", json!(1000.0)),
        ("/track/target/paper/model/templates/3/7", Value::Null),
        ("/track/target/paper/model/small_templates", json!([])),
        ("/track/target/paper/model/large_buffer/1", json!([0.5])),
        ("/track/target/paper/model/small_buffer/0/0", json!(-3.0)),
        ("/track/target/paper/model/batch/0", json!([1.0])),
        ("/track/target/paper/model/subspace/mean", json!([])),
        ("/track/target/paper/model/subspace/weight", json!(-1.0)),
        ("/track/target/paper/model/subspace/mean", json!(vec![1e300; 1024])),
        ("/track/target/paper/model/subspace/basis/0", json!(1e300)),
        ("/track/target/paper/frames", json!(u64::MAX - 2)),
        ("/track/target/paper/rng", json!(5)),
    ];
    for (at, value) in replaced {
        let message = good.with(at, value.clone()).restore().err();
        assert!(message.is_some(), "{at} = {value} was accepted");
    }
    let arrays = [
        "/track/target/paper/model/templates",
        "/track/target/paper/model/templates/0",
        "/track/target/paper/model/small_templates",
        "/track/target/paper/model/small_templates/9",
        "/track/target/paper/model/large_buffer",
        "/track/target/paper/model/large_buffer/3",
        "/track/target/paper/model/small_buffer",
        "/track/target/paper/model/small_buffer/2",
        "/track/target/paper/model/batch/1",
        "/track/target/paper/model/subspace/mean",
        "/track/target/paper/model/subspace/basis",
        "/track/target/paper/model/subspace/values",
    ];
    for at in arrays {
        assert!(good.changed(at, shorten).restore().is_err(), "{at} is too short");
        assert!(good.changed(at, lengthen).restore().is_err(), "{at} is too long");
    }
    for object in
        ["/track/target/paper", "/track/target/paper/model", "/track/target", "/track", ""]
    {
        for key in good.value.pointer(object).unwrap().as_object().unwrap().keys() {
            assert!(good.without(object, key).restore().is_err(), "without {object}/{key}");
        }
    }
    assert!(good.with("", json!("a tracker")).restore().is_err());
}

#[test]
fn an_error_names_the_part_that_does_not_fit() {
    let good = EditableSnapshot::new(&after(12, &paper()));
    let message = |at: &str, value: Value| good.with(at, value).restore().unwrap_err();
    assert!(message("/track/target/paper/model/templates", json!([])).contains("templates"));
    assert!(message("/track/target/paper/model/small_buffer", json!([])).contains("buffers"));
    assert!(message("/track/target/paper/model/subspace/mean", json!([])).contains("subspace"));
    assert!(message("/config/paper/particles", json!(0)).contains("particles"));
}

/// A snapshot whose damage cannot be detected may track badly, but must not cause a panic.
#[test]
fn an_odd_snapshot_never_panics() {
    let odd = [
        ("/track/target/paper/frames", json!(0)),
        ("/track/target/paper/state/x", json!(1e300)),
        ("/track/target/paper/state/y", json!(-1e9)),
        ("/track/target/paper/state/scale", json!(1e-300)),
        ("/track/target/paper/state/rotation", json!(1e18)),
        ("/track/target/paper/model/templates/0", json!(vec![0.0; 1024])),
        ("/track/target/paper/model/subspace/weight", json!(0.0)),
        ("/track/target/paper/model/subspace/mean", json!(vec![0.0; 1024])),
        ("/track/target/paper/model/subspace/values/0", json!(1e300)),
        ("/track/target/paper/model/subspace/weight", json!(1e300)),
    ];
    let mut config = paper();
    config.set("update_interval", 2).unwrap();
    for frames in [3, 13] {
        let good = EditableSnapshot::new(&after(frames, &config));
        for (at, value) in &odd {
            if good.value.pointer(at).is_none_or(|v| v.as_array().is_some_and(Vec::is_empty)) {
                continue;
            }
            let Ok(mut tracker) = good.with(at, value.clone()).restore() else {
                continue;
            };
            for k in 14..20 {
                if let Ok(estimate) = tracker.update(&SIMPLE.frame(k)) {
                    let box_numbers = &numbers(estimate)[..4];
                    assert!(box_numbers.iter().all(|v| v.is_finite()), "{at} {value}");
                }
            }
        }
    }
}
