//! The live page, with rendered pictures instead of a camera.

use std::io::Cursor;
use std::net::TcpStream;

use image::{ImageFormat, RgbImage};
use patchlock::BoundingBox;
use patchlock_scene::Scene;
use serde_json::{Value, json};
use tungstenite::{Message, WebSocket};

use crate::support::TestServer;

type Socket = WebSocket<TcpStream>;

fn picture(scene: &Scene, k: usize) -> Vec<u8> {
    let frame = scene.frame(k);
    let image = RgbImage::from_raw(frame.width as u32, frame.height as u32, frame.rgb);
    let mut jpeg = Cursor::new(Vec::new());
    image.expect("is complete").write_to(&mut jpeg, ImageFormat::Jpeg).expect("encodes");
    jpeg.into_inner()
}

fn truth(scene: &Scene, k: usize) -> BoundingBox {
    let [x, y, w, h] = scene.truth(k).bbox;
    BoundingBox { x, y, w, h }
}

fn say(socket: &mut Socket, order: &Value) {
    socket.send(Message::Text(order.to_string().into())).expect("sends");
}

/// Sends a picture and waits for the answer.
fn show(socket: &mut Socket, jpeg: Vec<u8>) -> Value {
    socket.send(Message::Binary(jpeg.into())).expect("sends");
    hear(socket)
}

fn hear(socket: &mut Socket) -> Value {
    loop {
        if let Message::Text(text) = socket.read().expect("a message") {
            return serde_json::from_str(&text).expect("is JSON");
        }
    }
}

#[test]
fn what_is_in_the_box_is_followed() {
    let server = TestServer::new();
    let scene = Scene::simple();
    let mut socket = server.socket("/api/camera");
    let before = show(&mut socket, picture(&scene, 0));
    assert!(before["box"].is_null() && before["frame"] == 0 && before["ms"].is_number());
    let BoundingBox { x, y, w, h } = truth(&scene, 0);
    say(&mut socket, &json!({ "start": { "box": [x, y, w, h] } }));
    for k in 0..10 {
        let answer = show(&mut socket, picture(&scene, k));
        let found: BoundingBox = serde_json::from_value(answer["box"].clone()).expect("a box");
        assert!(found.overlap(&truth(&scene, k)) > 0.6, "{k}: {answer}");
        assert_eq!(answer["status"], "tracked");
        assert_eq!(answer["corners"].as_array().expect("a list").len(), 4);
        assert!(answer["score"].is_number() && answer["ms"].as_f64().expect("a number") > 0.0);
    }
    say(&mut socket, &json!({ "stop": true }));
    assert!(show(&mut socket, picture(&scene, 10))["box"].is_null());
}

#[test]
fn pictures_that_come_too_fast_are_dropped_but_the_newest() {
    let server = TestServer::new();
    let scene = Scene::simple();
    let mut socket = server.socket("/api/camera");
    let jpeg = picture(&scene, 0);
    let count = 200;
    for _ in 0..count {
        socket.send(Message::Binary(jpeg.clone().into())).expect("sends");
    }
    let (mut dropped, mut seen) = (0, Vec::new());
    for _ in 0..count {
        let answer = hear(&mut socket);
        match answer["dropped"].as_bool() {
            Some(true) => dropped += 1,
            _ => seen.push(answer["frame"].as_u64().expect("a number")),
        }
    }
    assert_eq!(dropped + seen.len(), count);
    assert!(seen.is_sorted() && seen.last() == Some(&(count as u64 - 1)));
}

#[test]
fn a_recording_has_a_video_and_a_table() {
    let server = TestServer::new();
    let scene = Scene::simple();
    let mut socket = server.socket("/api/camera");
    say(&mut socket, &json!({ "record": true }));
    show(&mut socket, picture(&scene, 0));
    let BoundingBox { x, y, w, h } = truth(&scene, 1);
    say(&mut socket, &json!({ "start": { "box": [x, y, w, h] } }));
    for k in 1..5 {
        show(&mut socket, picture(&scene, k));
    }
    say(&mut socket, &json!({ "record": false }));
    let done = hear(&mut socket);
    assert!(done["recording"] == 1 && done["frames"] == 5, "{done}");
    let video = server.get("/api/camera/recordings/1/video");
    assert_eq!(video.header("content-type"), Some("video/mp4"));
    let kept = server.folder.path().join("uploads/camera.mp4");
    assert_eq!(std::fs::read(&kept).expect("is there"), video.body);
    let source = patchlock_media::open(kept.to_str().expect("is text"), false).expect("opens");
    assert_eq!(source.length(), Some(5));
    let table = server.get("/api/camera/recordings/1/table").text();
    let rows: Vec<&str> = table.lines().collect();
    assert!(rows.len() == 6 && rows[0].starts_with("frame,x,y,w,h,score,status,time"));
    assert!(rows[1].starts_with("0,,,,,,,") && rows[2].contains(",tracked,"), "{table}");
    for path in ["0/video", "2/video", "1/sound", "x/video"] {
        server.get(&format!("/api/camera/recordings/{path}")).error(404);
    }
}

