//! Attributes that labels declare, and their values by frame.

use std::fs;

use patchlock_media::Limits;
use patchlock_studio::export::write;
use patchlock_studio::import;
use patchlock_studio::project::{
    Attribute, Edit, Error, Label, Project, SharedLabels, Store, limits,
};
use patchlock_track::export::{KeyFrames, Options};
use serde_json::{Value, json};

use crate::support::{FRAMES, TestFolder, add, bbox, format_named, options};

fn attribute(text: Value) -> Attribute {
    serde_json::from_value(text).unwrap()
}

/// A truth value, a choice, a number and a text that change from frame to frame; a choice that does
/// not.
fn schema() -> Vec<Attribute> {
    [
        json!({"name": "parked", "kind": "checkbox", "mutable": true}),
        json!({
            "name": "light", "kind": "select", "values": ["off", "left & right"], "mutable": true,
        }),
        json!({
            "name": "doors", "kind": "number", "min": 0, "max": 5, "step": 0.5, "default": "4",
            "mutable": true,
        }),
        json!({"name": "plate", "kind": "text", "length": 8, "mutable": true}),
        json!({"name": "colour", "kind": "select", "values": ["red", "blue"], "default": "blue"}),
    ]
    .map(attribute)
    .to_vec()
}

fn declare(attributes: Vec<Attribute>) -> Edit {
    Edit::Declare { label: "target".into(), attributes }
}

fn set(target: u64, name: &str, frame: Option<usize>, value: Option<&str>) -> Edit {
    Edit::SetValue { target, name: name.into(), frame, value: value.map(Into::into) }
}

/// Two targets with key frames in frames 0 to 9, and 2 to 9.
fn store(place: &TestFolder) -> Store {
    let mut store = place.store();
    store.apply(vec![declare(schema()), add(0), add(2)]).unwrap();
    for target in 1..=2 {
        for frame in 2..10 {
            let bbox = bbox(10.0 + frame as f64, 10.0, 8.0, 6.0);
            let key = Edit::SetKey {
                target,
                frame,
                bbox,
                outline: None,
                occluded: false,
                truncated: false,
            };
            store.apply(vec![key]).unwrap();
        }
    }
    store
}

/// The values of an attribute in all frames.
fn values(project: &Project, target: u64, name: &str) -> Vec<String> {
    let target = project.target(target).unwrap();
    let attribute = project.declared(&target.label).iter().find(|it| it.name == name).unwrap();
    (0..FRAMES).map(|frame| target.value(attribute, frame).to_owned()).collect()
}

/// What a value is in the frames before those given, and from each on.
fn stretches(first: &str, changes: &[(usize, &str)]) -> Vec<String> {
    let at = |frame| changes.iter().rfind(|(from, _)| *from <= frame).map_or(first, |it| it.1);
    (0..FRAMES).map(|frame| at(frame).to_owned()).collect()
}

#[test]
fn a_value_holds_from_its_frame_to_the_next_change() {
    let place = TestFolder::new();
    let mut store = store(&place);
    assert_eq!(values(store.project(), 1, "doors"), stretches("4", &[]));
    let begun = store.project().clone();
    store
        .apply(vec![
            set(1, "doors", Some(7), Some("2.5")),
            set(1, "doors", Some(3), Some("5")),
            set(1, "colour", None, Some("red")),
        ])
        .unwrap();
    assert_eq!(values(store.project(), 1, "doors"), stretches("4", &[(3, "5"), (7, "2.5")]));
    assert_eq!(values(store.project(), 1, "colour"), stretches("red", &[]));
    assert_eq!(values(store.project(), 2, "colour"), stretches("blue", &[]));
    store.apply(vec![set(1, "doors", None, Some("1"))]).unwrap();
    assert_eq!(values(store.project(), 1, "doors"), stretches("1", &[(3, "5"), (7, "2.5")]));
    store.apply(vec![set(1, "doors", Some(3), None)]).unwrap();
    assert_eq!(values(store.project(), 1, "doors"), stretches("1", &[(7, "2.5")]));
    // The value that holds already is no change, and takes one back.
    store.apply(vec![set(1, "doors", Some(7), Some("1"))]).unwrap();
    assert!(store.project().target(1).unwrap().changes.is_empty());
    assert_eq!(store.history().text(false), Some("set doors of target 1 to \"1\" from frame 7 on"));
    for _ in 0..4 {
        store.step(false).unwrap();
    }
    assert_eq!(*store.project(), begun);
    while store.step(true).unwrap().is_some() {}
    assert_eq!(values(store.project(), 1, "doors"), stretches("1", &[]));
    assert_eq!(values(store.project(), 1, "colour"), stretches("red", &[]));
}

