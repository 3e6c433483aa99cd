//! Full disks, signals, closed pipes, limits of the system, and two programs on one output: files
//! are whole or absent, and messages say what happened. `docs/promises.md` is the list.

use std::collections::BTreeSet;
use std::fs;
use std::io::Write as _;
use std::os::unix::fs::{PermissionsExt as _, symlink};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::support::benchmark::Benchmark;
use crate::support::{BOX, Bench};
use assert_cmd::assert::Assert;
use predicates::prelude::*;
use predicates::str::contains;

fn program() -> PathBuf {
    assert_cmd::cargo::cargo_bin("patchlock")
}

/// Runs the program from a shell, after `before`, such as a limit, and with `after`, such as a
/// redirection.
fn in_shell(folder: &Path, before: &str, args: &[&str], after: &str) -> Assert {
    let mut command = assert_cmd::Command::new("sh");
    let line = format!("{before}\n\"$0\" \"$@\" {after}");
    command.current_dir(folder).args(["-c", &line]).arg(program()).args(args);
    command.timeout(Duration::from_secs(120)).assert()
}

/// No file can be longer than a block of 512 or 1024 bytes: the same as a disk that is full in the
/// middle of a file.
const SMALL_DISK: &str = "trap '' XFSZ; ulimit -f 1";
/// No file can have any content.
const NO_DISK: &str = "trap '' XFSZ; ulimit -f 0";

/// Every file below a folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut all = Vec::new();
    for entry in fs::read_dir(folder).into_iter().flatten() {
        let path = entry.unwrap().path();
        match path.is_dir() {
            true => all.extend(files(&path)),
            false => all.push(path),
        }
    }
    all.sort();
    all
}

/// Twenty frames, a track through them, and a project of one target.
fn bench() -> Bench {
    let bench = Bench::new();
    bench.images("f", 20);
    let row = |k: usize| format!("{k},{},18,32,28,96,72\n", 20 + k);
    let rows: String = (0..20).map(row).collect();
    fs::write(bench.path("t.csv"), format!("frame,x,y,w,h,frame_w,frame_h\n{rows}")).unwrap();
    bench.track("f").args(["--end", "3", "--project", "p.json"]).assert().success();
    let _ = fs::remove_file(bench.path("p.json.lock"));
    bench
}

const TRACK: [&str; 6] = ["track", "f", "--box", BOX, "--config", "quick.toml"];

/// The command lines of all writers but `bench`, `report` and `demo`, with the file or folder that
/// each makes.
fn writers() -> Vec<(Vec<&'static str>, &'static str)> {
    let track = |option: &'static str, out: &'static str| {
        (TRACK.into_iter().chain([option, out]).collect::<Vec<_>>(), out)
    };
    let export = |format: &'static str, out: &'static str| {
        (vec!["export", "t.csv", "--format", format, "--out", out], out)
    };
    vec![
        track("--save", "o.csv"),
        track("--save", "o.jsonl"),
        track("--save", "o.txt"),
        track("--video", "o.mp4"),
        track("--summary", "o.json"),
        track("--project", "o.patchlock.json"),
        (vec!["frame", "f", "--out", "o.png"], "o.png"),
        export("mot", "mot.txt"),
        export("coco", "coco.json"),
        export("cvat", "cvat.xml"),
        export("label-studio", "label.json"),
        export("lasot", "lasot"),
        export("got10k", "got"),
        (vec!["export", "t.csv", "--format", "yolo", "--images", "f", "--out", "yolo"], "yolo"),
        (vec!["export", "t.csv", "--format", "voc", "--images", "f", "--out", "voc"], "voc"),
        (vec!["export", "p.json", "--format", "coco", "--out", "p.coco"], "p.coco"),
    ]
}

