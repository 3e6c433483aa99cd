//! Tests of `patchlock score` and `patchlock dataset`.

use std::fs;

use crate::support::benchmark::Benchmark;
use predicates::prelude::*;
use predicates::str::contains;
use serde_json::Value;

/// A benchmark of targets A and B, and a tracker whose boxes equal the truth for A and are far off
/// for B.
fn half_right() -> Benchmark {
    let benchmark = Benchmark::new(2, 3);
    fs::create_dir(benchmark.path("half")).unwrap();
    fs::write(benchmark.path("half/a.txt"), "21,19,32,28\n22,19,32,28\n23,19,32,28\n").unwrap();
    fs::write(benchmark.path("half/b.txt"), "21,19,32,28\n90,19,32,28\n90,19,32,28\n").unwrap();
    fs::write(benchmark.path("attributes.csv"), "sequence,IV,OCC\nA,1,1\nB,0,1\n").unwrap();
    benchmark
}

#[test]
fn tables_and_json_have_the_same_scores() {
    let benchmark = half_right();
    let table = benchmark
        .patchlock(&["score", "half", "--truth", "data", "--by", "attribute"])
        .assert()
        .success()
        .stderr("");
    let table = String::from_utf8(table.get_output().stdout.clone()).unwrap();
    let lines: Vec<Vec<&str>> =
        table.lines().map(|line| line.split_whitespace().collect()).collect();
    // A is right in all frames, B in one of three. An overlap of 1 exceeds 20 of the 21 thresholds.
    assert_eq!(lines[1][..5], ["half", "2", "1", "0.667", "0.635"], "{table}");
    assert!(
        lines.contains(&vec!["IV", "1", "1.000"]) && lines.contains(&vec!["OCC", "2", "0.667"]),
        "{table}"
    );
    let json = benchmark
        .patchlock(&["score", "half", "--truth", "data", "--by", "attribute", "--json"])
        .assert()
        .success();
    let json: Value = serde_json::from_slice(&json.get_output().stdout).unwrap();
    let tracker = &json["trackers"][0];
    assert!((tracker["dp20"].as_f64().unwrap() - 2.0 / 3.0).abs() < 1e-12);
    assert!((tracker["auc"].as_f64().unwrap() - 20.0 / 21.0 * 2.0 / 3.0).abs() < 1e-12);
    assert_eq!(
        (&tracker["seeds"], &tracker["dp20_sd"], &tracker["fps"]),
        (&1.into(), &Value::Null, &Value::Null)
    );
    assert_eq!(tracker["attributes"]["IV"]["dp20"], 1.0);
    assert!((tracker["lost_share"].as_f64().unwrap() - 1.0 / 3.0).abs() < 1e-12);
    assert_eq!(tracker["overlap_not_lost"], 1.0);
    benchmark
        .patchlock(&["score", "half", "--truth", "data", "--by", "target"])
        .assert()
        .success()
        .stdout(contains("B             1  0.333"));
}

