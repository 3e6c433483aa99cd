//! What a page does with a clip.

use std::path::Path;
use std::time::{Duration, Instant};

use image::ImageFormat;
use patchlock::Preset;
use patchlock_media::Limits;
use patchlock_studio::project::Store;
use patchlock_studio::server::ProjectLocation;
use patchlock_track::models;
use serde_json::{Value, json};
use tungstenite::{Message, WebSocket};

use crate::support::{FRAMES, TestServer, options, video};

/// The next message of a window of this type.
fn next(socket: &mut WebSocket<std::net::TcpStream>, kind: &str) -> Value {
    loop {
        let message = socket.read().expect("a message");
        let Message::Text(text) = message else { continue };
        let event: Value = serde_json::from_str(&text).expect("is JSON");
        if event["type"] == kind {
            return event;
        }
    }
}

fn target(clip: &Value, at: usize) -> &Value {
    &clip["project"]["targets"][at]
}

fn tracked_frames(clip: &Value) -> Vec<usize> {
    let tracked = target(clip, 0)["tracked"].as_object().expect("is there");
    let mut frames: Vec<usize> = tracked.keys().map(|key| key.parse().expect("a frame")).collect();
    frames.sort_unstable();
    frames
}

#[test]
fn frames_are_exact_and_of_the_width_that_was_asked_for() {
    let server = TestServer::new();
    let mut source = patchlock_media::open(
        server.folder.path().join("clip.mp4").to_str().expect("is text"),
        false,
    )
    .expect("opens");
    let pictures: Vec<_> =
        (0..FRAMES).map(|k| source.frame(k).expect("decodes").expect("is there")).collect();
    for frame in [0_usize, 17, 16, 15, 39, 2, 3, 38] {
        let answer = server.get(&format!("/api/clips/1/frames/{frame}"));
        assert_eq!(answer.header("content-type"), Some("image/jpeg"));
        let decoded = image::load_from_memory_with_format(&answer.body, ImageFormat::Jpeg);
        let decoded = decoded.expect("is a JPEG").to_rgb8();
        let difference = |k: usize| -> f64 {
            let rgb = pictures[k].to_rgb();
            let pairs = decoded.as_raw().iter().zip(rgb.iter());
            pairs.map(|(&a, &b)| f64::from(a.abs_diff(b))).sum::<f64>() / decoded.len() as f64
        };
        let others = [frame.saturating_sub(1), (frame + 1).min(FRAMES - 1)];
        for other in others.into_iter().filter(|&other| other != frame) {
            assert!(difference(frame) < difference(other), "{frame} {other}");
        }
        assert!(difference(frame) < 6.0, "{frame}: {}", difference(frame));
    }
    let small = server.get("/api/clips/1/frames/5?width=100");
    let small = image::load_from_memory(&small.body).expect("is a JPEG");
    let (width, height) = (pictures[0].width as f64, pictures[0].height as f64);
    assert_eq!(small.width(), 100);
    assert!((f64::from(small.height()) - 100.0 * height / width).abs() <= 0.5);
    let same = server.get("/api/clips/1/frames/5?width=100000");
    let same = image::load_from_memory(&same.body).expect("is a JPEG");
    assert_eq!(same.width() as usize, pictures[0].width);
}

#[test]
fn a_browser_may_keep_frames() {
    let server = TestServer::new();
    let first = server.get("/api/clips/1/frames/1");
    let tag = first.header("etag").expect("is there");
    assert!(first.header("cache-control").expect("is there").contains("immutable"));
    let bearer = format!("Authorization: Bearer {}", server.token);
    let known = format!("If-None-Match: {tag}");
    let again = server.send_with("GET", "/api/clips/1/frames/1", &[&bearer, &known], &[]);
    assert!(again.status == 304 && again.body.is_empty());
    let other = server.send_with("GET", "/api/clips/1/frames/2", &[&bearer, &known], &[]);
    assert_eq!(other.status, 200);
}

