//! Folders and files from strangers, and names that are taken: nothing of the user is read or
//! replaced that the command does not name.

use std::fs;
use std::path::Path;

use crate::support::{Bench, patchlock};
use assert_cmd::assert::Assert;
use predicates::str::contains;

/// `patchlock` in the folder of the test.
fn run(bench: &Bench, args: &[&str]) -> Assert {
    patchlock().current_dir(bench.folder.path()).args(args).assert()
}

/// A track of two frames in `a.csv`, and its frames in the folder `f`.
fn tracked() -> Bench {
    let bench = Bench::new();
    bench.images("f", 2);
    bench.track("f").args(["--save", "a.csv"]).assert().success();
    bench
}

#[cfg(unix)]
#[test]
fn links_in_a_folder_destroy_nothing() {
    use std::os::unix::fs::symlink;
    let bench = Bench::new();
    bench.images("f", 2);
    fs::write(bench.path("precious.txt"), "a year of work").unwrap();
    symlink("precious.txt", bench.path("p.json.lock")).unwrap();
    let result = bench.track("f").args(["--project", "p.json"]).assert();
    result.code(1).stderr(contains("it is a link, not a lock of Patchlock"));
    symlink("nowhere.csv", bench.path("a.csv")).unwrap();
    let result = bench.track("f").args(["--save", "a.csv", "--overwrite"]).assert();
    result.code(2).stderr(contains("a.csv: it is a link that leads nowhere"));
    fs::create_dir(bench.path("demo")).unwrap();
    fs::write(bench.path("demo/about.txt"), "Made by `patchlock demo`").unwrap();
    symlink("../precious.txt", bench.path("demo/truth.csv")).unwrap();
    run(&bench, &["demo", "--overwrite"]).code(2).stderr(contains("truth.csv is a link to a file"));
    assert_eq!(fs::read_to_string(bench.path("precious.txt")).unwrap(), "a year of work");
    assert!(!bench.path("nowhere.csv").exists() && bench.leftovers().is_empty());
}

#[test]
fn a_list_of_files_is_no_video() {
    let bench = Bench::new();
    let private = bench.mp4("private.mp4", 3);
    let list = format!("#EXTM3U\n#EXTINF:9,\nfile://{}\n#EXT-X-ENDLIST\n", private.display());
    fs::write(bench.path("holiday.webm"), list).unwrap();
    let words = "holiday.webm is a list of files or addresses, not a video";
    bench.track("holiday.webm").assert().code(1).stderr(contains(words)).stderr(contains("hint: "));
}

#[cfg(unix)]
#[test]
fn an_export_copies_nothing_but_images_of_its_folder() {
    use std::os::unix::fs::symlink;
    let bench = tracked();
    let export = |more: &[&str]| {
        let args = ["export", "a.csv", "--format", "yolo", "--images", "f", "--out", "out"];
        run(&bench, &[&args, more].concat())
    };
    let image = bench.path("f/1.png");
    let with = |target: &Path| {
        let _ = fs::remove_file(&image);
        symlink(target, &image).unwrap();
    };
    fs::write(bench.path("id_rsa"), "a key").unwrap();
    bench.images("others", 2);
    for target in ["../id_rsa", "../others/1.png"] {
        with(Path::new(target));
        let words =
            format!("the frame f/1.png is a link to {}", bench.path(&target[3..]).display());
        export(&[]).code(1).stderr(contains(words)).stderr(contains("--follow-links"));
    }
    with(Path::new("../id_rsa"));
    export(&["--follow-links"]).code(1).stderr(contains("cannot read the frame f/1.png"));
    if cfg!(target_os = "linux") {
        with(Path::new("/proc/self/environ"));
        export(&["--follow-links"]).code(1).stderr(contains("the file is empty"));
    }
    fs::remove_file(&image).unwrap();
    assert!(std::process::Command::new("mkfifo").arg(&image).status().unwrap().success());
    export(&[]).code(1).stderr(contains("f/1.png: it is a pipe or a device"));
    assert!(!bench.path("out").exists() && bench.leftovers().is_empty());
    with(Path::new("../others/1.png"));
    export(&["--follow-links"]).success();
    let copy = bench.path("out/images/train/1.png");
    assert_eq!(fs::read(copy).unwrap(), fs::read(bench.path("others/1.png")).unwrap());
}