#[test]
fn several_targets_are_followed_and_their_recording_is_a_clip() {
    let server = TestServer::new();
    let scene = Scene::simple();
    let mut socket = server.socket("/api/camera");
    say(&mut socket, &json!({ "record": true }));
    let BoundingBox { x, y, w, h } = truth(&scene, 0);
    say(&mut socket, &json!({ "start": { "box": [x, y, w, h], "add": true } }));
    show(&mut socket, picture(&scene, 0));
    say(&mut socket, &json!({ "start": { "box": [10, 10, 40, 40], "add": true } }));
    let ids = |answer: &Value| {
        let targets = answer["targets"].as_array().expect("a list");
        targets.iter().map(|target| target["id"].as_u64().expect("an id")).collect::<Vec<_>>()
    };
    for k in 1..4 {
        let answer = show(&mut socket, picture(&scene, k));
        assert_eq!(ids(&answer), [1, 2], "{answer}");
        let found: BoundingBox =
            serde_json::from_value(answer["targets"][0]["box"].clone()).expect("a box");
        assert!(found.overlap(&truth(&scene, k)) > 0.6, "{k}: {answer}");
    }
    say(&mut socket, &json!({ "forget": 1 }));
    assert_eq!(ids(&show(&mut socket, picture(&scene, 4))), [2]);
    say(&mut socket, &json!({ "record": false }));
    let done = hear(&mut socket);
    let kept = server.folder.path().join("uploads/camera.mp4");
    assert_eq!(done["video"], json!(kept), "{done}");
    assert_eq!(done["clip"], 2, "{done}");
    let project = server.get("/api/clips/2").json()["project"].clone();
    let targets = project["targets"].as_array().expect("a list");
    let frames = |k: usize, part: &str| {
        let frames = targets[k][part].as_object().expect("by frame").keys();
        frames.map(|frame| frame.parse::<usize>().expect("a frame")).collect::<Vec<_>>()
    };
    assert_eq!((targets.len(), project["video"]["frames"].as_u64()), (2, Some(5)));
    assert_eq!((frames(0, "keys"), frames(0, "tracked")), (vec![0], vec![1, 2, 3]));
    assert_eq!((frames(1, "keys"), frames(1, "tracked")), (vec![1], vec![2, 3, 4]));
}

#[test]
fn a_recording_is_completed_when_the_page_is_closed() {
    let server = TestServer::new();
    let mut socket = server.socket("/api/camera");
    say(&mut socket, &json!({ "record": true }));
    show(&mut socket, picture(&Scene::simple(), 0));
    drop(socket);
    let begun = std::time::Instant::now();
    while server.get("/api/camera/recordings/1/table").status != 200 {
        assert!(begun.elapsed().as_secs() < 10, "the recording is not completed");
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
}

#[test]
fn nonsense_is_answered_with_an_error() {
    let server = TestServer::new();
    let scene = Scene::simple();
    let mut socket = server.socket("/api/camera");
    for order in ["", "{}", "[]", r#"{"start": 5}"#, r#"{"format": true}"#] {
        socket.send(Message::Text(order.into())).expect("sends");
        assert!(hear(&mut socket)["error"].is_string(), "{order}");
    }
    assert!(show(&mut socket, b"no picture".to_vec())["error"].is_string());
    say(&mut socket, &json!({ "start": { "box": [5000, 5000, 10, 10] } }));
    assert!(show(&mut socket, picture(&scene, 0))["error"].is_string());
    // After an error, all goes on.
    assert!(show(&mut socket, picture(&scene, 1))["box"].is_null());
    let huge = vec![0; 17 << 20];
    let _ = socket.send(Message::Binary(huge.into()));
    assert!(std::iter::repeat_with(|| socket.read()).take(3).any(|read| read.is_err()));
    assert_eq!(server.get("/api/clips").status, 200);
}
