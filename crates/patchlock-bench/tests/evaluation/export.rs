//! Checks the exported files of a small track, and that our own readers read them back.

use std::fs;
use std::path::{Path, PathBuf};

use image::RgbImage;
use patchlock::{BoundingBox, Status};
use patchlock_bench::dataset::{Dataset, Layout};
use patchlock_track::export::{
    self, Entry, Format, KeyFrames, Options, Selection, TargetMetadata, Track,
};
use serde_json::Value;
use tempfile::TempDir;

/// Target 1 in frames 0, 2 and 6, and target 3 in frames 2 and 4, where its box leaves the frame.
/// Only every second frame was tracked.
fn track() -> Track {
    let entry = |frame, id, [x, y, w, h]: [f64; 4], score, corners| Entry {
        frame,
        id,
        bbox: Some(BoundingBox { x, y, w, h }),
        score,
        corners,
        status: None,
        manual: None,
    };
    let corners = [[9.5, 4.5], [29.5, 4.5], [29.5, 14.5], [9.5, 14.5]];
    Track::new(vec![
        entry(6, 1, [14.0, 5.0, 20.0, 10.0], Some(0.75), None),
        entry(0, 1, [10.0, 5.0, 20.0, 10.0], Some(1.0), Some(corners)),
        entry(2, 3, [30.0, 20.0, 8.0, 6.0], None, None),
        entry(2, 1, [11.0, 5.0, 20.0, 10.0], Some(0.25), None),
        entry(4, 3, [-4.0, 27.0, 8.0, 6.123456], Some(0.5), None),
    ])
    .unwrap()
}

pub struct Workspace {
    folder: TempDir,
}

impl Workspace {
    pub fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Seven frames of 40 x 30 pixels: a JPEG, then PNGs.
    fn images(&self) -> PathBuf {
        let folder = self.path("frames");
        fs::create_dir(&folder).unwrap();
        for k in 0..7u8 {
            let name = format!("{k}.{}", if k == 0 { "jpg" } else { "png" });
            RgbImage::from_pixel(40, 30, image::Rgb([30 * k, 100, 50]))
                .save(folder.join(name))
                .unwrap();
        }
        folder
    }

    fn export(&self, options: &Options) -> Result<(usize, PathBuf), String> {
        let out = self.path("out");
        let written = export::write(&track(), options, &out, false);
        written.map(|written| (written.files, out)).map_err(|error| error.to_string())
    }
}

/// A target in frames 0 to 6: lost in 2 and 3 and at the end, uncertain in 4. `blank`: lost without
/// a box.
fn lost_track(blank: bool) -> Track {
    use Status::{Lost, Tracked, Uncertain};
    let statuses = [Tracked, Tracked, Lost, Lost, Uncertain, Tracked, Lost];
    let entry = |(frame, status): (usize, Status)| {
        // The last known box stays.
        let x = [10.0, 11.0, 11.0, 11.0, 14.0, 15.0, 15.0][frame];
        let bbox = BoundingBox { x, y: 5.0, w: 20.0, h: 10.0 };
        let bbox = Some(bbox).filter(|_| !(blank && status == Lost));
        let (score, status) = (Some(0.75), Some(status));
        Entry { frame, id: 1, bbox, score, corners: None, status, manual: None }
    };
    Track::new(statuses.into_iter().enumerate().map(entry).collect()).unwrap()
}

/// The output of both kinds of tracks with losses, by `read`.
fn lost_exports<T>(format: Format, read: impl Fn(&Path) -> T) -> [T; 2] {
    lost_exports_with(&options(format), read)
}

fn lost_exports_with<T>(options: &Options, read: impl Fn(&Path) -> T) -> [T; 2] {
    [false, true].map(|blank| {
        let workspace = Workspace::new();
        let out = workspace.path("out");
        export::write(&lost_track(blank), options, &out, false).unwrap();
        read(&out)
    })
}

/// The options of an export of boxes with these statuses.
fn with_status(format: &str, status: &str) -> Options {
    let status = Some(Selection::statuses(status).unwrap());
    let selection = Selection { status, ..Selection::default() };
    Options { selection, ..options(format_named(format)) }
}

#[test]
fn mot_has_confidence_0_or_no_line_for_a_lost_target() {
    let [kept, blank] = lost_exports(format_named("mot"), |out| text(out));
    let line = |frame: usize, left: u32, confidence: &str| {
        format!("{frame},1,{left}.0000,6.0000,20.0000,10.0000,{confidence},-1,-1,-1\n")
    };
    let found = [(1, 11), (2, 12), (5, 15), (6, 16)].map(|(k, left)| line(k, left, "0.7500"));
    assert_eq!(blank, found.concat());
    let lost = [(3, 12), (4, 12), (7, 16)].map(|(k, left)| line(k, left, "0.0000"));
    let [a, b, c, d] = found;
    let [e, f, g] = lost;
    assert_eq!(kept, [a, b, e, f, c, d, g].concat());
}

#[test]
fn coco_has_the_status_as_an_attribute() {
    let [kept, blank] = lost_exports_with(&with_status("coco", "tracked,uncertain,lost"), |out| {
        let all: Value = serde_json::from_str(&text(out)).unwrap();
        assert_eq!(all["images"].as_array().unwrap().len(), 7);
        let annotations = all["annotations"].as_array().unwrap().iter();
        annotations
            .map(|a| (a["image_id"].as_u64().unwrap(), a["attributes"]["status"].clone()))
            .collect::<Vec<_>>()
    });
    let names = ["tracked", "tracked", "lost", "lost", "uncertain", "tracked", "lost"];
    let named: Vec<(u64, Value)> = (1..).zip(names.map(Value::from)).collect();
    assert_eq!(kept, named);
    let found: Vec<_> = named.into_iter().filter(|(_, status)| status != "lost").collect();
    assert_eq!(blank, found);
}