#[test]
fn an_edit_is_written_at_once_and_found_again() {
    let mut server = TestServer::new();
    server.add_target(3);
    let file = server.folder.path().join("clip.patchlock.json");
    let written = std::fs::read_to_string(&file).expect("is written");
    assert!(written.contains("\"keys\""), "{written}");
    let before = server.clip();
    server.restart();
    let after = server.clip();
    assert_eq!(before["project"], after["project"]);
    assert_eq!(target(&after, 0)["keys"].as_object().expect("is there").len(), 1);
    let list = server.get("/api/clips").json();
    assert!(list["clips"][0]["targets"] == 1 && list["clips"][0]["keys"] == 1);
}

/// The folder of the project is away while something is changed, as a disk can be.
#[test]
fn what_could_not_be_written_is_written_at_the_end() {
    for comes_back in [true, false] {
        let folder = tempfile::tempdir().expect("a folder");
        let truth = video(&folder.path().join("clip.mp4"));
        let projects = folder.path().join("projects");
        std::fs::create_dir(&projects).expect("creates");
        let mut options = options(vec![folder.path().join("clip.mp4")], folder.path());
        options.projects = ProjectLocation::File(projects.join("p.json"));
        let mut server = TestServer::with(options, folder, truth);
        let away = projects.with_file_name("away");
        std::fs::rename(&projects, &away).expect("moves");
        let edits = json!({ "revision": 0, "edits": [{ "edit": "set_done", "done": true }] });
        let refused = server.post("/api/clips/1/edits", &edits).error(500);
        assert!(refused.contains("cannot write"), "{refused}");
        if comes_back {
            std::fs::rename(&away, &projects).expect("moves");
            let [file] = server.outcome().expect("runs").try_into().expect("one file");
            assert_eq!(file.file_name(), Some("p.json".as_ref()));
            assert!(std::fs::read_to_string(file).expect("is written").contains("\"done\": true"));
        } else {
            let error = server.outcome().expect_err("cannot write").to_string();
            assert!(error.contains("changes are lost: cannot write") && error.contains("p.json"));
        }
    }
}

/// A few bytes that say that the video is long.
#[test]
fn a_project_that_says_another_length_of_its_video_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let truth = video(&folder.path().join("clip.mp4"));
    std::fs::copy(folder.path().join("clip.mp4"), folder.path().join("other.mp4")).expect("copies");
    let file = folder.path().join("clip.patchlock.json");
    let mut store = Store::open(&file, Some(&folder.path().join("clip.mp4")), Limits::default())
        .expect("begins");
    store.save().expect("is not there");
    drop(store);
    let text = std::fs::read_to_string(&file).expect("is written");
    let long = text.replace("\"frames\":40", "\"frames\":100000000");
    assert_ne!(long, text);
    std::fs::write(&file, long).expect("writes");
    let server = TestServer::serving(folder, truth, &["clip.mp4", "other.mp4"]);
    let error = server.get("/api/clips/1").error(422);
    assert!(error.contains("100000000 frames; the video has 40"), "{error}");
    assert_eq!(server.get("/api/clips/2").status, 200);
}

#[test]
fn the_list_of_clips_says_which_are_done() {
    let server = TestServer::new();
    let is_done = || server.get("/api/clips").json()["clips"][0]["done"].clone();
    assert_eq!(is_done(), false);
    let edits = json!({ "revision": server.clip()["revision"], "edits": [
        { "edit": "set_done", "done": true },
    ] });
    assert_eq!(server.post("/api/clips/1/edits", &edits).status, 200);
    assert!(is_done() == true && server.clip()["project"]["done"] == true);
    server.post("/api/clips/1/undo", &json!({}));
    assert_eq!(is_done(), false);
}

#[test]
fn a_window_that_is_behind_cannot_overwrite() {
    let server = TestServer::new();
    let revision = server.clip()["revision"].clone();
    server.add_target(0);
    let late = json!({ "revision": revision, "edits": [
        { "edit": "add_label", "name": "late" },
    ] });
    let answer = server.post("/api/clips/1/edits", &late);
    answer.error(409);
    assert_eq!(answer.json()["revision"], server.clip()["revision"]);
    let far = json!({ "revision": 1_000_000, "edits": [] });
    server.post("/api/clips/1/edits", &far).error(409);
}

