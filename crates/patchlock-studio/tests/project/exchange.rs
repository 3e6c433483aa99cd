//! What is written for other tools, and read from them.

use std::fs;

use patchlock::{BoundingBox, Status};
use patchlock_media::Limits;
use patchlock_studio::export::write;
use patchlock_studio::import;
use patchlock_studio::project::{Edit, Key, Outline, Project, Store, Target, TrackedBox};
use patchlock_track::export::{self, Format, Selection};

use crate::support::{FRAMES, TestFolder, add, bbox, format_named, options};

/// Two targets: keys, tracked boxes, a lost one, hidden stretches, labels and attributes.
pub fn filled(place: &TestFolder) -> Store {
    let mut store = place.store();
    let tracked = |frame: usize, status| TrackedBox {
        bbox: bbox(10.125 + frame as f64, 9.5, 8.0, 6.25),
        score: 0.5 + frame as f64 / 100.0,
        status,
        visible: Some(0.75),
        agreement: Some(0.5),
    };
    let track = |target, frames: std::ops::RangeInclusive<usize>, lost: usize| {
        let status = |frame| if frame == lost { Status::Lost } else { Status::Tracked };
        let (from, to) = (*frames.start(), *frames.end());
        let tracked = frames.map(|frame| (frame, tracked(frame, status(frame)))).collect();
        Edit::SetTracked { target, from, to, tracked }
    };
    let key = |target, frame, occluded| Edit::SetKey {
        target,
        frame,
        bbox: bbox(-2.0, 12.0, 9.0, 7.0),
        outline: None,
        occluded,
        truncated: !occluded,
    };
    let attributes = [("maker & co".to_owned(), "<b>\"x\"</b>".to_owned())].into();
    store
        .apply(vec![
            Edit::AddLabel { name: "<car> & \"co\"".into(), colour: None, at: None },
            add(0),
            add(2),
            key(1, 5, true),
            key(2, 8, false),
            track(1, 1..=6, 6),
            track(2, 3..=11, 99),
            Edit::Hide { target: 1, from: 7, to: 9 },
            Edit::SetTarget {
                target: 2,
                label: Some("<car> & \"co\"".into()),
                attributes: Some(attributes),
            },
        ])
        .unwrap();
    store
}

fn exported(place: &TestFolder, project: &Project, format: Format) -> Vec<u8> {
    let out = place.folder().join(format!("out-{}", format.name));
    let mut options = options(format, &place.video(), true);
    if format.name == "coco" {
        // By default, it has what a detector is to learn.
        options.selection.status = Some(Selection::statuses("tracked,uncertain,lost").unwrap());
    }
    write(project, &options, &out, false).unwrap();
    let again = write(project, &options, &out, false).unwrap_err();
    assert!(again.to_string().contains("exists already") && again.is_misuse(), "{again}");
    write(project, &options, &out, true).unwrap();
    fs::read(&out).unwrap()
}

fn imported(format: import::Format, text: &[u8], store: &Store) -> Vec<Target> {
    import::read(format, text, store.project(), &[]).unwrap().targets
}

fn same_boxes(a: &Target, b: &Target) {
    for frame in 0..FRAMES {
        match (a.box_at(frame), b.box_at(frame)) {
            (Some(a), Some(b)) => {
                let sides = |BoundingBox { x, y, w, h }: BoundingBox| [x, y, w, h];
                let near = sides(a).iter().zip(sides(b)).all(|(a, b)| (a - b).abs() < 1e-3);
                assert!(near, "frame {frame}: {a:?} {b:?}");
            }
            (a, b) => assert_eq!(a.is_some(), b.is_some(), "frame {frame}"),
        }
    }
}