#[test]
fn a_lost_target_is_outside_in_cvat() {
    let exports = lost_exports(format_named("cvat"), |out| {
        let xml = text(out);
        let boxes = xml.lines().filter(|line| line.contains("<box "));
        let value = |line: &str, name: &str| {
            line.split_once(&format!(" {name}=\""))
                .unwrap()
                .1
                .split('"')
                .next()
                .unwrap()
                .to_string()
        };
        boxes
            .map(|line| {
                ["frame", "outside", "occluded", "xtl"].map(|name| value(line, name)).join(" ")
            })
            .collect::<Vec<_>>()
    });
    let expected =
        ["0 0 0 10", "1 0 0 11", "2 1 0 11", "4 0 1 14", "5 0 0 15", "6 1 0 15"].map(String::from);
    for boxes in exports {
        assert_eq!(boxes, expected);
    }
}

#[test]
fn yolo_leaves_out_frames_with_a_lost_or_uncertain_target() {
    for names in lost_exports(format_named("yolo"), |out| {
        let entries = fs::read_dir(out.join("labels/train")).unwrap();
        let mut names: Vec<_> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }) {
        assert_eq!(names, [0, 1, 5].map(|k| format!("frame_{k:06}.txt")));
    }
}

#[test]
fn benchmarks_flag_a_lost_target() {
    let boxes = |first: u32| {
        let line = |x: u32| format!("{x}.0000,{first}.0000,20.0000,10.0000\n");
        let offset = first + 5;
        [line(offset), line(offset + 1), "0,0,0,0\n".repeat(2), line(offset + 4), line(offset + 5)]
            .concat()
            + "0,0,0,0\n"
    };
    for out in lost_exports(format_named("lasot"), |out| {
        let folder = out.join("toy car/toy car-1");
        ["groundtruth.txt", "full_occlusion.txt"].map(|name| text(folder.join(name)))
    }) {
        assert_eq!(out, [boxes(6), "0,0,1,1,0,0,1\n".to_string()]);
    }
    for out in lost_exports(format_named("got10k"), |out| {
        let folder = out.join("film_000001");
        ["groundtruth.txt", "absence.label", "cover.label"].map(|name| text(folder.join(name)))
    }) {
        let lines =
            |digits: &str| digits.chars().map(|digit| format!("{digit}\n")).collect::<String>();
        assert_eq!(out, [boxes(5), lines("0011001"), lines("6600660")]);
    }
}

/// The export format of this name.
pub fn format_named(name: &str) -> Format {
    Format::named(name).unwrap()
}

pub fn options(format: Format) -> Options {
    let size = format.needs_size.then_some((40, 30));
    Options { label: "toy car".into(), size, ..Options::new(format, "film") }
}

pub fn text(path: impl AsRef<Path>) -> String {
    fs::read_to_string(path.as_ref()).unwrap_or_else(|error| panic!("{:?}: {error}", path.as_ref()))
}

/// The text of a format that is one file.
fn exported_text(format: Format) -> String {
    let workspace = Workspace::new();
    let (files, out) = workspace.export(&options(format)).unwrap();
    assert_eq!(files, 1);
    text(out)
}

#[test]
fn mot_counts_from_one() {
    assert_eq!(
        exported_text(format_named("mot")),
        "1,1,11.0000,6.0000,20.0000,10.0000,1.0000,-1,-1,-1\n\
         3,1,12.0000,6.0000,20.0000,10.0000,0.2500,-1,-1,-1\n\
         3,3,31.0000,21.0000,8.0000,6.0000,1.0000,-1,-1,-1\n\
         5,3,-3.0000,28.0000,8.0000,6.1235,0.5000,-1,-1,-1\n\
         7,1,15.0000,6.0000,20.0000,10.0000,0.7500,-1,-1,-1\n"
    );
}

/// Frames and pixels count from 0, and sides are those of the box, as the development kit reads them.
#[test]
fn kitti_has_the_placeholders_of_its_development_kit() {
    let line = |place: &str, occluded: i8, sides: &str, score: &str| {
        format!(
            "{place} toy_car -1 {occluded} -10 {sides} -1 -1 -1 -1000 -1000 -1000 -10 {score}\n"
        )
    };
    let expected = [
        line("0 1", -1, "10.0000 5.0000 30.0000 15.0000", "1.0000"),
        line("2 1", 1, "11.0000 5.0000 31.0000 15.0000", "0.2500"),
        line("2 3", -1, "30.0000 20.0000 38.0000 26.0000", "1.0000"),
        line("4 3", -1, "-4.0000 27.0000 4.0000 33.1235", "0.5000"),
        line("6 1", -1, "14.0000 5.0000 34.0000 15.0000", "0.7500"),
    ];
    let text_of_track = exported_text(format_named("kitti"));
    assert_eq!(text_of_track, expected.concat());
    assert!(text_of_track.lines().all(|line| line.split(' ').count() == 18));
    for text in lost_exports(format_named("kitti"), |out| text(out)) {
        let frames: Vec<&str> = text.lines().map(|line| line.split(' ').next().unwrap()).collect();
        assert_eq!(frames, ["0", "1", "4", "5"]);
    }
}

