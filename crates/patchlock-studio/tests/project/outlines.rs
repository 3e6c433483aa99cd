//! Rotated boxes and polygons: edits, the file, and what other tools get and give back.

use std::fs;

use patchlock::{BoundingBox, Status};
use patchlock_media::Limits;
use patchlock_studio::export;
use patchlock_studio::import;
use patchlock_studio::project::{Edit, Outline, Store, Target, TrackedBox};
use patchlock_track::export::Format;

use crate::support::{TestFolder, add, bbox, format_named, options};

/// A box of 20 x 8 pixels that is turned by 30 degrees.
const TURNED: BoundingBox = BoundingBox { x: 10.0, y: 12.0, w: 20.0, h: 8.0 };

fn turned(degrees: f64) -> Outline {
    Outline::of_box(TURNED, degrees)
}

/// Four pixels wide and high, without a corner.
fn polygon() -> Outline {
    Outline(vec![[40.0, 10.0], [56.0, 10.0], [56.0, 18.0], [48.0, 26.0], [40.0, 26.0]])
}

fn set_key(target: u64, frame: usize, outline: Outline) -> Edit {
    let (bbox, outline) = (outline.bounds(), Some(outline));
    Edit::SetKey { target, frame, bbox, outline, occluded: false, truncated: false }
}

fn tracked(bbox: BoundingBox) -> TrackedBox {
    let (visible, agreement) = (None, None);
    TrackedBox { bbox, score: 0.9, status: Status::Tracked, visible, agreement }
}

/// The first target is a rotated box from frame 0 to 4, the second a polygon in frame 0 and an upright
/// box in frame 1, the third an upright box.
fn drawn(place: &TestFolder) -> Store {
    let mut store = place.store();
    let outline = turned(30.0);
    let bounds = outline.bounds();
    let moved = |by: f64| bbox(bounds.x + by, bounds.y, bounds.w, bounds.h);
    let found = (1..4).map(|frame| (frame, tracked(moved(frame as f64)))).collect();
    let add_outline = |outline: Outline| Edit::AddTarget {
        label: "target".into(),
        frame: 0,
        bbox: outline.bounds(),
        outline: Some(outline),
    };
    let fourth = turned(50.0).carried(turned(50.0).bounds(), {
        let around = turned(50.0).bounds();
        bbox(around.x + 4.0, around.y, around.w, around.h)
    });
    let edits = vec![
        add_outline(outline),
        Edit::SetTracked { target: 1, from: 1, to: 3, tracked: found },
        set_key(1, 4, fourth),
        add_outline(polygon()),
        Edit::SetTracked {
            target: 2,
            from: 1,
            to: 1,
            tracked: [(1, tracked(bbox(41.0, 10.0, 16.0, 16.0)))].into(),
        },
        add(0),
    ];
    store.apply(edits).unwrap();
    store
}

fn target(store: &Store, id: u64) -> &Target {
    store.project().target(id).unwrap()
}

/// Writes a project in a format; returns the text of the file, or of a file in the folder.
fn exported(place: &TestFolder, store: &Store, format: &str, file: &str) -> String {
    let out = place.folder().join(format!("out-{format}"));
    let options = options(format_named(format), &place.video(), false);
    export::write(store.project(), &options, &out, false).unwrap();
    fs::read_to_string(if file.is_empty() { out } else { out.join(file) }).unwrap()
}

fn imported(format: import::Format, text: &str, store: &Store) -> Vec<Target> {
    import::read(format, text.as_bytes(), store.project(), &[]).unwrap().targets
}

#[track_caller]
fn near(found: &Outline, wanted: &Outline) {
    let both = found.0.iter().flatten().zip(wanted.0.iter().flatten());
    let off = both.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(found.0.len() == wanted.0.len() && off < 0.02, "{found:?} {wanted:?}");
}

#[test]
fn an_outline_is_kept_in_the_file_and_undone() {
    let place = TestFolder::new();
    let mut store = place.store();
    store.apply(vec![add(0)]).unwrap();
    store.save().unwrap();
    let version = |wanted: &str| {
        let text = fs::read_to_string(place.file()).unwrap();
        assert!(text.contains(&format!("\"version\": {wanted},")), "{text}");
        text
    };
    assert!(!version("1").contains("outline"));
    store.apply(vec![set_key(1, 0, polygon())]).unwrap();
    store.save().unwrap();
    version("4");
    let project = store.project().clone();
    store.step(false).unwrap();
    assert_eq!(target(&store, 1).keys[&0].outline, None);
    store.step(true).unwrap();
    assert_eq!(*store.project(), project);
    store.save().unwrap();
    drop(store);
    let mut store = Store::open(&place.file(), None, Limits::default()).unwrap();
    assert_eq!(*store.project(), project);
    assert_eq!(target(&store, 1).keys[&0].outline, Some(polygon()));
    // A new box without one takes its place.
    let upright = set_key(1, 0, polygon());
    let Edit::SetKey { bbox, .. } = upright else { panic!("a key") };
    let outline = None;
    store
        .apply(vec![Edit::SetKey {
            target: 1,
            frame: 0,
            bbox,
            outline,
            occluded: true,
            truncated: false,
        }])
        .unwrap();
    store.save().unwrap();
    assert!(!version("1").contains("outline"));
}

