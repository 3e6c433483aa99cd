//! Labels are those of all clips.

use serde_json::{Value, json};

use crate::support::{Answer, TestServer, options, video};

/// A server with the clips `a.mp4` and `b.mp4`, both open.
fn two_clips() -> TestServer {
    let folder = tempfile::tempdir().expect("a folder");
    let truth = video(&folder.path().join("a.mp4"));
    video(&folder.path().join("b.mp4"));
    let server = TestServer::serving(folder, truth, &["a.mp4", "b.mp4"]);
    for clip in 1..=2 {
        assert_eq!(server.get(&format!("/api/clips/{clip}")).status, 200);
    }
    server
}

fn project(server: &TestServer, clip: usize) -> Value {
    server.get(&format!("/api/clips/{clip}")).json()["project"].clone()
}

fn labels(server: &TestServer, clip: usize) -> Vec<String> {
    let project = project(server, clip);
    let labels = project["labels"].as_array().expect("a list").iter();
    labels.map(|label| label["name"].as_str().expect("a name").to_owned()).collect()
}

fn edit(server: &TestServer, clip: usize, edits: &Value) -> Answer {
    let revision = server.get(&format!("/api/clips/{clip}")).json()["revision"].clone();
    let body = json!({ "revision": revision, "edits": edits });
    server.post(&format!("/api/clips/{clip}/edits"), &body)
}

fn made(server: &TestServer, clip: usize, edits: &Value) {
    let answer = edit(server, clip, edits);
    assert_eq!(answer.status, 200, "{}", answer.text());
}

#[test]
fn a_label_of_one_clip_is_one_of_all() {
    let mut server = two_clips();
    let bbox = server.truth[0];
    let add = json!({ "edit": "add_label", "name": "boat" });
    let target = json!({ "edit": "add_target", "label": "boat", "frame": 0, "box": bbox });
    made(&server, 1, &json!([add]));
    made(&server, 2, &json!([target]));
    assert_eq!(labels(&server, 2), ["target", "boat"]);
    // A clip that has another project is not told by a new revision, but its file has the label.
    let rename = json!({ "edit": "set_label", "name": "boat", "new_name": "ship" });
    made(&server, 1, &json!([rename]));
    assert_eq!(project(&server, 2)["targets"][0]["label"], "ship");
    let file = std::fs::read_to_string(server.folder.path().join("b.patchlock.json"));
    assert!(file.expect("is there").contains("\"label\":\"ship\""));

    let remove = json!({ "edit": "remove_label", "name": "ship" });
    let error = edit(&server, 1, &json!([remove])).error(400);
    assert!(error.contains("targets of this clip or another one have it"), "{error}");
    made(&server, 2, &json!([{ "edit": "delete_target", "target": 1 }]));
    made(&server, 1, &json!([remove]));
    assert_eq!(labels(&server, 2), ["target"]);
    // What is put back brings its label back.
    assert_eq!(server.post("/api/clips/2/undo", &json!({})).status, 200);
    assert_eq!(labels(&server, 1), ["target", "ship"]);
    assert_eq!(project(&server, 2)["targets"][0]["label"], "ship");

    let videos = ["a.mp4", "b.mp4"].map(|name| server.folder.path().join(name));
    let options = options(videos.to_vec(), server.folder.path());
    server.restart_with(&options);
    assert_eq!(labels(&server, 1), ["target", "ship"]);
}