#[test]
fn an_edit_that_is_not_possible_changes_nothing() {
    let server = TestServer::new();
    let before = server.clip();
    for edit in [
        json!({ "edit": "add_target", "label": "target", "frame": 40,
            "box": { "x": 1.0, "y": 1.0, "w": 9.0, "h": 9.0 } }),
        json!({ "edit": "add_target", "label": "nobody", "frame": 0,
            "box": { "x": 1.0, "y": 1.0, "w": 9.0, "h": 9.0 } }),
        json!({ "edit": "delete_target", "target": 3 }),
    ] {
        let edits = json!({ "revision": before["revision"], "edits": [edit] });
        server.post("/api/clips/1/edits", &edits).error(400);
    }
    assert_eq!(server.clip()["project"], before["project"]);
}

#[test]
fn two_windows_know_of_each_other_and_of_changes() {
    let server = TestServer::new();
    let mut first = server.socket("/api/clips/1/events");
    assert_eq!(next(&mut first, "windows")["count"], 1);
    let mut second = server.socket("/api/clips/1/events");
    assert_eq!(next(&mut first, "windows")["count"], 2);
    server.add_target(0);
    let revision = server.clip()["revision"].clone();
    for window in [&mut first, &mut second] {
        assert_eq!(next(window, "project")["revision"], revision);
    }
    drop(second);
    assert_eq!(next(&mut first, "windows")["count"], 1);
}

#[test]
fn a_box_becomes_a_track_that_is_shown_live_and_undone_as_one() {
    let server = TestServer::new();
    server.add_target(0);
    let mut window = server.socket("/api/clips/1/events");
    let request = json!({ "target": 1, "from": 0, "direction": "forward" });
    let answer = server.post("/api/clips/1/track", &request);
    assert_eq!(answer.json()["job"], 1);
    assert_eq!(next(&mut window, "job")["state"], "running");
    let mut boxes = Vec::new();
    while boxes.len() < FRAMES - 1 {
        let event = next(&mut window, "tracked");
        assert!(event["target"] == 1 && event["fps"].as_f64().expect("a number") > 0.0);
        boxes.extend(event["boxes"].as_array().expect("a list").clone());
    }
    assert_eq!(next(&mut window, "job")["state"], "done");
    let frames: Vec<_> = boxes.iter().map(|row| row[0].as_u64().expect("a frame")).collect();
    assert_eq!(frames, (1..FRAMES as u64).collect::<Vec<_>>());
    let clip = server.wait();
    assert_eq!(tracked_frames(&clip), (1..FRAMES).collect::<Vec<_>>());
    for (frame, truth) in server.truth.iter().enumerate().skip(1) {
        let found = &target(&clip, 0)["tracked"][frame.to_string()]["box"];
        let found: patchlock::BoundingBox =
            serde_json::from_value(found.clone()).expect("is a box");
        assert!(found.overlap(truth) > 0.5, "frame {frame}");
    }
    assert_eq!(server.post("/api/clips/1/undo", &json!({})).status, 200);
    let undone = server.clip();
    assert!(tracked_frames(&undone).is_empty());
    assert_eq!(target(&undone, 0)["keys"].as_object().expect("is there").len(), 1);
    assert_eq!(server.post("/api/clips/1/redo", &json!({})).status, 200);
    assert_eq!(server.clip()["project"], clip["project"]);
}

#[test]
fn a_correction_is_tracked_from_both_sides() {
    let server = TestServer::new();
    server.add_target(0);
    for frame in [20, 39] {
        let bbox = server.truth[frame];
        server.edit(json!({ "edit": "set_key", "target": 1, "frame": frame, "box": bbox }));
    }
    let request = json!({ "target": 1, "around": 20 });
    assert_eq!(server.post("/api/clips/1/track", &request).status, 200);
    let clip = server.wait();
    let expected: Vec<usize> = (1..20).chain(21..39).collect();
    assert_eq!(tracked_frames(&clip), expected);
    for frame in expected {
        let tracked = &target(&clip, 0)["tracked"][frame.to_string()];
        assert!(tracked["agreement"].is_number(), "frame {frame}: {tracked}");
    }
}

