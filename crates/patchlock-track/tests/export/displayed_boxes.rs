//! What tools that interpolate show of an export: each target in the frames in which it has a box,
//! and in no other. The readers here follow the rules of the tools, not our imports.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;

use patchlock::{BoundingBox, Status};
use patchlock_track::export::{self, Entry, Format, KeyFrames, ManualFlags, Options, Track};
use proptest::prelude::*;
use serde_json::Value;

/// Width and height of the frames, in pixels.
const SIZE: (usize, usize) = (640, 480);

/// A box that a tool shows in a frame.
#[derive(Debug, Clone, Copy)]
struct DisplayedBox {
    /// Left, top, width and height in pixels.
    bbox: [f64; 4],
    /// Whether it is marked as occluded; `None` if the format has no such mark.
    occluded: Option<bool>,
    /// Whether the file has this box, as opposed to those around it.
    written: bool,
}

/// What is shown, by target and frame.
type DisplayedBoxes = BTreeMap<(u64, usize), DisplayedBox>;

/// A key of a file.
#[derive(Debug, Clone, Copy)]
struct Key {
    frame: usize,
    bbox: [f64; 4],
    occluded: Option<bool>,
    /// Whether the target is shown in this frame, and in the frames up to the next key.
    shown: bool,
    shown_after: bool,
}

/// What a tool shows of a target in a frame, as both tools do: the box of a key in its own frame, the
/// last one held where there is no other after it, and boxes on a straight line between two.
fn at(keys: &[Key], frame: usize) -> Option<DisplayedBox> {
    let next = keys.partition_point(|key| key.frame <= frame);
    let last = keys.get(next.checked_sub(1)?)?;
    let Key { bbox, occluded, .. } = *last;
    if last.frame == frame {
        return last.shown.then_some(DisplayedBox { bbox, occluded, written: true });
    }
    let share = |next: &Key| (frame - last.frame) as f64 / (next.frame - last.frame) as f64;
    let between = |next: &Key| {
        let share = share(next);
        [0, 1, 2, 3].map(|k| bbox[k] + share * (next.bbox[k] - bbox[k]))
    };
    let bbox = keys.get(next).filter(|next| next.shown).map_or(bbox, between);
    last.shown_after.then_some(DisplayedBox { bbox, occluded, written: false })
}

fn displayed_boxes(tracks: &BTreeMap<u64, Vec<Key>>, frames: usize) -> DisplayedBoxes {
    let of_frame = |frame| tracks.iter().map(move |(id, keys)| ((*id, frame), at(keys, frame)));
    let all = (0..frames).flat_map(of_frame);
    all.filter_map(|(place, shown)| Some((place, shown?))).collect()
}

/// The value of an attribute in a line of XML.
fn value<'a>(line: &'a str, name: &str) -> &'a str {
    let (_, rest) = line.split_once(&format!(" {name}=\"")).expect("has the attribute");
    rest.split('"').next().expect("ends")
}

/// The length of the clip and the tracks of a file of CVAT, which refuses tracks without boxes and
/// frames that are not in the clip, and passes over boxes that are no key frames.
fn read_cvat(text: &str) -> (usize, BTreeMap<u64, Vec<Key>>) {
    let (_, size) = text.split_once("<size>").unwrap();
    let size = size.split('<').next().unwrap().parse().unwrap();
    let mut tracks: BTreeMap<u64, Vec<Key>> = BTreeMap::new();
    let mut id = 0;
    for line in text.lines() {
        if line.contains("<track ") {
            id = value(line, "id").parse().unwrap();
            tracks.insert(id, Vec::new());
        }
        if line.contains("<box ") && value(line, "keyframe") == "1" {
            let side = |name: &str| value(line, name).parse::<f64>().unwrap();
            let [x, y, right, bottom] = ["xtl", "ytl", "xbr", "ybr"].map(side);
            let shown = value(line, "outside") == "0";
            tracks.get_mut(&id).unwrap().push(Key {
                frame: value(line, "frame").parse().unwrap(),
                bbox: [x, y, right - x, bottom - y],
                occluded: Some(value(line, "occluded") == "1"),
                shown,
                shown_after: shown,
            });
        }
    }
    for keys in tracks.values() {
        assert!(!keys.is_empty(), "CVAT refuses a track without boxes");
        assert!(keys.iter().all(|key| key.frame < size), "CVAT refuses frames after the last one");
        assert!(keys.windows(2).all(|pair| pair[0].frame < pair[1].frame));
    }
    (size, tracks)
}

