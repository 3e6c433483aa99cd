//! Edits, undo and redo.

use std::collections::BTreeMap;

use crate::support::{FRAMES, TestFolder, add, bbox};
use patchlock::{BoundingBox, Status};
use patchlock_media::Limits;
use patchlock_studio::project::{
    Attribute, Edit, Frames, Key, Kind, Label, MAX_BOXES, MAX_STEPS, Outline, Project, Store,
    Target, TrackedBox,
};
use proptest::prelude::*;

fn tracked(x: f64, status: Status) -> TrackedBox {
    TrackedBox {
        bbox: bbox(x, 5.0, 10.0, 8.0),
        score: 0.5,
        status,
        visible: Some(0.25),
        agreement: None,
    }
}

fn track(target: u64, from: usize, to: usize, status: Status) -> Edit {
    let tracked = (from..=to).map(|frame| (frame, tracked(frame as f64, status))).collect();
    Edit::SetTracked { target, from, to, tracked }
}

fn refusal(store: &mut Store, edit: Edit) -> String {
    let before = store.project().clone();
    let error = store.apply(vec![edit]).unwrap_err().to_string();
    assert_eq!(*store.project(), before);
    error
}

fn only(store: &Store) -> &Target {
    assert_eq!(store.project().targets.len(), 1);
    &store.project().targets[0]
}

#[test]
fn a_person_outweighs_the_tracker() {
    let place = TestFolder::new();
    let mut store = place.store();
    store.apply(vec![add(2), Edit::Hide { target: 1, from: 6, to: 8 }]).unwrap();
    store.apply(vec![track(1, 0, 11, Status::Tracked)]).unwrap();
    let target = only(&store);
    assert_eq!(target.tracked.keys().copied().collect::<Vec<_>>(), [0, 1, 3, 4, 5, 9, 10, 11]);
    // A key in a hidden frame shows it; hiding removes keys and boxes.
    let key = Edit::SetKey {
        target: 1,
        frame: 7,
        bbox: bbox(1.0, 1.0, 5.0, 5.0),
        outline: None,
        occluded: true,
        truncated: false,
    };
    store.apply(vec![key, Edit::Hide { target: 1, from: 1, to: 2 }]).unwrap();
    let target = only(&store);
    assert_eq!(target.hidden, [[1, 2], [6, 6], [8, 8]]);
    assert_eq!(target.keys.keys().copied().collect::<Vec<_>>(), [7]);
    assert!(!target.tracked.contains_key(&1) && target.keys[&7].occluded);
    assert!(target.is_hidden(8) && !target.is_hidden(7));
    store.apply(vec![Edit::Show { target: 1, from: 0, to: 7 }]).unwrap();
    assert_eq!(only(&store).hidden, [[8, 8]]);
}

#[test]
fn tracked_boxes_are_rounded_and_keys_are_not() {
    let place = TestFolder::new();
    let mut store = place.store();
    let mut entry = tracked(1.23456, Status::Tracked);
    (entry.score, entry.visible, entry.agreement) = (0.123_456, Some(0.666_66), Some(1.0));
    let third = bbox(1.0 / 3.0, 1.0, 5.0, 5.0);
    let begin = Edit::AddTarget { label: "target".into(), frame: 0, bbox: third, outline: None };
    let boxes = Edit::SetTracked { target: 1, from: 1, to: 1, tracked: [(1, entry)].into() };
    store.apply(vec![begin, boxes]).unwrap();
    let target = only(&store);
    assert_eq!(target.keys[&0].bbox, third);
    let found = target.tracked[&1];
    assert_eq!((found.bbox.x, found.score, found.visible), (1.235, 0.1235, Some(0.6667)));
}

