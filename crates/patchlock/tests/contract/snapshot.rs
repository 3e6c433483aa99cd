//! A restored tracker continues with the same boxes; a damaged snapshot is refused.

use crate::methods::{all, complete, complete_many};
use crate::sequence::{SIMPLE, bits};
use patchlock::{
    BoundingBox, Error, Estimate, Kind, MultiSnapshot, MultiTracker, PARAMETERS, Range, Snapshot,
    Tracker, TrackerConfig, Value, Visibility,
};

/// A tracker after this many frames.
fn after(frames: usize, config: &TrackerConfig) -> Tracker {
    let mut tracker = SIMPLE.begin(config, 0);
    SIMPLE.resume(&mut tracker, 1..1 + frames);
    tracker
}

fn text(tracker: &Tracker) -> String {
    serde_json::to_string(&tracker.snapshot()).unwrap()
}

fn restore(text: &str, config: &TrackerConfig) -> Result<Tracker, String> {
    let snapshot: Snapshot = serde_json::from_str(text).map_err(|error| error.to_string())?;
    Tracker::restore(complete(snapshot, config)).map_err(|error| error.to_string())
}

#[test]
fn a_restored_tracker_continues_with_the_same_boxes() {
    for config in all() {
        // Before the first frame, on an update, and between updates.
        for frames in [0, 1, 4, 9, 10, 13] {
            let mut tracker = after(frames, &config);
            let snapshot: Snapshot = serde_json::from_str(&text(&tracker)).unwrap();
            assert_eq!(snapshot, tracker.snapshot());
            let mut restored = Tracker::restore(complete(snapshot, &config)).unwrap();
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
fn a_restored_tracker_needs_frames_of_the_same_size() {
    for config in all() {
        let mut restored = restore(&text(&after(3, &config)), &config).unwrap();
        let other = [0; 12];
        let error = restored.update(&patchlock::Frame::grey8(&other, 4, 3).unwrap()).unwrap_err();
        assert!(matches!(error, Error::FrameSize { width: 4, height: 3, .. }));
    }
}

/// The first number of a method as a snapshot has it, one beyond its range, and what is said of that.
pub fn number_outside(config: &TrackerConfig) -> [String; 3] {
    let (row, max) = PARAMETERS
        .iter()
        .filter(|row| row.group == config.method.name())
        .find_map(|row| match row.range {
            Range::Number { max, .. } => Some((row, max)),
            _ => None,
        })
        .unwrap();
    let name = row.name;
    let outside = match row.kind {
        Kind::Whole => Value::from(max as i64 + 1),
        _ => Value::from(max + 1.0),
    };
    let written = |value: &Value| format!(r#""{name}":{value}"#);
    let value = config.get(name).unwrap();
    [written(&value), written(&outside), format!("`{name}` is {outside}")]
}

#[test]
fn a_damaged_snapshot_is_refused() {
    for config in all() {
        let good = text(&after(12, &config));
        restore(&good, &config).unwrap();
        let size =
            format!(r#""frame_size":{{"width":{},"height":{}}}"#, SIMPLE.width(), SIMPLE.height());
        let part = |config: &TrackerConfig| {
            format!(r#""config":{}"#, serde_json::to_string(config).unwrap())
        };
        let other = all().into_iter().find(|other| other.method.name() != config.method.name());
        let other = part(&other.unwrap());
        let [setting, outside, named] = number_outside(&config);
        let damaged = [
            (r#""version":11"#.to_owned(), r#""version":0"#, "version is 0"),
            (r#""version":11"#.to_owned(), r#""version":2"#, "version is 2"),
            (r#""version":11"#.to_owned(), r#""version":9"#, "version is 9"),
            (r#""version":11"#.to_owned(), r#""edition":5"#, "version"),
            (r#""seed":"#.to_owned(), r#""seeds":"#, "seeds"),
            (setting, &outside, &named),
            (part(&config), &other, "another method"),
            (r#""track":{"#.to_owned(), r#""trail":{"#, "track"),
            (r#""target":{"#.to_owned(), r#""goal":{"#, "target"),
            (r#""estimate":{"#.to_owned(), r#""guess":{"#, "estimate"),
            (size.clone(), r#""frame_size":null"#, "null"),
            (size.clone(), r#""frame_size":{"width":0,"height":5}"#, "frame size is 0"),
            (size, r#""frame_size":{"width":-5,"height":5}"#, "-5"),
        ];
        for (from, to, words) in damaged {
            let text = good.replacen(&from, to, 1);
            assert_ne!(text, good, "there is no {from}");
            let message =
                restore(&text, &config).err().unwrap_or_else(|| panic!("{to} was accepted"));
            assert!(message.contains(words), "{to}: {message}");
        }
        // Truncated snapshots.
        for share in 1..10 {
            assert!(restore(&good[..good.len() * share / 10], &config).is_err());
        }
    }
}

#[test]
fn a_target_that_is_too_small_for_the_method_paper_is_refused() {
    let config = all().into_iter().find(|config| config.method.name() == "paper").unwrap();
    let good = text(&after(2, &config));
    let begin = good.find(r#""scale":"#).unwrap() + r#""scale":"#.len();
    let end = begin + good[begin..].find(',').unwrap();
    let small = format!("{}0.01{}", &good[..begin], &good[end..]);
    let message = restore(&small, &config).unwrap_err();
    assert!(message.contains("smaller than any"), "{message}");
}

/// Estimates with a number that none has.
fn bad_estimates(good: &Estimate) -> Vec<Estimate> {
    let with_box = |bbox| Estimate { bbox, ..good.clone() };
    let with_score = |score| Estimate { score, ..good.clone() };
    let with_map = |change: fn(&mut Visibility)| {
        let mut visibility = good.visibility.clone().unwrap();
        change(&mut visibility);
        Estimate { visibility: Some(visibility), ..good.clone() }
    };
    let mut bad = vec![
        with_box(BoundingBox { w: 0.0, ..good.bbox }),
        with_box(BoundingBox { w: -3.0, ..good.bbox }),
        with_box(BoundingBox { h: 0.0, ..good.bbox }),
        with_box(BoundingBox { h: -0.5, ..good.bbox }),
        with_score(-0.01),
        with_score(1.01),
    ];
    if good.visibility.is_some() {
        bad.extend([
            with_map(|map| map.large.rows += 1),
            with_map(|map| map.small.columns = 0),
            with_map(|map| map.small.rows = usize::MAX),
            with_map(|map| map.large.visible.truncate(1)),
            with_map(|map| map.small.visible.push(true)),
        ]);
    }
    bad
}

#[test]
fn a_latest_estimate_with_bad_numbers_is_refused() {
    for config in all() {
        let tracker = after(4, &config);
        let (good, estimate) = (text(&tracker), tracker.estimate());
        let part = |estimate: &str| format!(r#""estimate":{estimate}}}"#);
        let written = serde_json::to_string(estimate).unwrap();
        assert!(good.contains(&part(&written)));
        for bad in bad_estimates(estimate) {
            let text = good.replace(&part(&written), &part(&serde_json::to_string(&bad).unwrap()));
            let message =
                restore(&text, &config).err().unwrap_or_else(|| panic!("{bad:?} was accepted"));
            assert!(message.contains("latest estimate"), "{message}");
            // The same with many targets.
            let track = text.split_once(r#""track":"#).unwrap().1.strip_suffix('}').unwrap();
            let many =
                text.replace(&format!(r#""track":{track}"#), &format!(r#""tracks":[[1,{track}]]"#));
            let many = many.replacen(r#""version":11"#, r#""version":11,"next":2"#, 1);
            let read = serde_json::from_str::<MultiSnapshot>(&many).unwrap();
            let error =
                MultiTracker::restore(complete_many(read, &config)).unwrap_err().to_string();
            assert_eq!(error, message);
        }
        // JSON writes a number that is not finite as null.
        let x = format!(r#""x":{:?}"#, estimate.bbox.x);
        for number in ["null", "1e999"] {
            let damaged = written.replacen(&x, &format!(r#""x":{number}"#), 1);
            assert_ne!(damaged, written);
            assert!(restore(&good.replace(&part(&written), &part(&damaged)), &config).is_err());
        }
    }
}