/// The length of the clip and the tracks of a file of Label Studio, which counts frames from 1. A key
/// that is not enabled is shown in its own frame only.
fn read_label_studio(text: &str) -> (usize, BTreeMap<u64, Vec<Key>>) {
    let tasks: Value = serde_json::from_str(text).unwrap();
    let regions = tasks[0]["predictions"][0]["result"].as_array().unwrap();
    let mut tracks = BTreeMap::new();
    for region in regions {
        let id = region["id"].as_str().unwrap().strip_prefix("target-").unwrap().parse().unwrap();
        let key = |key: &Value| {
            let number =
                |name: &str, side: usize| key[name].as_f64().unwrap() * side as f64 / 100.0;
            let [x, w] = ["x", "width"].map(|name| number(name, SIZE.0));
            let [y, h] = ["y", "height"].map(|name| number(name, SIZE.1));
            Key {
                frame: key["frame"].as_u64().unwrap() as usize - 1,
                bbox: [x, y, w, h],
                occluded: None,
                shown: true,
                shown_after: key["enabled"].as_bool().unwrap(),
            }
        };
        let keys: Vec<Key> =
            region["value"]["sequence"].as_array().unwrap().iter().map(key).collect();
        assert!(!keys.is_empty(), "the page looks at the first key of a region");
        assert!(keys.windows(2).all(|pair| pair[0].frame < pair[1].frame));
        tracks.insert(id, keys);
    }
    let length = regions.first().map_or(0, |it| it["value"]["framesCount"].as_u64().unwrap());
    (length as usize, tracks)
}

/// What a track has in a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
enum State {
    /// No row.
    Nothing,
    /// A row without a box.
    Blank,
    /// A row of a lost target, with its last box.
    Lost,
    /// A person has said that the target is not visible.
    Hidden,
    /// A box, by score and status.
    Found { score: Option<f64>, status: Option<Status> },
    /// A box that a person has drawn.
    Drawn { occluded: bool },
}

fn state() -> impl Strategy<Value = State> {
    let found = |score, status| Just(State::Found { score, status });
    prop_oneof![
        2 => Just(State::Nothing),
        1 => Just(State::Blank),
        1 => Just(State::Lost),
        1 => Just(State::Hidden),
        4 => found(Some(0.9), Some(Status::Tracked)),
        1 => found(Some(0.3), Some(Status::Tracked)),
        1 => found(Some(0.9), Some(Status::Uncertain)),
        1 => found(None, None),
        1 => any::<bool>().prop_map(|occluded| State::Drawn { occluded }),
    ]
}

/// A box in any place, of any size.
fn bbox() -> impl Strategy<Value = [f64; 4]> {
    [-50.0..700.0, -50.0..500.0, 0.5..300.0, 0.5..300.0]
}

/// A target: stretches of frames in one state each, with a box for each frame.
fn target() -> impl Strategy<Value = Vec<(State, [f64; 4])>> {
    let stretch = (state(), prop::collection::vec(bbox(), 1..9));
    let of_stretch = |(state, boxes): (State, Vec<[f64; 4]>)| {
        boxes.into_iter().map(move |bbox| (state, bbox)).collect::<Vec<_>>()
    };
    let stretches = prop::collection::vec(stretch.prop_map(of_stretch), 1..9);
    stretches.prop_map(|stretches| stretches.concat())
}

fn entry(frame: usize, id: u64, state: State, [x, y, w, h]: [f64; 4]) -> Option<Entry> {
    let (left, top, right, bottom) = (x - 0.5, y - 0.5, x + w - 0.5, y + h - 0.5);
    let entry = Entry {
        frame,
        id,
        bbox: Some(BoundingBox { x, y, w, h }),
        score: Some(0.9),
        corners: Some([[left, top], [right, top], [right, bottom], [left, bottom]]),
        status: None,
        ..Entry::default()
    };
    match state {
        State::Nothing => None,
        State::Blank => Some(Entry { bbox: None, ..entry }),
        State::Lost => Some(Entry { status: Some(Status::Lost), ..entry }),
        State::Hidden => {
            let manual = Some(ManualFlags { hidden: true, ..ManualFlags::default() });
            Some(Entry { bbox: None, manual, ..entry })
        }
        State::Found { score, status } => Some(Entry { score, status, ..entry }),
        State::Drawn { occluded } => Some(Entry {
            manual: Some(ManualFlags { occluded, ..ManualFlags::default() }),
            ..entry
        }),
    }
}