#[test]
fn a_job_can_be_stopped_and_others_wait_for_it() {
    let server = TestServer::new();
    server.add_target(0);
    server.add_target(5);
    for target in [1, 2] {
        let request = json!({ "target": target, "from": 5 * (target - 1), "direction": "forward" });
        assert_eq!(server.post("/api/clips/1/track", &request).json()["job"], target);
    }
    let stopped = server.post("/api/clips/1/stop", &json!({})).json();
    assert!(stopped["stopped"].as_u64().expect("a number") >= 1);
    let clip = server.clip();
    assert!(clip["job"].is_null(), "{}", clip["job"]);
    assert!(tracked_frames(&clip).len() < FRAMES - 1);
    let request = json!({ "target": 1, "from": 0, "direction": "forward", "until": 10 });
    assert_eq!(server.post("/api/clips/1/track", &request).json()["job"], 3);
    assert_eq!(tracked_frames(&server.wait()).iter().filter(|&&frame| frame <= 10).count(), 10);
}

#[test]
fn deleting_a_target_ends_its_job() {
    let server = TestServer::new();
    server.add_target(0);
    let request = json!({ "target": 1, "from": 0, "direction": "forward" });
    assert_eq!(server.post("/api/clips/1/track", &request).status, 200);
    server.edit(json!({ "edit": "delete_target", "target": 1 }));
    let clip = server.clip();
    assert!(clip["job"].is_null());
    assert!(clip["project"]["targets"].as_array().expect("a list").is_empty());
}

#[test]
fn requests_that_make_no_sense_are_refused() {
    let server = TestServer::new();
    server.add_target(5);
    for (request, status) in [
        (json!({ "target": 9, "around": 0 }), 404),
        (json!({ "target": 1, "around": 40 }), 400),
        (json!({ "target": 1, "from": 6, "direction": "forward" }), 400),
        (json!({ "target": 1, "from": 5, "direction": "sideways" }), 400),
        (json!({ "target": 1, "from": 5, "direction": "forward", "until": 2 }), 400),
        (json!({ "target": 1, "from": 5, "direction": "forward", "until": 5 }), 400),
        (json!({ "target": 1 }), 400),
    ] {
        assert!(!server.post("/api/clips/1/track", &request).error(status).is_empty(), "{request}");
    }
}

