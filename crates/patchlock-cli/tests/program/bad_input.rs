//! Invalid input: each error says what failed, where, and what to do, and has the right exit code.

use std::fs;

use crate::support::{Bench, patchlock};
use assert_cmd::assert::Assert;
use predicates::prelude::*;

/// Checks the exit code and that the error contains these words.
fn fails(result: Assert, code: i32, words: &[&str]) {
    let mut result = result.code(code);
    for word in words {
        result = result.stderr(predicate::str::contains(*word));
    }
    result
        .stderr(predicate::str::contains("error: "))
        .stderr(predicate::str::contains("panicked").not());
}

#[test]
fn missing_file() {
    let bench = Bench::new();
    fails(bench.track("nowhere.mp4").assert(), 1, &["no file or folder nowhere.mp4", "hint: "]);
    fails(bench.track("nowhere/%04d.jpg").assert(), 1, &["nowhere"]);
    fails(bench.track("*.jpg").assert(), 1, &["no image matches *.jpg"]);
    fails(bench.bare("x").args(["--box-from", "no.txt"]).assert(), 1, &["no.txt", "hint: "]);
}

#[test]
fn folder_without_images() {
    let bench = Bench::new();
    bench.images("seq/img", 1);
    fails(bench.track("seq").assert(), 1, &["no images in the folder seq", "seq/img"]);
    fs::create_dir(bench.path("empty")).unwrap();
    fails(bench.track("empty").assert(), 1, &["no images", "jpg"]);
    fails(bench.track("empty/%d.png").assert(), 1, &["no file matches"]);
}

#[test]
fn damaged_images_in_the_middle_keep_what_was_tracked() {
    for kind in ["garbage", "empty", "half png", "half jpeg"] {
        let bench = Bench::new();
        bench.images("f", 4);
        let victim = bench.path("f/2.png");
        match kind {
            "garbage" => fs::write(&victim, b"not an image").unwrap(),
            "empty" => fs::write(&victim, b"").unwrap(),
            "half png" => {
                let data = fs::read(&victim).unwrap();
                fs::write(&victim, &data[..data.len() / 2]).unwrap();
            }
            _ => {
                crate::support::grey_jpeg(&bench.path("t.jpg"), 2);
                let data = fs::read(bench.path("t.jpg")).unwrap();
                fs::write(&victim, &data[..data.len() * 2 / 3]).unwrap();
            }
        }
        let result = bench.track("f").args(["--save", "a.csv", "--video", "a.mp4"]).assert();
        fails(result, 1, &["frame 2", "2.png", "hint: ", "note: the 2 frames"]);
        assert_eq!(bench.lines("a.csv").len(), 3, "{kind}: a header and two rows");
        assert!(bench.path("a.mp4").exists());
        assert!(bench.leftovers().is_empty());
    }
}

#[cfg(unix)]
#[test]
fn broken_links_are_unreadable_frames() {
    let bench = Bench::new();
    bench.images("f", 4);
    fs::create_dir(bench.path("f/5.png")).unwrap();
    fs::remove_file(bench.path("f/2.png")).unwrap();
    std::os::unix::fs::symlink("nowhere.png", bench.path("f/2.png")).unwrap();
    for source in ["f", "f/%d.png", "f/*.png"] {
        fails(bench.track(source).assert(), 1, &["cannot read frame 2, f/2.png", "hint: "]);
    }
    fs::remove_file(bench.path("f/2.png")).unwrap();
    bench.track("f").assert().success();
    bench.track("f/*.png").assert().success();
}

#[test]
fn an_mp4_without_its_end_is_tracked_as_far_as_it_goes() {
    let bench = Bench::new();
    let video = bench.mp4("v.mp4", 8);
    let data = fs::read(&video).unwrap();
    fs::write(&video, &data[..data.len() - 30]).unwrap();
    for more in [&[][..], &["--reverse", "--overwrite"]] {
        let result = bench.track("v.mp4").args(["--save", "a.csv"]).args(more).assert();
        let note = "note: 1 frame at the end of v.mp4 cannot be decoded: they do not count\n";
        result.success().stderr(predicates::str::contains(note));
        assert_eq!(bench.lines("a.csv").len() - 1, 7);
    }
}