#[test]
fn a_value_that_is_not_allowed_says_what_is() {
    let place = TestFolder::new();
    let mut store = store(&place);
    let before = store.project().clone();
    let long = "x".repeat(9);
    for (edit, words) in [
        (
            set(1, "size", None, Some("1")),
            "declares no attribute \"size\"; it declares parked, light",
        ),
        (set(1, "parked", Some(1), Some("yes")), "allowed: true, false"),
        (set(1, "light", Some(1), Some("on")), "allowed: off, left & right"),
        (set(1, "doors", Some(1), Some("9")), "0 to 5 in steps of 0.5"),
        (set(1, "plate", Some(1), Some(&long)), "9 characters; allowed: at most 8"),
        (set(1, "colour", Some(1), Some("red")), "is the same in all frames"),
        (set(1, "doors", Some(1), None), "does not change in frame 1"),
        (set(1, "doors", Some(99), Some("1")), "frame 99 is not in the video"),
        (set(7, "doors", Some(1), Some("1")), "there is no target 7"),
        (
            Edit::SetTarget {
                target: 1,
                label: None,
                attributes: Some([("colour".into(), "green".into())].into()),
            },
            "allowed: red, blue",
        ),
        (Edit::Declare { label: "bus".into(), attributes: vec![] }, "there is no label \"bus\""),
        (
            declare(vec![schema()[0].clone(), schema()[0].clone()]),
            "the attribute \"parked\" appears twice",
        ),
    ] {
        let error = store.apply(vec![edit.clone()]).unwrap_err().to_string();
        assert!(error.contains(words), "{edit:?}: {error}");
    }
    assert_eq!(*store.project(), before);
}

#[test]
fn values_stay_when_the_label_changes_and_do_not_count_where_it_does_not_allow_them() {
    let place = TestFolder::new();
    let mut store = store(&place);
    store
        .apply(vec![
            set(1, "light", Some(4), Some("left & right")),
            set(1, "colour", None, Some("red")),
        ])
        .unwrap();
    let fewer = vec![attribute(
        json!({"name": "light", "kind": "select", "values": ["off", "on"], "mutable": true}),
    )];
    store.apply(vec![declare(fewer)]).unwrap();
    assert_eq!(values(store.project(), 1, "light"), stretches("off", &[]));
    // The file of such a project can be read: the label may have changed while it was closed.
    store.save().unwrap();
    let project = store.project().clone();
    drop(store);
    let mut store = Store::open(&place.file(), None, Limits::default()).unwrap();
    assert_eq!(*store.project(), project);
    store.apply(vec![set(1, "light", Some(6), Some("on")), declare(schema())]).unwrap();
    store.step(false).unwrap();
    store.apply(vec![declare(schema())]).unwrap();
    assert_eq!(values(store.project(), 1, "light"), stretches("off", &[(4, "left & right")]));
    assert_eq!(values(store.project(), 1, "colour"), stretches("red", &[]));
}

#[test]
fn both_parts_of_a_split_target_keep_their_values_and_so_does_what_is_joined() {
    let place = TestFolder::new();
    let mut store = store(&place);
    store
        .apply(vec![
            Edit::DeleteTarget { target: 2 },
            set(1, "doors", Some(2), Some("2")),
            set(1, "doors", Some(8), Some("3")),
        ])
        .unwrap();
    let before = store.project().clone();
    store.apply(vec![Edit::Split { target: 1, frame: 5 }]).unwrap();
    assert_eq!(values(store.project(), 1, "doors"), stretches("4", &[(2, "2")]));
    assert_eq!(values(store.project(), 3, "doors"), stretches("2", &[(8, "3")]));
    store.apply(vec![set(3, "doors", Some(6), Some("1"))]).unwrap();
    store.apply(vec![Edit::Join { first: 1, second: 3 }]).unwrap();
    let joined = stretches("4", &[(2, "2"), (6, "1"), (8, "3")]);
    assert_eq!(values(store.project(), 1, "doors"), joined);
    for _ in 0..3 {
        store.step(false).unwrap();
    }
    assert_eq!(store.project().targets, before.targets);
    // The values of the first hold where only it has boxes, also after those of the second.
    for _ in 0..3 {
        store.step(true).unwrap();
    }
    assert_eq!(values(store.project(), 1, "doors"), joined);
}

