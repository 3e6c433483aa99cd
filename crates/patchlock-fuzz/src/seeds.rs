//! Inputs to begin with, made by the writers of the program.

use std::fs;
use std::io::Cursor;
use std::iter;

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use image::{DynamicImage, ImageFormat};
use patchlock::{BoundingBox, Frame, MultiTracker, Preset, Status, Tracker, TrackerConfig};
use patchlock_media::{FrameRate, Limits, Mp4Writer};
use patchlock_studio::project::{Edit, Store};
use patchlock_track::export::{self, Entry, Format, Track};
use serde::Serialize;
use serde_json::{Value, json};

use crate::library::{pattern, quick};
use crate::scratch::Scratch;
use crate::{MADE_UP, SEPARATOR};

/// The seeds of a surface; none for a name that is not one.
pub fn seeds(surface: &str) -> Vec<Vec<u8>> {
    match surface {
        "mp4" => with_choices(&[0, 1], &videos()),
        "h264" => with_choices(&[0, 1, 2], &videos().map(|file| stream(&file))),
        "y4m" => with_choices(&[0, 1, 2, 3], &y4m()),
        "images" => images(),
        "truth" => truth(),
        "results" => results(),
        "boxes" => boxes(),
        "tracks" => tracks(),
        "imports" => [imports(), deep(&[0, 2, 3])].concat(),
        "settings" => [settings(), deep(&[0, 3])].concat(),
        "snapshot_robust" => snapshots(Preset::Robust, false),
        "snapshot_paper" => snapshots(Preset::Paper, false),
        "snapshot_network" => snapshots(Preset::Network, false),
        "snapshot_packed" => {
            Preset::ALL.into_iter().flat_map(|preset| snapshots(preset, true)).collect()
        }
        "model" => models(),
        "trax" => trax(),
        "project" => projects(),
        "labels" => labels(),
        "server" => requests(),
        "library" | "folder" => plans(),
        _ => Vec::new(),
    }
}

/// Texts that are nested deeply, once with each of these first bytes.
fn deep(choices: &[u8]) -> Vec<Vec<u8>> {
    let texts = [
        "[".repeat(4000),
        "{\"a\":".repeat(4000),
        format!("a = {}", "[".repeat(4000)),
        format!("[{}a]", "a.".repeat(4000)),
        "<annotations>".to_owned() + &"<a>".repeat(4000),
    ];
    with_choices(choices, &texts)
}

/// Each input once with each of these first bytes.
fn with_choices(choices: &[u8], inputs: &[impl AsRef<[u8]>]) -> Vec<Vec<u8>> {
    let mut all = Vec::new();
    for input in inputs {
        all.extend(choices.iter().map(|choice| [&[*choice], input.as_ref()].concat()));
    }
    all
}

/// The input with a first byte, and parts that are divided by separators.
fn joined(choice: Option<u8>, parts: &[&str]) -> Vec<u8> {
    let parts: Vec<&[u8]> = parts.iter().map(|part| part.as_bytes()).collect();
    [choice.as_slice(), &parts.join(&SEPARATOR)].concat()
}

fn rgb(width: usize, height: usize, variant: u8) -> Vec<u8> {
    pattern(width, height, variant).iter().flat_map(|v| [*v, v / 2, 255 - v]).collect()
}

/// A small image of 24 bits per pixel; the width must be a multiple of 4.
pub fn bmp(width: usize, height: usize, variant: usize) -> Vec<u8> {
    encoded(ImageFormat::Bmp, &of_rgb(width, height, variant as u8))
}

fn of_rgb(width: usize, height: usize, variant: u8) -> DynamicImage {
    let pixels = rgb(width, height, variant);
    let image = image::RgbImage::from_raw(width as u32, height as u32, pixels);
    image.expect("has the right length").into()
}

pub(crate) fn encoded(format: ImageFormat, image: &DynamicImage) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    image.write_to(&mut out, format).expect("can be encoded");
    out.into_inner()
}

fn images() -> Vec<Vec<u8>> {
    use ImageFormat::{Bmp, Jpeg, Png, Tiff, WebP};
    let colour = of_rgb(12, 8, 3);
    let grey = DynamicImage::from(colour.to_luma8());
    let deep = DynamicImage::from(colour.to_luma16());
    let of = |image: &DynamicImage, formats: &[ImageFormat]| -> Vec<Vec<u8>> {
        formats.iter().map(|format| encoded(*format, image)).collect()
    };
    [
        of(&colour, &[Bmp, Jpeg, Png, Tiff, WebP]),
        of(&grey, &[Bmp, Jpeg, Png, Tiff]),
        of(&deep, &[Png, Tiff]),
    ]
    .concat()
}