#[test]
fn what_is_exported_can_be_imported() {
    let place = TestFolder::new();
    let store = filled(&place);
    let before = &store.project().targets;
    let with_tracks = import::Format::ALL.into_iter().filter(|format| !format.has_files());
    for format in with_tracks {
        let same_name = format_named(format.name());
        let text = exported(&place, store.project(), same_name);
        let targets = imported(format, &text, &store);
        assert_eq!(targets.len(), 2, "{format:?}");
        for (old, new) in before.iter().zip(&targets) {
            same_boxes(old, new);
            if format != import::Format::Mot {
                assert_eq!(old.label, new.label, "{format:?}");
            }
        }
        if format == import::Format::Cvat {
            assert_eq!(targets[1].attributes, before[1].attributes);
            assert_eq!(targets[0].hidden, [[6, 11]], "lost, and then hidden, and not seen again");
            assert!(targets[0].keys[&5].occluded && targets[1].keys[&8].truncated);
        }
        if format == import::Format::Coco {
            let keys = |target: &Target| target.keys.clone();
            assert_eq!(
                (keys(&targets[0]), keys(&targets[1])),
                (keys(&before[0]), keys(&before[1]))
            );
            assert_eq!(targets[0].tracked[&6].status, Status::Lost);
        }
        if format == import::Format::Csv {
            assert_eq!(targets, *before);
        }
        // What was read can become part of a project.
        let mut other = Store::open_shared(
            &place.folder().join("other.json"),
            Some(&place.video()),
            Limits::default(),
        );
        let other = other.as_mut().unwrap();
        other.apply(vec![Edit::Import { targets }]).unwrap();
        assert_eq!(other.project().targets.len(), 2);
    }
}

/// Target 1 is not seen from frame 6 on, target 2 is in the last frame of the clip.
#[test]
fn tools_that_interpolate_know_where_a_target_and_the_clip_end() {
    let place = TestFolder::new();
    let store = filled(&place);
    let text = |format| String::from_utf8(exported(&place, store.project(), format)).unwrap();
    let cvat = text(format_named("cvat"));
    assert!(cvat.contains(&format!("<size>{FRAMES}</size>")), "{cvat}");
    let outside: Vec<&str> =
        cvat.lines().filter(|line| line.contains("outside=\"1\"")).map(str::trim).collect();
    let [outside] = outside[..] else { panic!("{outside:?}") };
    assert!(outside.starts_with("<box frame=\"6\""), "{outside}");
    let tasks: serde_json::Value =
        serde_json::from_str(&text(format_named("label-studio"))).unwrap();
    for (k, last) in [(0, 6), (1, FRAMES)] {
        let value = &tasks[0]["predictions"][0]["result"][k]["value"];
        assert_eq!(value["framesCount"], FRAMES);
        let keys = value["sequence"].as_array().unwrap();
        let end = keys.last().unwrap();
        assert_eq!((&end["frame"], &end["enabled"]), (&last.into(), &false.into()));
    }
}

#[test]
fn a_label_is_no_formula_in_a_table_and_comes_back() {
    for label in ["=HYPERLINK(\"x\")", "+1 car", "-2", "@SUM(A1)", "'=1", "'s", "a, b"] {
        let place = TestFolder::new();
        let mut store = place.store();
        let add = Edit::AddTarget {
            label: label.into(),
            frame: 0,
            bbox: bbox(1.0, 2.0, 9.0, 9.0),
            outline: None,
        };
        let name = Edit::AddLabel { name: label.into(), colour: None, at: None };
        store.apply(vec![name, add]).unwrap();
        let text = exported(&place, store.project(), format_named("csv"));
        let mut table = csv::Reader::from_reader(text.as_slice());
        let cell = table.records().next().unwrap().unwrap()[2].to_owned();
        let is_formula = cell.starts_with(['=', '+', '-', '@']) && cell.parse::<f64>().is_err();
        assert!(!is_formula, "{cell}");
        assert_eq!(imported(import::Format::Csv, &text, &store)[0].label, label);
    }
}

