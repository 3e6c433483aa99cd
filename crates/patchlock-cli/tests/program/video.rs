//! The annotated video, read back.

use std::fs;

use crate::support::film;
use patchlock_media::{FrameRate, Mp4Writer};
use predicates::prelude::*;

#[test]
fn the_annotated_video_has_all_frames_at_the_rate_of_the_source() {
    let bench = crate::support::Bench::new();
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

fn uneven(bench: &crate::support::Bench) {
    let file = fs::File::create(bench.path("v.mp4")).unwrap();
    let mut writer = Mp4Writer::new(file, 96, 72, FrameRate::DEFAULT, None).unwrap();
    for (k, &time) in TIMES.iter().enumerate() {
        writer.push_at(&film(k, 96, 72), Some(time)).unwrap();
    }
    writer.finish().unwrap();
}

#[test]
fn uneven_times_are_kept_in_video_and_tables() {
    let bench = crate::support::Bench::new();
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
    assert_eq!(csv[0], format!("{},time", crate::support::COLUMNS));
    near(&crate::support::column(&csv, "time"), &TIMES);
    assert!(bench.lines("a.jsonl")[3].ends_with(",\"time\":0.25}"), "{:?}", bench.lines("a.jsonl"));
    bench.track("v.mp4").args(["--video", "half.mp4", "--stride", "2"]).assert().success();
    near(&times("half.mp4"), &[0.0, 0.24, 0.95]);
    let export = ["export", "a.csv", "--format", "mot", "--out", "a.mot"];
    crate::support::patchlock().current_dir(bench.folder.path()).args(export).assert().success();
    bench.images("f", 2);
    bench.track("f").assert().success().stdout(predicate::str::contains("time").not());
}

#[test]
fn the_quality_of_the_video_can_be_chosen() {
    let bench = crate::support::Bench::new();
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

/// Size and delays, in hundredths of a second, of an animation.
fn animation(bench: &crate::support::Bench, name: &str) -> ((u16, u16), Vec<u16>) {
    let file = fs::File::open(bench.path(name)).unwrap();
    let mut decoder = gif::DecodeOptions::new().read_info(file).unwrap();
    let size = (decoder.width(), decoder.height());
    let mut delays = Vec::new();
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        delays.push(frame.delay);
    }
    (size, delays)
}

#[test]
fn an_animation_has_ten_frames_per_second() {
    let bench = crate::support::Bench::new();
    bench.mp4("v.mp4", 20);
    bench.track("v.mp4").args(["--gif", "out.gif"]).assert().success();
    let ((width, height), delays) = animation(&bench, "out.gif");
    // 25 frames per second, so 0.8 s.
    assert_eq!(delays, [10; 8]);
    let source = patchlock_media::open(bench.path("v.mp4").to_str().unwrap(), false);
    let first = source.unwrap().frame(0).unwrap().unwrap();
    assert_eq!((usize::from(width), usize::from(height)), (first.width, first.height));
    uneven(&bench);
    bench.track("v.mp4").args(["--gif", "out.gif", "--overwrite"]).assert().success();
    assert_eq!(animation(&bench, "out.gif").1.len(), 3, "at 0, 0.24 and 0.95 s");
    let wrong = bench.track("v.mp4").args(["--gif", "out.mp4"]).assert();
    wrong.code(2).stderr(predicate::str::contains("must end in .gif"));
}

#[test]
fn the_part_around_the_target_can_be_shown_alone() {
    let bench = crate::support::Bench::new();
    bench.mp4("v.mp4", 6);
    let outputs = ["--video", "out.mp4", "--gif", "out.gif", "--crop", "3", "--panel", "off"];
    bench.track("v.mp4").args(outputs).assert().success();
    let mut video = patchlock_media::open(bench.path("out.mp4").to_str().unwrap(), false).unwrap();
    let frame = video.frame(5).unwrap().unwrap();
    assert_eq!((video.length(), frame.width, frame.height), (Some(6), 240, 240));
    assert_eq!(animation(&bench, "out.gif").0, (240, 240));
    let fails = |options: &[&str], words: &str| {
        let result = bench.track("v.mp4").args(options).assert();
        result.code(2).stderr(predicate::str::contains(words));
    };
    fails(&["--video", "o.mp4", "--crop", "0.5"], "--crop 0.5: must be 1 to 20");
    fails(&["--video", "o.mp4", "--crop", "nan"], "--crop NaN: must be 1 to 20");
    fails(&["--crop", "3"], "--video");
    fails(&["--panel", "off"], "--video");
    fails(&["--box", "1,1,9,9", "--video", "o.mp4", "--crop", "3"], "around one target");
}

#[test]
fn sound_is_left_out_with_a_note() {
    let bench = crate::support::Bench::new();
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../patchlock-media/tests/data/turned.mov");
    let note = "note: out.mp4 has no sound: only pictures are written\n";
    let run = || {
        let mut command = crate::support::patchlock();
        command.current_dir(bench.folder.path());
        command.args(["track", file, "--box", "10,10,30,30", "--quiet", "--end", "2"]);
        command
    };
    run().args(["--video", "out.mp4"]).assert().success().stderr(note);
    run().assert().success().stderr("");
}
