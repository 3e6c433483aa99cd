//! The program as the process in which files of strangers are decoded.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use crate::support::{Bench, grey_jpeg, grey16, y4m};
use patchlock_media::{Error, FrameSource, Helper, Limits, Prefetcher, open_within};

/// How the program starts itself.
pub const WORD: &str = "decode-for-another-patchlock";

/// Limits with the program as the helper.
fn helped() -> Limits {
    let helper = Helper::new(env!("CARGO_BIN_EXE_patchlock"), [WORD]);
    Limits { helper: Some(Box::leak(Box::new(helper))), ..Limits::default() }
}

/// The processes that this one has started and that run.
pub fn children(parent: u32) -> Vec<u32> {
    let numbers = fs::read_dir("/proc").unwrap().flatten();
    let numbers = numbers.filter_map(|entry| entry.file_name().to_str()?.parse().ok());
    let is_child = |number: &u32| {
        let about = fs::read_to_string(format!("/proc/{number}/stat")).unwrap_or_default();
        // After the name, which may hold anything: state and parent.
        let mut words = about.rsplit(')').next().unwrap_or_default().split_whitespace();
        words.next().is_some_and(|state| state != "Z")
            && words.next() == Some(parent.to_string().as_str())
    };
    numbers.filter(is_child).collect()
}

/// The helpers that this process has started.
pub fn helpers(parent: u32) -> Vec<u32> {
    let is_helper = |number: &u32| {
        let line = fs::read(format!("/proc/{number}/cmdline")).unwrap_or_default();
        line.split(|&byte| byte == 0).any(|word| word == WORD.as_bytes())
    };
    children(parent).into_iter().filter(is_helper).collect()
}

/// The helper of the tests that has opened this file.
fn helper_of(file: &Path) -> u32 {
    let opened = |number: &u32| {
        let open = fs::read_dir(format!("/proc/{number}/fd")).into_iter().flatten().flatten();
        open.filter_map(|entry| fs::read_link(entry.path()).ok()).any(|path| path == file)
    };
    let found = helpers(std::process::id()).into_iter().find(opened);
    found.expect("a helper has opened the file")
}

pub fn kill(number: u32) {
    let killed = Command::new("kill").args(["-KILL", &number.to_string()]).status().unwrap();
    assert!(killed.success());
}

/// What a source says of itself and of its frames, in this order.
fn all_of(source: Result<Box<dyn FrameSource>, Error>, reverse: bool) -> Vec<String> {
    let shown = |error: Error| format!("{error}; {:?}; {}", error.advice(), error.is_misuse());
    let mut source = match source {
        Ok(source) => source,
        Err(error) => return vec![shown(error)],
    };
    let length = source.length();
    let mut said = vec![format!("{length:?} {:?} {}", source.rate(), source.has_sound())];
    let mut order: Vec<usize> = (0..length.unwrap_or(3) + 1).collect();
    if reverse {
        order.reverse();
    }
    said.extend(order.into_iter().map(|k| match source.frame(k) {
        Ok(frame) => format!("{frame:?}"),
        Err(error) => shown(error),
    }));
    said
}

#[test]
fn a_helper_gives_the_frames_and_the_errors_of_the_readers() {
    let bench = Bench::new();
    bench.mp4("a.mp4", 9);
    bench.images("f", 3);
    fs::create_dir_all(bench.path("deep/inner")).unwrap();
    fs::create_dir_all(bench.path("empty")).unwrap();
    fs::create_dir_all(bench.path("mixed")).unwrap();
    grey_jpeg(&bench.path("deep/inner/0.jpg"), 0);
    grey_jpeg(&bench.path("mixed/0.jpg"), 0);
    grey16(&bench.path("mixed/1.png"), 1);
    let jpeg = fs::read(bench.path("mixed/0.jpg")).unwrap();
    fs::write(bench.path("mixed/2.jpg"), &jpeg[..jpeg.len() - 50]).unwrap();
    fs::write(bench.path("mixed/3.png"), "no image").unwrap();
    std::os::unix::fs::symlink(bench.path("f/0.png"), bench.path("mixed/4.png")).unwrap();
    fs::write(bench.path("a.y4m"), y4m(4)).unwrap();
    fs::write(bench.path("cut.y4m"), &y4m(2)[..WIDE]).unwrap();
    fs::write(bench.path("none.webm"), "").unwrap();
    fs::write(bench.path("list.webm"), "#EXTM3U\n#EXTINF:9,\na.ts\n").unwrap();
    fs::write(bench.path("odd.webm"), "neither an image nor a video").unwrap();
    let mut mp4 = fs::read(bench.path("a.mp4")).unwrap();
    let middle = mp4.windows(4).position(|four| four == b"mdat").unwrap() + 300;
    mp4[middle..middle + 60].fill(0x55);
    fs::write(bench.path("damaged.mp4"), &mp4).unwrap();
    fs::write(bench.path("cut.mp4"), &mp4[..600]).unwrap();
    let names = [
        "a.mp4",
        "f",
        "f/1.png",
        "deep",
        "empty",
        "mixed",
        "a.y4m",
        "cut.y4m",
        "none.webm",
        "list.webm",
        "odd.webm",
        "damaged.mp4",
        "cut.mp4",
        "nowhere.mp4",
    ];
    for name in names {
        for (reverse, pixels) in [(false, 96 * 72), (true, 96 * 72), (false, 96 * 72 - 1)] {
            let said = |limits: Limits| {
                let limits = Limits { pixels, ..limits };
                all_of(open_within(bench.path(name), reverse, limits), reverse)
            };
            let [here, apart] = [Limits::default(), helped()].map(said);
            assert_eq!(apart.len(), here.len(), "{name}");
            for (apart, here) in apart.iter().zip(&here) {
                assert!(apart == here, "{name}: {apart:.300} instead of {here:.300}");
            }
        }
    }
}