#[test]
fn files_have_the_oldest_version_that_knows_all_of_them() {
    let place = TestFolder::new();
    let mut store = place.store();
    let version = |store: &mut Store| {
        store.save().unwrap();
        let text: Value = serde_json::from_slice(&fs::read(place.file()).unwrap()).unwrap();
        text["version"].clone()
    };
    store.apply(vec![add(0)]).unwrap();
    assert_eq!(version(&mut store), 1);
    store.apply(vec![declare(schema()), set(1, "doors", Some(3), Some("5"))]).unwrap();
    assert_eq!(version(&mut store), 3);
    let text: Value = serde_json::from_slice(&fs::read(place.file()).unwrap()).unwrap();
    assert_eq!(text["targets"][0]["changes"], json!({"doors": {"3": "5"}}));
    assert_eq!(
        text["labels"][0]["attributes"][2],
        json!({
            "name": "doors", "kind": "number", "min": 0.0, "max": 5.0, "step": 0.5, "default": "4",
            "mutable": true,
        })
    );
    let project = store.project().clone();
    drop(store);
    let mut store = Store::open(&place.file(), None, Limits::default()).unwrap();
    assert_eq!(*store.project(), project);
    store.apply(vec![declare(vec![]), set_nothing()]).unwrap();
    assert_eq!(version(&mut store), 1);
}

fn set_nothing() -> Edit {
    Edit::SetValues { target: 1, attributes: Default::default(), changes: Default::default() }
}

#[test]
fn a_file_with_wrong_attributes_says_what_is_wrong() {
    let place = TestFolder::new();
    let mut store = store(&place);
    store.apply(vec![set(1, "doors", Some(3), Some("5"))]).unwrap();
    store.save().unwrap();
    drop(store);
    let good: Value = serde_json::from_slice(&fs::read(place.file()).unwrap()).unwrap();
    let many: serde_json::Map<String, Value> =
        (0..=limits::ATTRIBUTES).map(|k| (format!("a{k}"), json!({"0": "x"}))).collect();
    let long = "x".repeat(limits::VALUE + 1);
    let at = |pointer: &str, value: Value| {
        let mut file = good.clone();
        *file.pointer_mut(pointer).unwrap() = value;
        file
    };
    for (file, words) in [
        (at("/targets/0/changes", json!({"doors": {"99": "1"}})), "\"doors\": frame 99 is not in"),
        (at("/targets/0/changes", json!({"doors": {"x": "1"}})), "\"x\" is not a frame"),
        (at("/targets/0/changes", json!({"doors": {"1": long}})), "1001 characters"),
        (at("/targets/0/changes", json!({" ": {"1": "1"}})), "name of the attribute is \" \""),
        (at("/targets/0/changes", Value::Object(many)), "101 attributes that change; at most 100"),
        (at("/labels/0/attributes/0/default", json!("no")), "the label \"target\": the default of"),
        (at("/labels/0/attributes/0/name", json!("status")), "are in exports already"),
        (at("/labels/0/attributes/1/values", json!([])), "has 0 values; allowed: 1 to 200"),
        (at("/labels/0/attributes/2/step", json!(0)), "in steps of 0"),
    ] {
        fs::write(place.file(), file.to_string()).unwrap();
        let error = Store::open(&place.file(), None, Limits::default()).unwrap_err();
        assert!(matches!(error, Error::Invalid { .. }), "{error:?}");
        assert!(error.to_string().contains(words), "{words}: {error}");
    }
}

fn exported(place: &TestFolder, project: &Project, name: &str, key_frames: usize) -> String {
    let out = place.folder().join(format!("out.{name}"));
    let options = options(format_named(name), &place.video(), false);
    let options = Options { key_frames: KeyFrames::Every(key_frames), ..options };
    write(project, &options, &out, true).unwrap();
    fs::read_to_string(&out).unwrap()
}

/// A target whose attributes change, and one with the defaults.
fn filled(place: &TestFolder) -> Store {
    let mut store = store(place);
    store
        .apply(vec![
            set(1, "parked", Some(4), Some("true")),
            set(1, "light", None, Some("left & right")),
            set(1, "light", Some(6), Some("off")),
            set(1, "doors", Some(5), Some("2.5")),
            set(1, "plate", Some(3), Some("=A 1")),
            set(1, "plate", Some(7), Some("")),
            set(1, "colour", None, Some("red")),
        ])
        .unwrap();
    store
}

