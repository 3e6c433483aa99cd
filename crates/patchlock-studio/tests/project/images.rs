//! Annotations of images of other programs: which frame they belong to, and what is left out.

use std::fs;

use patchlock_studio::export::write;
use patchlock_studio::import;
use patchlock_studio::project::Target;

use crate::exchange::filled;
use crate::support::{FRAMES, TestFolder, bbox, format_named, options};

/// The text of a COCO file with a box in each of these images; the width of the box is the place of
/// the image, from 1.
fn coco_of(names: &[&str]) -> String {
    let images = names.iter().enumerate();
    let images: Vec<serde_json::Value> =
        images.map(|(k, name)| serde_json::json!({ "id": k, "file_name": name })).collect();
    let annotations = (0..names.len()).map(
        |k| serde_json::json!({ "id": k, "image_id": k, "bbox": [1, 1, k + 1, 5], "track_id": 1 }),
    );
    let annotations: Vec<serde_json::Value> = annotations.collect();
    serde_json::json!({ "images": images, "annotations": annotations }).to_string()
}

/// The file of "CVAT for images" with a box in each of these images, by id and name.
fn cvat_of(names: &[(usize, &str)]) -> String {
    let image = |(k, (id, name)): (usize, &(usize, &str))| {
        format!(
            "<image id=\"{id}\" name=\"{name}\" width=\"64\" height=\"48\"><polyline points=\"\"/><box \
             label=\"car\" occluded=\"1\" xtl=\"1\" ytl=\"1\" xbr=\"{}\" ybr=\"6\"><attribute \
             name=\"parked\">yes</attribute></box></image>",
            k + 2
        )
    };
    let images: String = names.iter().enumerate().map(image).collect();
    format!("<annotations><version>1.1</version>{images}</annotations>")
}

/// The frames of boxes by their widths, which count from 1.
fn frames_by_width(targets: &[Target]) -> Vec<usize> {
    let keys = targets.iter().flat_map(|target| &target.keys);
    let mut frames: Vec<(f64, usize)> = keys.map(|(frame, key)| (key.bbox.w, *frame)).collect();
    frames.sort_by(|a, b| a.0.total_cmp(&b.0));
    frames.into_iter().map(|(_, frame)| frame).collect()
}

#[test]
fn boxes_are_put_on_the_image_with_their_name() {
    let place = TestFolder::new();
    let store = place.store();
    // Frames 0, 1, 2 and so on, with gaps in their numbers, and one name that two have.
    let images: Vec<String> =
        ["0001.png", "0003.png", "img-a.jpg", "img-a.png", "9-0010.bmp", "x.1.png"]
            .map(String::from)
            .to_vec();
    let read = |format, text: &str| import::read(format, text.as_bytes(), store.project(), &images);
    let names = [
        "0003.png",
        "a\\b/0001.jpg",
        "0003_png.rf.8a1b9c2d3e.jpg",
        "frames/x.1",
        "img-a.png",
        "8a1b9c2d-0001.png",
        "9-0010",
    ];
    let frames = [1, 0, 1, 5, 3, 0, 4];
    for (name, frame) in names.iter().zip(frames) {
        let imported = read(import::Format::Coco, &coco_of(&[name])).unwrap();
        assert_eq!(frames_by_width(&imported.targets), [frame], "{name}");
        assert!(imported.notes.is_empty());
        let imported = read(import::Format::Cvat, &cvat_of(&[(7, name)])).unwrap();
        assert_eq!(frames_by_width(&imported.targets), [frame], "{name}");
        let key = &imported.targets[0].keys[&frame];
        assert!(key.occluded && imported.targets[0].attributes["parked"] == "yes");
        assert_eq!(imported.notes, ["Left out: polyline (1)"]);
    }
    for name in ["0002.png", "1.png", "img-a", "frame_000001.png", "0003 .png", ""] {
        let said = format!("no image of the folder has the name {name:?}");
        for error in [
            read(import::Format::Coco, &coco_of(&["0003.png", name])).unwrap_err(),
            read(import::Format::Cvat, &cvat_of(&[(0, "0003.png"), (1, name)])).unwrap_err(),
        ] {
            assert!(error.to_string().contains(&said), "{error}");
        }
    }
    // An image without boxes may be missing, and its own frame_id is known for one that is renamed.
    let text = coco_of(&["0001.png"])
        .replace("\"images\":[", "\"images\":[{\"id\":9,\"file_name\":\"y\"},");
    assert_eq!(frames_by_width(&read(import::Format::Coco, &text).unwrap().targets), [0]);
    let text = coco_of(&["y.png"]).replace("\"id\":0", "\"frame_id\":2,\"id\":0");
    assert_eq!(frames_by_width(&read(import::Format::Coco, &text).unwrap().targets), [2]);
}