#[test]
fn coco_has_videos_tracks_and_outlines() {
    let all: Value = serde_json::from_str(&exported_text(format_named("coco"))).unwrap();
    assert_eq!(all["categories"][0]["name"], "toy car");
    assert_eq!(all["videos"][0]["name"], "film");
    let ids = |list: &str, field: &str| -> Vec<i64> {
        let values = all[list].as_array().unwrap().iter();
        values.map(|value| value[field].as_i64().unwrap()).collect()
    };
    assert_eq!(ids("tracks", "id"), [1, 3]);
    assert_eq!(ids("images", "frame_id"), [0, 2, 4, 6]);
    assert_eq!(ids("annotations", "image_id"), [1, 2, 2, 3, 4]);
    assert_eq!(ids("annotations", "track_id"), [1, 1, 3, 3, 1]);
    assert_eq!(all["annotations"][3]["attributes"]["track_id"], 3);
    assert_eq!(all["images"][1]["file_name"], "frame_000002.jpg");
    let first = &all["annotations"][0];
    assert_eq!(first["bbox"], serde_json::json!([10.0, 5.0, 20.0, 10.0]));
    assert_eq!(
        first["segmentation"],
        serde_json::json!([[10.0, 5.0, 30.0, 5.0, 30.0, 15.0, 10.0, 15.0]])
    );
    assert_eq!((&first["area"], &first["score"]), (&200.0.into(), &1.0.into()));
    let third = &all["annotations"][2];
    assert_eq!(third["area"], 48.0);
    assert!(third.get("score").is_none() && third.get("segmentation").is_none());
}

#[test]
fn cvat_marks_the_frames_without_a_target() {
    let xml = exported_text(format_named("cvat"));
    let track = |id: u64, boxes: &[(usize, u8, u8, [&str; 4])]| {
        let line = |(frame, outside, occluded, [l, t, r, b]): &(usize, u8, u8, [&str; 4])| {
            format!(
                "    <box frame=\"{frame}\" keyframe=\"1\" outside=\"{outside}\" occluded=\"{occluded}\" \
                 xtl=\"{l}\" ytl=\"{t}\" xbr=\"{r}\" ybr=\"{b}\" z_order=\"0\"></box>\n"
            )
        };
        let boxes: String = boxes.iter().map(line).collect();
        format!("  <track id=\"{id}\" label=\"toy car\" source=\"auto\">\n{boxes}  </track>\n")
    };
    let first = [
        (0, 0, 0, ["10", "5", "30", "15"]),
        (1, 1, 0, ["10", "5", "30", "15"]),
        (2, 0, 1, ["11", "5", "31", "15"]),
        (3, 1, 1, ["11", "5", "31", "15"]),
        (6, 0, 0, ["14", "5", "34", "15"]),
    ];
    let third = [
        (2, 0, 0, ["30", "20", "38", "26"]),
        (3, 1, 0, ["30", "20", "38", "26"]),
        (4, 0, 0, ["-4", "27", "4", "33.1235"]),
        (5, 1, 0, ["-4", "27", "4", "33.1235"]),
    ];
    let (_, tracks) = xml.split_once("</meta>\n").unwrap();
    assert_eq!(tracks, track(1, &first) + &track(3, &third) + "</annotations>\n");
    assert!(xml.contains("<size>7</size>") && xml.contains("<width>40</width>"));
}

/// The last frame of the clip has no frame after it in which the target could be outside.
#[test]
fn a_clip_has_the_frames_of_its_images_or_those_that_the_track_knows_of() {
    let workspace = Workspace::new();
    let images = workspace.images();
    let video = workspace.path("film.y4m");
    fs::write(&video, y4m(9)).unwrap();
    let known = |frames: usize| track().in_clip(frames);
    let cases = [
        ("images", track(), Some(images), 7),
        ("video", track(), Some(video), 9),
        ("track", known(7), None, 7),
        ("longer", known(20), None, 20),
        ("unknown", track(), None, 7),
    ];
    for (name, track, images, frames) in cases {
        let out = |format: Format| workspace.path(&format!("{name}.{}", format.name));
        for format in [format_named("cvat"), format_named("label-studio")] {
            let options = Options { images: images.clone(), ..options(format) };
            export::write(&track, &options, &out(format), false).unwrap();
        }
        let xml = text(out(format_named("cvat")));
        assert!(xml.contains(&format!("<size>{frames}</size>")), "{name}: {xml}");
        let outside = "<box frame=\"7\" keyframe=\"1\" outside=\"1\"";
        assert_eq!(xml.contains(outside), frames > 7, "{name}: {xml}");
        let tasks: Value = serde_json::from_str(&text(out(format_named("label-studio")))).unwrap();
        let value = &tasks[0]["predictions"][0]["result"][0]["value"];
        assert_eq!(value["framesCount"], frames, "{name}");
        let seconds = (frames as f64 / 30.0 * 1e4).round() / 1e4;
        assert_eq!(value["duration"], seconds, "{name}");
    }
    let out = workspace.path("short");
    let error = export::write(&known(6), &options(format_named("cvat")), &out, false).unwrap_err();
    let expected = "the track extends to frame 6, counted from 0, but the clip has 6 frames";
    assert!(error.to_string().contains(expected), "{error}");
}

/// CVAT and Label Studio cannot read a track without boxes.
#[test]
fn a_target_that_is_never_found_has_no_track() {
    let workspace = Workspace::new();
    let lost = |frame| Entry { frame, id: 2, status: Some(Status::Lost), ..track().entries()[0] };
    let entries = [track().entries(), &[lost(0), lost(1)]].concat();
    let with_lost = Track::new(entries).unwrap();
    for format in [format_named("cvat"), format_named("label-studio")] {
        let out = workspace.path(format.name);
        export::write(&with_lost, &options(format), &out, false).unwrap();
        assert_eq!(text(out), exported_text(format));
    }
}

