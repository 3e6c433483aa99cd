//! Tests of `patchlock bench`: stored runs survive crashes, and results do not depend on how runs
//! are split.

use std::fs;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use crate::support::benchmark::Benchmark;
use predicates::prelude::*;
use predicates::str::contains;
use serde_json::Value;

fn json(text: &[u8]) -> Value {
    serde_json::from_slice(text).unwrap()
}

#[test]
fn runs_are_stored_with_their_manifests() {
    let benchmark = Benchmark::new(2, 5);
    benchmark.bench("out", &["--seeds", "2"]).assert().success().stdout(contains("4 runs done"));
    let names: Vec<String> = benchmark.trajectories("out").into_keys().collect();
    assert_eq!(
        names,
        ["quick/ope/A/0.txt", "quick/ope/A/1.txt", "quick/ope/B/0.txt", "quick/ope/B/1.txt"]
    );
    let boxes = fs::read_to_string(benchmark.path("out/quick/ope/A/1.txt")).unwrap();
    assert!(boxes.starts_with("21,19,32,28\n") && boxes.lines().count() == 5, "{boxes}");
    let run = json(&fs::read(benchmark.path("out/quick/ope/A/1.json")).unwrap());
    assert_eq!(
        (&run["seed"], &run["frames"], &run["protocol"], &run["jobs"]),
        (&1.into(), &5.into(), &"ope".into(), &1.into())
    );
    assert_eq!(run["subject"]["configuration"]["paper"]["particles"], 20);
    assert_eq!(run["seconds"].as_array().unwrap().len(), 5);
    let scores = run["score"].as_array().unwrap();
    assert!(scores.len() == 5 && scores.iter().all(|s| (0.0..=1.0).contains(&s.as_f64().unwrap())));
    let statuses = run["status"].as_array().unwrap();
    assert!(statuses.len() == 5 && statuses.iter().all(|s| s == "tracked" || s == "uncertain"));
    assert!(run["machine"]["cores"].as_u64().unwrap() > 0);
    let manifest = json(&fs::read(benchmark.path("out/quick/manifest.json")).unwrap());
    assert_eq!(manifest["configuration_hash"], run["configuration_hash"]);

    let score =
        benchmark.patchlock(&["score", "out", "--truth", "data", "--json"]).assert().success();
    let score = json(&score.get_output().stdout);
    let tracker = &score["trackers"][0];
    assert_eq!(
        (&tracker["name"], &tracker["targets"], &tracker["seeds"]),
        (&"quick".into(), &2.into(), &2.into())
    );
    for name in
        ["dp20", "auc", "dp20_sd", "auc_sd", "fps", "success50", "mean_overlap", "norm_precision"]
    {
        assert!(tracker[name].as_f64().is_some_and(|value| value >= 0.0), "{name}: {tracker}");
    }
    assert_eq!(tracker["dp20"], 1.0, "the card moves one pixel per frame");
}

#[test]
fn complete_runs_are_kept_and_damaged_ones_repeated() {
    let benchmark = Benchmark::new(2, 4);
    benchmark.bench("out", &[]).assert().success();
    let whole = benchmark.trajectories("out");
    // One run as after a crash between writing its two files, the other as after a loss of data.
    fs::remove_file(benchmark.path("out/quick/ope/A/0.json")).unwrap();
    fs::write(benchmark.path("out/quick/ope/B/0.txt"), "21,19,32,28\n").unwrap();
    benchmark.bench("out", &[]).assert().success().stdout(contains("2 runs done"));
    assert_eq!(benchmark.trajectories("out"), whole);
    benchmark.bench("out", &[]).assert().success().stdout(contains("0 runs done, 2 already done"));
}

/// The process is killed without a chance to clean up.
#[test]
fn five_kills_do_not_change_the_results() {
    let benchmark = Benchmark::new(4, 10);
    let begin = Instant::now();
    benchmark.bench("whole", &["--seeds", "4"]).assert().success();
    let took = begin.elapsed().as_secs_f64();
    let mut kills = 0;
    // Five moments that look random, but are the same each time.
    for part in [0.17, 0.11, 0.23, 0.13, 0.19] {
        let mut process = Command::new(env!("CARGO_BIN_EXE_patchlock"))
            .current_dir(benchmark.bench.folder.path())
            .args(["bench", "data", "--config", "quick.toml", "--out", "out", "--seeds", "4"])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        thread::sleep(Duration::from_secs_f64(part * took));
        kills += usize::from(process.try_wait().unwrap().is_none());
        process.kill().unwrap();
        process.wait().unwrap();
    }
    benchmark.bench("out", &["--seeds", "4"]).assert().success().stdout(contains("already done"));
    assert!(kills >= 4, "the runs were faster than expected: {kills} kills");
    assert_eq!(benchmark.trajectories("out"), benchmark.trajectories("whole"));
}