#[test]
fn images_of_a_video_are_matched_by_numbers() {
    let place = TestFolder::new();
    let store = place.store();
    let read = |format, text: &str| import::read(format, text.as_bytes(), store.project(), &[]);
    let names = ["frame_0007.jpg", "clip/frame_0005.jpg", "frame_0010_jpg.rf.123abc.jpg"];
    let imported = read(import::Format::Coco, &coco_of(&names)).unwrap();
    // The first images may have no boxes, and be left out.
    assert_eq!(frames_by_width(&imported.targets), [6, 4, 9]);
    assert_eq!(
        imported.notes,
        ["The images are matched with the frames by the numbers at the ends of their names: \
          1 is frame 0"]
    );
    for (names, frames, first) in [
        (["a3.jpg", "a0.jpg"], [3, 0], "a0"),
        (["a3.jpg", "a12.jpg"], [2, 11], "1"),
        (["a13.jpg", "a11.jpg"], [2, 0], "a11"),
    ] {
        let imported = read(import::Format::Coco, &coco_of(&names)).unwrap();
        assert_eq!(frames_by_width(&imported.targets), frames, "{names:?}");
        assert!(imported.notes[0].ends_with(&format!(": {first} is frame 0")), "{names:?}");
    }
    let imported = read(import::Format::Coco, &coco_of(&["frame_000003.jpg", "frame_000005.png"]));
    let imported = imported.unwrap();
    assert_eq!(frames_by_width(&imported.targets), [3, 5]);
    assert!(imported.notes[0].ends_with("frame_000000 is frame 0"), "{:?}", imported.notes);
    let error = read(import::Format::Coco, &coco_of(&["frame_1.jpg", "frame_13.jpg"])).unwrap_err();
    assert!(error.to_string().contains("frame 12 is not in the video"), "{error}");
    // CVAT says which frame it is.
    let text = cvat_of(&[(3, "frame_000003.png"), (11, "b")]);
    let imported = read(import::Format::Cvat, &text).unwrap();
    assert_eq!(frames_by_width(&imported.targets), [3, 11]);
    assert_eq!(imported.notes, ["Left out: polyline (2)"]);
}

/// A list of results of a detector, with a box for each of these images; the widths count from 1.
fn results_of(images: &[serde_json::Value]) -> String {
    let result = |(k, image): (usize, &serde_json::Value)| {
        serde_json::json!({
            "image_id": image, "category_id": k + 3, "bbox": [1, 1, k + 1, 5], "score": 0.5,
            "file_name": "other.jpg", "segmentation": { "size": [48, 64], "counts": "" },
        })
    };
    serde_json::Value::from_iter(images.iter().enumerate().map(result)).to_string()
}

/// As [`frames_by_width`], of tracked boxes.
fn tracked_by_width(targets: &[Target]) -> Vec<usize> {
    let tracked = targets.iter().flat_map(|target| &target.tracked);
    let mut frames: Vec<(f64, usize)> = tracked.map(|(frame, it)| (it.bbox.w, *frame)).collect();
    frames.sort_by(|a, b| a.0.total_cmp(&b.0));
    frames.into_iter().map(|(_, frame)| frame).collect()
}