/// What is to be shown: the boxes of the track, and which of them a person has drawn.
fn expected(entries: &[Entry]) -> BTreeMap<(u64, usize), ([f64; 4], bool, bool)> {
    let of = |entry: &Entry| {
        let BoundingBox { x, y, w, h } = entry.found()?;
        let occluded = match entry.manual {
            Some(manual) => manual.occluded,
            None => entry.score.is_some_and(|score| score < 0.5),
        };
        let occluded = occluded || entry.status == Some(Status::Uncertain);
        Some(((entry.id, entry.frame), ([x, y, w, h], occluded, entry.manual.is_some())))
    };
    entries.iter().filter_map(of).collect()
}

/// The export format of this name.
fn format_named(name: &str) -> Format {
    Format::named(name, false).unwrap()
}

fn options(format: Format, size: (usize, usize), key_frames: KeyFrames) -> Options {
    Options { label: "car".into(), size: Some(size), key_frames, ..Options::new(format, "clip") }
}

/// The file of a format, as text.
fn written(track: &Track, format: Format, key_frames: KeyFrames) -> String {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    export::write(track, &options(format, SIZE, key_frames), &out, false).unwrap();
    fs::read_to_string(out).unwrap()
}

/// Reads the length of the clip and the tracks of a file.
type Reader = fn(&str) -> (usize, BTreeMap<u64, Vec<Key>>);

/// The reader of a format with key frames, and the largest distance in pixels between a side of a box
/// and what is read.
fn reader(format: Format) -> (Reader, f64) {
    match format.name {
        "label-studio" => (read_label_studio, 5.1e-7 * SIZE.0 as f64),
        _ => (read_cvat, 1.1e-4),
    }
}

/// A target that moves with its own speed and acceleration, and jumps now and then.
fn moving() -> impl Strategy<Value = Vec<[f64; 4]>> {
    let part = ([-8.0..8.0, -8.0..8.0, -1.0..1.0, -1.0..1.0], -0.4..0.4, 1..40_usize);
    prop::collection::vec(part, 1..6).prop_map(|parts| {
        let (mut boxes, mut now) = (Vec::new(), [200.0, 200.0, 60.0, 40.0_f64]);
        for (speed, more, frames) in parts {
            for k in 0..frames {
                boxes.push(now);
                let pace = 1.0 + more * k as f64;
                now = [0, 1, 2, 3].map(|side| now[side] + speed[side] * pace);
                now = [now[0], now[1], now[2].max(4.0), now[3].max(4.0)];
            }
        }
        boxes
    })
}