fn videos() -> [Vec<u8>; 4] {
    let video = |width: usize, height: usize, frames: usize, expected: Option<usize>| {
        let rate = FrameRate { frames: 25, seconds: 1 };
        let out = Cursor::new(Vec::new());
        let writer = Mp4Writer::with_quantiser(out, width, height, rate, expected, 40);
        let mut writer = writer.expect("begins");
        for k in 0..frames {
            writer.push(&rgb(width, height, k as u8 * 3)).expect("encodes");
        }
        writer.finish().expect("completes").into_inner()
    };
    let bframes = include_bytes!("../../patchlock-media/tests/data/bframes.mp4");
    [video(32, 32, 3, None), video(64, 48, 5, Some(5)), video(50, 30, 1, None), bframes.to_vec()]
}

/// The units of an MP4 of ours, each after a start code.
fn stream(file: &[u8]) -> Vec<u8> {
    let find = |kind: &[u8]| file.windows(4).position(|four| four == kind).map(|at| at + 4);
    let mut out = Vec::new();
    let mut unit = |unit: &[u8]| out.extend([&[0, 0, 1], unit].concat());
    if let Some(mut at) = find(b"avcC").map(|at| at + 5) {
        for mask in [31, 255] {
            let count = file[at] & mask;
            at += 1;
            for _ in 0..count {
                let length = usize::from(u16::from_be_bytes([file[at], file[at + 1]]));
                unit(&file[at + 2..at + 2 + length]);
                at += 2 + length;
            }
        }
    }
    let mut rest = find(b"mdat").map_or(&[][..], |at| &file[at..]);
    while let Some((length, data)) = rest.split_first_chunk::<4>() {
        let length = u32::from_be_bytes(*length) as usize;
        // Behind the last unit is another box.
        if length == 0 || length > data.len() || data.starts_with(b"moov") {
            break;
        }
        unit(&data[..length]);
        rest = &data[length..];
    }
    out
}

fn y4m() -> [Vec<u8>; 6] {
    let file = |format: &str, bytes: usize| {
        let frame = |k: u8| [b"FRAME\n".to_vec(), pattern(bytes, 1, k)].concat();
        let header = format!(" W16 H8 F25:1 Ip A1:1 {format} XCOLORRANGE=FULL\n");
        [header.into_bytes(), frame(1), frame(5)].concat()
    };
    let formats =
        [("C420jpeg", 192), ("C422", 256), ("C444", 384), ("C411", 192), ("Cmono", 128), ("", 192)];
    formats.map(|(format, bytes)| file(format, bytes))
}

const TRUTH: &str = "10,5,30,20\n11,6,30,20\n12.5,7.25,30,20\nNaN,NaN,NaN,NaN\n14,9,31,21\n";
const POLYGONS: &str = "10,5,40,5,40,25,10,25\n11,6,41,6,41,26,11,26\n";

fn truth() -> Vec<Vec<u8>> {
    let attributes = "sequence,OCC,SV\nX,1,0\n";
    let wide: Vec<u8> = TRUTH.encode_utf16().flat_map(u16::to_le_bytes).collect();
    vec![
        joined(Some(0), &[TRUTH, "", attributes]),
        joined(Some(1), &[TRUTH, "", "0\n0\n1\n0\n0\n"]),
        joined(Some(2), &[TRUTH, "", "0,0,1,0,0", "0,0,0,0,1"]),
        joined(Some(3), &[TRUTH, ""]),
        joined(Some(4), &[POLYGONS, ""]),
        joined(Some(5), &["10,5,30,20\n", "", ""]),
        joined(Some(6), &[TRUTH, "10\t5\t30\t20\r\n11 6 30 20\r\n", attributes]),
        [vec![0xff, 0xfe], wide].concat(),
    ]
}

