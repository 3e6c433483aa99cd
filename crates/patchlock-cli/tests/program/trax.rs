//! Tests of `bench --cmd`, which runs other trackers through the TraX protocol. The tracker here is
//! a short script that needs only the Python standard library. Without `python3` these tests print
//! SKIPPED and pass.

use std::fs;
use std::io::Write;
use std::process::Command;

use crate::support::benchmark::Benchmark;
use predicates::prelude::*;
use predicates::str::contains;

/// A tracker that moves the box by two pixels per frame and misbehaves as its argument demands.
const SERVER: &str = r#"
import os, sys, time
mode = sys.argv[1]
say = lambda text: print(text, flush=True)
if mode == "mute": time.sleep(600)
if mode == "endless":
    while True: sys.stdout.write("x" * 65536)
if mode == "flood":
    while True: sys.stdout.write("nothing\n" * 1000)
if mode == "long": say("@@TRAX:hello " + "x" * 100000)
if mode == "bell": sys.stderr.write("a \x1b[31m\x07 bell\n"); sys.exit(1)
if mode == "chatter": say("loading weights")
region = "polygon" if mode == "polygon" else "rectangle"
version = {"new": 5, "four": 4}.get(mode, 3)
hello = f'"trax.version={version}" "trax.image=path;" "trax.region={region};" trax.name=tiny'
say(f"@@TRAX:hello {hello}")
frame = 0
for line in sys.stdin:
    words = line.split('"')
    if line.startswith("@@TRAX:quit"): break
    if mode == "four" and line.startswith("@@TRAX:initialize"):
        # The message has only the box; the image comes with the next frame.
        x, y, w, h = [float(word) for word in words[1].split(",")]
        x += float(os.environ["PATCHLOCK_SEED"]) - 2
        frame = -1
        continue
    path = words[1]
    assert path.startswith("file:///") and os.path.isfile(path[7:]), path
    if line.startswith("@@TRAX:initialize"):
        numbers = [float(word) for word in words[3].split(",")]
        if mode == "polygon":
            assert len(numbers) == 8, numbers
            numbers = [numbers[0], numbers[1], numbers[4] - numbers[0], numbers[5] - numbers[1]]
        x, y, w, h = numbers
        x += float(os.environ["PATCHLOCK_SEED"])
    else:
        assert line.startswith("@@TRAX:frame"), line
        frame += 1
        x += 2
    if mode == "crash" and frame == 2: sys.exit("out of memory")
    if mode == "hang" and frame == 2: time.sleep(600)
    if mode == "nonsense" and frame == 2: say('@@TRAX:state "here"'); continue
    if mode == "babble" and frame == 2: say('@@TRAX:banana'); continue
    if mode == "lost" and frame == 2: say('@@TRAX:state "0"'); continue
    if mode == "colour" and frame == 2: say('@@TRAX:state "\x1b[31m\x07red"'); continue
    if mode == "quit" and frame == 2: say('@@TRAX:quit "trax.reason=no more ideas"'); break
    if mode == "polygon": say(f'@@TRAX:state "{x},{y},{x+w},{y},{x+w},{y+h},{x},{y+h}"')
    else: say(f'@@TRAX:state "{x},{y},{w},{h}" confidence=0.5')
"#;

/// The benchmark with the server script; `None` if there is no Python.
fn benchmark(test: &str) -> Option<Benchmark> {
    if Command::new("python3").arg("--version").output().is_err() {
        let _ = writeln!(std::io::stderr(), "{test}: SKIPPED, there is no python3");
        return None;
    }
    let benchmark = Benchmark::new(2, 4);
    fs::write(benchmark.path("my server.py"), SERVER).unwrap();
    Some(benchmark)
}

/// Programs mostly wait for what a server does not send, so all run at the same time.
fn side_by_side<T: Sync>(cases: &[T], run: impl Fn(&T) + Sync) {
    std::thread::scope(|scope| {
        for case in cases {
            scope.spawn(|| run(case));
        }
    });
}

