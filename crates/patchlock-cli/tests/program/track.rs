//! Tests of `patchlock track` with every kind of source and output.

use std::fs;

use crate::support::{BOX, Bench, COLUMNS, column};
use predicates::prelude::*;

#[test]
fn a_folder_gives_all_outputs() {
    let bench = Bench::new();
    bench.images("f", 12);
    bench
        .track("f")
        .args([
            "--save",
            "a.csv",
            "--save",
            "a.jsonl",
            "--save",
            "a.txt",
            "--video",
            "a.mp4",
            "--summary",
            "a.json",
        ])
        .args(["--seed", "5", "--threads", "2"])
        .assert()
        .success()
        .stdout("")
        .stderr("");
    let csv = bench.lines("a.csv");
    assert_eq!(csv[0], COLUMNS);
    assert!(
        csv[1].starts_with("0,20.0,18.0,32.0,28.0,"),
        "the first row is the given box: {}",
        csv[1]
    );
    assert_eq!(
        column(&csv, "frame"),
        (0..12).map(f64::from).collect::<Vec<_>>(),
        "2.png comes before 10.png"
    );
    assert_eq!(bench.lines("a.jsonl").len(), 12);
    let txt = bench.lines("a.txt");
    assert_eq!((txt.len(), txt[0].as_str()), (12, "21.0000,19.0000,32.0000,28.0000"));
    let summary: serde_json::Value =
        serde_json::from_slice(&fs::read(bench.path("a.json")).unwrap()).unwrap();
    assert_eq!(
        (&summary["frames"], &summary["seed"], &summary["threads"]),
        (&12.into(), &5.into(), &2.into())
    );
    let words = ["method", "preset", "version"].map(|name| summary[name].as_str().unwrap());
    assert_eq!(words, ["paper", "paper", env!("CARGO_PKG_VERSION")]);
    for number in ["tracking_fps", "ms_median", "ms_p95"] {
        assert!(summary[number].as_f64().unwrap() > 0.0, "{number}");
    }
    assert!(bench.leftovers().is_empty());
}