#[test]
fn every_format_has_the_labels() {
    let place = TestFolder::new();
    let mut store = filled(&place);
    let Key { bbox, .. } = store.project().targets[0].keys[&0].clone();
    let BoundingBox { x, y, w, h } = bbox;
    let outline = Some(Outline(vec![[x, y], [x + w, y], [x + w, y + h]]));
    let (target, frame, occluded, truncated) = (1, 0, false, false);
    let outlined = Edit::SetKey { target, frame, bbox, outline, occluded, truncated };
    store.apply(vec![outlined]).unwrap();
    let all = Format::all(true).filter(|format| !format.is_file());
    for format in all {
        let out = place.folder().join(format.name);
        let options = options(format, &place.video(), true);
        let slash = write(store.project(), &options, &out, false);
        assert!(slash.is_ok(), "{slash:?}");
        fs::remove_dir_all(&out).unwrap();
    }
    let rename = |name: &str, new: &str| Edit::SetLabel {
        name: name.into(),
        new_name: Some(new.into()),
        colour: None,
    };
    store.apply(vec![rename("<car> & \"co\"", "car"), rename("target", "a/b")]).unwrap();
    let lasot = options(format_named("lasot"), &place.video(), false);
    let out = place.folder().join("lasot");
    let error = write(store.project(), &lasot, &out, false).unwrap_err();
    assert!(error.to_string().contains("the label is \"a/b\""), "{error}");
    store.apply(vec![rename("a/b", "person")]).unwrap();
    write(store.project(), &lasot, &out, false).unwrap();
    assert!(out.join("person/person-1/groundtruth.txt").exists() && out.join("car/car-2").exists());

    let yolo = options(format_named("yolo"), &place.video(), false);
    let out = place.folder().join("yolo");
    write(store.project(), &yolo, &out, false).unwrap();
    let yaml = fs::read_to_string(out.join("data.yaml")).unwrap();
    assert!(yaml.contains("nc: 2\nnames:\n  0: \"person\"\n  1: \"car\"\n"), "{yaml}");
    let lines = |frame: usize| fs::read_to_string(out.join(format!("labels/train/{frame:04}.txt")));
    let named = |frame: usize| {
        fs::read_to_string(out.join(format!("labels/train/frame_{frame:06}.txt"))).or(lines(frame))
    };
    // Target 1 is lost in frame 6, where nothing is known, and hidden in frame 7, where that is
    // known.
    assert!(named(6).is_err());
    let hidden = named(7).unwrap();
    assert!(hidden.starts_with("1 ") && hidden.lines().count() == 1, "{hidden}");

    let voc = options(format_named("voc"), &place.video(), false);
    let out = place.folder().join("voc");
    write(store.project(), &voc, &out, false).unwrap();
    let xml = |frame: usize| {
        fs::read_to_string(out.join(format!("Annotations/frame_{frame:06}.xml"))).unwrap()
    };
    assert!(xml(5).contains("<name>person</name>") && xml(5).contains("<occluded>1</occluded>"));
    assert!(xml(8).contains("<name>car</name>") && xml(8).contains("<truncated>1</truncated>"));
    assert!(!xml(8).contains("person"));
}

#[test]
fn a_project_without_boxes_is_not_exported() {
    let place = TestFolder::new();
    let store = place.store();
    for format in Format::all(true) {
        let options = options(format, &place.video(), false);
        let out = place.folder().join("out");
        let error = write(store.project(), &options, &out, false).unwrap_err();
        assert!(error.to_string().contains("no boxes"), "{error}");
        assert!(!out.exists());
    }
    let error = Format::named("xls", true).unwrap_err().to_string();
    assert!(error.contains("csv, mot, kitti, coco, cvat, yolo"), "{error}");
}