#[test]
fn frames_with_too_many_pixels() {
    let bench = Bench::new();
    bench.mp4("v.mp4", 3);
    let few = bench.track("v.mp4").args(["--max-pixels", "100"]).assert();
    fails(
        few,
        1,
        &["cannot read v.mp4", "are more than the 100 that are accepted", "hint: if that"],
    );
    bench.track("v.mp4").args(["--max-pixels", "1000000"]).assert().success();
    bench.images("f", 2);
    let few = bench.track("f").args(["--max-pixels", "100"]).assert();
    fails(few, 1, &["cannot read frame 0", "are more than the 100 that are accepted"]);
    let none = bench.track("f").args(["--max-pixels", "0"]).assert();
    fails(none, 2, &["--max-pixels"]);
}

#[cfg(unix)]
#[test]
fn a_device_as_source() {
    let bench = Bench::new();
    fails(bench.track("/dev/zero").assert(), 1, &["/dev/zero is a pipe or a device", "hint: "]);
}

#[test]
fn mp4_without_its_index() {
    let bench = Bench::new();
    let video = bench.mp4("v.mp4", 3);
    let data = fs::read(&video).unwrap();
    fs::write(&video, &data[..60]).unwrap();
    fails(bench.track("v.mp4").assert(), 1, &["cannot read v.mp4", "hint: "]);
}

#[test]
fn mp4_with_sound_only() {
    let bench = Bench::new();
    let video = bench.mp4("v.mp4", 2);
    let mut data = fs::read(&video).unwrap();
    let kind = (0..data.len()).find(|&k| data[k..].starts_with(b"vide")).unwrap();
    data[kind..kind + 4].copy_from_slice(b"soun");
    fs::write(&video, data).unwrap();
    let words = ["there is no video in v.mp4", "hint: name a file with a video"];
    fails(bench.track("v.mp4").assert(), 1, &words);
}

#[test]
fn no_damage_of_an_mp4_causes_a_panic() {
    let bench = Bench::new();
    let data = fs::read(bench.mp4("v.mp4", 4)).unwrap();
    for step in 1..24 {
        let mut broken = data.clone();
        let at = data.len() * step / 24;
        broken[at..(at + 40).min(data.len())].fill(0xa5);
        fs::write(bench.path("b.mp4"), broken).unwrap();
        let output = bench.track("b.mp4").args(["--quiet"]).env("PATH", "").output().unwrap();
        assert!(matches!(output.status.code(), Some(0 | 1)), "{:?}", output);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(!said.contains("panicked"), "{said}");
    }
}

#[test]
fn unknown_codec_without_ffmpeg() {
    let bench = Bench::new();
    fs::write(bench.path("v.webm"), b"\x1a\x45\xdf\xa3 something else entirely").unwrap();
    let words = ["v.webm", "ffmpeg", "not on the PATH", "hint: install ffmpeg"];
    fails(bench.track("v.webm").env("PATH", "").assert(), 1, &words);
    // The same for a known container with an unknown codec.
    let video = bench.mp4("v.mp4", 2);
    let mut data = fs::read(&video).unwrap();
    let places: Vec<usize> = (0..data.len() - 4).filter(|&k| &data[k..k + 4] == b"avc1").collect();
    places.into_iter().for_each(|k| data[k..k + 4].copy_from_slice(b"xyz1"));
    fs::write(&video, data).unwrap();
    fails(bench.track("v.mp4").env("PATH", "").assert(), 1, &["xyz1", "ffmpeg"]);
}