#[test]
fn targets_are_split_and_joined() {
    let place = TestFolder::new();
    let mut store = place.store();
    let colour = BTreeMap::from([("colour".to_owned(), "red".to_owned())]);
    store
        .apply(vec![
            add(0),
            track(1, 1, 9, Status::Tracked),
            Edit::Hide { target: 1, from: 3, to: 5 },
            Edit::SetTarget { target: 1, label: None, attributes: Some(colour.clone()) },
        ])
        .unwrap();
    let whole = store.project().targets.clone();
    store.apply(vec![Edit::Split { target: 1, frame: 4 }]).unwrap();
    let [first, second] = &store.project().targets[..] else { panic!("two targets") };
    assert_eq!((first.hidden.as_slice(), second.hidden.as_slice()), (&[[3, 3]][..], &[[4, 5]][..]));
    assert_eq!((second.id, &second.attributes), (2, &colour));
    assert_eq!(first.tracked.len() + second.tracked.len(), 6);
    store.apply(vec![Edit::Join { first: 1, second: 2 }]).unwrap();
    assert_eq!(store.project().targets, whole);
    for _ in 0..2 {
        store.step(false).unwrap();
    }
    assert_eq!(store.project().targets, whole);

    let error = refusal(&mut store, Edit::Split { target: 1, frame: 0 });
    assert!(error.contains("cannot be split at frame 0"), "{error}");
    let error = refusal(&mut store, Edit::Join { first: 1, second: 1 });
    assert!(error.contains("with itself"), "{error}");
    store.apply(vec![add(8)]).unwrap();
    let error = refusal(&mut store, Edit::Join { first: 1, second: 3 });
    assert!(error.contains("targets 1 and 3 both have a box in frame 8"), "{error}");
}

#[test]
fn where_one_was_lost_or_hidden_the_boxes_of_the_other_count() {
    let place = TestFolder::new();
    let mut store = place.store();
    store
        .apply(vec![
            add(0),
            track(1, 1, 9, Status::Lost),
            Edit::Hide { target: 1, from: 10, to: 11 },
            add(8),
            track(2, 7, 11, Status::Tracked),
            Edit::Hide { target: 2, from: 3, to: 4 },
            Edit::Join { first: 1, second: 2 },
        ])
        .unwrap();
    let target = only(&store);
    assert_eq!(target.keys.keys().copied().collect::<Vec<_>>(), [0, 8]);
    assert_eq!(target.hidden, [[3, 4]]);
    assert_eq!(target.tracked.keys().copied().collect::<Vec<_>>(), [1, 2, 5, 6, 7, 9, 10, 11]);
    assert!(
        target.tracked[&7].status == Status::Tracked && target.tracked[&6].status == Status::Lost
    );
    assert!(target.box_at(7).is_some() && target.box_at(6).is_none());
}

#[test]
fn labels_are_added_renamed_and_removed() {
    let place = TestFolder::new();
    let mut store = place.store();
    let new = |name: &str| Edit::AddLabel { name: name.into(), colour: None, at: None };
    store.apply(vec![add(0), new("car"), new("<b>"), new("Fußgänger")]).unwrap();
    let rename = |name: &str, new_name: Option<&str>, colour: Option<&str>| Edit::SetLabel {
        name: name.into(),
        new_name: new_name.map(Into::into),
        colour: colour.map(Into::into),
    };
    store.apply(vec![rename("target", Some("bus"), Some("#123456"))]).unwrap();
    assert_eq!(only(&store).label, "bus");
    let first = Label { name: "bus".into(), colour: "#123456".into(), attributes: vec![] };
    assert_eq!(store.project().labels[0], first);
    let cases = [
        (new("car"), "there is a label \"car\" already"),
        (new(""), "1 to 100"),
        (new(" a"), "no space at the ends"),
        (new("a\nb"), "no control characters"),
        (new(&"ü".repeat(101)), "of 101 characters"),
        (rename("bus", Some("car"), None), "there is a label \"car\" already"),
        (rename("nothing", None, None), "the labels are \"bus\", \"car\""),
        (rename("car", None, Some("red")), "the colour \"red\" is not #rrggbb"),
        (rename("car", None, Some("#12345ü")), "is not #rrggbb"),
        (Edit::RemoveLabel { name: "bus".into() }, "1 targets have it"),
        (Edit::AddLabel { name: "x".into(), colour: None, at: Some(9) }, "allowed: 0 to 4"),
    ];
    for (edit, expected) in cases {
        let error = refusal(&mut store, edit);
        assert!(error.contains(expected), "{error}");
    }
    store.apply(vec![Edit::RemoveLabel { name: "car".into() }]).unwrap();
    store.step(false).unwrap();
    assert_eq!(store.project().labels[1].name, "car");
}