#[test]
fn names_are_escaped() {
    let workspace = Workspace::new();
    let escaped = Options { label: "a<b> & \"c\"".into(), ..options(format_named("cvat")) };
    let xml = text(workspace.export(&escaped).unwrap().1);
    assert!(xml.contains("label=\"a&lt;b&gt; &amp; &quot;c&quot;\""));
    let workspace = Workspace::new();
    let escaped = Options { label: "a: \"b\"".into(), ..options(format_named("yolo")) };
    let yaml = text(workspace.export(&escaped).unwrap().1.join("data.yaml"));
    assert!(yaml.ends_with("names:\n  0: \"a: \\\"b\\\"\"\n"), "{yaml}");
}

/// The corners of the outline, clipped to the frame; a track without outlines is refused.
#[test]
fn rotated_boxes_of_yolo_are_the_outlines() {
    let workspace = Workspace::new();
    let error = workspace.export(&options(format_named("yolo-obb"))).unwrap_err().to_string();
    assert!(error.contains("target 1 has no outline in frame 2, which yolo-obb needs"), "{error}");
    let entry = |frame, corners, status| Entry {
        frame,
        id: 1,
        bbox: Some(BoundingBox { x: 10.0, y: 5.0, w: 20.0, h: 10.0 }),
        score: None,
        corners,
        status: Some(status),
        manual: None,
    };
    let turned = [[19.5, -4.5], [29.5, 9.5], [19.5, 14.5], [9.5, 9.5]];
    let track = Track::new(vec![
        entry(0, Some(turned), Status::Tracked),
        entry(1, None, Status::Lost),
        entry(2, Some(turned), Status::Uncertain),
    ]);
    let out = workspace.path("rotated");
    let options = with_status("yolo-obb", "tracked,uncertain");
    export::write(&track.unwrap(), &options, &out, false).unwrap();
    let line = "0 0.500000 0.000000 0.750000 0.333333 0.500000 0.500000 0.250000 0.333333\n";
    for frame in [0, 2] {
        assert_eq!(text(out.join(format!("labels/train/frame_{frame:06}.txt"))), line);
    }
    assert!(!out.join("labels/train/frame_000001.txt").exists());
    assert!(text(out.join("data.yaml")).contains("train: images/train"));
}

/// A square that stands on a corner, one that is turned by a right angle, and an upright one.
#[test]
fn rotated_boxes_of_cvat_have_the_sides_before_they_are_turned() {
    let workspace = Workspace::new();
    let error = workspace.export(&options(format_named("cvat-obb"))).unwrap_err().to_string();
    assert!(error.contains("target 1 has no outline in frame 2, which cvat-obb needs"), "{error}");
    let entry = |frame, corners, status| Entry {
        frame,
        id: 1,
        bbox: Some(BoundingBox { x: 10.0, y: 5.0, w: 20.0, h: 20.0 }),
        score: None,
        corners,
        status: Some(status),
        manual: None,
    };
    let diamond = [[19.5, 4.5], [29.5, 14.5], [19.5, 24.5], [9.5, 14.5]];
    let right = [[29.5, 4.5], [29.5, 24.5], [9.5, 24.5], [9.5, 4.5]];
    let upright = [[9.5, 4.5], [29.5, 4.5], [29.5, 24.5], [9.5, 24.5]];
    let track = Track::new(vec![
        entry(0, Some(diamond), Status::Tracked),
        entry(1, Some(right), Status::Tracked),
        entry(2, Some(upright), Status::Tracked),
        entry(3, None, Status::Lost),
    ]);
    let out = workspace.path("rotated.xml");
    export::write(&track.unwrap(), &options(format_named("cvat-obb")), &out, false).unwrap();
    let boxes = text(&out);
    let boxes: Vec<&str> = boxes.lines().filter(|line| line.contains("<box ")).collect();
    let has = |k: usize, words: &str| assert!(boxes[k].contains(words), "{words}: {}", boxes[k]);
    has(0, "xtl=\"10\" ytl=\"5\" xbr=\"30\" ybr=\"25\"");
    has(0, " rotation=\"45\"");
    has(1, "xtl=\"10\" ytl=\"5\" xbr=\"30\" ybr=\"25\"");
    has(1, " rotation=\"90\"");
    has(2, "ybr=\"25\" z_order=\"0\">");
    has(3, "frame=\"3\" keyframe=\"1\" outside=\"1\"");
}

#[test]
fn yolo_is_relative_and_clipped() {
    let workspace = Workspace::new();
    let images = workspace.images();
    let (files, out) = workspace
        .export(&Options { images: Some(images.clone()), ..options(format_named("yolo")) })
        .unwrap();
    assert_eq!(files, 1 + 2 * 4);
    assert!(text(out.join("data.yaml")).contains("train: images/train\n"));
    let label = |name: &str| text(out.join("labels/train").join(name));
    assert_eq!(label("0.txt"), "0 0.500000 0.333333 0.500000 0.333333\n");
    assert_eq!(
        label("2.txt"),
        "0 0.525000 0.333333 0.500000 0.333333\n0 0.850000 0.766667 0.200000 0.200000\n"
    );
    // The box covers -4..4 and 27..33.1, of which 0..4 and 27..30 are in the frame.
    assert_eq!(label("4.txt"), "0 0.050000 0.950000 0.100000 0.100000\n");
    assert_eq!(
        fs::read(out.join("images/train/4.png")).unwrap(),
        fs::read(images.join("4.png")).unwrap()
    );
    assert!(!out.join("images/train/3.png").exists(), "frame 3 was not tracked");
}