fn results() -> Vec<Vec<u8>> {
    let boxes: String = (0..12).map(|k| format!("{},{},30,20\n", 11 + k, 5 + k)).collect();
    let mot: String = (1..9).map(|k| format!("{k},1,{},5,30,20,0.9,-1,-1,-1\n", 10 + k)).collect();
    let times = "0.01\n".repeat(12);
    let codes = format!("1\n{POLYGONS}0\n2\n1\n11,6,41,6,41,26,11,26\n");
    let subject = json!({ "kind": "trax", "command": ["other"] });
    let manifest = json!({
        "format": 1, "tracker": "A", "configuration_hash": "c", "subject": subject,
    });
    let run = |protocol: &str| {
        json!({
            "tracker": "A", "configuration_hash": "c", "subject": subject, "protocol": protocol,
            "target": "X", "seed": 0, "variant": 0, "first": 0,
            "given": { "x": 9.0, "y": 4.0, "w": 30.0, "h": 20.0 }, "frames": 12,
            "first_frame": "0001.png", "origin": 1.0,
            "machine": { "os": "linux", "architecture": "x86_64", "processor": "p", "cores": 2 },
            "threads": 1, "jobs": 1, "boxes_sha256": "HASH", "seconds": vec![0.01; 12],
            "score": vec![0.5; 12], "status": vec!["tracked"; 12],
        })
        .to_string()
    };
    let manifest = manifest.to_string();
    vec![
        joined(Some(0), &[&boxes, &times, &mot]),
        joined(Some(0), &[&mot, "", &boxes]),
        joined(Some(1), &[&boxes, &boxes, &times]),
        joined(Some(2), &[&codes, &codes]),
        joined(Some(3), &[&manifest, &run("ope"), &boxes]),
        joined(Some(4), &[&manifest, &run("tre"), &boxes]),
    ]
}

fn boxes() -> Vec<Vec<u8>> {
    let table = "frame,id,x,y,w,h,note\n0,1,1,2,8,6,a\n4,2,5.5,5,4,4,\n4,1,,,,,\n9,2,3,3,5,5,b\n";
    vec![joined(Some(0), &[table]), joined(Some(1), &[TRUTH]), joined(Some(1), &["11 21 30 40"])]
}

/// A track of two targets, one of which is lost for a while.
fn track() -> Track {
    let entry = |k: usize, id: u64| Entry {
        frame: k,
        id,
        bbox: (k != 5).then_some(BoundingBox { x: 10.5 + k as f64, y: 7.0, w: 32.25, h: 20.0 }),
        score: Some(1.0 - k as f64 / 16.0),
        corners: (id == 2).then_some([[10.0, 6.5], [42.0, 6.5], [42.0, 26.5], [10.0, 26.5]]),
        status: Some(if k == 6 { Status::Lost } else { Status::Tracked }),
        ..Entry::default()
    };
    let entries = (0..8).flat_map(|k| [entry(k, 1), entry(k, 2)]).collect();
    Track::new(entries).expect("is valid").sized(640, 480)
}

fn tracks() -> Vec<Vec<u8>> {
    let columns = "frame,id,x,y,w,h,score,x1,y1,x2,y2,x3,y3,x4,y4,status,frame_w,frame_h\n";
    let row = |k: usize| {
        let corners = "9.5,4.5,39.5,4.5,39.5,24.5,9.5,24.5";
        format!("{k},1,{},5,30,20,0.75,{corners},tracked,640,480\n", 10 + k)
    };
    let csv = format!("{columns}{}{}2,1,,,,,,,,,,,,,,lost,640,480\n", row(0), row(1));
    let line = |k: usize| {
        let row = json!({
            "frame": k, "id": 1, "x": 10 + k, "y": 5, "w": 30, "h": 20, "score": 0.75,
            "status": "uncertain", "frame_w": 640, "frame_h": 480,
        });
        format!("{row}\n")
    };
    vec![
        joined(Some(0), &[&csv]),
        joined(Some(9), &["frame,x,y,w,h\n0,1,2,30,40\n1,2,2,30,40\n5,3,2,30,40\n"]),
        joined(Some(1), &[&format!("{}{}", line(0), line(3))]),
        joined(Some(2), &[TRUTH]),
    ]
}