#[test]
fn edits_that_are_impossible_are_refused() {
    let place = TestFolder::new();
    let mut store = place.store();
    store.apply(vec![add(0)]).unwrap();
    let key = |frame, bbox| Edit::SetKey {
        target: 1,
        frame,
        bbox,
        outline: None,
        occluded: false,
        truncated: false,
    };
    let one = |entry| Edit::SetTracked { target: 1, from: 3, to: 3, tracked: [(3, entry)].into() };
    let good = tracked(1.0, Status::Tracked);
    let wrong_part = Frames { hidden: vec![[3, 4], [5, 6]], ..Frames::default() };
    let both = Frames {
        hidden: vec![[3, 4]],
        keys: [(4, Key::new(bbox(1.0, 1.0, 5.0, 5.0)))].into(),
        ..Frames::default()
    };
    let set = |frames| Edit::SetFrames { target: 1, from: 2, to: 7, frames };
    let target = store.project().targets[0].clone();
    let attributes = |name: &str, value: &str| Edit::SetTarget {
        target: 1,
        label: None,
        attributes: Some([(name.to_owned(), value.to_owned())].into()),
    };
    let cases = [
        (key(12, bbox(1.0, 1.0, 5.0, 5.0)), "frame 12 is not in the video; its frames are 0 to 11"),
        (key(0, bbox(f64::NAN, 1.0, 5.0, 5.0)), "the box is NaN,1,5,5"),
        (key(0, bbox(1.0, 1.0, 0.5, 5.0)), "must be 1 to 100000"),
        (key(0, bbox(1.0, 1.0, f64::INFINITY, 5.0)), "must be 1 to 100000"),
        (key(0, bbox(80.0, 1.0, 5.0, 5.0)), "too far outside the frame of 64 x 48"),
        (key(0, bbox(1.0, -20.0, 5.0, 5.0)), "too far outside"),
        (Edit::RemoveKey { target: 1, frame: 5 }, "target 1 has no key in frame 5"),
        (Edit::RemoveKey { target: 7, frame: 0 }, "there is no target 7"),
        (Edit::Hide { target: 1, from: 5, to: 4 }, "begins with 5 and ends before it, with 4"),
        (Edit::Hide { target: 1, from: 5, to: 12 }, "frame 12 is not in the video"),
        (Edit::DeleteTarget { target: 0 }, "there is no target 0"),
        (one(TrackedBox { score: 1.1, ..good }), "frame 3: score is 1.1; allowed: 0 to 1"),
        (one(TrackedBox { visible: Some(f64::NAN), ..good }), "visible is NaN"),
        (one(TrackedBox { bbox: bbox(1e9, 0.0, 5.0, 5.0), ..good }), "x and y at most 1000000"),
        (track(1, 4, 12, Status::Lost), "frame 12 is not in the video"),
        (set(wrong_part), "not apart from those before"),
        (set(both), "frame 4 is hidden and has a box"),
        (Edit::Restore { target: target.clone(), at: 0 }, "there is a target 1 already"),
        (Edit::Restore { target: Target { id: 5, ..target.clone() }, at: 2 }, "allowed: 0 to 1"),
        (Edit::Restore { target: Target { id: 1 << 60, ..target.clone() }, at: 0 }, "the id is"),
        (Edit::Import { targets: vec![Target { label: "\t".into(), ..target }] }, "the name"),
        (attributes("", "x"), "name of the attribute"),
        (attributes("x", &"y".repeat(1001)), "has 1001 characters"),
        (
            Edit::AddTarget {
                label: "cat".into(),
                frame: 0,
                bbox: bbox(1.0, 1.0, 5.0, 5.0),
                outline: None,
            },
            "there is no label \"cat\"; the labels are \"target\"",
        ),
    ];
    for (edit, expected) in cases {
        let shown = format!("{edit:?}");
        let error = refusal(&mut store, edit);
        assert!(error.contains(expected), "{shown}: {error}");
    }
    let other_range = Edit::SetTracked { target: 1, from: 4, to: 5, tracked: [(6, good)].into() };
    let error = refusal(&mut store, other_range);
    assert!(error.contains("frame 6 is not one of the frames 4 to 5"), "{error}");
}