#[test]
fn what_a_tracker_says_of_itself_is_scored_where_it_is_known() {
    let benchmark = Benchmark::new(1, 5);
    benchmark.bench("out", &[]).assert().success();
    let truth = "21,19,32,28\n22,19,32,28\n90,70,5,5\nNaN,NaN,NaN,NaN\n25,19,32,28\n";
    fs::write(benchmark.path("data/A/groundtruth_rect.txt"), truth).unwrap();
    fs::create_dir(benchmark.path("out/silent")).unwrap();
    fs::write(benchmark.path("out/silent/A.txt"), "21,19,32,28\n".repeat(5)).unwrap();
    let file = benchmark.path("out/quick/ope/A/0.json");
    let mut run: Value = serde_json::from_slice(&fs::read(&file).unwrap()).unwrap();
    run["score"] = vec![1.0, 0.9, 0.1, 0.1, 0.8].into();
    run["status"] = vec!["tracked", "tracked", "uncertain", "lost", "tracked"].into();
    fs::write(&file, run.to_string()).unwrap();

    let score = |more: &[&str]| {
        let arguments = [&["score", "out", "--truth", "data"], more].concat();
        benchmark.patchlock(&arguments).assert().success().get_output().stdout.clone()
    };
    let table = String::from_utf8(score(&[])).unwrap();
    assert!(table.contains("tracker  lost share  not lost"), "{table}");
    let (_, said) = table.split_once("Status and score, where known").unwrap();
    let lines: Vec<Vec<&str>> = said.lines().map(|l| l.split_whitespace().collect()).collect();
    assert_eq!(lines[3], ["quick", "1.000", "0.500", "0.000", "1.000", "0.125", "1.000"]);
    assert_eq!(lines.len(), 4, "the other tracker says nothing: {table}");

    let json: Value = serde_json::from_slice(&score(&["--json", "--by", "target"])).unwrap();
    let [quick, silent] = &json["trackers"].as_array().unwrap()[..] else { panic!("{json}") };
    for of in [quick, &quick["by_target"]["A"]] {
        let (status, calibration) = (&of["status"], &of["calibration"]);
        assert_eq!((&status["lost_precision"], &status["lost_recall"]), (&1.0.into(), &0.5.into()));
        assert_eq!((&status["first_lost"], &status["recoveries"]), (&3.0.into(), &1.0.into()));
        assert!((calibration["ece"].as_f64().unwrap() - 0.125).abs() < 1e-12);
        assert_eq!(calibration["pooled"]["bins"][1]["frames"], 2);
    }
    assert_eq!((&silent["status"], &silent["calibration"]), (&Value::Null, &Value::Null));
}

#[test]
fn invalid_results_are_reported_and_the_others_scored() {
    let benchmark = half_right();
    fs::create_dir(benchmark.path("short")).unwrap();
    fs::write(benchmark.path("short/A.txt"), "21,19,32,28\n").unwrap();
    benchmark
        .patchlock(&["score", "half", "short", "--truth", "data"])
        .assert()
        .code(1)
        .stdout(contains("half").and(contains("short").not()))
        .stderr(
            contains("1 boxes, but the truth of A has 3 frames").and(contains("not scored: short")),
        );
    benchmark
        .patchlock(&["score", "data/A/img", "--truth", "data"])
        .assert()
        .code(2)
        .stderr(contains("holds no results"));
    benchmark
        .patchlock(&["score", "half", "--truth", "half/a.txt"])
        .assert()
        .code(2)
        .stderr(contains("not a dataset"));
    // Invalid truth is reported as well.
    fs::write(benchmark.path("data/B/groundtruth_rect.txt"), "21,19,32,28\n\n23,19,32,28\n")
        .unwrap();
    benchmark
        .patchlock(&["score", "half", "--truth", "data"])
        .assert()
        .code(1)
        .stdout(contains("half           1"))
        .stderr(contains("truth of B: ").and(contains("line 2: the line is empty")));
    benchmark.patchlock(&["score", "half"]).assert().code(2).stderr(contains("--truth"));
}

#[test]
fn datasets_are_listed_with_anything_unusual() {
    let benchmark = half_right();
    benchmark
        .patchlock(&["dataset", "data"])
        .assert()
        .success()
        .stdout(
            contains("layout OTB, 2 targets, 6 frames, 6 rows of truth").and(contains("96 x 72")),
        )
        .stdout(contains("Nothing unusual"));
    fs::remove_file(benchmark.path("data/B/img/1.png")).unwrap();
    fs::write(
        benchmark.path("data/A/groundtruth_rect.txt"),
        "21,19,32,28\nNaN,NaN,NaN,NaN\n500,19,32,28\n",
    )
    .unwrap();
    let json = benchmark.patchlock(&["dataset", "data", "--json"]).assert().code(1);
    let json: Value = serde_json::from_slice(&json.get_output().stdout).unwrap();
    assert_eq!((&json["layout"], &json["targets"][0]["boxes"]), (&"OTB".into(), &2.into()));
    benchmark
        .patchlock(&["dataset", "data"])
        .assert()
        .code(1)
        .stdout(contains("! B: image 1 is missing"))
        .stdout(contains("  A: the truth of 1 of 3 frames is NaN"))
        .stdout(contains("  A: 1 of 2 boxes lie entirely outside the frame of 96 x 72"))
        .stderr(contains("1 fault found"));
    benchmark
        .patchlock(&["dataset", "half/a.txt"])
        .assert()
        .code(2)
        .stderr(contains("this is a file"));
}