#[test]
fn a_box_that_does_not_fit() {
    let bench = Bench::new();
    bench.images("f", 2);
    let boxed = |text: &str| bench.bare("f").arg("--box").arg(text).assert();
    fails(boxed("500,10,20,20"), 2, &["500,10,20,20", "frame 0", "96 x 72", "hint: "]);
    fails(boxed("-50,10,20,20"), 2, &["no part of the box"]);
    for bad in ["10,10,0,20", "10,10,20,-5", "10,10,20,NaN", "inf,10,20,20"] {
        fails(boxed(bad), 2, &[bad, "hint: a box is X,Y,W,H"]);
    }
    for bad in ["10,10,20", "10;10;20;20", "a,b,c,d", "", "1,2,3,4,5"] {
        fails(boxed(bad), 2, &["not four numbers", "hint: a box is X,Y,W,H"]);
    }
    fs::write(bench.path("t.txt"), "hello\n").unwrap();
    fails(
        bench.bare("f").args(["--box-from", "t.txt"]).assert(),
        2,
        &["t.txt", "hello", "counted from 1"],
    );
    bench.bare("f").assert().code(2).stderr(predicate::str::contains("--box"));
    fails(boxed("10,10,200000,10"), 2, &["10,10,200000,10", "1 to 100000 pixels"]);
    fails(
        boxed("1e300,10,20,20"),
        2,
        &["--box 1e300,10,20,20: 1e300 is not a coordinate; allowed: -1e9 to 1e9"],
    );
    for bad in ["NaN,1,20,20", "5,5,0,20"] {
        fs::write(bench.path("t.txt"), bad).unwrap();
        let result = bench.bare("f").args(["--box-from", "t.txt"]).assert();
        fails(result, 2, &["t.txt", bad, "hint: the line of the first tracked frame", "from 1"]);
    }
}

#[test]
fn options_that_are_not_valid_numbers() {
    let bench = Bench::new();
    for (option, value, allowed) in [
        ("--start", "-1", "0.."),
        ("--end", "1.5", "0.."),
        ("--stride", "x", "1.."),
        ("--seed", "-1", "0..=9007199254740991"),
        ("--seed", "1.5", "0..=9007199254740991"),
        ("--seed", "9007199254740992", "0..=9007199254740991"),
        ("--threads", "abc", "1..=1024"),
        ("--threads", "-2", "1..=1024"),
    ] {
        let result = bench.track("f").args([option, value]).assert();
        fails(result, 2, &[&format!("invalid value '{value}' for '{option} <{allowed}>'")]);
    }
}

#[test]
fn frames_of_changing_size() {
    let bench = Bench::new();
    bench.images("f", 4);
    image::RgbImage::new(50, 40).save(bench.path("f/2.png")).unwrap();
    let result = bench.track("f").args(["--save", "a.csv"]).assert();
    fails(result, 1, &["frame 2 is 50 x 40", "96 x 72", "hint: "]);
    assert_eq!(bench.lines("a.csv").len(), 3);
}

#[test]
fn unknown_presets_and_settings() {
    let bench = Bench::new();
    fails(
        bench.track("x").args(["--preset", "papre"]).assert(),
        2,
        &["papre", "the presets are robust, paper, network"],
    );
    let configured = |text: &str| {
        fs::write(bench.path("c.toml"), text).unwrap();
        let mut command = patchlock();
        command
            .current_dir(bench.folder.path())
            .args(["track", "x", "--box", "1,1,9,9", "--config", "c.toml"]);
        command.assert()
    };
    fails(
        configured("[paper]\npartcles = 3"),
        2,
        &["c.toml", "partcles", "did you mean particles?"],
    );
    let whole = "takes: a whole number, 1 to 100000";
    let paper = |setting: &str| configured(&format!("[paper]\n{setting}"));
    for wrong in ["\"many\"", "1.5", "650.0", "[1]"] {
        let said = ["`particles` is", "it takes a whole number", whole];
        fails(paper(&format!("particles = {wrong}")), 2, &said);
    }
    fails(paper("particles = -5"), 2, &["`particles` is -5; allowed: 1 to 100000"]);
    fails(paper("sigma_x = -1.0"), 2, &["c.toml: ", "sigma_x", "allowed: 0 to 1000"]);
    fails(paper("gamma = \"foo\""), 2, &["`gamma` is foo; allowed: exp_visible, one"]);
    let unused = "the setting `particles` has no effect with the method `robust`";
    fails(configured("particles = 300"), 2, &["c.toml: ", unused, "--preset paper"]);
    let unused = "the setting `search` has no effect with the method `paper`";
    fails(configured("search = 4.0\n[paper]"), 2, &["c.toml: ", unused, "--preset robust"]);
    fails(
        configured("[paper]\n[robust]"),
        2,
        &["c.toml", "several methods: robust and paper", "one method"],
    );
    // The settings of these tests choose the paper's tracker.
    let unused = bench.track("x").args(["--set", "rotate=true"]).assert();
    fails(unused, 2, &["--set: ", "`rotate` has no effect with the method `paper`"]);
    fails(paper("particles = 0"), 2, &["c.toml: ", "particles", "allowed"]);
    fails(bench.track("x").args(["--preset", ""]).assert(), 2, &["unknown preset \"\""]);
    fails(bench.track("").assert(), 1, &["no file or folder \"\""]);
    fails(configured("seed = 1\nparticles 3"), 2, &["c.toml, line 2", "TOML"]);
    fails(patchlock().args(["config", "--preset", "nope"]).assert(), 2, &["nope", "paper"]);
}