fn imports() -> Vec<Vec<u8>> {
    let scratch = Scratch::new();
    let written = |format: &str| {
        let format = Format::named(format, false).expect("is known");
        let options = export::Options {
            label: "car".to_owned(),
            size: Some((640, 480)),
            ..export::Options::new(format, "clip")
        };
        let out = scratch.folder().join(format.name);
        export::write(&track(), &options, &out, false).expect("can be written");
        fs::read_to_string(out).expect("is text")
    };
    let own = "frame,id,label,x,y,w,h,score,status,key,occluded,truncated,hidden,visible,agreement,\
               frame_w,frame_h\n0,1,car,10,5,30,20,,,true,false,true,false,,,640,480\n\
               1,1,car,11,5,30,20,0.5,tracked,false,false,false,false,0.5,0.75,640,480\n\
               2,1,car,,,,,,,false,false,false,true,,,640,480\n";
    let lines = r#"{"frame":0,"x":1,"y":2,"w":30,"h":40}"#.to_owned() + "\n";
    let results = r#"[{"image_id":"0003","category_id":3,"bbox":[1,2,30,40],"score":0.75},"#
        .to_owned()
        + r#"{"image_id":4,"category_id":1,"bbox":[5,6,30,40],"score":1}]"#;
    let truth = "1,1,10,5,30,20,1,2,0.5\n2,1,11,5,30,20,1,2,0.5\n1,2,50,60,30,20,0,1,1\n";
    vec![
        joined(Some(0), &[own]),
        joined(Some(0), &[&lines]),
        joined(Some(1), &[&written("mot")]),
        joined(Some(1), &[truth]),
        joined(Some(2), &[&written("cvat")]),
        joined(Some(3), &[&written("coco")]),
        joined(Some(3), &[&results]),
    ]
}

fn settings() -> Vec<Vec<u8>> {
    let mut all = Vec::new();
    for (k, preset) in (0..).zip(Preset::ALL) {
        let config = TrackerConfig::from(preset);
        let text = toml::to_string(&config).expect("can be written");
        all.push(joined(Some(4 * k), &[&text]));
        all.push(joined(Some(4 * k + 1), &["search=7\nseed = 3\nrobust.rotate=false"]));
        let text = serde_json::to_string(&config).expect("can be written");
        all.push(joined(Some(4 * k + 3), &[&text]));
    }
    all.push(joined(Some(8), &["particles = 300\nepsilon = 0.1\n"]));
    all.push(joined(Some(8), &["[paper]\nbeta = 1\n[paper.patches]\natoms = 3\n"]));
    all.push(joined(Some(2), &["seed = 4\n", "scale_count=9\nsure=0.5"]));
    all.push(joined(Some(9), &["particles=5\ngamma=none\nsubtract_mean=true"]));
    all
}

/// Few scales and particles, and few small patches.
const SMALL: &[(&str, &str, f64)] = &[
    ("robust", "patch", 32.0),
    ("robust", "scale_count", 5.0),
    ("paper", "particles", 20.0),
    ("patches", "template_side", 8.0),
    ("patches", "templates", 3.0),
    ("patches", "large_patch", 4.0),
    ("patches", "small_patch", 4.0),
    ("patches", "small_step", 4.0),
    ("patches", "update_interval", 2.0),
    ("patches", "small_update_interval", 3.0),
    ("patches", "buffer", 2.0),
    ("patches", "subspace_vectors", 3.0),
];

/// A tracker of a preset, with [`SMALL`] settings, after a few updates on frames of 40 x 32 pixels.
fn tracker(preset: Preset, updates: u8) -> Tracker {
    let config = quick(preset, SMALL);
    let pixels = |k: u8| pattern(40, 32, k + 3);
    let first = pixels(0);
    let frame = Frame::grey8(&first, 40, 32).expect("is a frame");
    let mut tracker = Tracker::start(config, &frame, TARGET).expect("begins");
    for k in 1..=updates {
        let pixels = pixels(k);
        let frame = Frame::grey8(&pixels, 40, 32).expect("is a frame");
        tracker.update(&frame).expect("tracks");
    }
    tracker
}

const TARGET: BoundingBox = BoundingBox { x: 4.0, y: 2.0, w: 14.0, h: 11.0 };

/// A snapshot as text, or packed as bytes.
fn saved(snapshot: &impl Serialize, packed: bool) -> Vec<u8> {
    if packed {
        return rmp_serde::to_vec_named(snapshot).expect("a snapshot can be written");
    }
    // Not by `serde_json::Value`, which has no whole numbers of 128 bits.
    serde_json::to_vec(snapshot).expect("a snapshot can be written")
}

/// Snapshots of one target and of several, packed or not.
fn snapshots(preset: Preset, packed: bool) -> Vec<Vec<u8>> {
    let one = |tracker: &Tracker| saved(&tracker.snapshot(), packed);
    let many = |tracker: &MultiTracker| saved(&tracker.snapshot(), packed);
    let (begun, after_four) = (tracker(preset, 0), tracker(preset, 4));
    let mut several = MultiTracker::new(begun.config().clone()).expect("is valid");
    let none = many(&several);
    let pixels = pattern(40, 32, 3);
    let frame = Frame::grey8(&pixels, 40, 32).expect("is a frame");
    several.add(&frame, TARGET).expect("begins");
    vec![one(&after_four), one(&begun), many(&several), none]
}