/// With six decimal places each, centre and length of this box would end at 1.0000005.
#[test]
fn boxes_of_yolo_end_in_the_frame_when_they_are_rounded() {
    let workspace = Workspace::new();
    let bbox = BoundingBox { x: 32.000048, y: 5.0, w: 7.999952, h: 10.0 };
    let entry = Entry { bbox: Some(bbox), ..track().entries()[0] };
    // Less than half a millionth of the frame is in it.
    let sliver = BoundingBox { x: 40.0 - 1e-6, y: 5.0, w: 7.0, h: 10.0 };
    let sliver = Entry { id: 2, bbox: Some(sliver), ..entry };
    let out = workspace.path("yolo");
    let track = Track::new(vec![entry, sliver]).unwrap();
    export::write(&track, &options(format_named("yolo")), &out, false).unwrap();
    let lines = text(out.join("labels/train/frame_000000.txt"));
    assert_eq!(lines, "0 0.900001 0.333333 0.199998 0.333333\n");
}

#[test]
fn lasot_is_read_back() {
    let workspace = Workspace::new();
    let options = Options { images: Some(workspace.images()), ..options(format_named("lasot")) };
    let out = workspace.export(&options).unwrap().1;
    let first = out.join("toy car/toy car-1");
    assert_eq!(
        text(first.join("groundtruth.txt")),
        "11.0000,6.0000,20.0000,10.0000\n12.0000,6.0000,20.0000,10.0000\n0,0,0,0\n\
         15.0000,6.0000,20.0000,10.0000\n"
    );
    assert_eq!(text(first.join("full_occlusion.txt")), "0,0,1,0\n");
    assert_eq!(text(first.join("out_of_view.txt")), "0,0,0,0\n");
    let names: Vec<_> =
        Dataset::open(&out).unwrap().sequences.into_iter().map(|s| s.name).collect();
    assert_eq!(names, ["toy car-1", "toy car-3"]);
    assert_reads_back(&out, Layout::Lasot);
}

#[test]
fn got10k_is_read_back() {
    let workspace = Workspace::new();
    let options = Options { images: Some(workspace.images()), ..options(format_named("got10k")) };
    let out = workspace.export(&options).unwrap().1;
    assert_eq!(text(out.join("list.txt")), "film_000001\nfilm_000003\n");
    let (first, third) = (out.join("film_000001"), out.join("film_000003"));
    assert_eq!(text(first.join("absence.label")), "0\n0\n1\n0\n");
    assert_eq!(text(first.join("cover.label")), "8\n2\n0\n6\n");
    assert_eq!(text(third.join("cut_by_image.label")), "0\n1\n");
    assert!(
        text(first.join("meta_info.ini")).contains("object_class: toy car\nresolution: (40, 30)")
    );
    // The first image is a JPEG and is copied; the others are converted.
    let (one, four) = (first.join("00000001.jpg"), first.join("00000004.jpg"));
    assert_eq!(fs::read(one).unwrap(), fs::read(workspace.path("frames/0.jpg")).unwrap());
    let red = image::open(four).unwrap().to_rgb8().get_pixel(20, 15)[0];
    assert!(red.abs_diff(180) < 4, "{red}");
    assert_reads_back(&out, Layout::Got10k);
}

/// Checks that our own reader finds two sequences with frames, the first with the boxes of
/// target 1.
fn assert_reads_back(out: &Path, layout: Layout) {
    let dataset = Dataset::open(out).unwrap();
    assert_eq!((dataset.layout, dataset.sequences.len()), (layout, 2));
    let first = &dataset.sequences[0];
    let x: Vec<_> = first.truth.iter().map(|bbox| bbox.map(|bbox| bbox.x)).collect();
    assert_eq!(x, [Some(10.0), Some(11.0), None, Some(14.0)]);
    assert_eq!(first.frames.len(), 4);
    assert_eq!(dataset.sequences[1].frames.len(), 2);
}

pub fn choosing(selection: Selection, options: &Options) -> Options {
    Options { selection, ..options.clone() }
}