/// The values of all attributes in the frames 0 to 9, which have boxes, of both targets.
fn all_values(project: &Project) -> Vec<Vec<String>> {
    let targets = project.targets.iter().flat_map(|target| {
        schema().into_iter().map(|it| values(project, target.id, &it.name)[2..10].to_vec())
    });
    targets.collect()
}

#[test]
fn attributes_of_cvat_come_back_with_their_declarations() {
    let place = TestFolder::new();
    let store = filled(&place);
    let text = exported(&place, store.project(), "cvat", 1);
    let mut other = Store::open_shared(
        &place.folder().join("other.json"),
        Some(&place.video()),
        Limits::default(),
    )
    .unwrap();
    let imported =
        import::read(import::Format::Cvat, text.as_bytes(), other.project(), &[]).unwrap();
    let edits = imported.edits(&other.project().labels);
    other.apply(edits).unwrap();
    let declared = |project: &Project| {
        let mut declared = project.declared("target").to_vec();
        // CVAT limits no text.
        declared.retain(|it| it.name != "plate");
        declared
    };
    assert_eq!(declared(other.project()), declared(store.project()));
    assert_eq!(all_values(other.project()), all_values(store.project()));
    other.step(false).unwrap();
    assert!(other.project().targets.is_empty() && other.project().declared("target").is_empty());
}

#[test]
fn a_label_keeps_what_it_declares_and_refuses_imported_values_that_it_does_not_allow() {
    let place = TestFolder::new();
    let store = filled(&place);
    let text = exported(&place, store.project(), "cvat", 1);
    let mut other = Store::open_shared(
        &place.folder().join("other.json"),
        Some(&place.video()),
        Limits::default(),
    )
    .unwrap();
    let own = attribute(json!({"name": "light", "kind": "checkbox", "mutable": true}));
    other.apply(vec![declare(vec![own.clone()])]).unwrap();
    let imported =
        import::read(import::Format::Cvat, text.as_bytes(), other.project(), &[]).unwrap();
    let error = other.apply(imported.edits(&other.project().labels)).unwrap_err().to_string();
    assert!(error.contains("target 1 of those to import: the attribute \"light\""), "{error}");
    assert_eq!(other.project().declared("target"), [own]);
}

#[test]
fn definitions_of_cvat_that_a_project_cannot_have_are_texts() {
    let place = TestFolder::new();
    let text = r#"<annotations><meta><job><labels><label><name>car</name><attributes>
        <attribute><name>a</name><mutable>False</mutable><input_type>select</input_type>
          <default_value>x</default_value><values>y&#10;z</values></attribute>
        <attribute><name>b</name><mutable>True</mutable><input_type>radio</input_type>
          <default_value>y</default_value><values>y
            z</values></attribute>
        <attribute><name>occluded</name><mutable>True</mutable><input_type>checkbox</input_type>
          <default_value>false</default_value><values></values></attribute>
        </attributes></label></labels></job>
        <original_size><width>64</width><height>48</height></original_size></meta>
        <track id="0" label="car">
          <box frame="5" xtl="1" ytl="1" xbr="9" ybr="9" outside="0" occluded="0" keyframe="1">
            <attribute name="b">z</attribute></box>
          <box frame="1" xtl="1" ytl="1" xbr="9" ybr="9" outside="0" occluded="0" keyframe="1">
            <attribute name="a">what</attribute><attribute name="b">y</attribute></box>
        </track></annotations>"#;
    let store = place.store();
    let imported =
        import::read(import::Format::Cvat, text.as_bytes(), store.project(), &[]).unwrap();
    let kinds: Vec<_> =
        imported.declared["car"].iter().map(|it| (it.name.as_str(), it.kind.name())).collect();
    assert_eq!(kinds, [("a", "text"), ("b", "select")]);
    let [target] = imported.targets.as_slice() else { panic!("{imported:?}") };
    assert_eq!(target.attributes["a"], "what");
    assert_eq!((target.attributes["b"].as_str(), target.changes["b"].at(5)), ("y", Some("z")));
    let wrong = text.replace("<width>64", "<width>65");
    let error =
        import::read(import::Format::Cvat, wrong.as_bytes(), store.project(), &[]).unwrap_err();
    assert!(error.to_string().contains("65 x 48"), "{error}");
}