fn as_box([x, y, w, h]: [f64; 4]) -> BoundingBox {
    BoundingBox { x, y, w, h }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(250))]

    /// With key frames for an overlap, what is shown overlaps the track by that much in each frame,
    /// and no key could be left out between two that follow each other closely: a straight line has
    /// two.
    #[test]
    fn interpolated_boxes_overlap_the_track_by_what_was_asked_for(
        boxes in moving(), least in 0.3..0.99, straight in any::<bool>(),
    ) {
        let line = |frame: usize| {
            let [x, y, w, h] = boxes[0];
            [x + 2.5 * frame as f64, y - frame as f64, w, h]
        };
        let boxes: Vec<[f64; 4]> = match straight {
            true => (0..boxes.len()).map(line).collect(),
            false => boxes,
        };
        let state = State::Found { score: Some(0.9), status: Some(Status::Tracked) };
        let entries = boxes.iter().enumerate().filter_map(|(k, bbox)| entry(k, 1, state, *bbox));
        let track = Track::new(entries.collect()).unwrap().in_clip(boxes.len());
        for format in Format::ALL.into_iter().filter(|format| format.has_key_frames) {
            let text = written(&track, format, KeyFrames::Overlap(least));
            let (read, accuracy) = reader(format);
            let (_, tracks) = read(&text);
            let shown = displayed_boxes(&tracks, boxes.len());
            for (frame, bbox) in boxes.iter().enumerate() {
                let shown = shown[&(1, frame)];
                let overlap = as_box(shown.bbox).overlap(&as_box(*bbox));
                prop_assert!(
                    overlap >= least - 4.0 * accuracy, "{:?} {}: {} {}", format, frame, overlap, least
                );
            }
            prop_assert!(!straight || tracks[&1].len() <= 2, "{:?} {:?}", format, tracks[&1]);
        }
    }

    /// In a clip of known length, and in one of which only the track is known. With each box a key
    /// frame, all boxes are those of the track; otherwise those that are written, and those that a
    /// person has drawn are among them.
    #[test]
    fn a_target_is_shown_where_it_has_a_box_and_nowhere_else(
        targets in prop::collection::vec(target(), 1..4),
        more in prop_oneof![Just(Some(0_usize)), (1..20_usize).prop_map(Some), Just(None)],
        step in prop_oneof![Just(1_usize), 2..12_usize],
    ) {
        let entries = targets.iter().zip(1..).flat_map(|(states, id)| {
            let of_frame = move |(frame, &(state, bbox))| entry(frame, id, state, bbox);
            states.iter().enumerate().filter_map(of_frame)
        });
        let entries: Vec<Entry> = entries.collect();
        let expected = expected(&entries);
        prop_assume!(entries.iter().any(|entry| entry.bbox.is_some()));
        let end = entries.iter().map(|entry| entry.frame + 1).max().unwrap_or(0);
        let length = more.map(|more| end + more);
        let track = Track::new(entries).unwrap();
        let track = length.map_or(track.clone(), |length| track.in_clip(length));
        for format in Format::ALL.into_iter().filter(|format| format.has_key_frames) {
            let text = written(&track, format, KeyFrames::Every(step));
            let (read, accuracy) = reader(format);
            let (of_file, tracks) = read(&text);
            prop_assert!(length.is_none_or(|length| of_file == length || tracks.is_empty()));
            let shown = displayed_boxes(&tracks, length.unwrap_or(end));
            let places = |all: &mut dyn Iterator<Item = (u64, usize)>| all.collect::<BTreeSet<_>>();
            prop_assert_eq!(
                places(&mut shown.keys().copied()), places(&mut expected.keys().copied()), "{:?}", format
            );
            for (place, (bbox, occluded, drawn)) in &expected {
                let shown = &shown[place];
                prop_assert!(shown.occluded.is_none_or(|shown| shown == *occluded), "{:?} {:?}", format, place);
                prop_assert!(shown.written || (step > 1 && !drawn), "{:?} {:?}", format, place);
                let near = bbox.iter().zip(shown.bbox).all(|(a, b)| (a - b).abs() <= accuracy);
                prop_assert!(near || !shown.written, "{:?} {:?}: {:?} {:?}", format, place, bbox, shown);
            }
        }
    }

    /// Both ends of a box are in the frame, as a reader gets them from the centre and the length.
    #[test]
    fn boxes_of_yolo_are_in_the_frame(
        bbox in bbox(), size in (1..2000_usize, 1..2000_usize), to_the_end in any::<bool>(),
    ) {
        let [x, y, w, h] = bbox;
        let w = if to_the_end { (size.0 as f64 - x).max(0.5) } else { w };
        let entry = entry(0, 1, State::Drawn { occluded: false }, [x, y, w, h]).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        let track = Track::new(vec![entry]).unwrap();
        for format in [format_named("yolo"), format_named("yolo-obb")] {
            let out = out.with_extension(format.name);
            export::write(&track, &options(format, size, KeyFrames::Every(1)), &out, false).unwrap();
            let text = fs::read_to_string(out.join("labels/train/frame_000000.txt")).unwrap();
            for line in text.lines() {
                let numbers: Vec<f64> =
                    line.split(' ').skip(1).map(|number| number.parse().unwrap()).collect();
                let ends = match numbers[..] {
                    [x, y, w, h] => vec![x - w / 2.0, y - h / 2.0, x + w / 2.0, y + h / 2.0],
                    _ => numbers,
                };
                prop_assert!(ends.iter().all(|end| (0.0..=1.0).contains(end)), "{}", line);
            }
        }
    }
}