#[test]
fn an_outline_that_does_not_fit_its_box_is_refused() {
    let place = TestFolder::new();
    let mut store = place.store();
    store.apply(vec![add(0)]).unwrap();
    let mut refused = |bbox: BoundingBox, outline: Outline, words: &str| {
        let outline = Some(outline);
        let edit =
            Edit::SetKey { target: 1, frame: 0, bbox, outline, occluded: false, truncated: false };
        let error = store.apply(vec![edit]).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    };
    let line = Outline(vec![[1.0, 1.0], [5.0, 5.0], [9.0, 9.0]]);
    refused(line.bounds(), line, "the outline has an area of 0 pixels; allowed: 1 or more");
    let two = Outline(vec![[1.0, 1.0], [5.0, 5.0]]);
    refused(two.bounds(), two, "the outline has 2 points; allowed: 3 to 1000");
    refused(
        bbox(40.0, 10.0, 16.0, 15.0),
        polygon(),
        "the box is 40,10,16,15; the upright box around the outline is 40,10,16,16",
    );
}

#[test]
fn between_key_frames_the_outline_follows_the_box() {
    let place = TestFolder::new();
    let store = drawn(&place);
    let first = target(&store, 1);
    for (frame, degrees) in [(0, 30.0), (1, 35.0), (2, 40.0), (4, 50.0)] {
        let (found, angle) = first.outline_at(frame).unwrap().rotated_box();
        assert!((angle - degrees).abs() < 1e-6, "frame {frame}: {angle}");
        // Tracked boxes are rounded.
        assert!((found.x + found.w / 2.0 - 20.0 - frame as f64).abs() < 1e-3, "{found:?}");
    }
    // After the last one it is that of the last one, and of a target without one there is none.
    let second = target(&store, 2).outline_at(1).unwrap();
    near(&second, &Outline(polygon().0.iter().map(|[x, y]| [x + 1.0, *y]).collect()));
    assert_eq!((first.outline_at(5), target(&store, 3).outline_at(0)), (None, None));
}

#[test]
fn cvat_gets_rotated_boxes_and_polygons_and_gives_them_back() {
    let place = TestFolder::new();
    let store = drawn(&place);
    let text = exported(&place, &store, "cvat", "");
    let lines = |name: &str| text.lines().filter(|line| line.contains(name)).collect::<Vec<_>>();
    let boxes = lines("<box ");
    assert!(
        boxes[0]
            .contains("xtl=\"10\" ytl=\"12\" xbr=\"30\" ybr=\"20\" z_order=\"0\" rotation=\"30\""),
        "{text}"
    );
    assert!(boxes[2].contains("rotation=\"40\"") && !boxes[6].contains("rotation"), "{text}");
    // CVAT takes no track of boxes and polygons.
    let polygons = lines("<polygon ");
    assert_eq!(polygons.len(), 3, "{text}");
    assert!(polygons[0].contains("points=\"40,10;56,10;56,18;48,26;40,26\""), "{text}");
    assert!(polygons[2].contains("frame=\"2\" keyframe=\"1\" outside=\"1\""), "{text}");
    let again = imported(import::Format::Cvat, &text, &store);
    near(again[0].keys[&0].outline.as_ref().unwrap(), &turned(30.0));
    near(again[0].keys[&4].outline.as_ref().unwrap(), &target(&store, 1).outline_at(4).unwrap());
    assert_eq!(again[1].keys[&0].outline, Some(polygon()));
    assert_eq!(
        (again[2].keys[&0].bbox, again[2].keys[&0].outline.clone()),
        (bbox(10.0, 10.0, 8.0, 6.0), None)
    );
}