#[test]
fn several_edits_are_applied_all_or_none_and_undone_together() {
    let place = TestFolder::new();
    let mut store = place.store();
    let before = store.project().clone();
    let error = store.apply(vec![add(0), add(1), add(99)]).unwrap_err().to_string();
    assert!(error.contains("frame 99"), "{error}");
    assert_eq!(store.project().targets, before.targets);
    assert_eq!((store.revision(), store.history().text(false)), (0, None));
    store.apply(vec![add(0), add(1)]).unwrap();
    assert_eq!(store.history().text(false), Some("add target in frame 0, and 1 more"));
    assert_eq!(store.step(false).unwrap(), Some(2));
    assert_eq!(store.project().targets, before.targets);
    assert_eq!(store.history().text(true), Some("add target in frame 0, and 1 more"));
    // Ids are not used again, not even those of steps that were undone.
    store.apply(vec![add(0)]).unwrap();
    assert!(only(&store).id > 2);
    assert!(store.history().text(true).is_none() && store.step(true).unwrap().is_none());
}

#[test]
fn pieces_of_one_job_are_undone_together() {
    let place = TestFolder::new();
    let mut store = place.store();
    let before = store.apply(vec![add(0)]).unwrap();
    let kept = store.project().clone();
    let job = store.begin_tracking(1, None);
    for piece in [
        track(1, 1, 3, Status::Tracked),
        track(1, 4, 6, Status::Tracked),
        track(1, 2, 5, Status::Lost),
    ] {
        assert_eq!(store.track(1, job, vec![piece]).unwrap(), job);
    }
    let all = store.project().clone();
    store.step(false).unwrap();
    assert_eq!(*store.project(), kept);
    store.step(true).unwrap();
    assert_eq!(*store.project(), all);
    // Somebody else was faster: a step of its own.
    store.apply(vec![Edit::Hide { target: 1, from: 9, to: 9 }]).unwrap();
    let hidden = store.project().clone();
    let other = store.track(1, job, vec![track(1, 7, 8, Status::Tracked)]).unwrap();
    assert_ne!(other, job);
    store.step(false).unwrap();
    assert_eq!(*store.project(), hidden);
    store.step(false).unwrap();
    assert_eq!(*store.project(), all);
    assert!(store.revision() > before);
}

