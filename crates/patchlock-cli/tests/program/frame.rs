//! `patchlock frame` saves a frame, and the pages and completions cover every command.

use std::fs;

use crate::support::{Bench, patchlock};
use predicates::prelude::*;
use predicates::str::contains;

fn frame(bench: &Bench, args: &[&str]) -> assert_cmd::assert::Assert {
    patchlock().current_dir(bench.folder.path()).arg("frame").args(args).assert()
}

#[test]
fn a_frame_is_saved_as_it_is_or_with_a_grid() {
    let bench = Bench::new();
    bench.images("f", 4);
    frame(&bench, &["f", "--at", "2", "--out", "plain.png"])
        .success()
        .stdout("")
        .stderr(contains("plain.png: frame 2, 96 x 72 pixels"));
    let rgb = |name: &str| image::open(bench.path(name)).unwrap().to_rgb8();
    assert_eq!(rgb("plain.png"), rgb("f/2.png"));
    frame(&bench, &["f", "--grid"]).success();
    let (grid, plain) = (rgb("frame_000000.png"), rgb("f/0.png"));
    assert_eq!(grid.dimensions(), plain.dimensions());
    let changed =
        |x: u32| (0..72).filter(|&y| grid.get_pixel(x, y) != plain.get_pixel(x, y)).count();
    // A line every 10 pixels: all of column 50 is drawn on, little of column 55.
    assert!(changed(50) > 60 && changed(55) < 40, "{} {}", changed(50), changed(55));
}

#[test]
fn errors_say_what_to_do() {
    let bench = Bench::new();
    bench.images("f", 2);
    frame(&bench, &["f", "--at", "2"])
        .code(2)
        .stderr(contains("--at 2 is beyond the end: the source has 2 frames"));
    let y4m = crate::support::y4m(3);
    let mut stream = patchlock();
    stream.current_dir(bench.folder.path()).args(["frame", "-", "--at", "3", "--out", "s.png"]);
    stream.write_stdin(y4m).assert().code(2).stderr(contains("--at 3 is beyond the end"));
    frame(&bench, &["f", "--out", "a.jpg"]).code(2).stderr(contains("unknown extension; use .png"));
    frame(&bench, &["f"]).success();
    frame(&bench, &["f"]).code(2).stderr(contains("already exists").and(contains("--overwrite")));
    frame(&bench, &["f", "--overwrite"]).success();
    frame(&bench, &["nowhere.mp4", "--out", "b.png"]).code(1).stderr(contains("nowhere.mp4"));
}

#[test]
fn large_frames_need_the_option() {
    let bench = Bench::new();
    bench.images("f", 1);
    frame(&bench, &["f", "--max-pixels", "6911"]).code(1).stderr(
        contains("96 x 72 pixels are more than the 6911").and(contains("--max-pixels 6912")),
    );
    frame(&bench, &["f", "--max-pixels", "0"]).code(2).stderr(contains("--max-pixels"));
    frame(&bench, &["f", "--max-pixels", "6912"]).success();
}

const COMMANDS: [&str; 13] = [
    "track",
    "frame",
    "export",
    "demo",
    "studio",
    "config",
    "dataset",
    "bench",
    "score",
    "report",
    "trax",
    "completions",
    "man",
];

#[test]
fn every_shell_has_completions() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let output = patchlock().args(["completions", shell]).output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        for word in COMMANDS.into_iter().chain(["overwrite", "box-from"]) {
            assert!(text.contains(word), "{shell}: {word}");
        }
    }
    // The others complete no values.
    for shell in ["bash", "zsh", "fish"] {
        let output = patchlock().args(["completions", shell]).output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        for format in ["label-studio", "yolo-obb", "got10k"] {
            assert!(text.contains(format), "{shell}: {format}");
        }
    }
    patchlock().args(["completions", "cmd"]).assert().code(2).stderr(contains("bash"));
}

#[test]
fn every_command_has_a_manual_page() {
    let output = patchlock().arg("man").output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains(".TH patchlock 1") && text.contains("EXIT CODES"), "{text}");
    let folder = tempfile::tempdir().unwrap();
    patchlock().args(["man", "--out"]).arg(folder.path()).assert().success();
    for command in COMMANDS {
        let page = folder.path().join(format!("patchlock-{command}.1"));
        assert!(fs::read_to_string(page).unwrap().contains("EXAMPLES"), "{command}");
    }
    let new = folder.path().join("a/b");
    patchlock().args(["man", "--out"]).arg(&new).assert().success();
    assert!(new.join("patchlock-track.1").is_file());
    let file = folder.path().join("patchlock.1");
    let error = patchlock().args(["man", "--out"]).arg(file).assert().code(1);
    error.stderr(contains("patchlock.1: cannot make it"));
}