/// The made-up files, and changes of them.
fn models() -> Vec<Vec<u8>> {
    let mut draws = fastrand::Rng::with_seed(12);
    let mut all: Vec<Vec<u8>> = (0..).zip(MADE_UP).map(|(k, file)| [&[k], file].concat()).collect();
    for k in 0..30 {
        let length = 6 * (1 + draws.usize(..3));
        let edits: Vec<u8> = (0..length).map(|_| draws.u8(..)).collect();
        all.push([&[3 + k % 3], &edits[..]].concat());
    }
    all
}

fn trax() -> Vec<Vec<u8>> {
    let pixels = |k: u8| BASE64_STANDARD.encode(pattern(32, 24, k));
    let memory = |k: u8| format!("\"image:32;24;gray8;{}\"", pixels(k));
    let file = BASE64_STANDARD.encode(encoded(ImageFormat::Png, &of_rgb(32, 24, 4)));
    let three = format!(
        "@@TRAX:initialize {} \"4,3,10,8\" \"a=b c\"\n@@TRAX:frame {}\n\
         @@TRAX:frame \"data:image/png;{file}\"\n\
         @@TRAX:quit\n",
        memory(3),
        memory(4)
    );
    let four = format!(
        "hello\n@@TRAX:initialize rect:4,3,10,8\n@@TRAX:initialize 4,3,14,3,14,11,4,11\n\
         @@TRAX:frame {}\n@@TRAX:frame {}\n@@TRAX:initialize\n@@TRAX:initialize 1,2,9,9\n\
         @@TRAX:frame {}\n@@TRAX:quit\n",
        memory(3),
        memory(4),
        memory(5)
    );
    let path =
        "@@TRAX:initialize file:///a.png 1,2,3,4\n@@TRAX:frame /b.png\n@@TRAX:status 1,2,3,4 k=v\n";
    vec![joined(Some(0), &[&three]), joined(Some(1), &[&four]), joined(Some(0), &[path])]
}

/// Edits of every kind, as JSON.
fn edits() -> Vec<Value> {
    let bbox = json!({ "x": 5.0, "y": 4.0, "w": 12.0, "h": 9.0 });
    let tracked = json!({ "box": bbox, "score": 0.5, "status": "tracked", "visible": 0.5 });
    vec![
        json!({ "edit": "add_target", "label": "target", "frame": 0, "box": bbox }),
        json!({ "edit": "set_tracked", "target": 1, "from": 1, "to": 2,
                "tracked": { "1": tracked, "2": tracked } }),
        json!({ "edit": "set_key", "target": 1, "frame": 3, "box": bbox, "occluded": true }),
        json!({ "edit": "hide", "target": 1, "from": 4, "to": 5 }),
        json!({ "edit": "add_label", "name": "car", "colour": "#ff0000" }),
        json!({ "edit": "set_target", "target": 1, "label": "car", "attributes": { "a": "b" } }),
        json!({ "edit": "declare", "label": "car", "attributes": [
                { "name": "seen", "kind": "checkbox", "mutable": true },
                { "name": "doors", "kind": "number", "min": 2, "max": 5 } ] }),
        json!({ "edit": "set_value", "target": 1, "name": "seen", "frame": 2, "value": "true" }),
        json!({ "edit": "split", "target": 1, "frame": 3 }),
        json!({ "edit": "join", "first": 1, "second": 2 }),
        json!({ "edit": "show", "target": 1, "from": 5, "to": 5 }),
        json!({ "edit": "remove_key", "target": 1, "frame": 3 }),
        json!({ "edit": "delete_target", "target": 1 }),
    ]
}

/// Files of labels without and with attributes, and edits of them.
fn labels() -> Vec<Vec<u8>> {
    let plain = r##"{"format":"patchlock-labels","version":1,"labels":[
        {"name":"target","colour":"#ff0000","was":["thing"]},{"name":"car","colour":"#00ff00"}],
        "removed":["dog"]}"##;
    let with = r##"{"format":"patchlock-labels","version":2,"labels":[{"name":"target","colour":
        "#ff0000","attributes":[{"name":"seen","kind":"checkbox","mutable":true}]}]}"##;
    let edits = [
        json!({ "edit": "add_label", "name": "cat", "colour": "#0000ff" }).to_string(),
        json!({ "edit": "set_label", "name": "car", "new_name": "van" }).to_string(),
        json!({ "edit": "declare", "label": "cat", "attributes": [
                { "name": "fur", "kind": "select", "values": ["long", "short"] } ] })
        .to_string(),
        json!({ "edit": "remove_label", "name": "van" }).to_string(),
    ];
    let steps = edits.iter().map(String::as_str);
    let of = |file| joined(None, &iter::once(file).chain(steps.clone()).collect::<Vec<_>>());
    vec![of(plain), of(with)]
}