#[test]
fn a_table_of_the_tracker_is_read() {
    let place = TestFolder::new();
    let store = place.store();
    let csv = "frame,x,y,w,h,score,visible_large,status,frame_w,frame_h,time\n\
        0,10,10,8,6,1,,tracked,64,48,0\n1,11,10,8,6,1,,tracked,64,48,0.1\n\
        2,12,10,8,6,0.25,,uncertain,64,48,0.2\n3,,,,,0,,lost,64,48,0.3\n";
    let json = "{\"frame\":0,\"x\":10,\"y\":10,\"w\":8,\"h\":6,\"score\":1,\"status\":\"tracked\"}\n\n\
        {\"frame\":1,\"x\":11,\"y\":10,\"w\":8,\"h\":6,\"score\":1,\"status\":\"tracked\"}\n\
        {\"frame\":2,\"x\":12,\"y\":10,\"w\":8,\"h\":6,\"score\":0.25,\"status\":\"uncertain\"}\n";
    for text in [csv, json, &format!("\u{feff}{csv}")] {
        let targets = imported(import::Format::Csv, text.as_bytes(), &store);
        assert_eq!(targets.len(), 1);
        let target = &targets[0];
        assert_eq!(target.keys.keys().copied().collect::<Vec<_>>(), [0], "the box that was given");
        assert_eq!(target.tracked[&2].status, Status::Uncertain);
        assert_eq!(target.tracked.len(), 2);
        assert_eq!(target.label, "target");
    }
}

#[test]
fn files_of_others_are_read() {
    let place = TestFolder::new();
    let store = place.store();
    // Ground truth: class and visible share; a person has drawn the boxes. Detections: no target.
    let mot = "1,4,11,11,8,6,1,3,0.5\n2,4,12,11,8,6,0,3,1\n";
    let targets = imported(import::Format::Mot, mot.as_bytes(), &store);
    assert_eq!(
        (targets[0].label.as_str(), targets[0].keys[&0].bbox),
        ("class 3", bbox(10.0, 10.0, 8.0, 6.0))
    );
    assert_eq!(targets[0].tracked[&1].status, Status::Lost);
    let detections = "1,-1,11,11,8,6,37.5\n1,-1,15,11,8,6,-1\n";
    assert_eq!(imported(import::Format::Mot, detections.as_bytes(), &store).len(), 2);

    let cvat = r#"<?xml version="1.0" encoding="utf-8"?><annotations><version>1.1</version>
        <track id="0" label="car" source="manual">
        <box frame="2" keyframe="1" outside="0" occluded="0" xtl="1" ytl="2" xbr="11" ybr="12" z_order="0">
          <attribute name="colour">red</attribute></box>
        <box frame="3" keyframe="0" outside="0" occluded="0" xtl="1" ytl="2" xbr="11" ybr="12"/>
        <box frame="4" keyframe="1" outside="1" occluded="0" xtl="1" ytl="2" xbr="11" ybr="12"/>
        <box frame="8" keyframe="1" outside="0" occluded="1" xtl="1" ytl="2" xbr="11" ybr="12"/>
        </track></annotations>"#;
    let targets = imported(import::Format::Cvat, cvat.as_bytes(), &store);
    let target = &targets[0];
    assert_eq!(target.keys.keys().copied().collect::<Vec<_>>(), [2, 8]);
    assert_eq!(
        (target.hidden.as_slice(), target.attributes["colour"].as_str()),
        (&[[4, 7]][..], "red")
    );
    assert!(target.tracked.contains_key(&3) && target.keys[&8].occluded);

    // Without tracks, each box is a target; frames are in the names of images.
    let coco = r#"{"images": [{"id": 7, "file_name": "a/frame_000004.PNG", "width": 64, "height": 48}],
        "annotations": [{"image_id": 7, "category_id": 2, "bbox": [1, 2, 3, 4], "iscrowd": 0},
        {"image_id": 7, "category_id": 2, "bbox": [5, 6, 7, 8], "score": 0.5}],
        "categories": [{"id": 2, "name": "dog"}], "licenses": []}"#;
    let targets = imported(import::Format::Coco, coco.as_bytes(), &store);
    assert_eq!((targets.len(), targets[0].label.as_str()), (2, "dog"));
    assert!(targets[0].keys.contains_key(&4) && targets[1].tracked.contains_key(&4));
}