#[test]
fn inconsistent_options_are_errors_and_nothing_is_written() {
    let workspace = Workspace::new();
    let images = workspace.images();
    let short = workspace.path("short");
    fs::create_dir(&short).unwrap();
    fs::copy(images.join("0.jpg"), short.join("0.jpg")).unwrap();
    let coco = options(format_named("coco"));
    let rejected = [
        (Options { size: None, ..coco.clone() }, "coco needs the frame size"),
        (Options { size: Some((0, 30)), ..coco.clone() }, "the size is 0 x 30"),
        (
            Options { size: Some((41, 30)), images: Some(images), ..coco.clone() },
            "the size as given is 41 x 30, but of the images it is 40 x 30",
        ),
        (
            Options { images: Some(short), ..coco.clone() },
            "extends to frame 6, counted from 0, but",
        ),
        (
            Options { images: Some(workspace.path("no")), ..coco.clone() },
            "is neither a folder of images nor a video",
        ),
        (
            Options { key_frames: KeyFrames::Every(0), ..options(format_named("cvat")) },
            "every 0th frame",
        ),
        (
            Options { key_frames: KeyFrames::Overlap(1.0), ..options(format_named("cvat")) },
            "the least overlap of key frames is 1; it must be above 0 and below 1",
        ),
        (
            Options { key_frames: KeyFrames::Every(9), ..coco.clone() },
            "coco has no key frames; cvat, cvat-obb, label-studio have",
        ),
        (choosing(Selection { every: 0, ..Selection::default() }, &coco), "every 0th frame"),
        (
            choosing(Selection { min_score: Some(2.0), ..Selection::default() }, &coco),
            "the least score is 2; allowed: 0 to 1",
        ),
        (
            choosing(Selection { min_score: Some(f64::NAN), ..Selection::default() }, &coco),
            "the least score is NaN",
        ),
        (
            choosing(Selection { status: Some(vec![]), ..Selection::default() }, &coco),
            "no status is given; allowed: tracked, uncertain, lost",
        ),
        (with_status("yolo", "tracked,lost"), "yolo cannot mark lost targets"),
        (
            choosing(
                Selection { every: 5, ..Selection::default() },
                &options(format_named("cvat")),
            ),
            "cvat cannot have every 5th frame",
        ),
        (
            Options { images: Some(workspace.path("x")), ..options(format_named("mot")) },
            "does not use images",
        ),
        (Options { label: "a/b".into(), ..coco.clone() }, "the label is \"a/b\""),
        (Options { name: "..".into(), ..coco }, "the name is \"..\""),
    ];
    for (options, message) in rejected {
        let error = workspace.export(&options).unwrap_err();
        assert!(error.contains(message), "{error}");
        assert_eq!(fs::read_dir(workspace.folder.path()).unwrap().count(), 2, "{message}");
    }
    assert!(
        Format::named("vot")
            .unwrap_err()
            .to_string()
            .contains("mot, kitti, coco, cvat, cvat-obb, yolo, yolo-obb, voc")
    );
}

#[test]
fn a_size_that_is_not_needed_is_ignored() {
    let workspace = Workspace::new();
    let (_, out) =
        workspace.export(&Options { size: Some((4, 3)), ..options(format_named("mot")) }).unwrap();
    assert_eq!(text(out), exported_text(format_named("mot")));
}

/// A target that moves by a pixel per frame from 0 to 30, is half hidden in 12 to 14, and is lost
/// in 21 to 24.
fn long_track() -> Track {
    let entry = |frame: usize| {
        let bbox = BoundingBox { x: frame as f64, y: 5.0, w: 4.0, h: 3.0 };
        let hidden = (12..=14).contains(&frame);
        let lost = (21..=24).contains(&frame);
        let status = if lost { Status::Lost } else { Status::Tracked };
        let score = Some(if hidden { 0.25 } else { 1.0 });
        Entry {
            frame,
            id: 1,
            bbox: Some(bbox),
            score,
            corners: None,
            status: Some(status),
            manual: None,
        }
    };
    Track::new((0..=30).map(entry).collect()).unwrap()
}

#[test]
fn key_frames_are_sparse_and_keep_every_change() {
    let workspace = Workspace::new();
    let out = workspace.path("a.xml");
    let sparse = Options { key_frames: KeyFrames::Every(10), ..options(format_named("cvat")) };
    export::write(&long_track(), &sparse, &out, false).unwrap();
    let written = text(&out);
    let value = |line: &str, name: &str| -> usize {
        let (_, rest) = line.split_once(&format!(" {name}=\"")).unwrap();
        rest.split('"').next().unwrap().parse().unwrap()
    };
    let boxes: Vec<[usize; 3]> = written
        .lines()
        .filter(|line| line.contains("<box "))
        .map(|line| ["frame", "outside", "occluded"].map(|name| value(line, name)))
        .collect();
    let expected = [
        [0, 0, 0],
        [10, 0, 0],
        [12, 0, 1],
        [15, 0, 0],
        [20, 0, 0],
        [21, 1, 0],
        [25, 0, 0],
        [30, 0, 0],
    ];
    assert_eq!(boxes, expected);
}

#[test]
fn label_studio_has_percent_and_stretches() {
    let workspace = Workspace::new();
    let out = workspace.path("a.json");
    let sparse =
        Options { key_frames: KeyFrames::Every(10), ..options(format_named("label-studio")) };
    export::write(&long_track(), &sparse, &out, false).unwrap();
    let tasks: Value = serde_json::from_str(&text(&out)).unwrap();
    assert_eq!(tasks[0]["data"]["video"], "film");
    let region = &tasks[0]["predictions"][0]["result"][0];
    assert_eq!(
        (&region["type"], &region["value"]["labels"][0]),
        (&"videorectangle".into(), &"toy car".into())
    );
    assert_eq!(region["value"]["framesCount"], 31);
    // Without times in the track, 30 frames per second.
    assert_eq!(region["value"]["duration"], 1.0333);
    let keys = region["value"]["sequence"].as_array().unwrap();
    let frames: Vec<(u64, bool)> = keys
        .iter()
        .map(|key| (key["frame"].as_u64().unwrap(), key["enabled"].as_bool().unwrap()))
        .collect();
    assert_eq!(frames, [(1, true), (11, true), (21, false), (26, true), (31, false)]);
    let [x, y, w, h, time] =
        ["x", "y", "width", "height", "time"].map(|name| keys[1][name].as_f64().unwrap());
    assert_eq!([x, y, w, h, time], [25.0, 16.6667, 10.0, 10.0, 0.3333]);
}

#[test]
fn label_studio_has_the_times_of_the_table() {
    let workspace = Workspace::new();
    let (table, out) = (workspace.path("a.csv"), workspace.path("a.json"));
    fs::write(&table, "frame,x,y,w,h,time\n0,1,2,3,4,0\n1,1,2,3,4,0.05\n2,1,2,3,4,0.2\n").unwrap();
    export::write(
        &Track::read(&table).unwrap(),
        &options(format_named("label-studio")),
        &out,
        false,
    )
    .unwrap();
    let tasks: Value = serde_json::from_str(&text(&out)).unwrap();
    let value = &tasks[0]["predictions"][0]["result"][0]["value"];
    let keys = value["sequence"].as_array().unwrap();
    let times: Vec<f64> = keys.iter().map(|key| key["time"].as_f64().unwrap()).collect();
    assert_eq!((times, &value["duration"]), (vec![0.0, 0.05, 0.2], &0.3.into()));
}

