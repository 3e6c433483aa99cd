//! Boxes and videos in and out.

use std::path::Path;

use patchlock::BoundingBox;
use serde_json::json;

use crate::support::{FRAMES, TestServer};

/// Opens what was downloaded as a video.
fn opened(server: &TestServer, body: &[u8]) -> Box<dyn patchlock_media::FrameSource> {
    let file: &Path = &server.folder.path().join("downloaded.mp4");
    std::fs::write(file, body).expect("writes");
    patchlock_media::open(file.to_str().expect("is text"), false).expect("is a video")
}

#[test]
fn what_is_exported_can_be_imported() {
    let server = TestServer::new();
    server.add_target(0);
    server.edit(json!({ "edit": "set_key", "target": 1, "frame": 9, "box": server.truth[9] }));
    for (format, kind) in [("csv", "text/csv"), ("mot", "text/plain"), ("cvat", "application/xml")]
    {
        let exported = server.get(&format!("/api/clips/1/export?format={format}"));
        assert_eq!(exported.status, 200, "{format}: {}", exported.text());
        assert!(exported.header("content-type").expect("is there").starts_with(kind));
        let named = exported.header("content-disposition").expect("is there").to_owned();
        assert!(named.contains(&format!("filename=\"clip.{format}.")), "{named}");
        let path = format!("/api/clips/1/import?format={format}");
        let imported = server.send("POST", &path, &exported.body);
        assert_eq!(imported.status, 200, "{format}: {}", imported.text());
        let id = imported.json()["targets"][0].as_u64().expect("an id");
        let clip = server.clip();
        assert_eq!(clip["revision"], imported.json()["revision"]);
        let targets = clip["project"]["targets"].as_array().expect("a list");
        assert!(targets.len() == 2 && targets[1]["id"] == id, "{format}");
        assert_eq!(server.post("/api/clips/1/undo", &json!({})).status, 200);
    }
}

/// What the page offers is what the server takes.
#[test]
fn all_formats_are_listed_and_what_is_left_out_is_said() {
    let server = TestServer::new();
    server.add_target(0);
    // Formats of rotated boxes need an outline.
    let bbox @ BoundingBox { x, y, w, h } = server.truth[0];
    let outline = [[x, y], [x + w, y], [x + w, y + h]];
    let edit = json!({
        "edit": "set_key", "target": 1, "frame": 0, "box": bbox, "outline": outline,
    });
    server.edit(edit);
    let listed = server.get("/api/formats").json();
    let exports = listed["exports"].as_array().expect("a list").clone();
    assert!(exports.len() > 8, "{listed}");
    for format in exports {
        let name = format["name"].as_str().expect("a name");
        let exported = server.get(&format!("/api/clips/1/export?format={name}"));
        assert_eq!(exported.status, 200, "{name}: {}", exported.text());
        let is_folder = exported.header("content-type") == Some("application/zip");
        assert_eq!(is_folder, format["folder"] == true, "{name}");
        assert_eq!(exported.header("patchlock-remarks"), None, "{name}");
        let keys = server.get(&format!("/api/clips/1/export?format={name}&key_frames=0.9"));
        assert_eq!(keys.status == 200, format["key_frames"] == true, "{name}: {}", keys.text());
    }
    let tracked = |status: &str, score: f64| {
        let bbox = server.truth[1];
        json!({ "box": bbox, "score": score, "status": status })
    };
    let edit = json!({
        "edit": "set_tracked", "target": 1, "from": 1, "to": 3,
        "tracked": { "1": tracked("tracked", 0.9), "2": tracked("uncertain", 0.6), "3": tracked("tracked", 0.3) },
    });
    server.edit(edit);
    let remarks = |query: &str| {
        let exported = server.get(&format!("/api/clips/1/export?{query}"));
        assert_eq!(exported.status, 200, "{query}: {}", exported.text());
        exported.header("patchlock-remarks").unwrap_or_default().to_owned()
    };
    assert_eq!(remarks("format=yolo"), "left out 1 of 4 boxes: 1 uncertain");
    assert_eq!(remarks("format=mot"), "doubtful among the 4 boxes written: 1 uncertain");
    assert_eq!(
        remarks("format=mot&status=tracked&min_score=0.5&every=1"),
        "left out 2 of 4 boxes: 1 uncertain, 1 with a lower score"
    );
    let all = server.get("/api/export?format=yolo&every=2&status=tracked,uncertain");
    let said = all.header("patchlock-remarks");
    assert_eq!(
        said,
        Some(
            "left out 2 of 4 boxes: 2 in the frames between; doubtful among the 2 boxes written: 1 uncertain"
        )
    );
    for wrong in ["status=gone", "min_score=3", "every=0", "key_frames=1.5", "key_frames=0"] {
        server.get(&format!("/api/clips/1/export?format=cvat&{wrong}")).error(400);
    }
}