#[test]
fn files_that_are_wrong_are_refused_with_their_place() {
    let place = TestFolder::new();
    let store = place.store();
    let cvat = |inside: &str| {
        format!("<annotations>\n<track id=\"1\" label=\"a\">\n{inside}</track></annotations>")
    };
    let shape = |more: &str| {
        cvat(&format!("<box frame=\"0\" xtl=\"1\" ytl=\"1\" xbr=\"9\" ybr=\"9\" {more}/>\n"))
    };
    let coco = |images: &str, annotations: &str| {
        format!("{{\"images\": [{images}], \"annotations\": [{annotations}]}}")
    };
    let image = "{\"id\": 1, \"file_name\": \"0000.jpg\"}";
    use import::Format::{Coco, Csv, Cvat, Mot};
    let cases = [
        (Csv, "a,b\n1,2\n".to_owned(), "no column frame"),
        (
            Csv,
            "frame,x,y,w,h\n0,1,1,5,5\n12,1,1,5,5\n".into(),
            "line 3: frame 12 is not in the video",
        ),
        (
            Csv,
            "frame,x,y,w,h\n18446744073709551615,1,1,5,5\n".into(),
            "line 2: frame 18446744073709551615 is not in the video",
        ),
        (
            Csv,
            "{\"frame\":18446744073709551615,\"x\":1,\"y\":1,\"w\":5,\"h\":5}\n".into(),
            "line 1: frame 18446744073709551615 is not in the video",
        ),
        (
            Mot,
            "18446744073709551615,1,1,1,5,5\n".into(),
            "line 1: frame 18446744073709551614 is not",
        ),
        (
            Cvat,
            shape("").replace("\"0\"", "\"18446744073709551615\""),
            "line 3: frame 18446744073709551615 is not in the video",
        ),
        (
            Coco,
            coco(
                "{\"id\": 1, \"frame_id\": 18446744073709551615}",
                "{\"image_id\": 1, \"bbox\": [1, 1, 5, 5]}",
            ),
            "annotation 1: frame 18446744073709551615 is not in the video",
        ),
        (Csv, "frame,x,y,w,h\n0,1,1,5,a\n".into(), "line 2: "),
        (Csv, "frame,x,y,w,h\n0,1,1,5,\n".into(), "line 2: the box is incomplete"),
        (Csv, "frame,x,y,w,h\n0,1,1,5,NaN\n".into(), "line 2: the box is 1,1,5,NaN"),
        (Csv, "frame,x,y,w,h\n0,1,1,5,5\n0,1,1,5,5\n".into(), "target 1 appears twice in frame 0"),
        (Csv, "frame,x,y,w,h\n".into(), "no boxes"),
        (
            Csv,
            "frame,x,y,w,h,frame_w,frame_h\n0,1,1,5,5,640,480\n".into(),
            "640 x 480 pixels; those of",
        ),
        (Csv, "{\"frame\": 0\n".into(), "line 1: "),
        (
            Cvat,
            shape("outside=\"0\"").replacen(
                "</track>",
                "<box frame=\"0\" outside=\"1\" xtl=\"1\" ytl=\"1\" xbr=\"9\" ybr=\"9\"/></track>",
                1,
            ),
            "line 4: target 1 appears twice in frame 0",
        ),
        (Mot, "1,1,1,1,5\n".into(), "line 1: there are 5 columns"),
        (Mot, "0,1,1,1,5,5\n".into(), "frames count from 1"),
        (Mot, "1e300,1,1,1,5,5\n".into(), "is not in the video"),
        (Mot, "1,1,1,x,5,5\n".into(), "column 4 is \"x\""),
        (Mot, "1,1,1,1,0,5\n".into(), "the box is 0,0,0,5"),
        (Cvat, "{}".into(), "not XML"),
        (Cvat, "<a/>".into(), "begins with <a>"),
        (Cvat, "<annotations><image/></annotations>".into(), "no boxes"),
        (Cvat, cvat(""), "no boxes"),
        (Cvat, cvat("<polyline/>"), "there are no boxes in the file. Left out: polyline (1)"),
        (Cvat, shape("").replace("\"0\"", "\"12\""), "line 3: frame 12 is not in the video"),
        (
            Cvat,
            "<annotations>\n<image id=\"a\"><box label=\"b\" xtl=\"1\" ytl=\"1\" xbr=\"9\" ybr=\"9\"/>\
             </image></annotations>"
                .into(),
            "line 2: the id is \"a\", not the number of a frame",
        ),
        (Cvat, cvat("<box/>"), "line 3: <box> has no frame"),
        (Cvat, shape("rotation=\"NaN\""), "rotation is NaN; allowed: a number of degrees"),
        (Cvat, shape("rotation=\"a\""), "rotation is \"a\", not a number"),
        (Cvat, shape("").replace("\"9\"", "\"0\""), "line 3: the box is 1,1,-1,-1"),
        (Cvat, "<!DOCTYPE a [<!ENTITY b \"c\">]><annotations>&b;</annotations>".into(), "not XML"),
        (Coco, "[]".into(), "cannot import"),
        (Coco, coco(image, ""), "no boxes"),
        (Coco, coco("{\"id\": 1, \"file_name\": \"a.jpg\"}", ""), "no number at the end"),
        (
            Coco,
            coco(image, "{\"image_id\": 2, \"bbox\": [1, 1, 5, 5]}"),
            "annotation 1: there is no image",
        ),
        (Coco, coco(image, "{\"image_id\": 1, \"bbox\": [1, 1, 5]}"), "invalid length 3"),
        (
            Coco,
            coco(image, "{\"image_id\": 1, \"bbox\": [1, 1, 5, 5], \"category_id\": 5}"),
            "no category with the id 5",
        ),
        (
            Coco,
            "{\"videos\": [{}, {}], \"images\": [], \"annotations\": []}".into(),
            "has 2 videos; a project has one",
        ),
    ];
    for (format, text, expected) in cases {
        let error = import::read(format, text.as_bytes(), store.project(), &[]).unwrap_err();
        assert!(error.to_string().contains(expected), "{format:?} {text}: {error}");
        assert!(error.is_misuse());
    }
    let error = import::read(Csv, &[0xff, 0xfe], store.project(), &[]).unwrap_err().to_string();
    assert!(error.contains("not text in UTF-8"), "{error}");
    assert!(import::Format::named("xml").unwrap_err().to_string().contains("csv, mot, cvat, coco"));
}