#[test]
fn outputs_that_cannot_be_written() {
    let bench = Bench::new();
    bench.images("f", 2);
    let saved = |name: &str| bench.track("f").args(["--save", name]).assert();
    fails(saved("no/such/a.csv"), 1, &["no/such", "hint: mkdir"]);
    fails(saved("a.xlsx"), 2, &["a.xlsx", ".csv, .jsonl or .txt"]);
    fails(saved("noend"), 2, &[".csv, .jsonl or .txt"]);
    fails(bench.track("f").args(["--video", "a.avi"]).assert(), 2, &["a.avi", "mp4"]);
    fs::write(bench.path("a.csv"), "old").unwrap();
    fails(saved("a.csv"), 2, &["a.csv already exists", "--overwrite"]);
    assert_eq!(fs::read_to_string(bench.path("a.csv")).unwrap(), "old");
    let twice = bench.track("f").args(["--save", "b.csv", "--save", "./b.csv"]).assert();
    fails(twice, 2, &["b.csv", "two outputs"]);
    let itself = bench.track("f/0.png").args(["--overwrite", "--summary", "f/0.png"]).assert();
    fails(itself, 2, &["is an input and would be replaced"]);
    bench.track("f").args(["--save", "a.csv", "--overwrite"]).assert().success();
    assert_eq!(bench.lines("a.csv").len(), 3);
}

#[cfg(unix)]
#[test]
fn folders_without_permission() {
    use std::os::unix::fs::PermissionsExt;
    let bench = Bench::new();
    bench.images("f", 2);
    fs::create_dir(bench.path("ro")).unwrap();
    fs::set_permissions(bench.path("ro"), fs::Permissions::from_mode(0o555)).unwrap();
    if fs::write(bench.path("ro/probe"), "").is_ok() {
        println!("skipped: this user may write everywhere");
        return;
    }
    fails(bench.track("f").args(["--save", "ro/a.csv"]).assert(), 1, &["ro/a.csv", "hint: "]);
}

#[cfg(target_os = "linux")]
#[test]
fn full_disk() {
    if !std::path::Path::new("/dev/full").exists() {
        println!("skipped: there is no /dev/full here");
        return;
    }
    let bench = Bench::new();
    bench.images("f", 3);
    for option in [
        ["--save", "full.csv"],
        ["--save", "full.jsonl"],
        ["--save", "full.txt"],
        ["--video", "full.mp4"],
    ] {
        std::os::unix::fs::symlink("/dev/full", bench.path(option[1])).unwrap();
        let result =
            bench.track("f").args(option).args(["--save", "good.csv", "--overwrite"]).assert();
        fails(result, 1, &["/dev/full", "hint: the disk is full"]);
        assert!(bench.path("good.csv").exists(), "the other output is kept");
        assert!(bench.leftovers().is_empty());
    }
    std::os::unix::fs::symlink("/dev/full", bench.path("full.json")).unwrap();
    let result = bench.track("f").args(["--summary", "full.json"]).assert();
    fails(result, 1, &["/dev/full", "hint: the disk is full"]);
}

/// Runs the program with standard output on a full disk.
#[cfg(target_os = "linux")]
fn printed_to_full(bench: &Bench, arguments: &[&str]) -> Assert {
    let program = assert_cmd::cargo::cargo_bin("patchlock");
    let mut command = assert_cmd::Command::new("sh");
    let line = "exec \"$0\" \"$@\" > /dev/full";
    command.current_dir(bench.folder.path()).args(["-c", line]).arg(program).args(arguments);
    command.assert()
}