#[test]
fn undo_says_how_many_frames_it_changes() {
    let place = TestFolder::new();
    let mut store = place.store();
    store.apply(vec![add(4)]).unwrap();
    // The frame of the key stays as it is.
    let job = store.apply(vec![track(1, 0, 6, Status::Tracked)]).unwrap();
    assert_eq!(store.history().text(false), Some("track target 1 in 6 frames, 0 to 6"));
    // A job that goes on, over frames that it has changed already, too.
    store.track(1, job, vec![track(1, 5, 8, Status::Lost)]).unwrap();
    store.track(1, job, vec![track(1, 8, 9, Status::Lost)]).unwrap();
    assert_eq!(store.history().text(false), Some("track target 1 in 9 frames, 0 to 9"));
    store.step(false).unwrap();
    assert_eq!(store.history().text(true), Some("track target 1 in 9 frames, 0 to 9"));
    store.step(true).unwrap();
    store.apply(vec![Edit::Hide { target: 1, from: 8, to: 11 }]).unwrap();
    assert_eq!(store.history().text(false), Some("hide target 1 in 4 frames, 8 to 11"));
    store.apply(vec![Edit::Show { target: 1, from: 0, to: 8 }]).unwrap();
    assert_eq!(store.history().text(false), Some("show target 1 in frame 8"));
    store.apply(vec![Edit::Show { target: 1, from: 0, to: 8 }]).unwrap();
    assert_eq!(store.history().text(false), Some("show target 1 in no frame"));
}

#[test]
fn the_history_is_bounded() {
    let place = TestFolder::new();
    let mut store = place.store();
    for _ in 0..MAX_STEPS + 5 {
        store.apply(vec![add(0)]).unwrap();
    }
    let mut steps = 0;
    while store.step(false).unwrap().is_some() {
        steps += 1;
    }
    assert_eq!((steps, store.project().targets.len()), (MAX_STEPS, 5));
}

#[test]
fn the_history_holds_a_bounded_number_of_boxes() {
    let place = TestFolder::new();
    let frames = 100_000;
    let mut store = place.store_of(frames);
    store.apply(vec![add(0)]).unwrap();
    let full = MAX_BOXES / (frames - 1);
    for _ in 0..full + 3 {
        store.apply(vec![track(1, 1, frames - 1, Status::Tracked)]).unwrap();
    }
    let mut steps = 0;
    while store.step(false).unwrap().is_some() {
        steps += 1;
    }
    assert_eq!(steps, full);
}

#[test]
fn imported_targets_get_new_ids_and_their_labels() {
    let place = TestFolder::new();
    let mut store = place.store();
    store.apply(vec![add(0)]).unwrap();
    let target = store.project().targets[0].clone();
    let targets =
        ["car", "target", "car"].map(|label| Target { label: label.into(), ..target.clone() });
    let before = store.project().clone();
    store.apply(vec![Edit::Import { targets: targets.into() }]).unwrap();
    let project = store.project();
    let found: Vec<_> = project.targets.iter().map(|t| (t.id, t.label.as_str())).collect();
    assert_eq!(found, [(1, "target"), (2, "car"), (3, "target"), (4, "car")]);
    let names: Vec<_> = project.labels.iter().map(|label| label.name.as_str()).collect();
    assert_eq!(names, ["target", "car"]);
    assert_ne!(project.labels[0].colour, project.labels[1].colour);
    store.step(false).unwrap();
    assert_eq!(
        (&store.project().targets, &store.project().labels),
        (&before.targets, &before.labels)
    );
}