/// The file of the project has a few hundred bytes.
#[test]
fn a_project_that_hides_a_target_in_millions_of_frames_is_not_exported() {
    let place = TestFolder::new();
    let mut store = place.store_of(100_000_000);
    store.apply(vec![add(0), Edit::Hide { target: 1, from: 1, to: 99_999_999 }]).unwrap();
    for format in Format::all(true) {
        let options = options(format, &place.video(), false);
        let out = place.folder().join("out");
        let error = write(store.project(), &options, &out, false).unwrap_err();
        let expected = "1 boxes, and 99999999 frames in which a target is not visible";
        assert!(error.to_string().contains(expected), "{error}");
        assert!(!out.exists());
    }
}

/// Takes minutes if the lines before each box are counted.
#[test]
fn a_long_file_of_cvat_is_read_in_a_time_that_follows_its_length() {
    let place = TestFolder::new();
    let store = place.store_of(1_000_000);
    let shape = |frame: usize| {
        let outside = frame % 2;
        format!(
            "<box frame=\"{frame}\" outside=\"{outside}\" xtl=\"1\" ytl=\"1\" xbr=\"9\" ybr=\"9\"/>\n"
        )
    };
    let boxes: String = (0..100_000).map(shape).collect();
    let text =
        format!("<annotations><track id=\"0\" label=\"target\">\n{boxes}</track></annotations>");
    let begun = std::time::Instant::now();
    let targets = imported(import::Format::Cvat, text.as_bytes(), &store);
    assert!(begun.elapsed().as_secs() < 10, "{:?}", begun.elapsed());
    assert_eq!((targets[0].keys.len(), targets[0].hidden.len()), (50_000, 50_000));
}