/// The results are in the folder `out-MODE`.
fn bench(benchmark: &Benchmark, mode: &str, more: &[&str]) -> assert_cmd::Command {
    let program = format!("python3 'my server.py' {mode}");
    let out = format!("out-{mode}");
    let mut command =
        benchmark.patchlock(&["bench", "data", "--out", &out, "--cmd", &program, "--name", mode]);
    command.args(["--timeout", "2"]).args(more);
    command
}

#[test]
fn boxes_of_the_tracker_are_stored() {
    let Some(benchmark) = benchmark("boxes_of_the_tracker_are_stored") else { return };
    for mode in ["good", "polygon", "chatter", "four"] {
        bench(&benchmark, mode, &["--seeds", "2"]).assert().success().stderr("");
        let boxes = benchmark.trajectories(&format!("out-{mode}"));
        let expected = "21,19,32,28\n23,19,32,28\n25,19,32,28\n27,19,32,28\n";
        assert_eq!(boxes[&format!("{mode}/ope/A/0.txt")], expected, "{mode}");
        assert!(
            boxes[&format!("{mode}/ope/A/1.txt")].ends_with("\n28,19,32,28\n"),
            "the tracker receives the seed"
        );
    }
    benchmark
        .patchlock(&["score", "out-good/good", "--truth", "data"])
        .assert()
        .success()
        .stdout(contains("good").and(contains("1.000")));
    // Our own tracker must not use the same name.
    benchmark
        .bench("out-good", &["--name", "good"])
        .assert()
        .code(2)
        .stderr(contains("already holds different runs"));
}

#[test]
fn a_lost_target_is_stored_as_nan() {
    let Some(benchmark) = benchmark("a_lost_target_is_stored_as_nan") else { return };
    bench(&benchmark, "lost", &[]).assert().success();
    let boxes = &benchmark.trajectories("out-lost")["lost/ope/A/0.txt"];
    assert_eq!(boxes.lines().nth(2), Some("NaN,NaN,NaN,NaN"));
}

#[test]
fn errors_are_reported_for_each_run() {
    let Some(benchmark) = benchmark("errors_are_reported_for_each_run") else { return };
    let reported = |mode: &str, said: &str| {
        let both =
            contains("error: A (seed 0").and(contains("error: B (seed 0")).and(contains(said));
        bench(&benchmark, mode, &[]).assert().code(1).stdout(contains("0 runs done")).stderr(both);
        let out = format!("out-{mode}");
        assert!(benchmark.trajectories(&out).is_empty(), "no partial runs are kept");
    };
    for (mode, said) in [
        (
            "crash",
            "the tracker exited (exit status: 1) without sending state; its output: out of memory",
        ),
        ("nonsense", "invalid region \"here\": \"here\" is not a number"),
        ("babble", "sent the message banana instead of state"),
        ("long", "the tracker sent a message of more than 65536 bytes"),
        ("colour", "invalid region \"\\u{1b}[31m\\u{7}red\""),
        ("bell", "its output: a \\u{1b}[31m\\u{7} bell"),
        ("quit", "the tracker quit: no more ideas"),
        ("new", "speaks version 5 of TraX"),
    ] {
        reported(mode, said);
    }
    side_by_side(&["endless", "flood"], |mode| {
        reported(mode, "the tracker did not send hello within 2 s");
    });
}

#[test]
fn answers_have_a_time_limit() {
    let Some(benchmark) = benchmark("answers_have_a_time_limit") else { return };
    side_by_side(&[("hang", "state"), ("mute", "hello")], |(mode, message)| {
        let said = format!("did not send {message} within 2 s");
        bench(&benchmark, mode, &["--sequences", "A"]).assert().code(1).stderr(contains(said));
    });
}

#[test]
fn programs_that_cannot_be_started() {
    let benchmark = Benchmark::new(1, 3);
    let start = |command: &str| {
        benchmark
            .patchlock(&["bench", "data", "--out", "out", "--name", "x", "--cmd", command])
            .assert()
    };
    start("no-such-program-anywhere")
        .code(1)
        .stderr(contains("cannot start no-such-program-anywhere"));
    start("'unclosed").code(2).stderr(contains("not a valid command line"));
    start("").code(2);
    benchmark
        .patchlock(&["bench", "data", "--out", "o", "--cmd", "x"])
        .assert()
        .code(2)
        .stderr(contains("--name"));
}