#[test]
fn a_full_disk_leaves_no_part_of_a_file() {
    let bench = bench();
    let before = files(bench.folder.path());
    for disk in [SMALL_DISK, NO_DISK] {
        // These may fit in a block.
        let small = |out: &str| disk == SMALL_DISK && matches!(out, "o.json" | "o.png");
        for (args, out) in writers().into_iter().filter(|(_, out)| !small(out)) {
            in_shell(bench.folder.path(), disk, &args, "")
                .code(1)
                .stderr(contains("error: ").and(contains(out)).and(contains("hint: ")))
                .stderr(contains("File too large"));
            assert_eq!(files(bench.folder.path()), before, "{disk}: {args:?}");
        }
    }
}

#[test]
fn a_full_disk_keeps_the_file_that_was_to_be_replaced() {
    let bench = bench();
    // Folders are never replaced, and a project must be one before.
    let replaces = |args: &[&str], out: &str| out.contains('.') && !args.contains(&"--project");
    for (mut args, out) in writers().into_iter().filter(|(args, out)| replaces(args, out)) {
        fs::write(bench.path(out), "old").unwrap();
        args.push("--overwrite");
        in_shell(bench.folder.path(), NO_DISK, &args, "").code(1).stderr(contains(out));
        assert_eq!(fs::read_to_string(bench.path(out)).unwrap(), "old", "{args:?}");
    }
}

#[test]
fn a_project_on_a_full_disk_stays_as_it_was() {
    let bench = bench();
    let before = fs::read(bench.path("p.json")).unwrap();
    let args = [&TRACK[..], &["--project", "p.json"]].concat();
    in_shell(bench.folder.path(), SMALL_DISK, &args, "").code(1).stderr(contains("p.json"));
    assert_eq!(fs::read(bench.path("p.json")).unwrap(), before);
}

#[test]
fn a_benchmark_and_its_report_on_a_full_disk_leave_no_part_of_a_file() {
    let benchmark = Benchmark::new(1, 20);
    let folder = benchmark.bench.folder.path();
    let bench = ["bench", "data", "--config", "quick.toml", "--out", "out"];
    in_shell(folder, SMALL_DISK, &bench, "").code(1).stderr(contains("cannot write out/quick"));
    // What is there is whole: a later run goes on from it.
    assert!(
        files(&folder.join("out")).iter().all(|path| path.extension().is_some_and(|e| e == "txt"))
    );
    benchmark.patchlock(&bench).assert().success();
    let before = files(folder);
    let report = ["report", "out", "--truth", "data", "--out", "r.html"];
    in_shell(folder, SMALL_DISK, &report, "").code(1).stderr(contains("cannot write r"));
    assert!(!folder.join("r.html").exists());
    // A part would end where the disk does.
    let whole = |path: &PathBuf| !fs::metadata(path).unwrap().len().is_multiple_of(512);
    assert!(files(folder).iter().filter(|path| !before.contains(path)).all(whole));
    let args = ["demo", "--out", "d"];
    in_shell(folder, SMALL_DISK, &args, "").code(1).stderr(contains("cannot write d/"));
    assert!(files(&folder.join("d")).iter().all(whole));
}

#[test]
fn folders_that_are_missing_or_cannot_be_written_are_named() {
    let bench = bench();
    fs::create_dir(bench.path("closed")).unwrap();
    fs::set_permissions(bench.path("closed"), fs::Permissions::from_mode(0o555)).unwrap();
    let everywhere = fs::write(bench.path("closed/probe"), "").is_ok();
    let before = files(bench.folder.path());
    for (mut args, out) in writers() {
        let place = args.iter().rposition(|arg| *arg == out).unwrap();
        let (missing, closed) = (format!("missing/{out}"), format!("closed/{out}"));
        args[place] = &missing;
        let result = in_shell(bench.folder.path(), "", &args, "").failure();
        result.stderr(contains("missing").and(contains("hint: ")));
        if !everywhere {
            args[place] = &closed;
            let result = in_shell(bench.folder.path(), "", &args, "").failure();
            result.stderr(contains("closed").and(contains("ermission denied")));
        }
        assert_eq!(files(bench.folder.path()), before, "{args:?}");
    }
    fs::set_permissions(bench.path("closed"), fs::Permissions::from_mode(0o755)).unwrap();
}