#[test]
fn other_settings_need_another_name() {
    let benchmark = Benchmark::new(1, 3);
    benchmark.bench("out", &[]).assert().success();
    fs::write(benchmark.path("quick.toml"), "small_step = 8\n[paper]\nparticles = 21\n").unwrap();
    benchmark
        .bench("out", &[])
        .assert()
        .code(2)
        .stderr(contains("particles is 20 there and 21 here").and(contains("--name")));
    benchmark.bench("out", &["--name", "other"]).assert().success();
    assert_eq!(benchmark.trajectories("out").len(), 2);
    // The same names with other frames belong to another dataset.
    fs::remove_file(benchmark.path("data/A/img/2.png")).unwrap();
    fs::write(benchmark.path("data/A/groundtruth_rect.txt"), "21,19,32,28\n22,19,32,28\n").unwrap();
    let error = contains("has 3 frames").and(contains("--out"));
    benchmark.bench("out", &["--name", "other"]).assert().code(2).stderr(error);
}

#[test]
fn shards_and_jobs_give_the_same_boxes() {
    let benchmark = Benchmark::new(3, 4);
    benchmark.bench("whole", &["--seeds", "2"]).assert().success();
    for shard in ["1/4", "2/4", "3/4", "4/4"] {
        benchmark.bench("parts", &["--seeds", "2", "--shard", shard]).assert().success();
    }
    benchmark.bench("side", &["--seeds", "2", "--jobs", "3", "--threads", "2"]).assert().success();
    let whole = benchmark.trajectories("whole");
    assert_eq!((whole.len(), &benchmark.trajectories("parts")), (6, &whole));
    assert_eq!(benchmark.trajectories("side"), whole);
    // Times of parallel runs do not measure speed.
    let score =
        benchmark.patchlock(&["score", "side", "--truth", "data", "--json"]).assert().success();
    let score = json(&score.get_output().stdout);
    assert!(score["trackers"][0]["fps"].is_null());
    assert!(score["trackers"][0]["notes"].to_string().contains("in parallel"));
}

#[test]
fn failed_sequences_do_not_stop_the_others() {
    let benchmark = Benchmark::new(3, 4);
    fs::write(benchmark.path("data/A/img/2.png"), "not an image").unwrap();
    fs::remove_file(benchmark.path("data/B/img/1.png")).unwrap();
    fs::create_dir(benchmark.path("data/D")).unwrap();
    fs::write(benchmark.path("data/D/groundtruth_rect.txt"), "21,19,32\n").unwrap();
    benchmark
        .bench("out", &[])
        .assert()
        .code(1)
        .stdout(contains("1 run done"))
        .stderr(contains("A (seed 0").and(contains("2.png")))
        .stderr(contains("B: image 1 is missing"))
        .stderr(contains("D: ").and(contains("line 1: 3 numbers, where a box has 4")));
    assert_eq!(
        benchmark.trajectories("out").into_keys().collect::<Vec<_>>(),
        ["quick/ope/C/0.txt"]
    );
}

#[test]
fn protocols_with_many_starts_and_many_first_boxes() {
    let benchmark = Benchmark::new(1, 24);
    benchmark
        .bench("out", &["--protocol", "tre"])
        .assert()
        .success()
        .stdout(contains("5 runs done"));
    benchmark
        .bench("out", &["--protocol", "sre"])
        .assert()
        .success()
        .stdout(contains("12 runs done"));
    let boxes = benchmark.trajectories("out");
    assert_eq!(boxes["quick/tre/A/0-4.txt"].lines().count(), 20, "starts on the fifth frame");
    let score =
        benchmark.patchlock(&["score", "out", "--truth", "data", "--json"]).assert().success();
    let score = json(&score.get_output().stdout);
    let names: Vec<&str> =
        score["trackers"].as_array().unwrap().iter().map(|t| t["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["quick TRE", "quick SRE"]);
    // A missing run would shift the score of its target.
    fs::remove_file(benchmark.path("out/quick/sre/A/0-3.txt")).unwrap();
    fs::remove_file(benchmark.path("out/quick/sre/A/0-3.json")).unwrap();
    benchmark
        .patchlock(&["score", "out", "--truth", "data"])
        .assert()
        .code(1)
        .stderr(contains("A, seed 0: left out, since only 11 of 12 runs are complete"));
}

#[test]
fn invalid_options_are_refused() {
    let benchmark = Benchmark::new(2, 3);
    fs::write(benchmark.path("attributes.csv"), "sequence,IV,OCC\nA,1,0\nB,0,1\n").unwrap();
    let usage = |more: &[&str], said: &str| {
        benchmark.bench("out", more).assert().code(2).stderr(contains(said));
    };
    usage(&["--sequences", "Z"], "no target Z");
    usage(&["--attributes", "XX"], "the attributes are IV, OCC");
    usage(&["--sequences", "A", "--attributes", "OCC"], "no target is selected");
    usage(&["--shard", "3/2"], "I from 1 to N");
    usage(&["--protocol", "abc"], "ope, tre and sre");
    for name in ["a/b", "a\u{1b}[31m", &"n".repeat(300)] {
        usage(&["--name", name], "folder name");
    }
    usage(&["--seeds", "0"], "0");
    benchmark.bench("out", &["--attributes", "occ"]).assert().success();
    assert_eq!(
        benchmark.trajectories("out").into_keys().collect::<Vec<_>>(),
        ["quick/ope/B/0.txt"]
    );
    benchmark
        .patchlock(&["bench", "nowhere", "--out", "o"])
        .assert()
        .code(1)
        .stderr(contains("nowhere"));
    benchmark
        .patchlock(&["bench", "out", "--out", "o"])
        .assert()
        .code(2)
        .stderr(contains("not a dataset"));
}