#[test]
fn labels_of_an_import_are_those_of_all_clips() {
    let server = two_clips();
    let table = "frame,id,label,x,y,w,h\n0,1,boat,10,10,20,20\n1,1,boat,11,10,20,20\n";
    let preview = "/api/clips/1/import?format=csv&preview=true";
    let found = server.send("POST", preview, table.as_bytes()).json();
    let expected = json!({
        "targets": 1, "keys": 2, "boxes": 2, "first": 0, "last": 1, "there": 0,
        "labels": [{ "name": "boat", "targets": 1, "new": true }], "attributes": {}, "notes": [],
        "proposals": [{
            "frame": 0, "label": "boat", "score": null,
            "box": { "x": 10.0, "y": 10.0, "w": 20.0, "h": 20.0 },
        }],
    });
    assert_eq!(found, expected);
    assert_eq!(project(&server, 1)["targets"], json!([]));
    let import = "/api/clips/1/import?format=csv";
    assert_eq!(server.send("POST", import, table.as_bytes()).status, 200);
    assert_eq!(labels(&server, 2), ["target", "boat"]);
    let again = server.send("POST", preview, table.as_bytes()).json();
    assert_eq!((&again["there"], &again["labels"][0]["new"]), (&json!(1), &json!(false)));
}

#[test]
fn attributes_of_an_import_are_those_of_all_clips() {
    let server = two_clips();
    let xml = r#"<annotations><meta><task><labels><label><name>boat</name><attributes><attribute>
        <name>sail</name><mutable>True</mutable><input_type>select</input_type>
        <default_value>up</default_value><values>up
            down</values></attribute></attributes></label></labels></task></meta>
        <track id="0" label="boat">
        <box frame="0" xtl="1" ytl="1" xbr="9" ybr="9" keyframe="1"><attribute name="sail">up</attribute></box>
        <box frame="1" xtl="1" ytl="1" xbr="9" ybr="9" keyframe="1"><attribute name="sail">down</attribute></box>
        </track></annotations>"#;
    let preview = "/api/clips/1/import?format=cvat&preview=true";
    let found = server.send("POST", preview, xml.as_bytes()).json();
    assert_eq!(found["attributes"], json!({ "boat": ["sail"] }));
    assert_eq!(labels(&server, 1), ["target"]);
    let answer = server.send("POST", "/api/clips/1/import?format=cvat", xml.as_bytes());
    assert_eq!(answer.status, 200, "{}", answer.text());
    let sail = json!({
        "name": "sail", "kind": "select", "values": ["up", "down"], "default": "up", "mutable": true,
    });
    assert_eq!(project(&server, 2)["labels"][1]["attributes"], json!([sail]));
    assert_eq!(project(&server, 1)["targets"][0]["changes"], json!({ "sail": { "1": "down" } }));
    let again = server.send("POST", preview, xml.as_bytes()).json();
    assert_eq!(again["attributes"], json!({}));
    let value = |value: &str| {
        json!({
            "edit": "set_value", "target": 1, "name": "sail", "frame": 1, "value": value,
        })
    };
    let error = edit(&server, 1, &json!([value("torn")])).error(400);
    assert!(error.contains("allowed: up, down"), "{error}");
    made(&server, 1, &json!([value("up")]));
    assert_eq!(project(&server, 1)["targets"][0].get("changes"), None);
}

#[test]
fn all_clips_are_exported_as_one_file() {
    let server = two_clips();
    let bbox = server.truth[0];
    for clip in 1..=2 {
        let target = json!({ "edit": "add_target", "label": "target", "frame": 0, "box": bbox });
        made(&server, clip, &json!([target]));
    }
    let images =
        ["clips/data.yaml", "clips/images/train/", "clips/images/val/", "_frame_000000.jpg"];
    for (query, parts) in [
        ("format=yolo&frames=true&val=0.5", &images[..]),
        // A table for each clip.
        ("format=csv", &["clips/a.csv", "clips/b.csv"]),
    ] {
        let exported = server.get(&format!("/api/export?{query}"));
        assert_eq!(exported.header("content-type"), Some("application/zip"), "{}", exported.text());
        for part in parts {
            let found = exported.body.windows(part.len()).any(|found| found == part.as_bytes());
            assert!(found, "{part}");
        }
    }
    server.get("/api/export?format=yolo&val=2").error(400);
    server.get("/api/export?format=yolo&val=z").error(400);
}