#[test]
fn edits_are_json() {
    let texts = [
        r##"{"edit":"add_target","label":"target","frame":3,"box":{"x":1,"y":2,"w":3,"h":4}}"##,
        r##"{"edit":"set_key","target":1,"frame":3,"box":{"x":1,"y":2,"w":3,"h":4},"occluded":true}"##,
        r##"{"edit":"remove_key","target":1,"frame":3}"##,
        r##"{"edit":"set_tracked","target":1,"from":4,"to":5,"tracked":{"4":{"box":{"x":1,"y":2,"w":3,
            "h":4},"score":0.5,"status":"uncertain","visible":0.5}}}"##,
        r##"{"edit":"hide","target":1,"from":4,"to":5}"##,
        r##"{"edit":"show","target":1,"from":4,"to":5}"##,
        r##"{"edit":"set_target","target":1,"attributes":{"colour":"red"}}"##,
        r##"{"edit":"add_label","name":"car","colour":"#00ff00"}"##,
        r##"{"edit":"set_label","name":"car","new_name":"bus"}"##,
        r##"{"edit":"remove_label","name":"bus"}"##,
        r##"{"edit":"set_frames","target":1,"from":4,"to":9,"frames":{"keys":{"4":{"box":{"x":1,
            "y":2,"w":3,"h":4}},"9":{"box":{"x":1,"y":2,
            "w":3,"h":4}}},"hidden":[[5,6]]}}"##,
        r##"{"edit":"split","target":1,"frame":6}"##,
        r##"{"edit":"join","first":1,"second":2}"##,
        r##"{"edit":"delete_target","target":1}"##,
        r##"{"edit":"set_done","done":true}"##,
        r##"{"edit":"import","targets":[{"id":1,"label":"car","attributes":{},"keys":{"0":{"box":{"x":1,
            "y":2,"w":3,"h":4},"truncated":true}},"tracked":{},"hidden":[]}]}"##,
    ];
    let place = TestFolder::new();
    let mut store = place.store();
    let edits = texts.map(|text| serde_json::from_str::<Edit>(text).expect(text));
    for edit in &edits {
        let again: Edit = serde_json::from_str(&serde_json::to_string(edit).unwrap()).unwrap();
        assert_eq!(again, *edit);
        assert!(!edit.text().is_empty());
    }
    store.apply(edits.into()).unwrap();
    assert!(only(&store).keys[&0].truncated);
    let wrong = [
        (r#"{"edit":"fly"}"#, "unknown variant `fly`"),
        (r#"{"edit":"split","target":1,"frame":-1}"#, "-1"),
        (r#"{"edit":"split","target":1,"frame":1,"more":1}"#, "unknown field `more`"),
        (
            r#"{"edit":"set_frames","target":1,"from":0,"to":1,"frames":{"keys":{"a":0}}}"#,
            "not a frame",
        ),
        (
            r#"{"edit":"set_frames","target":1,"from":0,"to":1,"frames":{"keys":{"1":{"box":{"x":1,
                "y":2,"w":3,"h":4}},"01":{"box":{"x":1,"y":2,"w":3,"h":4}}}}}"#,
            "frame 1 appears twice",
        ),
    ];
    for (text, expected) in wrong {
        let error = serde_json::from_str::<Edit>(text).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}

/// An edit of one of the targets that there may be; most of them are possible.
fn any_edit() -> impl Strategy<Value = Edit> {
    let target = 1u64..5;
    let frame = 0..FRAMES;
    let range =
        (0..FRAMES, 0..5usize).prop_map(|(from, more)| (from, (from + more).min(FRAMES - 1)));
    let place = (0.0..60.0f64, 0.0..40.0f64, 1.0..20.0f64).prop_map(|(x, y, w)| bbox(x, y, w, 9.5));
    let label = prop::sample::select(vec!["target", "car", "bus"]).prop_map(str::to_owned);
    let status = prop::sample::select(vec![Status::Tracked, Status::Uncertain, Status::Lost]);
    prop_oneof![
        3 => (label.clone(), frame.clone(), place.clone())
            .prop_map(|(label, frame, bbox)| Edit::AddTarget { label, frame, bbox, outline: None }),
        3 => (target.clone(), frame.clone(), place, any::<bool>()).prop_map(
            |(target, frame, bbox, occluded)| {
                let BoundingBox { x, y, w, h } = bbox;
                let triangle = || Outline(vec![[x, y], [x + w, y], [x + w, y + h]]);
                let outline = occluded.then(triangle);
                Edit::SetKey { target, frame, bbox, outline, occluded, truncated: !occluded }
            }
        ),
        1 => (target.clone(), frame.clone())
            .prop_map(|(target, frame)| Edit::RemoveKey { target, frame }),
        4 => (target.clone(), range.clone(), status)
            .prop_map(|(target, (from, to), status)| track(target, from, to, status)),
        2 => (target.clone(), range.clone())
            .prop_map(|(target, (from, to))| Edit::Hide { target, from, to }),
        2 => (target.clone(), range).prop_map(|(target, (from, to))| Edit::Show { target, from, to }),
        1 => (target.clone(), prop::option::of(label.clone()), any::<bool>()).prop_map(
            |(target, label, given)| Edit::SetTarget {
                target,
                label,
                attributes: given.then(|| [("a".to_owned(), "b".to_owned())].into()),
            }
        ),
        1 => target.clone().prop_map(|target| Edit::DeleteTarget { target }),
        2 => (target.clone(), frame).prop_map(|(target, frame)| Edit::Split { target, frame }),
        3 => (target.clone(), target).prop_map(|(first, second)| Edit::Join { first, second }),
        1 => (label.clone(), prop::option::of(0..3usize))
            .prop_map(|(name, at)| Edit::AddLabel { name, colour: None, at }),
        1 => (label.clone(), prop::option::of(label.clone())).prop_map(|(name, new_name)| {
            Edit::SetLabel { name, new_name, colour: Some("#010203".to_owned()) }
        }),
        1 => (label.clone(), 0..3usize).prop_map(|(label, count)| Edit::Declare {
            label,
            attributes: ["a", "c"][..count.min(2)].iter().map(|name| declared(name)).collect(),
        }),
        3 => any_value(),
        1 => label.prop_map(|name| Edit::RemoveLabel { name }),
        1 => any::<bool>().prop_map(|done| Edit::SetDone { done }),
    ]
}

