//! A restored tracker continues with the same boxes; a damaged snapshot is refused.

use crate::methods::all;
use crate::sequence::{SIMPLE, bits};
use patchlock::{Error, Snapshot, Tracker, TrackerConfig};

/// A tracker after this many frames.
fn after(frames: usize, config: &TrackerConfig) -> Tracker {
    let mut tracker = SIMPLE.begin(config, 0);
    SIMPLE.resume(&mut tracker, 1..1 + frames);
    tracker
}

fn text(tracker: &Tracker) -> String {
    serde_json::to_string(&tracker.snapshot()).unwrap()
}

fn restore(text: &str) -> Result<Tracker, String> {
    let snapshot: Snapshot = serde_json::from_str(text).map_err(|error| error.to_string())?;
    Tracker::restore(snapshot).map_err(|error| error.to_string())
}

#[test]
fn a_restored_tracker_continues_with_the_same_boxes() {
    for config in all() {
        // Before the first frame, on an update, and between updates.
        for frames in [0, 1, 4, 9, 10, 13] {
            let mut tracker = after(frames, &config);
            let snapshot: Snapshot = serde_json::from_str(&text(&tracker)).unwrap();
            assert_eq!(snapshot, tracker.snapshot());
            let mut restored = Tracker::restore(snapshot).unwrap();
            assert_eq!(restored.config(), tracker.config());
            let frames_after = 1 + frames..16 + frames;
            let a = SIMPLE.resume(&mut tracker, frames_after.clone());
            let b = SIMPLE.resume(&mut restored, frames_after);
            assert_eq!(bits(&a), bits(&b), "saved after {frames}");
            assert_eq!(a, b);
        }
    }
}

#[test]
fn a_snapshot_without_a_target_waits_for_one() {
    for config in all() {
        let empty = text(&Tracker::new(config.clone()).unwrap());
        let mut restored = restore(&empty).unwrap();
        assert_eq!(restored.update(&SIMPLE.frame(0)), Err(Error::NotInitialised));
        restored.init(&SIMPLE.frame(0), SIMPLE.truth(0)).unwrap();
        let fresh = SIMPLE.track(&config, 0..6);
        assert_eq!(SIMPLE.resume(&mut restored, 1..6), fresh);
    }
}

#[test]
fn a_restored_tracker_needs_frames_of_the_same_size() {
    for config in all() {
        let mut restored = restore(&text(&after(3, &config))).unwrap();
        let other = [0; 12];
        let error = restored.update(&patchlock::Frame::grey8(&other, 4, 3).unwrap()).unwrap_err();
        assert!(matches!(error, Error::FrameSize { width: 4, height: 3, .. }));
    }
}

#[test]
fn a_damaged_snapshot_is_refused() {
    for config in all() {
        let good = text(&after(12, &config));
        restore(&good).unwrap();
        let size =
            format!(r#""frame_size":{{"width":{},"height":{}}}"#, SIMPLE.width(), SIMPLE.height());
        let damaged = [
            (r#""version":2"#.to_owned(), r#""version":0"#, "version is 0"),
            (r#""version":2"#.to_owned(), r#""version":7"#, "version is 7"),
            (r#""version":2"#.to_owned(), r#""edition":2"#, "version"),
            (r#""method":"#.to_owned(), r#""means":"#, "means"),
            (r#""target":{"#.to_owned(), r#""goal":{"#, "not both"),
            (size.clone(), r#""frame_size":null"#, "not both"),
            (size.clone(), r#""frame_size":{"width":0,"height":5}"#, "frame size is 0"),
            (size, r#""frame_size":{"width":-5,"height":5}"#, "-5"),
        ];
        for (from, to, words) in damaged {
            let text = good.replacen(&from, to, 1);
            assert_ne!(text, good, "there is no {from}");
            let message = restore(&text).err().unwrap_or_else(|| panic!("{to} was accepted"));
            assert!(message.contains(words), "{to}: {message}");
        }
        // Truncated snapshots.
        for share in 1..10 {
            assert!(restore(&good[..good.len() * share / 10]).is_err());
        }
    }
}