#[test]
fn results_of_detectors_are_read() {
    let place = TestFolder::new();
    let store = place.store();
    let images: Vec<String> = ["0009.png", "0010.png", "b-7.png"].map(String::from).to_vec();
    let read = |text: &str, images: &[String]| {
        import::read(import::Format::Coco, text.as_bytes(), store.project(), images)
    };
    let labels = "The file has no names of categories: the label of category 3 is class 3";

    // In a video the ids are numbers, or end with them; several boxes of an image are targets.
    let ids = [7.into(), 5.into(), "clip_0010".into(), 7.into()];
    let imported = read(&results_of(&ids), &[]).unwrap();
    assert_eq!(tracked_by_width(&imported.targets), [6, 4, 9, 6]);
    let found: Vec<&str> = imported.targets.iter().map(|target| target.label.as_str()).collect();
    assert_eq!(found, ["class 3", "class 4", "class 5", "class 6"]);
    assert_eq!(imported.targets[0].tracked[&6].score, 0.5);
    let numbers = "The images are matched with the frames by the numbers at the ends of their names: \
                   1 is frame 0";
    assert_eq!(imported.notes, [labels, numbers]);

    // In a folder they are names, or the numbers that names are.
    let imported = read(&results_of(&["0010".into(), 9.into(), "b-7".into()]), &images).unwrap();
    assert_eq!(tracked_by_width(&imported.targets), [1, 0, 2]);
    assert_eq!(imported.notes, [labels]);

    let twice = ["1.png", "01.png"].map(String::from);
    let results = |text: &str| format!("[{{{text}}}]");
    let cases = [
        (
            results_of(&[7.into()]),
            &images[..],
            "image 7: no image of the folder has the name \"7\"",
        ),
        (results_of(&["c".into()]), &images, "image c: no image of the folder has the name \"c\""),
        (results_of(&[1.into(), 13.into()]), &[], "annotation 2: frame 12 is not in the video"),
        (results_of(&["c".into()]), &[], "\"c\" has no number at the end of its name"),
        (
            results_of(&[(-1).into()]),
            &[],
            "the id of an image is -1; allowed: a whole number from 0, or a name",
        ),
        (results("\"category_id\": 1"), &[], "missing field `image_id`"),
        (results("\"image_id\": 1, \"bbox\": [1, 2, 3]"), &[], "invalid length 3"),
        (results("\"image_id\": 1, \"bbox\": [1, 2, 3, 4], \"score\": 87"), &[], "87"),
        (results("\"image_id\": 1"), &[], "Left out: annotation without a box (1)"),
    ];
    for (text, images, words) in cases {
        let error = read(&text, images).unwrap_err().to_string();
        assert!(error.contains(words), "{text}: {error}");
    }
    // Two names are this number.
    let error = read(&results_of(&[1.into(), 2.into()]), &twice).unwrap_err().to_string();
    assert!(error.contains("image 2: no image"), "{error}");
}

/// The files below a folder.
fn files_below(folder: &std::path::Path) -> Vec<import::File> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(files_below(&path));
        } else {
            let (name, content) = (path.to_string_lossy().into_owned(), fs::read(&path).unwrap());
            files.push(import::File { name, content });
        }
    }
    files
}