/// The tool takes all frames to be of one length, and shows at a time the frame of that number.
#[test]
fn boxes_of_frames_of_different_lengths_are_where_label_studio_shows_them() {
    let workspace = Workspace::new();
    let written = |times: &[f64]| {
        let rows = times.iter().enumerate().map(|(k, time)| format!("{k},{k},2,3,4,{time}\n"));
        let table = workspace.path("a.csv");
        fs::write(&table, format!("frame,x,y,w,h,time\n{}", rows.collect::<String>())).unwrap();
        let (track, out) = (Track::read(&table).unwrap(), workspace.path("a.json"));
        let options = options(format_named("label-studio"));
        let written = export::write(&track, &options, &out, true).unwrap();
        let tasks: Value = serde_json::from_str(&text(&out)).unwrap();
        let value = &tasks[0]["predictions"][0]["result"][0]["value"];
        let keys = value["sequence"].as_array().unwrap().iter();
        let key = |key: &Value| (key["frame"].as_u64().unwrap(), key["time"].as_f64().unwrap());
        (keys.map(key).collect::<Vec<_>>(), written.remarks())
    };
    let (keys, notes) = written(&[0.0, 0.04, 0.08, 0.12]);
    assert_eq!(keys, [(1, 0.0), (2, 0.04), (3, 0.08), (4, 0.12)]);
    assert_eq!(notes, ["give the Video of the project framerate=\"25\""]);
    // Five frames in half a second, at ten per second in the mean; the second one is long.
    let (keys, notes) = written(&[0.0, 0.01, 0.31, 0.4, 0.405, 0.5]);
    assert_eq!(keys, [(1, 0.01), (4, 0.31), (5, 0.405), (6, 0.5)]);
    let note = "the frames of this clip differ in length, so a box is in the frame that is shown at its \
                time; give the Video of the project framerate=\"10\"";
    assert_eq!(notes, [note]);
    let (_, notes) = written(&[0.0]);
    assert!(notes.is_empty());
}

#[test]
fn voc_counts_from_one_and_clips() {
    let workspace = Workspace::new();
    let images = workspace.images();
    let (files, out) = workspace
        .export(&Options { images: Some(images), ..options(format_named("voc")) })
        .unwrap();
    assert_eq!(files, 2 + 2 * 4);
    assert_eq!(text(out.join("ImageSets/Main/trainval.txt")), "0\n2\n4\n6\n");
    assert_eq!(text(out.join("labelmap.txt")), "# label:color_rgb:parts:actions\ntoy car:::\n");
    let first = text(out.join("Annotations/0.xml"));
    for part in [
        "<filename>0.jpg</filename>",
        "<width>40</width>\n    <height>30</height>",
        "<name>toy car</name>",
        "<xmin>11</xmin>\n      <ymin>6</ymin>\n      <xmax>30</xmax>\n      <ymax>15</ymax>",
        "<truncated>0</truncated>\n    <occluded>0</occluded>",
    ] {
        assert!(first.contains(part), "{part}: {first}");
    }
    let second = text(out.join("Annotations/2.xml"));
    assert_eq!(second.matches("<object>").count(), 2);
    assert!(second.contains("<occluded>1</occluded>"));
    // The box covers -4..4 and 27..33.1 of a frame of 40 x 30.
    let third = text(out.join("Annotations/4.xml"));
    let sides =
        "<xmin>1</xmin>\n      <ymin>28</ymin>\n      <xmax>4</xmax>\n      <ymax>30</ymax>";
    assert!(third.contains(sides) && third.contains("<truncated>1</truncated>"), "{third}");
    assert!(image::open(out.join("JPEGImages/6.jpg")).is_ok());
    for names in
        lost_exports(format_named("voc"), |out| text(out.join("ImageSets/Main/trainval.txt")))
    {
        assert_eq!(names, [0, 1, 5].map(|k| format!("frame_{k:06}\n")).concat());
    }
}

/// A video of up to 9 frames of 40 x 30 pixels, each brighter than the one before.
fn y4m(frames: u8) -> Vec<u8> {
    let mut bytes = b"YUV4MPEG2 W40 H30 F25:1 Ip A1:1 C420jpeg\n".to_vec();
    for k in 0..frames {
        bytes.extend(b"FRAME\n");
        bytes.extend(vec![30 * k; 40 * 30]);
        bytes.extend(vec![128; 2 * 20 * 15]);
    }
    bytes
}

#[test]
fn frames_of_a_video_are_saved_as_images() {
    let workspace = Workspace::new();
    let video = workspace.path("film.y4m");
    let bytes = y4m(7);
    fs::write(&video, &bytes).unwrap();
    let with_video =
        |format| Options { size: None, images: Some(video.clone()), ..options(format) };
    for (format, image) in [
        (format_named("yolo"), "images/train/frame_000004.jpg"),
        (format_named("voc"), "JPEGImages/frame_000004.jpg"),
        // The fourth frame of target 1 is frame 6; the frames of target 3, which come later, begin
        // before it.
        (format_named("got10k"), "film_000003/00000002.jpg"),
        (format_named("lasot"), "toy car/toy car-3/img/00000002.jpg"),
    ] {
        let out = workspace.path(format.name);
        export::write(&track(), &with_video(format), &out, false).unwrap();
        let red = image::open(out.join(image)).unwrap().to_rgb8().get_pixel(20, 15)[0];
        assert!(red.abs_diff(120) < 6, "{}: {red}", format.name);
    }
    fs::write(&video, &bytes[..bytes.len() - 1900]).unwrap();
    let out = workspace.path("short");
    let error =
        export::write(&track(), &with_video(format_named("yolo")), &out, false).unwrap_err();
    assert!(error.to_string().contains("frame 6"), "{error}");
    assert!(!out.exists());
}