/// With this setting the paper's tracker is never certain.
#[test]
fn the_status_is_in_tables_and_summary() {
    let bench = Bench::new();
    bench.images("f", 3);
    fs::write(bench.path("quick.toml"), "[paper]\nparticles = 12\n[paper.patches]\ndelta = 1.0\n")
        .unwrap();
    let outputs =
        ["--save", "a.csv", "--save", "a.jsonl", "--summary", "a.json", "--lost", "blank"];
    bench.track("f").args(outputs).assert().success();
    let lines = bench.lines("a.csv");
    assert!(lines[1..].iter().all(|line| line.ends_with(",uncertain,96,72")), "{lines:?}");
    assert!(bench.lines("a.jsonl")[2].contains("\"status\":\"uncertain\","));
    let summary = fs::read(bench.path("a.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_slice(&summary).unwrap();
    let counts = ["frames_tracked", "frames_uncertain", "frames_lost"].map(|name| &summary[name]);
    assert_eq!(counts, [&0.into(), &3.into(), &serde_json::Value::from(0)]);
    assert_eq!(summary["losses"], serde_json::json!([]));
    assert_eq!((&summary["method"], &summary["preset"]), (&"paper".into(), &"paper".into()));
    let wrong = bench.track("f").args(["--lost", "hide"]).assert().code(2);
    wrong.stderr(predicate::str::contains("hide").and(predicate::str::contains("keep, blank")));
}

#[test]
fn rotation_is_followed_unless_turned_off() {
    let bench = Bench::new();
    let bbox = bench.turning("f", 21);
    // The difference in height between the upper corners in the last frame.
    let rise = |settings: &str, options: &[&str]| {
        fs::write(bench.path("quick.toml"), settings).unwrap();
        let output = bench.bare("f").args(["--box", &bbox]).args(options).output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        let lines: Vec<String> = text.lines().map(str::to_string).collect();
        column(&lines, "y2")[20] - column(&lines, "y1")[20]
    };
    let turned = rise("", &[]);
    // The width is 48 pixels, and the target turns by 60 degrees.
    assert!(turned > 24.0, "{turned} pixels");
    assert_eq!(rise("", &["--set", "rotate=false"]), 0.0);
    assert_eq!(rise("rotate = false", &[]), 0.0);
    assert_eq!(rise("rotate = false", &["--set", "rotate=true"]), turned);
}

#[test]
fn the_table_of_a_method_in_a_settings_file_chooses_it() {
    let bench = Bench::new();
    bench.images("f", 4);
    let x = |settings: &str, options: &[&str]| {
        fs::write(bench.path("quick.toml"), settings).unwrap();
        let output = bench.track("f").args(options).output().unwrap();
        let lines: Vec<String> =
            String::from_utf8(output.stdout).unwrap().lines().map(str::to_string).collect();
        column(&lines, "x")
    };
    let paper = x("particles = 12\n", &["--preset", "paper"]);
    assert_eq!(x("[paper]\nparticles = 12\n", &[]), paper);
    let robust = x("", &[]);
    assert_ne!(robust, paper);
    assert_eq!(x("[robust]\nsearch = 5.0\n", &["--preset", "paper"]), robust);
}

#[test]
fn without_outputs_the_table_is_printed() {
    let bench = Bench::new();
    bench.images("f", 2);
    bench.track("f").assert().success().stdout(predicate::str::starts_with(COLUMNS));
}

#[test]
fn boxes_depend_on_the_seed_but_not_on_threads() {
    let bench = Bench::new();
    bench.images("f", 4);
    let boxes = |seed: &str, threads: &str| {
        let output =
            bench.track("f").args(["--seed", seed, "--threads", threads]).output().unwrap();
        let lines: Vec<String> =
            String::from_utf8(output.stdout).unwrap().lines().map(str::to_string).collect();
        column(&lines, "x")
    };
    assert_eq!(boxes("1", "1"), boxes("1", "3"));
    assert_ne!(boxes("1", "1"), boxes("2", "1"));
}

#[test]
fn ranges_strides_and_reverse_select_frames() {
    let bench = Bench::new();
    bench.images("f", 9);
    bench.mp4("v.mp4", 9);
    fs::write(bench.path("v.y4m"), crate::support::y4m(9)).unwrap();
    let frames = |source: &str, options: &[&str], stdin: Vec<u8>| {
        let output = bench.track(source).args(options).write_stdin(stdin).output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        let lines: Vec<String> = text.lines().map(str::to_string).collect();
        assert!(output.status.success(), "{source} {}", String::from_utf8_lossy(&output.stderr));
        column(&lines, "frame")
    };
    for source in ["f", "v.mp4", "v.y4m", "-"] {
        let data = || if source == "-" { crate::support::y4m(9) } else { Vec::new() };
        assert_eq!(
            frames(source, &["--start", "2", "--end", "7", "--stride", "2"], data()),
            [2.0, 4.0, 6.0],
            "{source}"
        );
        assert_eq!(
            frames(source, &["--start", "6", "--reverse"], data()),
            [8.0, 7.0, 6.0],
            "{source}"
        );
    }
}

#[test]
fn patterns_globs_and_truth_files() {
    let bench = Bench::new();
    bench.images("f", 3);
    fs::write(bench.path("truth.txt"), "21\t19\t32\t28\n1\t1\t1\t1\n").unwrap();
    for source in ["f/%d.png", "f/*.png"] {
        let run = bench.bare(source).args(["--box-from", "truth.txt"]).assert().success();
        run.stdout(predicate::str::contains("\n0,20.0,18.0,32.0,28.0,"))
            .stdout(predicate::str::contains("\n2,"));
    }
}

#[test]
fn grey_images_of_both_depths_are_tracked() {
    let bench = Bench::new();
    fs::create_dir(bench.path("deep")).unwrap();
    fs::create_dir(bench.path("jpeg")).unwrap();
    for k in 0..3 {
        crate::support::grey16(&bench.path(&format!("deep/{k}.png")), k);
        crate::support::grey_jpeg(&bench.path(&format!("jpeg/{k}.jpg")), k);
    }
    for source in ["deep", "jpeg"] {
        bench
            .track(source)
            .args(["--save", &format!("{source}.csv"), "--video", &format!("{source}.mp4")])
            .assert()
            .success();
        assert_eq!(bench.lines(&format!("{source}.csv")).len(), 4);
    }
}

#[cfg(unix)]
#[test]
fn other_formats_are_decoded_by_ffmpeg() {
    let bench = Bench::new();
    fs::write(bench.path("real.y4m"), crate::support::y4m(3)).unwrap();
    fs::write(bench.path("v.webm"), "not ours").unwrap();
    let script = |text: &str| bench.track_with_ffmpeg("v.webm", text).assert();
    script("cat real.y4m").success().stdout(predicate::str::contains("\n2,"));
    // Old versions reject an option; its old name is tried then.
    script(
        "case \"$*\" in *fps_mode*) echo \"Unrecognized option 'fps_mode'.\" >&2; \
         echo 'Error splitting the argument list' >&2; exit 1;; esac; cat real.y4m",
    )
    .success()
    .stdout(predicate::str::contains("\n2,"));
    script("echo 'Invalid data found' >&2; exit 1")
        .code(1)
        .stderr(predicate::str::contains("Invalid data found"));
    script("cat real.y4m; echo 'error in stream' >&2; exit 1").code(1).stderr(
        predicate::str::contains("frame 3").and(predicate::str::contains("error in stream")),
    );
}

/// ffmpeg exits successfully if it skips frames that it can't decode; only its messages tell.
#[cfg(unix)]
#[test]
fn damage_reported_by_ffmpeg_is_a_note() {
    let bench = Bench::new();
    fs::write(bench.path("real.y4m"), crate::support::y4m(3)).unwrap();
    fs::write(bench.path("v.webm"), "not ours").unwrap();
    let script = "for k in 0 1 2; do echo \"frame:$k pts:${k}0000\" >&2; done; cat real.y4m
                  echo '[mov @ 0x55] bad unit' >&2
                  echo '    Last message repeated 1 times' >&2; echo 'partial file' >&2";
    let note = "note: ffmpeg found damage in v.webm, near frame 3: bad unit; all frames that it can \
                decode are used\n";
    let run = |more: &[&str]| {
        bench.track_with_ffmpeg("v.webm", script).args(["--save", "a.csv"]).args(more).assert()
    };
    for more in [&[][..], &["--reverse", "--overwrite"]] {
        run(more).success().stderr(predicate::str::contains(note).count(1));
        assert_eq!(bench.lines("a.csv").len(), 4);
    }
    let frame = ["frame", "v.webm", "--at", "3", "--out", "f.png"];
    let path = format!("{}:/usr/bin:/bin", bench.path("bin").display());
    let mut command = crate::support::patchlock();
    command.current_dir(bench.folder.path()).env("PATH", path).args(frame);
    command.assert().code(2).stderr(predicate::str::contains(note));
}

/// A recording that a crash has ended, with a true ffmpeg.
#[test]
fn a_video_without_its_end_is_tracked_as_far_as_it_goes() {
    let bench = Bench::new();
    let whole = bench.path("whole.mkv");
    bench.mp4("v.mp4", 60);
    let mut ffmpeg = std::process::Command::new("ffmpeg");
    ffmpeg.args(["-v", "error", "-nostdin", "-i"]).arg(bench.path("v.mp4"));
    ffmpeg.args(["-c:v", "mjpeg", "-q:v", "3"]).arg(&whole);
    if !ffmpeg.status().is_ok_and(|status| status.success()) {
        return println!("skipped: there is no ffmpeg");
    }
    let bytes = fs::read(&whole).unwrap();
    fs::write(bench.path("crash.mkv"), &bytes[..bytes.len() * 2 / 3]).unwrap();
    let outputs = ["--save", "a.csv", "--project", "p.json"];
    bench
        .track("crash.mkv")
        .args(outputs)
        .assert()
        .success()
        .stderr(predicate::str::contains("note: ffmpeg found damage in crash.mkv").count(1));
    let rows = bench.lines("a.csv").len() - 1;
    assert!((35..45).contains(&rows), "{rows}");
    let project: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(bench.path("p.json")).unwrap()).unwrap();
    assert_eq!(project["video"]["frames"], rows);
}

/// The file shows ffmpeg's test pattern and was made with x264 -qp 0: H.264 with 8 bits and 4:2:0,
/// but with a feature that the decoder does not support.
#[cfg(unix)]
#[test]
fn unsupported_kinds_of_h264_are_decoded_by_ffmpeg() {
    let bench = Bench::new();
    fs::write(bench.path("real.y4m"), crate::support::y4m(3)).unwrap();
    let data = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/lossless.mp4");
    bench
        .track_with_ffmpeg(data, "cat real.y4m")
        .assert()
        .success()
        .stdout(predicate::str::contains("\n2,"));
    bench.track(data).env("PATH", "").assert().code(1).stderr(
        predicate::str::contains("holds H.264 with transform-bypass")
            .and(predicate::str::contains("hint: install ffmpeg")),
    );
}

#[test]
fn the_output_of_config_gives_the_same_boxes() {
    let bench = Bench::new();
    bench.images("f", 2);
    let printed =
        crate::support::patchlock().args(["config", "--preset", "paper"]).output().unwrap().stdout;
    let text = String::from_utf8(printed).unwrap().replace("particles = 650", "particles = 12");
    fs::write(bench.path("all.toml"), text).unwrap();
    let x = |config: &str| {
        let mut command = crate::support::patchlock();
        command
            .current_dir(bench.folder.path())
            .args(["track", "f", "--box", BOX, "--config", config]);
        let text = String::from_utf8(command.output().unwrap().stdout).unwrap();
        column(&text.lines().map(str::to_string).collect::<Vec<_>>(), "x")
    };
    assert_eq!(x("all.toml"), x("quick.toml"));
}

#[test]
fn help_has_examples() {
    for command in ["track", "demo", "config"] {
        let help = crate::support::patchlock().args([command, "--help"]).assert().success();
        help.stdout(predicate::str::contains("EXAMPLES:"));
    }
}

#[cfg(unix)]
#[test]
fn a_closed_pipe_is_not_an_error() {
    let bench = Bench::new();
    bench.images("f", 6);
    let program = assert_cmd::cargo::cargo_bin("patchlock");
    let line = format!(
        "{{ '{}' track f --box {BOX} --config quick.toml; echo code $? >&2; }} | head -n 1",
        program.display()
    );
    let output = std::process::Command::new("sh")
        .args(["-c", &line])
        .current_dir(bench.folder.path())
        .output()
        .unwrap();
    assert_eq!(String::from_utf8_lossy(&output.stderr).trim(), "code 0");
}

#[cfg(unix)]
#[test]
fn ctrl_c_leaves_complete_files() {
    use std::io::Write;
    use std::process::{Command, Stdio};
    let bench = Bench::new();
    let mut child = Command::new(assert_cmd::cargo::cargo_bin("patchlock"))
        .current_dir(bench.folder.path())
        .args([
            "track",
            "-",
            "--box",
            BOX,
            "--config",
            "quick.toml",
            "--save",
            "a.csv",
            "--video",
            "a.mp4",
        ])
        .stdin(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // The pipe stays open: without Ctrl-C the program would wait for more frames forever.
    let mut stdin = child.stdin.take().unwrap();
    stdin.write_all(&crate::support::y4m(3)).unwrap();
    stdin.flush().unwrap();
    let started = |bench: &Bench| {
        bench
            .leftovers()
            .iter()
            .any(|p| fs::read_to_string(p).is_ok_and(|t| t.lines().count() == 4))
    };
    let begin = std::time::Instant::now();
    while !started(&bench) && begin.elapsed().as_secs() < 60 {
        std::thread::sleep(std::time::Duration::from_millis(50));
    }
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(bench.lines("a.csv").len(), 4);
    assert!(bench.path("a.mp4").exists() && bench.leftovers().is_empty());
    drop(stdin);
}

#[cfg(unix)]
#[test]
fn a_second_ctrl_c_keeps_the_tables_and_removes_partial_files() {
    use std::process::{Command, Stdio};
    use std::time::{Duration, Instant};
    let bench = Bench::new();
    bench.images("f", 3);
    // The first frame is fast; the second takes much longer than this test.
    fs::write(bench.path("slow.toml"), "[paper]\nparticles = 100000\n").unwrap();
    let child = Command::new(assert_cmd::cargo::cargo_bin("patchlock"))
        .current_dir(bench.folder.path())
        .args(["track", "f", "--box", BOX, "--config", "slow.toml", "--threads", "1"])
        .args(["--save", "a.csv", "--save", "a.txt", "--video", "a.mp4", "--summary", "a.json"])
        .stdin(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let started = || {
        let rows = |path: &std::path::PathBuf| fs::read(path).is_ok_and(|data| !data.is_empty());
        bench.leftovers().iter().filter(|path| rows(path)).count() >= 2
    };
    let begin = Instant::now();
    while !started() && begin.elapsed().as_secs() < 60 {
        std::thread::sleep(Duration::from_millis(20));
    }
    for _ in 0..2 {
        Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
        std::thread::sleep(Duration::from_millis(200));
    }
    let output = child.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(130), "{said}");
    let expected = "stopped immediately by a second Ctrl-C; the frames tracked so far are in ";
    assert!(said.contains(expected), "{said}");
    assert!(said.lines().count() == 1 && said.contains("not written: "), "{said}");
    assert_eq!((bench.lines("a.csv").len(), bench.lines("a.txt").len()), (2, 1));
    assert!(!bench.path("a.mp4").exists() && !bench.path("a.json").exists());
    assert_eq!(bench.leftovers(), Vec::<std::path::PathBuf>::new());
}

#[test]
fn the_box_of_a_truth_file_is_that_of_the_first_tracked_frame() {
    let bench = Bench::new();
    bench.images("f", 6);
    let truth: String = (0..6).map(|k| format!("{},19,32,28\n", 21 + 2 * k)).collect();
    fs::write(bench.path("truth.txt"), truth).unwrap();
    let first = |args: &[&str]| {
        let output = bench.bare("f").args(["--box-from", "truth.txt"]).args(args).output().unwrap();
        String::from_utf8(output.stdout).unwrap().lines().nth(1).unwrap_or_default().to_string()
    };
    assert!(first(&[]).starts_with("0,20.0,18.0,"));
    assert!(first(&["--start", "3"]).starts_with("3,26.0,18.0,"));
    assert!(first(&["--reverse"]).starts_with("5,30.0,18.0,"));
    assert!(first(&["--reverse", "--stride", "2"]).starts_with("4,28.0,18.0,"));
    fs::write(bench.path("truth.txt"), "21,19,32,28\n23,19,32,28\n").unwrap();
    let args = ["--box-from", "truth.txt", "--start", "3"];
    let error = "truth.txt: there is no line for frame 3: it has 2 lines";
    bench.bare("f").args(args).assert().code(2).stderr(predicate::str::contains(error));
    // A single line is the box itself.
    fs::write(bench.path("truth.txt"), "21,19,32,28\n").unwrap();
    assert!(first(&["--start", "3"]).starts_with("3,20.0,18.0,"));
}

#[test]
fn single_settings_are_changed_on_the_command_line() {
    let bench = Bench::new();
    bench.images("f", 3);
    fs::write(bench.path("my.toml"), "[paper]\nparticles = 25\nsigma_x = 3.0\n").unwrap();
    let track = |args: &[&str]| {
        let mut command = crate::support::patchlock();
        command.current_dir(bench.folder.path()).args(["track", "f", "--box", "20,18,32,28"]);
        command.args(args);
        command
    };
    let table = |args: &[&str]| {
        let output = track(args).output().unwrap();
        assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
        let text = String::from_utf8(output.stdout).unwrap();
        let boxes = |line: &str| line.split(',').take(5).collect::<Vec<_>>().join(",");
        text.lines().map(boxes).collect::<Vec<_>>()
    };
    let file = table(&["--config", "my.toml"]);
    let given =
        table(&["--preset", "paper", "--set", "particles=25", "--set", "paper.sigma_x = 3"]);
    assert_eq!(given, file);
    let other = table(&["--config", "my.toml", "--set", "sigma_x=12", "--set", "gamma=one"]);
    assert_ne!(other, file, "--set takes precedence over the file");
    table(&["--set", "search=4", "--set", "rotate=false"]);
    for (set, said) in [
        ("serch=4", "--set: unknown setting `serch`"),
        ("search=99", "--set: the setting `search` is 99; allowed: 1.5 to 20"),
        ("search=wide", "--set: the setting `search` is wide; it takes a number"),
        ("particles=9", "--set: the setting `particles` has no effect with the method `robust`"),
        ("search", "--set: \"search\" is not of the form NAME=VALUE"),
        ("=4", "--set: \"=4\" is not of the form NAME=VALUE"),
    ] {
        let error = track(&["--set", set]).assert().code(2);
        error.stderr(predicate::str::contains(said)).stderr(predicate::str::contains("hint: "));
    }
}