/// The boxes of the project that a detector is trained with, by label and frame.
#[test]
fn data_sets_of_detectors_are_read_back() {
    let place = TestFolder::new();
    let store = filled(&place);
    let images = import::names_of(&place.video());
    assert_eq!(images[3], "0003.bmp");
    for name in ["yolo", "voc"] {
        let out = place.folder().join(name);
        let options = options(format_named(name), &place.video(), true);
        let written = write(store.project(), &options, &out, false).unwrap();
        let files: Vec<import::File> = files_below(&out);
        let format = import::Format::named(name).unwrap();
        let imported = import::read_files(format, &files, store.project(), &images).unwrap();
        assert_eq!((imported.targets.len(), &imported.notes), (written.boxes.boxes, &vec![]));
        // VOC has whole pixels.
        let near = |a: f64, b: f64| (a - b).abs() <= if name == "voc" { 1.0 } else { 1e-3 };
        for target in &imported.targets {
            let (frame, key) = target.keys.iter().next().unwrap();
            let is_same = |known: &&Target| {
                let Some(b) = known.box_at(*frame) else { return false };
                let a = key.bbox;
                // What is outside the frame is cut off.
                let (left, top) = (b.x.max(0.0), b.y.max(0.0));
                known.label == target.label
                    && near(a.x, left)
                    && near(a.y, top)
                    && near(a.x + a.w, b.x + b.w)
                    && near(a.y + a.h, b.y + b.h)
            };
            assert!(store.project().targets.iter().any(|it| is_same(&it)), "{name} {target:?}");
        }
        let error = import::read_files(format, &files, store.project(), &images[..3]).unwrap_err();
        let error = error.to_string();
        assert!(error.contains("no image of the folder has the name \""), "{error}");
    }
    let file = import::File { name: "a.csv".into(), content: Vec::new() };
    let both = [file.clone(), file];
    let error = import::read_files(import::Format::Csv, &both, store.project(), &images);
    assert!(error.unwrap_err().to_string().contains("csv is one file, and 2 are given"));
}

#[test]
fn yolo_of_other_programs_is_read() {
    let place = TestFolder::new();
    let store = place.store();
    let file = |name: &str, text: &str| import::File { name: name.into(), content: text.into() };
    let line = "1 0.5 0.5 0.25 0.5\n";
    for (names, label) in [
        (file("data.yaml", "nc: 2\nnames: ['a', \"b c\"]\n"), "b c"),
        (file("data.yaml", "names:\n- a\n- b\nnc: 2\n"), "b"),
        (file("x/data.yml", "path: .\nnames:\n  0: a\n  1: \"b\"\ntrain: t\n"), "b"),
        (file("obj.names", "a\nb\n"), "b"),
        (file("classes.txt", "a\nb\n"), "b"),
        (file("train.txt", "images/5.jpg\n"), "class 1"),
    ] {
        let files = [names, file("5.txt", line), file("labels/7.txt", "1 0.5 0.5 0.25 0.5 0.75\n")];
        let imported = import::read_files(import::Format::Yolo, &files, store.project(), &[]);
        let imported = imported.unwrap();
        let [first, second] = &imported.targets[..] else { panic!("two boxes") };
        assert_eq!(
            (first.label.as_str(), first.keys[&4].bbox),
            (label, bbox(24.0, 12.0, 16.0, 24.0))
        );
        assert_eq!(second.tracked[&6].score, 0.75);
        assert!(imported.notes[0].ends_with(": 1 is frame 0"), "{:?}", imported.notes);
    }
    let read = |text: &str| {
        let files = [file("1.txt", line), file("2.txt", text)];
        import::read_files(import::Format::Yolo, &files, store.project(), &[])
    };
    let polygon = &read("0 0.25 0.25 0.5 0.25 0.5 0.5\n").unwrap().targets[1].keys[&1];
    assert_eq!(polygon.bbox, bbox(16.0, 12.0, 16.0, 12.0));
    assert_eq!(polygon.outline.as_ref().unwrap().to_string(), "16,12;32,12;32,24");
    for (text, words) in [
        ("0 0.5 0.5 0.5\n", "2.txt: line 1: there are 4 columns; a box has five or six"),
        ("\n0 0.5 0.5 0.5 x\n", "2.txt: line 2: column 5 is \"x\", not a number"),
        ("-1 0.5 0.5 0.5 0.5\n", "the class is \"-1\", not a whole number"),
        ("0 0.5 0.5 0 0.5\n", "2.txt: line 1: the box is "),
    ] {
        let error = read(text).unwrap_err().to_string();
        assert!(error.contains(words), "{text:?}: {error}");
    }
}