#[test]
fn existing_files_are_kept() {
    let workspace = Workspace::new();
    let (_, out) = workspace.export(&options(format_named("mot"))).unwrap();
    assert!(
        workspace.export(&options(format_named("mot"))).unwrap_err().contains("exists already")
    );
    assert!(workspace.export(&options(format_named("lasot"))).unwrap_err().contains("is a file"));
    fs::write(&out, "old").unwrap();
    export::write(&track(), &options(format_named("mot")), &out, true).unwrap();
    assert!(text(&out).starts_with("1,1,11.0000"));

    let folder = workspace.path("folder");
    fs::create_dir(&folder).unwrap();
    let lasot = options(format_named("lasot"));
    export::write(&track(), &lasot, &folder, false).unwrap();
    let again = export::write(&track(), &lasot, &folder, true).unwrap_err().to_string();
    assert!(again.contains("never replaced"), "{again}");
    let nowhere = workspace.path("no/out");
    assert!(export::write(&track(), &lasot, &nowhere, true).is_err());
    // No temporary files are left beside the two results.
    assert_eq!(fs::read_dir(workspace.folder.path()).unwrap().count(), 2);
}

/// A target has two entries, and each begins a frame after the one before it and ends a frame
/// earlier.
fn nested(targets: usize) -> Track {
    let entry = |frame, id| Entry {
        frame,
        id: id as u64,
        bbox: Some(BoundingBox { x: 1.0, y: 2.0, w: 3.0, h: 4.0 }),
        score: None,
        corners: None,
        status: None,
        manual: None,
    };
    let both = |id| [entry(id, id), entry(2 * targets - 1 - id, id)];
    Track::new((0..targets).flat_map(both).collect()).unwrap()
}

#[test]
fn a_short_track_does_not_become_a_huge_folder() {
    for format in [format_named("lasot"), format_named("got10k")] {
        let workspace = Workspace::new();
        let out = workspace.path("out");
        let error = export::write(&nested(5000), &options(format), &out, false).unwrap_err();
        let error = error.to_string();
        assert!(error.contains("25005000 for this track of 5000 targets"), "{error}");
        assert!(error.contains("at most 5000000 are written"), "{error}");
        assert!(!out.exists());
        export::write(&nested(20), &options(format), &out, false).unwrap();
    }
}

/// A track of targets with a label and an attribute of their own.
fn distinct_targets(count: u64) -> Track {
    let entry = |id: u64| Entry {
        frame: id as usize % 10,
        id,
        bbox: Some(BoundingBox { x: 1.0, y: 2.0, w: 3.0, h: 4.0 }),
        score: None,
        corners: None,
        status: None,
        manual: None,
    };
    let metadata = |id: u64| {
        let attributes = [(format!("a{id}"), "b".to_owned())].into();
        let label = format!("label {id}");
        (id, TargetMetadata { label, attributes, ..TargetMetadata::default() })
    };
    let track = Track::new((0..count).map(entry).collect()).unwrap();
    track.with_targets((0..count).map(metadata).collect())
}

/// Ten times the targets take some ten times as long, and a hundred times if a format looks at all
/// entries for each target, or at all labels. What other programs do meanwhile may hide that, so it is
/// tried again.
#[test]
fn the_time_of_an_export_follows_the_number_of_targets() {
    let [few, many] = [5_000, 50_000].map(distinct_targets);
    for name in ["mot", "coco", "cvat", "yolo", "voc", "label-studio"] {
        let seconds = |track: &Track| {
            let (workspace, begun) = (Workspace::new(), std::time::Instant::now());
            let options = options(format_named(name));
            export::write(track, &options, &workspace.path("out"), false).unwrap();
            let seconds = begun.elapsed().as_secs_f64();
            assert!(seconds < 60.0, "{name} took {seconds} s");
            seconds
        };
        let factors = || (0..4).map(|_| seconds(&many) / seconds(&few));
        assert!(factors().any(|factor| factor < 30.0), "{name}");
    }
}

#[test]
fn file_names_with_control_characters_make_valid_xml() {
    let workspace = Workspace::new();
    let frames = workspace.path("frames");
    fs::create_dir(&frames).unwrap();
    for k in 0..7 {
        let name = format!("<&\u{1b}[31m\n\u{7}{k}.jpg");
        RgbImage::new(40, 30).save(frames.join(name)).unwrap();
    }
    let (_, out) = workspace
        .export(&Options { images: Some(frames), ..options(format_named("voc")) })
        .unwrap();
    let annotations = fs::read_dir(out.join("Annotations")).unwrap();
    let mut count = 0;
    for file in annotations {
        let xml = fs::read_to_string(file.unwrap().path()).unwrap();
        let name = xml.split(['<', '>']).skip_while(|tag| *tag != "filename").nth(1).unwrap();
        assert!(name.starts_with("&lt;&amp;\u{fffd}[31m&#10;\u{fffd}"), "{name:?}");
        count += 1;
    }
    assert_eq!(count, 4);
}