#[test]
fn a_change_of_an_attribute_is_a_key_frame_of_cvat() {
    let place = TestFolder::new();
    let mut store = place.store();
    let tracked = |frame: usize| patchlock_studio::project::TrackedBox {
        bbox: bbox(10.0 + frame as f64, 10.0, 8.0, 6.0),
        score: 0.9,
        status: patchlock::Status::Tracked,
        visible: None,
        agreement: None,
    };
    let tracked = (1..=9).map(|frame| (frame, tracked(frame))).collect();
    store
        .apply(vec![
            declare(schema()),
            add(0),
            Edit::SetTracked { target: 1, from: 1, to: 9, tracked },
            set(1, "parked", Some(4), Some("true")),
        ])
        .unwrap();
    let text = exported(&place, store.project(), "cvat", 100);
    let frames: Vec<&str> =
        text.split("<box frame=\"").skip(1).map(|rest| rest.split('"').next().unwrap()).collect();
    // In frame 10, the target is outside.
    assert_eq!(frames, ["0", "4", "9", "10"]);
}

#[test]
fn coco_and_tables_have_the_values_of_each_frame() {
    let place = TestFolder::new();
    let store = filled(&place);
    let coco: Value = serde_json::from_str(&exported(&place, store.project(), "coco", 1)).unwrap();
    let annotations = coco["annotations"].as_array().unwrap();
    let of = |frame: u64| {
        let is = |it: &&Value| it["image_id"] == frame && it["track_id"] == 1;
        annotations.iter().find(is).unwrap()["attributes"].clone()
    };
    // Images count from 1, and frame 1 has none: frame 4 is the fourth.
    let at = of(4);
    assert_eq!(at["parked"], true);
    assert_eq!(at["doors"], 4);
    assert_eq!(of(5)["doors"], 2.5);
    assert_eq!((&at["light"], &at["colour"]), (&json!("left & right"), &json!("red")));

    let table = exported(&place, store.project(), "csv", 1);
    assert!(table.lines().next().unwrap().ends_with(
        ",frame_w,frame_h,outline,attribute:colour,attribute:doors,attribute:light,attribute:parked,attribute:plate"
    ));
    assert!(table.contains(",'=A 1\n"), "a value is no formula: {table}");
    let mut other = Store::open_shared(
        &place.folder().join("other.json"),
        Some(&place.video()),
        Limits::default(),
    )
    .unwrap();
    other.apply(vec![declare(schema())]).unwrap();
    let imported =
        import::read(import::Format::Csv, table.as_bytes(), other.project(), &[]).unwrap();
    other.apply(imported.edits(&other.project().labels)).unwrap();
    assert_eq!(all_values(other.project()), all_values(store.project()));
}

#[test]
fn attributes_are_those_of_all_clips() {
    let place = TestFolder::new();
    let mut shared = SharedLabels::new(place.folder());
    let store = store(&place);
    shared.update(|labels| labels.absorb(store.project())).unwrap();
    assert_eq!(shared.read().unwrap().labels(), store.project().labels);
    let file = place.folder().join("patchlock-labels.json");
    let version = || {
        let text: Value = serde_json::from_slice(&fs::read(&file).unwrap()).unwrap();
        text["version"].clone()
    };
    assert_eq!(version(), 2);
    let rename =
        Edit::SetLabel { name: "target".into(), new_name: Some("car".into()), colour: None };
    shared.update(|labels| labels.apply(&rename, |_| false)).unwrap();
    let [Label { name, attributes, .. }] = &shared.read().unwrap().labels()[..] else { panic!() };
    assert_eq!((name.as_str(), attributes), ("car", &schema()));
    let nothing = Edit::Declare { label: "car".into(), attributes: vec![] };
    shared.update(|labels| labels.apply(&nothing, |_| false)).unwrap();
    assert_eq!(version(), 1);
    let wrong = r##"{"format": "patchlock-labels", "version": 2, "labels": [{"name": "a",
        "colour": "#000000", "attributes": [{"name": "b", "kind": "text", "length": 0}]}]}"##;
    fs::write(&file, wrong).unwrap();
    let error = shared.read().unwrap_err().to_string();
    assert!(error.contains("\"b\": its length is 0; allowed: 1 to 1000"), "{error}");
}