#[test]
fn what_a_job_has_found_survives_the_end_of_the_program() {
    let mut server = TestServer::new();
    server.add_target(0);
    let request = json!({ "target": 1, "from": 0, "direction": "forward" });
    assert_eq!(server.post("/api/clips/1/track", &request).status, 200);
    let begun = Instant::now();
    while server.clip()["job"]["done"].as_u64().unwrap_or(0) < 2 {
        if server.clip()["job"].is_null() && begun.elapsed() > Duration::from_secs(2) {
            break;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    server.restart();
    assert!(!tracked_frames(&server.clip()).is_empty());
}

#[test]
fn a_look_says_what_is_visible() {
    let server = TestServer::new();
    server.add_target(0);
    server.edit(json!({ "edit": "set_key", "target": 1, "frame": 8, "box": server.truth[8] }));
    let look = server.get("/api/clips/1/look?target=1&frame=8").json();
    assert_eq!(look["key"], 0);
    assert!(look["visible"].as_f64().expect("a share") > 0.5, "{look}");
    for scale in look["scales"].as_array().expect("a list") {
        let cells = scale["rows"].as_u64().unwrap() * scale["columns"].as_u64().unwrap();
        assert_eq!(scale["hidden"].as_array().expect("a list").len() as u64, cells);
    }
    // A box where the target is not.
    let away = json!({ "x": 2.0, "y": 2.0, "w": 30.0, "h": 30.0 });
    server.edit(json!({ "edit": "set_key", "target": 1, "frame": 30, "box": away }));
    let look = server.get("/api/clips/1/look?target=1&frame=30").json();
    assert!(look["visible"].as_f64().is_none_or(|share| share < 0.5), "{look}");
    assert!(!look["words"].as_array().expect("a list").is_empty());
}

/// A made-up network: it finds nothing, but works as the real ones do.
#[test]
fn a_network_tracks_targets() {
    let file =
        concat!(env!("CARGO_MANIFEST_DIR"), "/../patchlock/tests/golden/network/vittrack.onnx");
    let folder = tempfile::tempdir().expect("a folder");
    let truth = video(&folder.path().join("clip.mp4"));
    let mut options = options(vec![folder.path().join("clip.mp4")], folder.path());
    options.config = Preset::Network.into();
    options.config.network = Some(models::load(Path::new(file), None).expect("loads"));
    let server = TestServer::with(options, folder, truth);
    server.add_target(0);
    server.edit(json!({ "edit": "set_key", "target": 1, "frame": 8, "box": server.truth[8] }));
    let request = json!({ "target": 1, "from": 0, "direction": "forward", "until": 12 });
    assert_eq!(server.post("/api/clips/1/track", &request).status, 200);
    assert_eq!(tracked_frames(&server.wait()).len(), 11);
    let look = server.get("/api/clips/1/look?target=1&frame=4").json();
    assert!(look["visible"].is_null() && look["scales"] == json!([]), "{look}");
    assert!(!look["words"].to_string().contains("hidden"), "{look}");
}

#[test]
fn doubtful_places_are_listed() {
    let server = TestServer::new();
    server.add_target(0);
    let tracked =
        |score: f64| json!({ "box": server.truth[0], "score": score, "status": "uncertain" });
    server.edit(json!({ "edit": "set_tracked", "target": 1, "from": 1, "to": 4,
        "tracked": { "1": tracked(0.9), "2": tracked(0.1), "3": tracked(0.1), "4": tracked(0.9) } }));
    let suggestions = server.get("/api/clips/1/doubts").json();
    let found = suggestions["doubts"].as_array().expect("a list");
    // What was never tracked, and what is probably wrong.
    assert_eq!(found[0]["frame"], 5, "{found:?}");
    assert!(found.iter().any(|suggestion| [2, 3].map(Value::from).contains(&suggestion["frame"])));
    for suggestion in found {
        assert!(suggestion["target"] == 1 && suggestion["reason"].is_string(), "{suggestion}");
        assert!(suggestion["gain"].as_f64().expect("a number") > 0.0, "{suggestion}");
    }
    assert_eq!(server.get("/api/clips/1/doubts?target=1").json(), suggestions);
}

/// A recording that a crash has ended.
#[test]
fn a_video_without_its_end_is_shown_as_far_as_it_goes() {
    let folder = tempfile::tempdir().expect("a folder");
    let truth = video(&folder.path().join("clip.mp4"));
    let [clip, whole] = ["clip.mp4", "whole.mkv"].map(|name| folder.path().join(name));
    let mut ffmpeg = std::process::Command::new("ffmpeg");
    ffmpeg.args(["-v", "error", "-nostdin", "-i"]).arg(clip).args(["-c:v", "mjpeg"]).arg(&whole);
    if !ffmpeg.status().is_ok_and(|status| status.success()) {
        return println!("skipped: there is no ffmpeg");
    }
    let bytes = std::fs::read(whole).expect("reads");
    std::fs::write(folder.path().join("crash.mkv"), &bytes[..bytes.len() * 2 / 3]).expect("writes");
    let server = TestServer::serving(folder, truth, &["crash.mkv"]);
    let clip = server.get("/api/clips/1").json();
    let frames = clip["project"]["video"]["frames"].as_u64().expect("a number") as usize;
    assert!((FRAMES / 4..FRAMES).contains(&frames), "{frames}");
    let notes = clip["notes"].as_array().expect("is there");
    let note = notes[0].as_str().expect("is text");
    assert!(note.starts_with("ffmpeg found damage in") && note.contains("crash.mkv"), "{note}");
    for frame in [frames - 1, 0] {
        assert_eq!(server.get(&format!("/api/clips/1/frames/{frame}")).status, 200);
    }
}
