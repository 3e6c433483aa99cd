//! Label Studio.

use crate::support::*;
use patchlock_track::export::{self, KeyFrames, Options, Track};
use serde_json::Value;
use std::fs;

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