/// `track` on standard input that has got three frames and waits for more.
struct WaitingRun {
    child: Child,
}

impl WaitingRun {
    fn new(bench: &Bench, args: &[&str]) -> Self {
        let mut child = Command::new(program())
            .current_dir(bench.folder.path())
            .args(["track", "-", "--box", BOX, "--config", "quick.toml"])
            .args(args)
            .stdin(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let stdin = child.stdin.as_mut().unwrap();
        stdin.write_all(&crate::support::y4m(3)).unwrap();
        stdin.flush().unwrap();
        let tracked = |path: &PathBuf| {
            fs::read(path).is_ok_and(|text| text.iter().filter(|byte| **byte == b'\n').count() == 4)
        };
        until(|| bench.leftovers().iter().any(tracked));
        Self { child }
    }

    /// Exit code and standard error, after a signal.
    fn signalled(mut self, signal: &str) -> (Option<i32>, String) {
        // The input stays open, or its end would end the program.
        let stdin = self.child.stdin.take();
        let id = self.child.id().to_string();
        assert!(Command::new("kill").args([signal, &id]).status().unwrap().success());
        let output = self.child.wait_with_output().unwrap();
        drop(stdin);
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    }
}

/// Waits for something, for a minute at most.
fn until(happens: impl Fn() -> bool) {
    let begin = Instant::now();
    while !happens() {
        assert!(begin.elapsed().as_secs() < 60, "it does not happen");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn signals_to_end_leave_whole_files() {
    for signal in ["-TERM", "-HUP", "-INT"] {
        let bench = Bench::new();
        let outputs =
            ["--save", "a.csv", "--save", "a.jsonl", "--video", "a.mp4", "--summary", "a.json"];
        let (code, said) = WaitingRun::new(&bench, &outputs).signalled(signal);
        assert_eq!(code, Some(130), "{signal}: {said}");
        assert!(said.contains("stopped after 3 frames"), "{signal}: {said}");
        assert_eq!((bench.lines("a.csv").len(), bench.lines("a.jsonl").len()), (4, 3));
        let summary = fs::read_to_string(bench.path("a.json")).unwrap();
        serde_json::from_str::<serde_json::Value>(&summary).unwrap();
        let mut video = patchlock_media::open(bench.path("a.mp4"), false).unwrap();
        assert_eq!((0..).map_while(|k| video.frame(k).unwrap()).count(), 3);
        assert!(bench.leftovers().is_empty());
    }
}

/// A shell script in place of ffmpeg that writes a frame now and then, without end.
#[cfg(target_os = "linux")]
#[test]
fn an_export_that_is_told_to_end_leaves_nothing() {
    let bench = Bench::new();
    fs::write(bench.path("real.y4m"), crate::support::y4m(1)).unwrap();
    fs::write(bench.path("v.webm"), "something").unwrap();
    let lines: String = (0..2000).map(|k| format!("{k},1,1,9,9,1,96,72\n")).collect();
    fs::write(bench.path("t.csv"), format!("frame,x,y,w,h,score,frame_w,frame_h\n{lines}"))
        .unwrap();
    let script = "case \"$*\" in *showinfo*) exit 0;; esac\necho frame:0 pts:0 >&2; cat real.y4m\n\
                  while echo frame:1 pts:1 >&2 && tail -n +2 real.y4m; do sleep 0.05; done";
    drop(bench.track_with_ffmpeg("v.webm", script));
    for signal in ["-TERM", "-HUP", "-INT"] {
        let child = Command::new(program())
            .current_dir(bench.folder.path())
            .args(["export", "t.csv", "--format", "yolo", "--images", "v.webm", "--out", "data"])
            .env("PATH", format!("{}:/usr/bin:/bin", bench.path("bin").display()))
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        until(|| !bench.leftovers().is_empty());
        let (code, said) = WaitingRun { child }.signalled(signal);
        assert_eq!(code, Some(130), "{signal}: {said}");
        assert!(said.contains("nothing was written"), "{said}");
        assert!(bench.leftovers().is_empty() && !bench.path("data").exists());
    }
}

#[test]
fn kill_leaves_nothing_under_the_names_of_the_outputs() {
    let bench = Bench::new();
    fs::write(bench.path("old.csv"), "old").unwrap();
    let outputs =
        ["--save", "a.csv", "--video", "a.mp4", "--summary", "a.json", "--save", "old.csv"];
    let (code, _) =
        WaitingRun::new(&bench, &[&outputs[..], &["--overwrite"]].concat()).signalled("-KILL");
    assert_eq!(code, None);
    for name in ["a.csv", "a.mp4", "a.json"] {
        assert!(!bench.path(name).exists(), "{name}");
    }
    assert_eq!(fs::read_to_string(bench.path("old.csv")).unwrap(), "old");
}

/// A shell script in place of ffmpeg that writes frames and then nothing.
#[cfg(target_os = "linux")]
#[test]
fn no_ffmpeg_outlives_a_program_that_was_told_to_end() {
    let bench = Bench::new();
    fs::write(bench.path("real.y4m"), crate::support::y4m(3)).unwrap();
    fs::write(bench.path("v.webm"), "something").unwrap();
    let script = "case \"$*\" in *showinfo*) exit 0;; esac\n\
                  for k in 0 1 2; do echo frame:$k pts:$k >&2; done\ncat real.y4m\nexec sleep 1000";
    drop(bench.track_with_ffmpeg("v.webm", script));
    for signal in ["-TERM", "-HUP", "-INT"] {
        let mut child = Command::new(program())
            .current_dir(bench.folder.path())
            .args(["track", "v.webm", "--box", BOX, "--config", "quick.toml", "--save", "a.csv"])
            .arg("--overwrite")
            .env("PATH", format!("{}:/usr/bin:/bin", bench.path("bin").display()))
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let lines = |path: &PathBuf| fs::read_to_string(path).is_ok_and(|t| t.lines().count() == 4);
        until(|| bench.leftovers().iter().any(lines));
        let id = child.id().to_string();
        let tasks = fs::read_dir(Path::new("/proc").join(&id).join("task")).unwrap();
        let started = tasks.map(|task| task.unwrap().path().join("children"));
        let started: Vec<_> = started.filter_map(|file| fs::read_to_string(file).ok()).collect();
        let ffmpeg = started.concat();
        assert!(ffmpeg.trim().parse::<u32>().is_ok(), "one process was started: {ffmpeg}");
        assert!(Command::new("kill").args([signal, &id]).status().unwrap().success());
        assert_eq!(child.wait().unwrap().code(), Some(130), "{signal}");
        assert!(!Path::new("/proc").join(ffmpeg.trim()).exists(), "{signal}: ffmpeg runs on");
        assert_eq!(bench.lines("a.csv").len(), 4);
    }
}

#[test]
fn a_reader_that_goes_away_is_not_an_error() {
    let bench = bench();
    for args in [&TRACK[..], &["config"], &["man"], &["completions", "bash"]] {
        let after = "2>err; echo code $? >&2; } | head -n 1";
        in_shell(bench.folder.path(), "{", args, after).success().stderr("code 0\n");
        assert_eq!(fs::read_to_string(bench.path("err")).unwrap(), "", "{args:?}");
    }
}

#[test]
fn a_closed_or_full_standard_error_is_no_panic() {
    let bench = bench();
    let full = if Path::new("/dev/full").exists() { "2>/dev/full" } else { "2>&-" };
    for after in [full, "2>&-"] {
        let failing = ["track", "nowhere", "--box", BOX];
        in_shell(bench.folder.path(), "", &failing, after).code(1);
        let frame = ["frame", "f", "--out", "a.png", "--overwrite"];
        in_shell(bench.folder.path(), "", &frame, after).code(0);
    }
}

#[test]
fn the_later_of_two_programs_does_not_replace_the_output_of_the_other() {
    let bench = Bench::new();
    bench.images("f", 2);
    let slow = WaitingRun::new(&bench, &["--save", "a.csv"]);
    bench.track("f").args(["--save", "a.csv"]).assert().success();
    let (code, said) = slow.signalled("-INT");
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("a.csv") && said.contains("--overwrite replaces it"), "{said}");
    assert_eq!(bench.lines("a.csv").len(), 3, "that of the program that was first");
    // With --overwrite, the last one replaces a whole file by a whole file.
    let slow = WaitingRun::new(&bench, &["--save", "a.csv", "--overwrite"]);
    bench.track("f").args(["--save", "a.csv", "--overwrite"]).assert().success();
    assert_eq!(bench.lines("a.csv").len(), 3);
    assert_eq!(slow.signalled("-INT").0, Some(130));
    assert_eq!(bench.lines("a.csv").len(), 4);
    assert!(bench.leftovers().is_empty());
}

#[test]
fn two_exports_to_one_folder_leave_one_whole_folder() {
    let bench = bench();
    let start = || {
        Command::new(program())
            .current_dir(bench.folder.path())
            .args(["export", "t.csv", "--format", "yolo", "--images", "f", "--out", "yolo"])
            .stderr(Stdio::null())
            .spawn()
            .unwrap()
    };
    let both = [start(), start()];
    let codes = both.map(|mut child| child.wait().unwrap().code());
    assert!(codes.contains(&Some(0)), "{codes:?}");
    // A file with the classes, and an image and a text for each frame.
    assert_eq!(files(&bench.path("yolo")).len(), 1 + 2 * 20);
    let hidden = |path: &PathBuf| path.to_string_lossy().contains("/.patchlock-");
    assert!(!files(bench.folder.path()).iter().any(hidden));
}

#[test]
fn too_many_open_files_have_a_hint() {
    let bench = bench();
    let saves: Vec<String> = (0..30).map(|k| format!("--save={k}.csv")).collect();
    let args: Vec<&str> = TRACK.into_iter().chain(saves.iter().map(String::as_str)).collect();
    in_shell(bench.folder.path(), "ulimit -n 20", &args, "")
        .code(1)
        .stderr(
            contains("oo many open files")
                .and(contains("hint: the limit of open files is too low")),
        )
        .stderr(contains("ulimit -n 1024"));
    assert!(bench.leftovers().is_empty() && !bench.path("0.csv").exists());
}

#[test]
fn frames_that_change_while_they_are_read_are_named() {
    let size = image::RgbImage::new(8, 8);
    type FileChange<'a> = &'a dyn Fn(&Path);
    let changes: [(FileChange<'_>, &str); 4] = [
        (&|file| fs::write(file, "").unwrap(), "the file is empty"),
        (&|file| fs::write(file, &fs::read(file).unwrap()[..200]).unwrap(), "40.png"),
        (&|file| fs::remove_file(file).unwrap(), "No such file"),
        (&|file| size.save(file).unwrap(), "8 x 8"),
    ];
    for (change, expected) in changes {
        let bench = Bench::new();
        bench.images("f", 41);
        fs::write(bench.path("slow.toml"), "[paper]\nparticles = 100\n").unwrap();
        let child = Command::new(program())
            .current_dir(bench.folder.path())
            .args(["track", "f", "--box", BOX, "--config", "slow.toml", "--save", "a.csv"])
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        // A row is there, so the folder has been listed; 40 frames are still to come.
        let begun = |path: &PathBuf| fs::metadata(path).is_ok_and(|about| about.len() > 0);
        until(|| bench.leftovers().iter().any(begun));
        change(&bench.path("f/40.png"));
        let output = child.wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.contains("40") && said.contains(expected), "{said}");
        assert!(said.contains("the 40 frames tracked before this are in a.csv"), "{said}");
        assert_eq!(bench.lines("a.csv").len(), 41);
    }
}

#[test]
fn a_link_to_a_full_device_names_it_for_every_writer() {
    if !Path::new("/dev/full").exists() {
        println!("skipped: there is no /dev/full here");
        return;
    }
    let bench = bench();
    for out in ["o.png", "o.csv", "o.mp4", "o.json"] {
        symlink("/dev/full", bench.path(out)).unwrap();
    }
    let frame = ["frame", "f", "--out", "o.png", "--overwrite"];
    in_shell(bench.folder.path(), "", &frame, "")
        .code(1)
        .stderr(contains("/dev/full").and(contains("hint: the disk is full")));
    for (option, out) in [("--save", "o.csv"), ("--video", "o.mp4"), ("--summary", "o.json")] {
        let args = [&TRACK[..], &[option, out, "--overwrite"]].concat();
        in_shell(bench.folder.path(), "", &args, "")
            .code(1)
            .stderr(contains("/dev/full").and(contains("hint: the disk is full")));
    }
}

#[test]
fn names_do_not_command_the_terminal() {
    let bench = bench();
    let name = "a\u{1b}[31m\u{7}\n";
    fs::create_dir(bench.path(name)).unwrap();
    fs::write(bench.path(name).join(format!("{name}.png")), "no image").unwrap();
    fs::write(bench.path(&format!("{name}.csv")), "frame,x,y,w,h\n0,1,2,3,4,5\n").unwrap();
    let (folder, table) = (name.to_string(), format!("{name}.csv"));
    for args in [
        vec!["track", &folder, "--box", BOX],
        vec!["track", "f", "--boxes", &table],
        vec!["frame", &folder, "--out", "a.png"],
        vec!["export", &table, "--format", "mot", "--out", "out"],
        vec!["dataset", &folder],
        vec!["score", &folder, "--truth", &folder],
    ] {
        let output =
            Command::new(program()).current_dir(bench.folder.path()).args(&args).output().unwrap();
        assert!(!output.status.success(), "{args:?}");
        let said = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
        assert!(said.contains("a\\u{1b}[31m\\u{7}"), "{args:?}: {said}");
        assert!(!said.contains(['\u{1b}', '\u{7}']), "{args:?}: {said:?}");
    }
}

/// Every promise of the pages on promises and on threats has tests, and they are there.
#[test]
fn every_promise_has_tests_that_exist() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let sources: String = files(&crates)
        .iter()
        .filter(|path| path.extension().is_some_and(|end| end == "rs"))
        .map(|path| fs::read_to_string(path).unwrap())
        .collect();
    let (mut promise, mut held) = ("", BTreeSet::new());
    for line in include_str!("promises.txt").lines().skip(2) {
        let Some(name) = line.strip_prefix("    ") else {
            promise = line;
            continue;
        };
        assert!(sources.contains(&format!("fn {name}()")), "there is no test {name}");
        held.insert(promise.to_owned());
    }
    let page = |name: &str| fs::read_to_string(crates.join("../docs").join(name)).unwrap();
    let pages = [page("promises.md"), page("security.md")];
    let on_a_line = |text: &str| {
        let text = text.split("\n\n").next().unwrap();
        text.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let promises: BTreeSet<String> =
        pages.iter().flat_map(|page| page.split("\n- ").skip(1)).map(on_a_line).collect();
    assert_eq!(promises, held, "the pages, and promises.txt with the tests");
    assert!(promises.len() > 40, "{}", promises.len());
}
