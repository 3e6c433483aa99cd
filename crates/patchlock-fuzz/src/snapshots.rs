//! Saved trackers, as text and as bytes.

use std::fmt::Display;

use patchlock::{
    Error, Frame, MultiSnapshot, MultiTracker, Preset, Snapshot, Tracker, TrackerConfig,
};
use serde_json::Value;

use crate::check::{accepted, estimate, through_text};
use crate::library::{is_quick, pattern};
use crate::made_up_network;

/// Frames with a longer side are not tracked.
const SIDE: usize = 128;
/// Updates of what was restored.
const UPDATES: usize = 2;

/// A snapshot of the preset `robust`.
pub fn snapshot_robust(data: &[u8]) {
    of_preset(data, Preset::Robust);
}

/// A snapshot of the preset `paper`.
pub fn snapshot_paper(data: &[u8]) {
    of_preset(data, Preset::Paper);
}

/// A snapshot of the preset `network`, whose network is the made-up one.
pub fn snapshot_network(data: &[u8]) {
    of_preset(data, Preset::Network);
}

/// A snapshot of any preset in MessagePack, as pickles of the Python package have it.
pub fn snapshot_packed(data: &[u8]) {
    restored(rmp_serde::from_slice(data), rmp_serde::from_slice(data), is_quick);
}

/// A tracker that continues from a snapshot, with a network if it needs one.
pub fn one_restored(snapshot: Snapshot) -> Result<Tracker, Error> {
    match Tracker::restore(snapshot.clone()) {
        Err(Error::Network(_)) => Tracker::restore(snapshot.with_network(made_up_network())),
        restored => restored,
    }
}

fn many_restored(snapshot: MultiSnapshot) -> Result<MultiTracker, Error> {
    match MultiTracker::restore(snapshot.clone()) {
        Err(Error::Network(_)) => MultiTracker::restore(snapshot.with_network(made_up_network())),
        restored => restored,
    }
}

/// A snapshot as text. Those of another method than the preset's have a surface of their own.
fn of_preset(text: &[u8], preset: Preset) {
    let method = TrackerConfig::from(preset).method;
    restored(serde_json::from_slice(text), serde_json::from_slice(text), |config| {
        config.method.name() == method.name() && is_quick(config)
    });
}

/// Continues from a snapshot, of one target or of many, as far as it could be read. A tracker whose
/// configuration is `kept` tracks, and its own snapshot is read again.
fn restored<E: Display>(
    of_one: Result<Snapshot, E>,
    of_many: Result<MultiSnapshot, E>,
    kept: impl Fn(&TrackerConfig) -> bool,
) {
    let tracker = accepted(of_one).and_then(|snapshot| accepted(one_restored(snapshot)));
    tracker.filter(|tracker| kept(tracker.config())).into_iter().for_each(one);
    let tracker = accepted(of_many).and_then(|snapshot| accepted(many_restored(snapshot)));
    tracker.filter(|tracker| kept(tracker.config())).into_iter().for_each(many);
}

/// The size of the frames in the text of a snapshot, if frames of it can be made here.
fn frame_size(text: &str) -> Option<[usize; 2]> {
    let value: Value = serde_json::from_str(text).expect("is JSON");
    let side = |name: &str| value["frame_size"][name].as_u64().map(|side| side as usize);
    Some([side("width")?, side("height")?]).filter(|size| size.iter().all(|side| *side <= SIDE))
}

fn one(mut tracker: Tracker) {
    for k in 0..UPDATES {
        let (text, read) = through_text(&tracker.snapshot());
        let mut twin = one_restored(read).expect("what was written can be restored");
        let Some([width, height]) = frame_size(&text) else { return };
        let pixels = pattern(width, height, k as u8);
        let frame = Frame::grey8(&pixels, width, height).expect("is a frame");
        let found = tracker.update(&frame).expect("the frame has the right size");
        estimate(found);
        assert_eq!(twin.update(&frame), Ok(found));
        assert_eq!(twin.snapshot(), tracker.snapshot());
    }
}

fn many(mut tracker: MultiTracker) {
    let (text, read) = through_text(&tracker.snapshot());
    accepted(many_restored(read)).expect("what was written can be restored");
    let Some([width, height]) = frame_size(&text) else { return };
    let pixels = pattern(width, height, 3);
    let frame = Frame::grey8(&pixels, width, height).expect("is a frame");
    let found = tracker.update(&frame).expect("the frame has the right size");
    found.iter().for_each(|tracked| estimate(&tracked.estimate));
}