#[cfg(target_os = "linux")]
#[test]
fn full_disk_behind_standard_output() {
    if !std::path::Path::new("/dev/full").exists() {
        println!("skipped: there is no /dev/full here");
        return;
    }
    let bench = Bench::new();
    bench.images("f", 2);
    let track = ["track", "f", "--config", "quick.toml", "--box", crate::support::BOX];
    for arguments in [&["config"][..], &track] {
        let words = ["cannot write to standard output", "hint: the disk is full"];
        fails(printed_to_full(&bench, arguments), 1, &words);
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_demo_on_a_full_disk_leaves_no_files() {
    if !std::path::Path::new("/dev/full").exists() {
        println!("skipped: there is no /dev/full here");
        return;
    }
    let bench = Bench::new();
    fs::create_dir(bench.path("d")).unwrap();
    std::os::unix::fs::symlink("/dev/full", bench.path("d/input.mp4")).unwrap();
    let mut demo = patchlock();
    demo.current_dir(bench.folder.path()).args(["demo", "--out", "d", "--overwrite"]);
    fails(demo.assert(), 1, &["cannot write /dev/full", "hint: the disk is full"]);
    let left: Vec<_> = fs::read_dir(bench.path("d")).unwrap().map(|e| e.unwrap().path()).collect();
    assert_eq!(left, [bench.path("d/input.mp4")]);
}

#[cfg(unix)]
#[test]
fn no_temporary_folder_for_a_reversed_stream() {
    let bench = Bench::new();
    let mut run = bench.track("-");
    run.arg("--reverse").env("TMPDIR", bench.path("gone")).write_stdin(crate::support::y4m(2));
    fails(run.assert(), 1, &["standard input", "gone, which --reverse needs", "set TMPDIR"]);
}

#[test]
fn ranges_without_frames() {
    let bench = Bench::new();
    bench.images("f", 3);
    fails(
        bench.track("f").args(["--stride", "0"]).assert(),
        2,
        &["'0' for '--stride <1..>'", "0 is not in 1.."],
    );
    fails(
        bench.track("f").args(["--start", "3"]).assert(),
        2,
        &["--start 3", "3 frames", "the last one is 2"],
    );
    fails(
        bench.track("f").args(["--start", "2", "--end", "2"]).assert(),
        2,
        &["--end 2", "not after"],
    );
    let stream =
        bench.track("-").args(["--start", "9"]).write_stdin(crate::support::y4m(3)).assert();
    fails(stream, 2, &["--start 9", "beyond the end"]);
    fails(
        bench.track("f").args(["--threads", "0"]).assert(),
        2,
        &["'0' for '--threads <1..=1024>'", "0 is not in 1..=1024"],
    );
}

#[test]
fn bad_streams() {
    let bench = Bench::new();
    fails(bench.track("-").write_stdin("no video").assert(), 1, &["standard input", "YUV4MPEG2"]);
    fails(bench.track("-").write_stdin("").assert(), 1, &["standard input"]);
    let mut cut = crate::support::y4m(3);
    cut.truncate(cut.len() - 100);
    let result = bench.track("-").args(["--save", "a.csv"]).write_stdin(cut).assert();
    fails(result, 1, &["frame 2", "truncated", "note: the 2 frames"]);
    assert_eq!(bench.lines("a.csv").len(), 3);
}

/// What is no file may never end, or never begin.
#[cfg(unix)]
#[test]
fn pipes_and_devices_are_refused_where_a_text_file_is_expected() {
    let bench = Bench::new();
    bench.images("f", 2);
    let pipe = bench.path("pipe");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for file in ["/dev/zero", "pipe"] {
        for option in ["--box-from", "--boxes"] {
            let result = bench.bare("f").args([option, file]).assert();
            fails(result, 1, &[file, "a pipe or a device", "hint: "]);
        }
        let mut track = patchlock();
        track.current_dir(bench.folder.path()).args(["track", "f", "--box", "20,18,32,28"]);
        let result = track.args(["--config", file]).assert();
        fails(result, 1, &[file, "a pipe or a device", "hint: "]);
    }
    std::os::unix::fs::symlink("/dev/zero", bench.path("zero.csv")).unwrap();
    let mut export = patchlock();
    export.current_dir(bench.folder.path());
    let args = ["export", "zero.csv", "--format", "mot", "--out", "a.txt"];
    fails(export.args(args).assert(), 1, &["zero.csv", "a pipe or a device", "hint: "]);
}