#[test]
fn yolo_gets_the_corners_of_rotated_boxes_and_gives_them_back() {
    let place = TestFolder::new();
    let store = drawn(&place);
    let text = exported(&place, &store, "yolo-obb", "labels/train/frame_000000.txt");
    let again = import::read_files(
        import::Format::Yolo,
        &[import::File { name: "frame_000000.txt".into(), content: text.into_bytes() }],
        store.project(),
        &[],
    );
    let again = again.unwrap().targets;
    let outline = |k: usize| again[k].keys[&0].outline.clone();
    near(&outline(0).unwrap(), &turned(30.0));
    // The smallest rectangle around the polygon is upright.
    assert_eq!(outline(1), None);
    assert_eq!(outline(2), None);
    let BoundingBox { x, y, w, h } = again[1].keys[&0].bbox;
    assert!([x - 40.0, y - 10.0, w - 16.0, h - 16.0].iter().all(|off| off.abs() < 1e-3));
    // Upright formats have the boxes around the outlines.
    let text = exported(&place, &store, "yolo", "labels/train/frame_000000.txt");
    assert!(text.contains("0 0.750000 0.375000 0.250000 0.333333\n"), "{text}");

    let place = TestFolder::new();
    let mut upright = place.store();
    upright.apply(vec![add(0)]).unwrap();
    let options = options(format_named("yolo-obb"), &place.video(), false);
    let out = place.folder().join("none");
    let error = export::write(upright.project(), &options, &out, false);
    let error = error.unwrap_err().to_string();
    assert!(error.contains("no box has an outline, which yolo-obb is for"), "{error}");
    let error = Format::named("cvat-obb", true).unwrap_err().to_string();
    assert!(error.contains("there is no format \"cvat-obb\"; the formats are csv, mot"), "{error}");
}

#[test]
fn coco_gets_outlines_as_segmentations_and_gives_them_back() {
    let place = TestFolder::new();
    let store = drawn(&place);
    let text = exported(&place, &store, "coco", "");
    let all: serde_json::Value = serde_json::from_str(&text).unwrap();
    let annotations = all["annotations"].as_array().unwrap();
    let of = |track: u64, frame: usize| {
        let image =
            |it: &&serde_json::Value| it["track_id"] == track && it["image_id"] == frame as u64 + 1;
        annotations.iter().find(image).unwrap()
    };
    let points: Vec<f64> = polygon().0.into_iter().flatten().collect();
    assert_eq!(of(2, 0)["segmentation"], serde_json::json!([points]));
    assert_eq!(of(2, 0)["area"], 224.0);
    assert_eq!(of(2, 0)["bbox"], serde_json::json!([40.0, 10.0, 16.0, 16.0]));
    assert!(of(1, 2)["segmentation"][0].as_array().unwrap().len() == 8);
    assert!(of(3, 0).get("segmentation").is_none());
    let again = imported(import::Format::Coco, &text, &store);
    near(again[0].keys[&0].outline.as_ref().unwrap(), &turned(30.0));
    assert_eq!(again[1].keys[&0].outline, Some(polygon()));
    // What is not one polygon is left out, and the box is kept.
    let parts = text.replace("\"segmentation\": [", "\"segmentation\": [[1, 1, 5, 1, 5, 5], ");
    let again = imported(import::Format::Coco, &parts, &store);
    assert_eq!(
        (again[1].keys[&0].outline.clone(), again[1].keys[&0].bbox),
        (None, polygon().bounds())
    );
}

#[test]
fn label_studio_gets_rotated_boxes_and_gives_them_back() {
    let place = TestFolder::new();
    let store = drawn(&place);
    let text = exported(&place, &store, "label-studio", "");
    let all: serde_json::Value = serde_json::from_str(&text).unwrap();
    let results = &all[0]["predictions"][0]["result"];
    let first = &results[0]["value"]["sequence"][0];
    let [x, y] = turned(30.0).0[0];
    let number = |name: &str| first[name].as_f64().unwrap();
    let wanted = [
        ("x", 100.0 * x / 64.0),
        ("y", 100.0 * y / 48.0),
        ("width", 100.0 * 20.0 / 64.0),
        ("height", 100.0 * 8.0 / 48.0),
        ("rotation", 30.0),
    ];
    assert!(wanted.iter().all(|(name, value)| (number(name) - value).abs() < 1e-3), "{first}");
    assert_eq!(results[1]["value"]["sequence"][0]["rotation"], 0);
    let again = imported(import::Format::LabelStudio, &text, &store);
    near(again[0].keys[&0].outline.as_ref().unwrap(), &turned(30.0));
    assert_eq!(again[2].keys[&0].outline, None);
}

#[test]
fn our_table_has_outlines() {
    let place = TestFolder::new();
    let store = drawn(&place);
    let text = exported(&place, &store, "csv", "");
    assert!(text.contains("\"40,10;56,10;56,18;48,26;40,26\""), "{text}");
    let again = imported(import::Format::Csv, &text, &store);
    for (again, id) in again.iter().zip(1..) {
        assert_eq!(
            (&again.keys, &again.tracked),
            (&target(&store, id).keys, &target(&store, id).tracked)
        );
    }
    let wrong = text.replace("40,10;", "40;");
    let error = import::read(import::Format::Csv, wrong.as_bytes(), store.project(), &[]);
    let error = error.unwrap_err().to_string();
    assert!(error.contains("\"40\" is not a point x,y of an outline"), "{error}");
}
