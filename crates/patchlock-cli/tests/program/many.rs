//! Tests of `patchlock track` with many targets.

use std::fs;

use crate::support::{BOX, Bench, COLUMNS};
use predicates::prelude::*;

/// A box inside the card: on the smooth background the atoms are almost equal, which makes coding
/// slow.
const OTHER: &str = "30,24,20,18";

/// The rows of a table: target, frame, and the other columns.
fn rows(lines: &[String]) -> Vec<(u64, usize, String)> {
    let row = |line: &String| {
        let cells: Vec<&str> = line.split(',').collect();
        (cells[1].parse().unwrap(), cells[0].parse().unwrap(), cells[2..17].join(","))
    };
    lines[1..].iter().map(row).collect()
}

/// The rows of a run with this box only, from `start` to `end`, as rows of target `id`.
fn alone(bench: &Bench, id: u64, bbox: &str, start: &str, end: &str) -> Vec<(u64, usize, String)> {
    let output = bench.bare("f").args(["--box", bbox, "--start", start, "--end", end]).output();
    let lines = String::from_utf8(output.unwrap().stdout).unwrap();
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        (id, cells[0].parse().unwrap(), cells[1..16].join(","))
    };
    lines.lines().skip(1).map(row).collect()
}

#[test]
fn several_boxes_give_the_tracks_of_single_runs() {
    let bench = Bench::new();
    bench.images("f", 6);
    let outputs =
        ["--save", "a.csv", "--save", "a.jsonl", "--video", "a.mp4", "--summary", "a.json"];
    bench.track("f").args(["--box", OTHER]).args(outputs).assert().success().stderr("");
    let lines = bench.lines("a.csv");
    assert_eq!(lines[0], COLUMNS.replacen("frame,", "frame,id,", 1));
    let mut expected = alone(&bench, 1, BOX, "0", "6");
    expected.extend(alone(&bench, 2, OTHER, "0", "6"));
    expected.sort_by_key(|(id, frame, _)| (*frame, *id));
    assert_eq!(rows(&lines), expected);
    let first: serde_json::Value = serde_json::from_str(&bench.lines("a.jsonl")[1]).unwrap();
    assert_eq!((&first["frame"], &first["id"]), (&0.into(), &2.into()));
    let summary: serde_json::Value =
        serde_json::from_slice(&fs::read(bench.path("a.json")).unwrap()).unwrap();
    assert_eq!((&summary["frames"], &summary["targets"]), (&6.into(), &2.into()));
    let video = patchlock_media::open(bench.path("a.mp4").to_str().unwrap(), false).unwrap();
    assert_eq!(video.length(), Some(6));
}

#[test]
fn targets_start_restart_and_end_at_any_frame() {
    let bench = Bench::new();
    bench.images("f", 8);
    let table = format!("frame,id,x,y,w,h\n1,5,{BOX}\n2,3,{OTHER}\n4,3,34,24,20,18\n6,5,,,,\n");
    fs::write(bench.path("t.csv"), table).unwrap();
    let run = || {
        let mut command = bench.bare("f");
        command.args(["--boxes", "t.csv"]);
        command
    };
    run().args(["--save", "a.csv", "--video", "a.mp4"]).assert().success();
    let mut expected = alone(&bench, 5, BOX, "1", "6");
    expected.extend(alone(&bench, 3, OTHER, "2", "4"));
    expected.extend(alone(&bench, 3, "34,24,20,18", "4", "8"));
    expected.sort_by_key(|(id, frame, _)| (*frame, *id));
    assert_eq!(rows(&bench.lines("a.csv")), expected);
    // Frame 0 has no target yet, but is part of the video.
    let video = patchlock_media::open(bench.path("a.mp4").to_str().unwrap(), false).unwrap();
    assert_eq!(video.length(), Some(8));
    // In reverse, the start in the later frame comes first.
    fs::write(bench.path("t.csv"), format!("frame,id,x,y,w,h\n7,1,{BOX}\n5,1,,,,\n")).unwrap();
    run().args(["--reverse", "--save", "b.csv"]).assert().success();
    let frames: Vec<_> = rows(&bench.lines("b.csv")).iter().map(|(_, frame, _)| *frame).collect();
    assert_eq!(frames, [7, 6]);
}

#[test]
fn exports_keep_the_ids_of_targets() {
    let bench = Bench::new();
    bench.images("f", 3);
    bench.track("f").args(["--box", OTHER, "--save", "a.csv"]).assert().success();
    let mut export = crate::support::patchlock();
    export.current_dir(bench.folder.path());
    export.args(["export", "a.csv", "--format", "mot", "--out", "a.txt"]).assert().success();
    let ids: Vec<String> =
        bench.lines("a.txt").iter().map(|line| line.split(',').nth(1).unwrap().into()).collect();
    assert_eq!(ids, ["1", "2", "1", "2", "1", "2"]);
}

#[test]
fn errors_name_their_cause() {
    let bench = Bench::new();
    bench.images("f", 4);
    let table = |lines: &str| {
        fs::write(bench.path("t.csv"), format!("frame,id,x,y,w,h\n{lines}\n")).unwrap();
        bench.bare("f").args(["--boxes", "t.csv", "--save", "a.csv"]).assert()
    };
    let says =
        |words: &str| predicate::str::contains(words).and(predicate::str::contains("hint: "));
    table("9,1,1,2,30,40").code(2).stderr(says("target 1 has a line for frame 9"));
    table("0,1,500,2,30,40").code(2).stderr(says("no part of the box is in it"));
    table("0,1,1,2,30,40\n2,4,,,,").code(2).stderr(says("target 4 ends in frame 2, but"));
    // The frames tracked before the error are kept.
    assert_eq!(bench.lines("a.csv").len(), 3);
    fs::remove_file(bench.path("a.csv")).unwrap();
    table("0,1,1,2,30").code(2).stderr(says("t.csv"));
    assert!(!bench.path("a.csv").exists());
    let text = ["--box", OTHER, "--save", "a.txt"];
    bench.track("f").args(text).assert().code(2).stderr(says("a .txt file holds one target"));
    let both = ["--boxes", "t.csv"];
    bench.track("f").args(both).assert().code(2).stderr(predicate::str::contains("--boxes"));
    // A source of unknown length that ends too early.
    fs::write(bench.path("t.csv"), format!("frame,id,x,y,w,h\n0,1,{BOX}\n7,2,{OTHER}\n")).unwrap();
    let mut piped = bench.bare("-");
    piped.args(["--boxes", "t.csv", "--save", "b.csv"]).write_stdin(crate::support::y4m(3));
    piped.assert().code(2).stderr(says("target 2 has a line for frame 7"));
    assert_eq!(bench.lines("b.csv").len(), 4);
}
