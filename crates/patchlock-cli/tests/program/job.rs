//! Runs as messages: executed anywhere, they give the results of `bench` and the boxes of `track`.

use std::fs;
use std::path::Path;

use crate::support::Bench;
use crate::support::benchmark::Benchmark;
use patchlock::{BoundingBox, Preset, TrackerConfig};
use patchlock_bench::bench::job::{self, Frames, Job};
use patchlock_bench::bench::plan::{Options, TrackerSpec};
use patchlock_bench::bench::schemes::{Scheme, Start};
use patchlock_bench::bench::store::{Clip, Identity, Series};
use patchlock_track::ModelPaths;

/// The job after a round trip through its JSON message.
fn sent(job: &Job) -> Job {
    let message = serde_json::to_string(job).unwrap();
    let received: Job = serde_json::from_str(&message).unwrap();
    assert_eq!(&received, job);
    received
}

fn options(benchmark: &Benchmark, out: &str) -> Options {
    let config = Some(benchmark.path("quick.toml"));
    Options {
        dataset: benchmark.path("data"),
        out: benchmark.path(out),
        tracker: TrackerSpec::Patchlock {
            preset: "paper".into(),
            config,
            paths: ModelPaths::default(),
            name: None,
        },
        scheme: Scheme::Ope,
        seeds: 1,
        sequences: Vec::new(),
        attributes: Vec::new(),
        shard: (1, 1),
    }
}

#[test]
fn jobs_give_the_results_of_bench() {
    let benchmark = Benchmark::new(3, 4);
    fs::remove_file(benchmark.path("data/B/img/1.png")).unwrap();
    benchmark.bench("whole", &["--seeds", "2"]).assert().code(1);
    let options = Options { seeds: 2, ..options(&benchmark, "parts") };
    let found = job::of_bench(&options, 1, 2).unwrap();
    assert_eq!((found.tasks.len(), found.before, found.failures.len()), (4, 0, 1));
    for job in &found.tasks {
        let written = sent(job).track(None).unwrap();
        found.store.keep(&job.run(), &written).unwrap();
    }
    assert_eq!(benchmark.trajectories("parts"), benchmark.trajectories("whole"));
    let again = job::of_bench(&options, 1, 2).unwrap();
    assert_eq!((again.tasks.len(), again.before), (0, 4));
}

#[test]
fn invalid_options_are_refused() {
    let benchmark = Benchmark::new(1, 3);
    let error = |options: Options| job::of_bench(&options, 1, 1).unwrap_err().to_string();
    let good = || options(&benchmark, "out");
    assert!(error(Options { sequences: vec!["Z".into()], ..good() }).contains("no target Z"));
    let program = |command: &str, name: &str| TrackerSpec::Program {
        command: command.into(),
        name: name.into(),
        patience: std::time::Duration::ZERO,
    };
    assert!(
        error(Options { tracker: program("'x", "x"), ..good() })
            .contains("not a valid command line")
    );
    assert!(
        error(Options { tracker: program("x", "a/b"), ..good() })
            .contains(r#""a/b" is not a valid folder name"#)
    );
    assert!("abc".parse::<Scheme>().unwrap_err().contains("ope, tre and sre"));
}

fn clip(path: &Path, clip: Clip, config: &TrackerConfig) -> Job {
    let (scheme, subject) = (Scheme::Ope, Identity::patchlock(config, "paper"));
    let bbox = BoundingBox { x: 22.0, y: 18.0, w: 32.0, h: 28.0 };
    Job {
        series: Series { tracker: "quick".into(), scheme, subject, origin: 1.0 },
        target: "a".into(),
        seed: 5,
        start: Start { variant: 0, first: 0, bbox },
        frames: Frames::Clip { path: path.display().to_string(), clip },
        threads: 1,
        side_by_side: 1,
        patience: std::time::Duration::from_secs(1),
        paths: ModelPaths::default(),
        video: None,
    }
}

#[test]
fn a_clip_has_the_boxes_of_track() {
    let bench = Bench::new();
    bench.mp4("a.mp4", 8);
    let part = ["--box", "22,18,32,28", "--start", "2", "--end", "8", "--stride", "2"];
    bench.bare("a.mp4").args(part).args(["--seed", "5", "--save", "a.txt"]).assert().success();
    let mut config = TrackerConfig::from(Preset::Paper);
    config.set("particles", 12).unwrap();
    let part = Clip { source: "a.mp4".into(), start: 2, end: Some(8), stride: 2 };
    let written = sent(&clip(&bench.path("a.mp4"), part, &config)).track(None).unwrap();
    let boxes = |text: &str| -> Vec<Vec<f64>> {
        text.lines().map(|l| l.split(',').map(|word| word.parse().unwrap()).collect()).collect()
    };
    let (own, tracked) = (boxes(&written.boxes), boxes(&bench.lines("a.txt").join("\n")));
    assert_eq!((own.len(), tracked.len()), (3, 3));
    // `track` writes fewer digits.
    for (a, b) in own.iter().flatten().zip(tracked.iter().flatten()) {
        assert!((a - b).abs() < 1e-3, "{own:?} {tracked:?}");
    }
}

#[test]
fn invalid_clips_are_refused() {
    let bench = Bench::new();
    bench.mp4("a.mp4", 3);
    let mut config = TrackerConfig::from(Preset::Paper);
    config.set("particles", 12).unwrap();
    let whole = || Clip { source: "a.mp4".into(), start: 0, end: None, stride: 1 };
    let good = clip(&bench.path("a.mp4"), whole(), &config);
    let error = |job: Job| job.track(None).unwrap_err().to_string();
    assert!(error(clip(&bench.path("b.mp4"), whole(), &config)).contains("no file or folder"));
    let late = Clip { start: 3, ..whole() };
    assert!(error(clip(&bench.path("a.mp4"), late, &config)).contains("source has 3 frames"));
    let still = Clip { stride: 0, ..whole() };
    assert!(error(clip(&bench.path("a.mp4"), still, &config)).contains("the stride is 0"));
    let outside = BoundingBox { x: 500.0, y: 18.0, w: 32.0, h: 28.0 };
    let start = Start { bbox: outside, ..good.start };
    assert!(error(Job { start, ..good.clone() }).contains("does not fit frame 0"));
    // Another version may give other boxes.
    let mut other = good;
    if let Identity::Patchlock { version, .. } = &mut other.series.subject {
        *version = "0.0.9".into();
    }
    assert!(error(other).contains("the same build everywhere"));
}