/// Small files that take a reader long which compares each attribute, or each namespace, with all
/// others; and rows that come backwards.
#[test]
fn an_import_takes_a_time_that_follows_its_length() {
    let place = TestFolder::new();
    let store = place.store_of(1_000_000);
    let begun = std::time::Instant::now();
    let read = |format, text: &str| import::read(format, text.as_bytes(), store.project(), &[]);
    let attributes: String = (0..80_000).map(|k| format!(" a{k}=\"\"")).collect();
    let names: String = (0..5000).map(|k| format!(" xmlns:n{k}=\"{k}\"")).collect();
    for text in [
        format!("<annotations><track id=\"0\" label=\"a\"{attributes}/></annotations>"),
        format!("<annotations><meta{names}>{}</meta></annotations>", "<a/>".repeat(5000)),
    ] {
        let error = read(import::Format::Cvat, &text).unwrap_err().to_string();
        assert!(error.contains("line 1: an element has more than 100 attributes"), "{error}");
    }
    let boxes = "<box frame=\"0\" xtl=\"1\" ytl=\"1\" xbr=\"9\" ybr=\"9\"/>\n".repeat(1000);
    let long = "x".repeat(1 << 20);
    let text =
        format!("<annotations><track id=\"{long}\" label=\"a\">{boxes}</track></annotations>");
    let error = read(import::Format::Cvat, &text).unwrap_err().to_string();
    assert!(error.contains("more than 1000 bytes"), "{error}");
    let rows: String = (0..200_000).rev().map(|k| format!("{},7,,,,,true\n", 2 * k)).collect();
    let text = format!("frame,id,x,y,w,h,hidden\n{rows}1,7,1,1,5,5,\n");
    let imported = read(import::Format::Csv, &text).unwrap();
    assert_eq!(imported.targets[0].hidden.len(), 200_000);
    assert!(begun.elapsed().as_secs() < 10, "{:?}", begun.elapsed());
}

/// What `patchlock track` has found is written with the rotation, and read as outlines.
#[test]
fn rotated_boxes_of_cvat_are_read_with_the_upright_boxes_around_them() {
    let place = TestFolder::new();
    let store = place.store();
    let entry = |frame: usize| {
        let turn = (20.0 * frame as f64).to_radians();
        let corner = |[x, y]: [f64; 2]| {
            let (sin, cos) = turn.sin_cos();
            [29.5 + x * cos - y * sin, 19.5 + x * sin + y * cos]
        };
        let corners = [[-8.0, -3.0], [8.0, -3.0], [8.0, 3.0], [-8.0, 3.0]].map(corner);
        export::Entry {
            frame,
            id: 1,
            bbox: Some(bbox(22.0, 17.0, 16.0, 6.0)),
            corners: Some(corners),
            status: Some(Status::Tracked),
            ..export::Entry::default()
        }
    };
    let entries: Vec<export::Entry> = (0..FRAMES).map(entry).collect();
    let track = export::Track::new(entries.clone()).unwrap().in_clip(FRAMES).sized(64, 48);
    let out = place.folder().join("rotated.xml");
    let options = export::Options::new(Format::named("cvat-obb", false).unwrap(), "clip");
    export::write(&track, &options, &out, false).unwrap();
    let targets = imported(import::Format::Cvat, &fs::read(&out).unwrap(), &store);
    for entry in entries {
        let corners = entry.corners.unwrap();
        let side = |k: usize, end: fn(f64, f64) -> f64| {
            corners.iter().map(|corner| corner[k] + 0.5).reduce(end).unwrap()
        };
        let read = targets[0].keys[&entry.frame].bbox;
        let near = [
            (read.x, side(0, f64::min)),
            (read.y, side(1, f64::min)),
            (read.x + read.w, side(0, f64::max)),
            (read.y + read.h, side(1, f64::max)),
        ];
        assert!(near.iter().all(|(a, b)| (a - b).abs() < 1e-3), "frame {}: {near:?}", entry.frame);
    }
}