#[test]
fn no_command_replaces_what_it_reads() {
    let bench = tracked();
    bench.mp4("v.mp4", 3);
    bench.track("v.mp4").args(["--project", "v.json"]).assert().success();
    fs::hard_link(bench.path("a.csv"), bench.path("same.csv")).unwrap();
    let mot = ["--format", "mot", "--overwrite", "--out"];
    let csv = ["--format", "csv", "--overwrite", "--out"];
    let frame = |source: &'static str, out: &'static str| {
        vec!["frame", source, "--overwrite", "--out", out]
    };
    let cases = [
        [&["export", "a.csv"], &mot[..], &["a.csv"]].concat(),
        [&["export", "a.csv"], &mot[..], &["f/../a.csv"]].concat(),
        [&["export", "a.csv"], &mot[..], &["same.csv"]].concat(),
        [&["export", "v.json"], &csv[..], &["v.json"]].concat(),
        [&["export", "v.json"], &csv[..], &["v.mp4"]].concat(),
        frame("f", "f/1.png"),
        frame("f/%d.png", "f/1.png"),
        frame("f/*.png", "f/0.png"),
        frame("f/0.png", "f/0.png"),
    ];
    let before = [fs::read(bench.path("a.csv")), fs::read(bench.path("f/1.png"))];
    for args in cases {
        let refused = run(&bench, &args).code(2);
        refused.stderr(contains("is an input and would be replaced")).stderr(contains("hint: "));
    }
    let after = [fs::read(bench.path("a.csv")), fs::read(bench.path("f/1.png"))];
    assert_eq!(before.map(Result::unwrap), after.map(Result::unwrap));
    run(&bench, &frame("f/0.png", "f/1.png")).success();
    let page = ["report", "x", "--truth", "y", "--out", "f/1.png", "--overwrite"];
    run(&bench, &page).code(2).stderr(contains("--out f/1.png: unknown extension; use .html"));
}

#[cfg(target_os = "linux")]
#[test]
fn a_file_that_the_system_makes_up_has_no_frames() {
    let bench = Bench::new();
    for source in ["/proc/self/environ", "/proc/self/mem"] {
        bench.track(source).assert().code(1).stderr(contains("the file is empty"));
    }
    let table = bench.bare("x").args(["--boxes", "/proc/self/environ"]).assert();
    table.code(2).stderr(contains("the file has no target"));
}

#[cfg(unix)]
#[test]
fn paths_need_not_be_text() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt as _;
    let bench = Bench::new();
    bench.mp4("v.mp4", 3);
    let odd = OsStr::from_bytes(b"v\xff.mp4");
    fs::rename(bench.path("v.mp4"), bench.folder.path().join(odd)).unwrap();
    let out = OsStr::from_bytes(b"\xfe.csv");
    let track = |more: [&OsStr; 2]| {
        let mut command = bench.bare("--quiet");
        command.arg(odd).args(["--box", crate::support::BOX]).args(more).assert()
    };
    track([OsStr::new("--save"), out]).success();
    assert_eq!(fs::read_to_string(bench.folder.path().join(out)).unwrap().lines().count(), 4);
    let refused = track([OsStr::new("--project"), OsStr::new("p.json")]).code(1);
    refused.stderr(contains("its path is not text in UTF-8, which a project needs"));
    let mut frame = patchlock();
    frame.current_dir(bench.folder.path()).arg("frame").arg(odd).assert().success();
}

#[test]
fn a_table_of_very_many_targets_is_refused() {
    let bench = Bench::new();
    bench.images("f", 2);
    let lines: String = (0..10_000).map(|id| format!("0,{id},20,18,32,28\n")).collect();
    fs::write(bench.path("t.csv"), format!("frame,id,x,y,w,h\n{lines}")).unwrap();
    let track = |more: &[&str]| {
        let options = ["--boxes", "t.csv", "--save", "a.csv"];
        bench.bare("f").args(options).args(more).assert()
    };
    let words = "more than 500 targets would be tracked at once, each in about 20 MB of memory";
    track(&[]).code(2).stderr(contains(words)).stderr(contains("--max-targets 10000 allows"));
    track(&["--max-targets", "0"]).code(2).stderr(contains("--max-targets"));
    assert!(!bench.path("a.csv").exists() && bench.leftovers().is_empty());
}