#[test]
fn label_studio_is_read() {
    let place = TestFolder::new();
    let store = place.store();
    let key = |frame: usize, enabled: bool, x: f64| {
        serde_json::json!({
            "frame": frame, "enabled": enabled, "time": 0, "rotation": 0, "x": x, "y": 50.0, "width": 25.0,
            "height": 25.0,
        })
    };
    let region = serde_json::json!({
        "id": "a", "type": "videorectangle",
        "value": { "labels": ["car"], "framesCount": 12,
                   "sequence": [key(1, true, 0.0), key(4, false, 25.0), key(8, true, 50.0)] },
    });
    let polygon = serde_json::json!({ "id": "b", "type": "polygonlabels", "value": {} });
    let text = serde_json::json!([{
        "data": { "video": "x.mp4" }, "annotations": [{ "result": [region, polygon] }],
    }]);
    let read = |text: &serde_json::Value, images: &[String]| {
        let text = text.to_string();
        import::read(import::Format::LabelStudio, text.as_bytes(), store.project(), images)
    };
    let imported = read(&text, &[]).unwrap();
    let [target] = &imported.targets[..] else { panic!("one target") };
    assert_eq!(target.label, "car");
    assert_eq!(target.keys.keys().copied().collect::<Vec<_>>(), [0, 3, 7]);
    assert_eq!(target.keys[&3].bbox, bbox(16.0, 24.0, 16.0, 12.0));
    assert_eq!(target.hidden, [[4, 6]]);
    assert_eq!(imported.notes, ["Left out: polygonlabels (1)"]);

    let image = |name: &str| {
        serde_json::json!({
            "data": { "image": name }, "annotations": [{ "result": [{
                "type": "rectanglelabels", "value": { "x": 0.0, "y": 50.0, "width": 25.0, "height": 25.0,
                "rectanglelabels": ["boat"] },
            }] }],
        })
    };
    let images = import::names_of(&place.video());
    let both = serde_json::json!([image("/data/upload/1/8a1b9c2d-0004.bmp"), image("0002.bmp")]);
    let imported = read(&both, &images).unwrap();
    let frames = imported.targets.iter().map(|target| *target.keys.keys().next().unwrap());
    assert_eq!(frames.collect::<Vec<_>>(), [4, 2]);
    let error = read(&serde_json::json!([image("other.png")]), &images).unwrap_err().to_string();
    assert!(error.contains("no image of the folder has the name \"other.png\""), "{error}");
}

/// CVAT writes a box that is outside for the frame after a job.
#[test]
fn what_is_no_box_in_the_clip_is_left_out_and_counted() {
    let place = TestFolder::new();
    let store = place.store();
    let shape = |frame: usize, outside: u8| {
        format!(
            "<box frame=\"{frame}\" outside=\"{outside}\" xtl=\"1\" ytl=\"1\" xbr=\"9\" ybr=\"9\"/>"
        )
    };
    let text = format!(
        "<annotations><track id=\"0\" label=\"car\">{}{}<polyline points=\"1,2\"><attribute \
         name=\"a\">b</attribute></polyline></track></annotations>",
        shape(0, 0),
        shape(FRAMES, 1)
    );
    let imported =
        import::read(import::Format::Cvat, text.as_bytes(), store.project(), &[]).unwrap();
    assert_eq!(imported.targets[0].keys.keys().collect::<Vec<_>>(), [&0]);
    assert!(imported.targets[0].hidden.is_empty() && imported.targets[0].attributes.is_empty());
    assert_eq!(imported.notes, ["Left out: box outside after the last frame (1), polyline (1)"]);
    let text = coco_of(&["1.png", "2.png"]).replacen("\"bbox\"", "\"other\"", 1);
    let imported =
        import::read(import::Format::Coco, text.as_bytes(), store.project(), &[]).unwrap();
    assert_eq!(frames_by_width(&imported.targets), [1]);
    assert_eq!(imported.notes[1..], ["Left out: annotation without a box (1)"]);
}