#[test]
fn files_of_images_are_imported_together() {
    let server = TestServer::new();
    let files = json!({
        "data.yaml": "names: [boat]\n",
        "frame_000001.txt": "0 0.5 0.5 0.25 0.5\n",
        "frame_000004.txt": "0 0.5 0.5 0.25 0.5\n",
    });
    let preview = server.post("/api/clips/1/import?format=yolo&preview=true", &files);
    assert_eq!(preview.status, 200, "{}", preview.text());
    let preview = preview.json();
    assert_eq!((&preview["boxes"], &preview["last"]), (&json!(2), &json!(4)));
    let note = preview["notes"][0].as_str().expect("a note");
    assert!(note.ends_with("frame_000000 is frame 0"), "{note}");
    assert_eq!(server.post("/api/clips/1/import?format=yolo", &files).status, 200);
    assert_eq!(server.clip()["project"]["targets"].as_array().expect("a list").len(), 2);
    server.send("POST", "/api/clips/1/import?format=yolo", b"x").error(400);
}

/// What a person is asked about: boxes that a person could have drawn, each with the score of the
/// detector.
#[test]
fn a_preview_has_the_first_box_of_each_target() {
    let server = TestServer::new();
    let mot = "1,-1,10,20,30,40,0.75\n1,-1,900000,20,30,40,0.75\n1,-1,60,20,0.5,40,0.75\n\
               2,7,10,20,30,40,0\n3,7,11,20,30,40,0.5\n4,7,12,20,30,40,1\n";
    let preview =
        server.send("POST", "/api/clips/1/import?format=mot&preview=true", mot.as_bytes());
    assert_eq!(preview.status, 200, "{}", preview.text());
    let proposal = |frame: usize, x: f64, score: f64| {
        let bbox = json!({ "x": x, "y": 19.0, "w": 30.0, "h": 40.0 });
        json!({ "frame": frame, "label": "target", "box": bbox, "score": score })
    };
    let expected = [proposal(0, 9.0, 0.75), proposal(2, 10.0, 0.5)];
    let found = preview.json();
    assert_eq!((&found["proposals"], &found["targets"]), (&json!(expected), &json!(4)));
    assert_eq!(server.clip()["project"]["targets"], json!([]));
}

#[test]
fn a_folder_is_exported_as_one_file() {
    let server = TestServer::new();
    server.add_target(0);
    let exported = server.get("/api/clips/1/export?format=voc&frames=true");
    assert_eq!(exported.header("content-type"), Some("application/zip"), "{}", exported.text());
    assert!(exported.body.starts_with(b"PK\x03\x04"));
    for part in ["clip/Annotations/", "clip/JPEGImages/"] {
        assert!(exported.body.windows(part.len()).any(|found| found == part.as_bytes()), "{part}");
    }
}

#[test]
fn what_cannot_be_read_or_written_is_an_error() {
    let server = TestServer::new();
    server.send("POST", "/api/clips/1/import?format=excel", b"x").error(400);
    server.send("POST", "/api/clips/1/import?format=cvat", b"<annotations").error(400);
    server.send("POST", "/api/clips/1/import?format=csv", &[0xff]).error(400);
    server.send("POST", "/api/clips/1/import", b"x").error(400);
    server.get("/api/clips/1/export?format=excel").error(400);
    server.get("/api/clips/1/export?format=mot").error(400);
    assert_eq!(server.clip()["revision"], 0);
}

#[test]
fn the_annotated_video_has_all_frames_with_boxes_drawn_in() {
    let server = TestServer::new();
    let whole = server.truth[7];
    server.add_target(7);
    let answer = server.get("/api/clips/1/video");
    assert_eq!(answer.header("content-type"), Some("video/mp4"), "{}", answer.text());
    assert_eq!(
        answer.header("content-disposition"),
        Some("attachment; filename=\"clip.annotated.mp4\"")
    );
    let mut drawn = opened(&server, &answer.body);
    assert_eq!(drawn.length(), Some(FRAMES));
    let mut plain = patchlock_media::open(
        server.folder.path().join("clip.mp4").to_str().expect("is text"),
        false,
    )
    .expect("opens");
    let mut differs = |frame: usize| -> f64 {
        let pictures = [&mut drawn, &mut plain]
            .map(|video| video.frame(frame).expect("decodes").expect("is there"));
        let (x, y) = (whole.x as usize, (whole.y + whole.h / 2.0) as usize);
        let [a, b] = pictures.map(|picture| {
            let row = 3 * y * picture.width;
            picture.to_rgb()[row + 3 * (x - 2)..row + 3 * (x + 3)].to_vec()
        });
        a.iter().zip(b).map(|(&a, b)| f64::from(a.abs_diff(b))).sum::<f64>() / a.len() as f64
    };
    let (with, without) = (differs(7), differs(20));
    assert!(with > 3.0 * without + 10.0, "{with} {without}");
}

#[test]
fn the_clip_of_a_target_shows_it_in_the_middle() {
    let server = TestServer::new();
    server.add_target(2);
    for frame in 3..9 {
        let bbox = server.truth[frame];
        server.edit(json!({ "edit": "set_key", "target": 1, "frame": frame, "box": bbox }));
    }
    let answer = server.get("/api/clips/1/targets/1/clip");
    assert_eq!(answer.status, 200, "{}", answer.text());
    let mut clip = opened(&server, &answer.body);
    assert_eq!(clip.length(), Some(7));
    let picture = clip.frame(0).expect("decodes").expect("is there");
    let longest = server.truth[8];
    assert!((picture.width as f64 - 2.0 * longest.w).abs() <= 3.0, "{}", picture.width);
    assert!((picture.height as f64 - 2.0 * longest.h).abs() <= 3.0, "{}", picture.height);
    server.get("/api/clips/1/targets/9/clip").error(404);
}