fn declared(name: &str) -> Attribute {
    let values = vec!["b".to_owned(), "d".to_owned()];
    let kind = Kind::Select { values };
    Attribute { name: name.to_owned(), kind, default: "b".to_owned(), mutable: true }
}

fn any_value() -> impl Strategy<Value = Edit> {
    let text = |texts: [&'static str; 2]| prop::sample::select(texts.to_vec());
    let value = prop::option::of(text(["b", "d"]));
    let frame = prop::option::weighted(0.8, 0..FRAMES);
    (1..5u64, text(["a", "c"]), frame, value).prop_map(|(target, name, frame, value)| {
        let value = value.map(ToOwned::to_owned);
        Edit::SetValue { target, name: name.to_owned(), frame, value }
    })
}

fn same(a: &Project, b: &Project) -> bool {
    (&a.video, &a.labels, &a.targets, a.done) == (&b.video, &b.labels, &b.targets, b.done)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn undo_of_all_restores_and_redo_brings_back(
        steps in prop::collection::vec(prop::collection::vec(any_edit(), 1..3), 1..40),
        saves in any::<u8>(),
    ) {
        let place = TestFolder::new();
        let mut store = place.store();
        let mut states = vec![store.project().clone()];
        let labels = ["car", "bus"].map(|name| Edit::AddLabel {
            name: name.into(), colour: None, at: None
        });
        store.apply(labels.into()).unwrap();
        states.push(store.project().clone());
        for (k, edits) in steps.into_iter().enumerate() {
            let before = store.project().clone();
            match store.apply(edits) {
                Ok(_) => states.push(store.project().clone()),
                Err(_) => prop_assert!(same(store.project(), &before)),
            }
            if k % 8 == usize::from(saves % 8) {
                store.save().unwrap();
                let read = Store::open_shared(&place.file(), None, Limits::default()).unwrap();
                prop_assert_eq!(read.project(), store.project());
                prop_assert_eq!(read.revision(), store.revision());
            }
        }
        for state in states[..states.len() - 1].iter().rev() {
            prop_assert!(store.step(false).unwrap().is_some());
            prop_assert!(same(store.project(), state));
        }
        prop_assert!(store.step(false).unwrap().is_none());
        for state in &states[1..] {
            prop_assert!(store.step(true).unwrap().is_some());
            prop_assert!(same(store.project(), state));
        }
        store.save().unwrap();
        let read = Store::open_shared(&place.file(), None, Limits::default()).unwrap();
        prop_assert_eq!(read.project(), store.project());
    }
}