/// Some bytes within the second frame.
const WIDE: usize = 96 * 72 * 5;

#[test]
fn after_a_helper_was_killed_the_next_frame_is_of_another_one() {
    let bench = Bench::new();
    let file = bench.mp4("a.mp4", 6);
    let mut here = open_within(&file, false, Limits::default()).unwrap();
    let mut apart = open_within(&file, false, helped()).unwrap();
    assert!(apart.frame(0).unwrap() == here.frame(0).unwrap());
    let first = helper_of(&file);
    kill(first);
    let error = apart.frame(1).unwrap_err().to_string();
    let words = "cannot read frame 1 of ";
    assert!(error.starts_with(words) && error.contains("has ended: signal: 9"), "{error}");
    for k in 1..7 {
        assert!(apart.frame(k).unwrap() == here.frame(k).unwrap(), "frame {k}");
    }
    assert_ne!(helper_of(&file), first);
}

#[test]
fn ffmpeg_is_within_the_walls_of_a_helper_and_ends_with_it() {
    let bench = Bench::new();
    let file = bench.path("long.mp4");
    // Long enough to be worth it.
    let source = "testsrc2=size=640x480:rate=25";
    let mut command = Command::new("ffmpeg");
    command.args(["-v", "error", "-f", "lavfi", "-i", source, "-frames:v", "120"]);
    command.args(["-c:v", "libx264", "-pix_fmt", "yuv420p"]).arg(&file);
    let Ok(made) = command.status() else {
        return println!("skipped: ffmpeg is not on the PATH");
    };
    assert!(made.success());
    let mut apart = Prefetcher::start(open_within(&file, false, helped()).unwrap(), 0..120);
    let (_, first) = apart.next().unwrap().unwrap();
    let mut here = open_within(&file, false, Limits::default()).unwrap();
    assert!(Some(first) == here.frame(0).unwrap());
    let started = children(helper_of(&file));
    assert_eq!(started.len(), 1, "its ffmpeg");
    // Walls of its own, and those around the helper.
    let filters = |number| -> Option<u32> { status(number, "Seccomp_filters")?.parse().ok() };
    let [own, around] = [filters(started[0]), filters(helper_of(&file))];
    assert!(own > around || own.is_none(), "{own:?} {around:?}");
    for frame in apart.by_ref().take(40) {
        let (k, picture) = frame.unwrap();
        assert!(Some(picture) == here.frame(k).unwrap(), "frame {k}");
    }
    drop(apart);
    let process = PathBuf::from(format!("/proc/{}", started[0]));
    let begun = std::time::Instant::now();
    while process.exists() {
        assert!(begun.elapsed().as_secs() < 60, "ffmpeg goes on");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// What the system says of a running process.
pub fn status(number: u32, name: &str) -> Option<String> {
    let about = fs::read_to_string(format!("/proc/{number}/status")).unwrap();
    let line = about.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(':'));
    line.map(|value| value.trim().to_string())
}

#[test]
fn a_helper_without_anybody_ends() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_patchlock"));
    let out = command.arg(WORD).stdin(std::process::Stdio::null()).output().unwrap();
    assert_eq!(out.status.code(), Some(1));
    assert_eq!(
        (out.stdout.as_slice(), out.stderr.as_slice()),
        (b"patchlock helper".as_slice(), b"".as_slice())
    );
}