fn projects() -> Vec<Vec<u8>> {
    let scratch = Scratch::new();
    for k in 0..6 {
        scratch.file(&format!("frames/{k:04}.bmp"), &bmp(64, 48, k));
    }
    let file = scratch.folder().join("p.json");
    let mut store = Store::open(&file, Some(&scratch.folder().join("frames")), Limits::default())
        .expect("the video can be read");
    store.save().expect("can be written");
    let empty = fs::read_to_string(&file).expect("is text");
    let all = edits();
    for edit in &all[..8] {
        let edit: Edit = serde_json::from_value(edit.clone()).expect("is an edit");
        store.apply(vec![edit]).expect("fits");
    }
    store.save().expect("can be written");
    let full = fs::read_to_string(&file).expect("is text");
    let steps: Vec<String> = all.iter().map(|edit| json!([edit]).to_string()).collect();
    let steps: Vec<&str> = steps.iter().map(String::as_str).collect();
    let with = |first: &str, rest: &[&str]| joined(None, &[&[first], rest].concat());
    vec![
        with(&empty, &steps),
        with(&empty, &[&steps[..3], &["undo", "save", "redo", "undo", "undo"]].concat()),
        with(&full, &[&["save"], &steps[6..], &["undo"]].concat()),
    ]
}

fn requests() -> Vec<Vec<u8>> {
    let edit = |revision: u64, edit: &Value| {
        let body = json!({ "revision": revision, "edits": [edit] });
        format!("POST /api/clips/1/edits\ncontent-type: application/json\n\n{body}")
    };
    let all: Vec<String> = (0..).zip(&edits()).map(|(k, change)| edit(k, change)).collect();
    let all: Vec<&str> = all.iter().map(String::as_str).collect();
    let reads = [
        "GET /",
        "GET /api/clips",
        "GET /api/clips/1",
        "HEAD /api/clips/1/edits",
        "GET /api/clips/1/frames/2?width=32",
        "GET /api/clips/1/doubts?target=1",
        "GET /api/camera",
        "GET /page.js",
        "GET /api/clips/1/look?target=1&frame=1",
        "GET /api/clips/9",
    ];
    let table = "frame,x,y,w,h\n0,5,4,12,9\n1,6,4,12,9\n";
    let import = format!("POST /api/clips/1/import?format=csv\n\n{table}");
    let exports: Vec<String> = Format::all(true)
        .map(|format| format!("GET /api/clips/1/export?format={}", format.name))
        .collect();
    let exports: Vec<&str> = exports.iter().map(String::as_str).collect();
    let track = "POST /api/clips/1/track\n\n{\"target\":1,\"from\":0,\"direction\":\"forward\"}";
    let steps =
        ["POST /api/clips/1/undo\n\n", "POST /api/clips/1/redo\n\n", "POST /api/clips/1/stop\n\n"];
    let raw = [
        "!GET /api/clips/1\nhost: HOST",
        "!GET /\nhost: evil.example",
        "GET /api/clips/1\norigin: http://evil.example",
        "!DELETE /api/clips\nhost: HOST",
    ];
    let upload = [
        b"POST /api/clips?name=a%20b.bmp\n\n".as_slice(),
        &bmp(16, 8, 1),
        &[SEPARATOR],
        b"GET /api/clips/2/frames/0",
    ]
    .concat();
    vec![
        joined(None, &reads),
        joined(None, &all),
        joined(None, &[&all[..1], &[track], &steps[..]].concat()),
        joined(None, &[&[import.as_str()], &exports[..]].concat()),
        joined(None, &raw),
        joined(
            None,
            &[all[0], "GET /api/clips/1/video", "GET /api/clips/1/targets/1/clip?frame=0"],
        ),
        upload,
    ]
}

/// Bytes that stand for plans of calls, or of a folder.
fn plans() -> Vec<Vec<u8>> {
    let mut draws = fastrand::Rng::with_seed(11);
    let plan = |_| {
        let length = 200 + draws.usize(..600);
        (0..length).map(|_| draws.u8(..)).collect()
    };
    (0..24).map(plan).collect()
}
