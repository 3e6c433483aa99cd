//! The annotated video, read back.

mod support;

use std::fs;

use patchlock_media::{FrameRate, Mp4Writer};
use predicates::prelude::*;
use support::film;

#[test]
fn the_annotated_video_has_all_frames_at_the_rate_of_the_source() {
    let bench = support::Bench::new();
    bench.mp4("v.mp4", 6);
    bench.track("v.mp4").args(["--video", "out.mp4"]).assert().success();
    bench.track("v.mp4").args(["--video", "half.mp4", "--stride", "2"]).assert().success();
    let look = |name: &str| {
        let video = patchlock_media::open(bench.path(name).to_str().unwrap(), false).unwrap();
        (video.length(), video.rate().map(|rate| f64::from(rate.frames) / f64::from(rate.seconds)))
    };
    assert_eq!(look("out.mp4"), (Some(6), Some(25.0)));
    assert_eq!(look("half.mp4"), (Some(3), Some(12.5)));
}

/// Frames at uneven times, as phones and screen recorders write them.
const TIMES: [f64; 5] = [0.0, 0.04, 0.24, 0.25, 0.95];

fn uneven(bench: &support::Bench) {
    let file = fs::File::create(bench.path("v.mp4")).unwrap();
    let mut writer = Mp4Writer::new(file, 96, 72, FrameRate::DEFAULT, None).unwrap();
    for (k, &time) in TIMES.iter().enumerate() {
        writer.push_at(&film(k, 96, 72), Some(time)).unwrap();
    }
    writer.finish().unwrap();
}

#[test]
fn uneven_times_are_kept_in_video_and_tables() {
    let bench = support::Bench::new();
    uneven(&bench);
    let times = |name: &str| -> Vec<f64> {
        let mut video = patchlock_media::open(bench.path(name).to_str().unwrap(), false).unwrap();
        (0..).map_while(|k| video.frame(k).unwrap()?.time).collect()
    };
    let outputs = ["--video", "out.mp4", "--save", "a.csv", "--save", "a.jsonl"];
    bench.track("v.mp4").args(outputs).assert().success();
    let near = |found: &[f64], expected: &[f64]| {
        assert_eq!(found.len(), expected.len());
        let far = found.iter().zip(expected).find(|(a, b)| (*a - *b).abs() > 1e-4);
        assert_eq!(far, None, "{found:?}");
    };
    near(&times("out.mp4"), &TIMES);
    let csv = bench.lines("a.csv");
    assert_eq!(csv[0], format!("{},time", support::COLUMNS));
    near(&support::column(&csv, "time"), &TIMES);
    assert!(bench.lines("a.jsonl")[3].ends_with(",\"time\":0.25}"), "{:?}", bench.lines("a.jsonl"));
    bench.track("v.mp4").args(["--video", "half.mp4", "--stride", "2"]).assert().success();
    near(&times("half.mp4"), &[0.0, 0.24, 0.95]);
    let export = ["export", "a.csv", "--format", "mot", "--out", "a.mot"];
    support::patchlock().current_dir(bench.folder.path()).args(export).assert().success();
    bench.images("f", 2);
    bench.track("f").assert().success().stdout(predicate::str::contains("time").not());
}

#[test]
fn the_quality_of_the_video_can_be_chosen() {
    let bench = support::Bench::new();
    bench.mp4("v.mp4", 4);
    let size = |quality: Option<&str>| {
        let mut command = bench.track("v.mp4");
        command.args(["--video", "out.mp4", "--overwrite"]);
        if let Some(quality) = quality {
            command.args(["--quality", quality]);
        }
        command.assert().success();
        fs::metadata(bench.path("out.mp4")).unwrap().len()
    };
    let [best, usual, given, smallest] = [Some("0"), None, Some("26"), Some("51")].map(size);
    assert!(best > 2 * usual && usual == given && given > smallest, "{best} {usual} {smallest}");
    let wrong = bench.track("v.mp4").args(["--video", "o.mp4", "--quality", "52"]).assert();
    wrong.code(2).stderr(predicate::str::contains("0..=51"));
    let alone = bench.track("v.mp4").args(["--quality", "30"]).assert();
    alone.code(2).stderr(predicate::str::contains("--video"));
}

#[test]
fn sound_is_left_out_with_a_note() {
    let bench = support::Bench::new();
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../patchlock-media/tests/data/turned.mov");
    let note = "note: out.mp4 has no sound: only pictures are written\n";
    let run = || {
        let mut command = support::patchlock();
        command.current_dir(bench.folder.path());
        command.args(["track", file, "--box", "10,10,30,30", "--quiet", "--end", "2"]);
        command
    };
    run().args(["--video", "out.mp4"]).assert().success().stderr(note);
    run().assert().success().stderr("");
}
