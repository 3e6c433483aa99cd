//! Stores runs on disk and reads them back.

use std::path::Path;

use crate::support::{Folder, rows};
use patchlock::{BoundingBox, Preset, Status, TrackerConfig};
use patchlock_bench::bench::runner::{self, ProgressListener};
use patchlock_bench::bench::schemes::{Scheme, Start};
use patchlock_bench::bench::store::{Clip, Identity, Run, Series, Store, Trajectory};
use patchlock_bench::bench::subject::{Answer, Subject};
use patchlock_bench::dataset::Dataset;
use patchlock_bench::{Error, results};

fn open_store(out: &Path, subject: Identity, origin: f64) -> Result<Store, Error> {
    Store::open(out, Series { tracker: "ours".into(), scheme: Scheme::Ope, subject, origin })
}

fn keep(store: &Store, run: &Run<'_>, boxes: &[Option<BoundingBox>], seconds: Vec<f64>) {
    let trajectory = Trajectory { boxes: boxes.to_vec(), seconds, ..Trajectory::default() };
    store.keep(run, &store.series().write(run, trajectory, 2, 1)).unwrap();
}

#[test]
fn boxes_and_times_are_read_back() {
    let folder = Folder::new();
    folder.file("truth/a.txt", rows(3));
    let truth = Dataset::open(&folder.path().join("truth")).unwrap();
    let config = TrackerConfig::from(Preset::Paper);
    let open = |config: &TrackerConfig| {
        let identity = Identity::patchlock(config, "paper");
        open_store(&folder.path().join("out"), identity, truth.origin())
    };
    let store = open(&config).unwrap();
    let first = BoundingBox { x: 2.0, y: 3.0, w: 5.0, h: 6.0 };
    let frames = ["a/1.png".into(), "a/2.png".into(), "a/3.png".into()];
    let start = Start { variant: 0, first: 0, bbox: first };
    let run = Run { target: "a", frames: &frames, clip: None, seed: 7, start };
    assert!(!store.holds(&run).unwrap());
    let fractional =
        BoundingBox { x: 1.0 / 3.0, y: -std::f64::consts::PI, w: 5.1e-7, h: 1e5 / 7.0 };
    let seconds = vec![0.1, 1.0 / 3.0, 2e-9];
    keep(&store, &run, &[Some(first), None, Some(fractional)], seconds.clone());
    assert!(store.holds(&run).unwrap());

    let [back] = &results::read(&folder.path().join("out"), &truth).unwrap()[..] else {
        panic!("one tracker")
    };
    let read = &back.runs[0];
    assert_eq!((read.target.as_str(), read.seed, &read.seconds), ("a", 7, &Some(seconds)));
    assert_eq!(read.boxes[..2], [Some(first), None]);
    let got = read.boxes[2].unwrap();
    // Sizes are read back exactly. Positions lose at most the bit that adding 1 costs.
    assert_eq!((got.w, got.h), (fractional.w, fractional.h));
    assert!((got.x - fractional.x).abs() < 1e-15 && (got.y - fractional.y).abs() < 1e-15);

    // The seed belongs to the run, not to the configuration; any other change makes other runs.
    let mut seeded = config.clone();
    seeded.seed = 99;
    assert!(open(&seeded).is_ok());
    let mut other = config;
    other.set("particles", 99).unwrap();
    let other = open(&other);
    assert!(matches!(other, Err(Error::Conflict { .. })));
    let elsewhere = Run { start: Start { bbox: fractional, ..start }, ..run };
    assert!(matches!(store.holds(&elsewhere), Err(Error::Conflict { .. })));
}

/// A run of three frames with the given scores and statuses, in the folder `out`, and the truth.
fn with_answers(folder: &Folder, answers: [(Option<f64>, Option<Status>); 3]) -> Dataset {
    folder.file("truth/a.txt", rows(3));
    let truth = Dataset::open(&folder.path().join("truth")).unwrap();
    let identity = Identity::Trax { command: vec!["x".into()] };
    let store = open_store(&folder.path().join("out"), identity, truth.origin()).unwrap();
    let bbox = BoundingBox { x: 2.0, y: 3.0, w: 5.0, h: 6.0 };
    let frames = ["a/1.png".into(), "a/2.png".into(), "a/3.png".into()];
    let start = Start { variant: 0, first: 0, bbox };
    let run = Run { target: "a", frames: &frames, clip: None, seed: 0, start };
    let mut trajectory = Trajectory::default();
    for (score, status) in answers {
        trajectory.add(Answer { score, status, ..Answer::of_box(Some(bbox), 0.1) });
    }
    store.keep(&run, &store.series().write(&run, trajectory, 1, 1)).unwrap();
    truth
}

#[test]
fn scores_and_statuses_are_read_back() {
    let folder = Folder::new();
    let scores = [1.0, 1.0 / 3.0, 0.0];
    let statuses = [Status::Tracked, Status::Uncertain, Status::Lost];
    let answer = |k: usize| (Some(scores[k]), Some(statuses[k]));
    let truth = with_answers(&folder, [0, 1, 2].map(answer));
    let back = results::read(&folder.path().join("out"), &truth).unwrap();
    assert_eq!(back[0].runs[0].scores.as_deref(), Some(&scores[..]));
    assert_eq!(back[0].runs[0].statuses.as_deref(), Some(&statuses[..]));
    let boxes = std::fs::read_to_string(folder.path().join("out/ours/ope/a/0.txt")).unwrap();
    assert_eq!(boxes, rows(3), "the file of boxes has nothing else");

    // A run by another program may lack them; values that cannot be are refused.
    let file = "out/ours/ope/a/0.json";
    let text = std::fs::read_to_string(folder.path().join(file)).unwrap();
    let columns =
        ",\"score\":[1.0,0.3333333333333333,0.0],\"status\":[\"tracked\",\"uncertain\",\"lost\"]";
    assert!(text.contains(columns), "{text}");
    for (change, fault) in [
        ("", None),
        (",\"score\":[1.0,0.5]", Some("it does not have one score and status for each box")),
        (",\"status\":[]", Some("it does not have one score and status for each box")),
        (",\"score\":[1.0,0.5,1.25]", Some("the score 1.25 is not between 0 and 1")),
        (",\"status\":[\"tracked\",\"found\",\"lost\"]", Some("unknown variant `found`")),
    ] {
        folder.file(file, text.replace(columns, change));
        let back = &results::read(&folder.path().join("out"), &truth).unwrap()[0];
        match fault {
            None => assert_eq!((&back.runs[0].scores, &back.runs[0].statuses), (&None, &None)),
            Some(fault) => assert!(back.faults[0].contains(fault), "{:?}", back.faults),
        }
    }
}

#[test]
fn scores_are_stored_only_if_all_frames_have_one() {
    let folder = Folder::new();
    let some = (Some(0.5), Some(Status::Tracked));
    let truth = with_answers(&folder, [some, (None, Some(Status::Lost)), some]);
    let run = &results::read(&folder.path().join("out"), &truth).unwrap()[0].runs[0];
    assert_eq!(run.scores, None);
    assert_eq!(run.statuses, Some(vec![Status::Tracked, Status::Lost, Status::Tracked]));
}

#[test]
fn runs_of_other_versions_can_be_scored_but_not_continued() {
    let folder = Folder::new();
    folder.file("truth/a.txt", rows(1));
    let truth = Dataset::open(&folder.path().join("truth")).unwrap();
    let out = folder.path().join("out");
    let config = TrackerConfig::from(Preset::Paper);
    let identity = Identity::patchlock(&config, "paper");
    let store = open_store(&out, identity.clone(), 1.0).unwrap();
    let bbox = BoundingBox { x: 2.0, y: 3.0, w: 5.0, h: 6.0 };
    let frames = ["a/1.png".into()];
    let start = Start { variant: 0, first: 0, bbox };
    let run = Run { target: "a", frames: &frames, clip: None, seed: 0, start };
    keep(&store, &run, &[Some(bbox)], vec![0.1]);
    // As written by a version with one more parameter in its configuration.
    let hash = identity.hash();
    for name in ["out/ours/manifest.json", "out/ours/ope/a/0.json"] {
        let text = std::fs::read_to_string(folder.path().join(name)).unwrap();
        let text =
            text.replace(&hash, "0123").replacen("\"particles\"", "\"novel\":1,\"particles\"", 1);
        folder.file(name, text);
    }
    let back = results::read(&out, &truth).unwrap();
    assert_eq!((back[0].runs.len(), back[0].faults.len()), (1, 0));
    let error = open_store(&out, identity, 1.0).unwrap_err().to_string();
    assert!(error.contains("novel is 1 there and not set here"), "{error}");
}

/// Whether a preset or a settings file has chosen the method.
#[test]
fn the_recorded_preset_has_the_method_in_use() {
    let paper = TrackerConfig::from(Preset::Paper);
    let preset = |config: &TrackerConfig, preset: &str| match Identity::patchlock(config, preset) {
        Identity::Patchlock { preset, .. } => preset,
        Identity::Trax { .. } => panic!("not an external program"),
    };
    assert_eq!(preset(&paper, "robust"), "paper");
    assert_eq!(preset(&TrackerConfig::default(), "paper"), "robust");
}

/// Reports the given box, then none; panics on the target `bad`.
struct PanickingTracker;

impl Subject for PanickingTracker {
    fn step(&mut self, frame: &Path, start: Option<BoundingBox>) -> Result<Answer, Error> {
        assert!(!frame.starts_with("bad"), "a decoder may panic on a damaged file");
        Ok(Answer::of_box(start, 0.1))
    }
}

struct NoProgress;

impl ProgressListener for NoProgress {
    fn begins(&self, _: &Run<'_>) {}
    fn frame(&self) {}
    fn ends(&self, _: usize, _: bool) {}
    fn stopped(&self) -> bool {
        false
    }
}

#[test]
fn a_panic_in_one_run_does_not_stop_the_others() {
    let folder = Folder::new();
    let identity = Identity::Trax { command: vec!["x".into()] };
    let store = open_store(folder.path(), identity, 1.0).unwrap();
    let bbox = BoundingBox { x: 2.0, y: 3.0, w: 5.0, h: 6.0 };
    let start = Start { variant: 0, first: 0, bbox };
    let (bad, good) = (["bad/1.png".into()], ["good/1.png".into(), "good/2.png".into()]);
    let task = |target, frames| Run { target, frames, clip: None, seed: 0, start };
    let tasks = [task("bad", &bad[..]), task("good", &good[..])];
    let make = |_| Ok(Box::new(PanickingTracker) as Box<dyn Subject>);
    let failures = runner::run(&tasks, &store, &make, 1, 1, &NoProgress);
    assert_eq!((failures.len(), failures[0].target.as_str()), (1, "bad"));
    assert!(!store.holds(&tasks[0]).unwrap() && store.holds(&tasks[1]).unwrap());
}

#[test]
fn modified_boxes_are_not_scored() {
    let folder = Folder::new();
    folder.file("truth/a.txt", rows(1));
    let truth = Dataset::open(&folder.path().join("truth")).unwrap();
    let identity = Identity::Trax { command: vec!["x".into()] };
    let out = folder.path().join("out");
    let store = open_store(&out, identity, truth.origin()).unwrap();
    let bbox = BoundingBox { x: 2.0, y: 3.0, w: 5.0, h: 6.0 };
    let frames = ["a/1.png".into()];
    let start = Start { variant: 0, first: 0, bbox };
    let run = Run { target: "a", frames: &frames, clip: None, seed: 0, start };
    keep(&store, &run, &[Some(bbox)], vec![0.1]);
    folder.file("out/ours/ope/a/0.txt", "3,4,5,7\n");
    let faults = &results::read(&out, &truth).unwrap()[0].faults;
    assert!(faults[0].contains("the hash of the boxes beside it does not match"), "{faults:?}");
    assert!(!store.holds(&run).unwrap(), "the run is made again");
}

#[test]
fn clips_differ_if_their_source_or_range_differs() {
    let folder = Folder::new();
    let identity = Identity::Trax { command: vec!["x".into()] };
    let store = open_store(folder.path(), identity, 1.0).unwrap();
    let bbox = BoundingBox { x: 2.0, y: 3.0, w: 5.0, h: 6.0 };
    let start = Start { variant: 0, first: 0, bbox };
    let clip = Clip { source: "films/a.mp4".into(), start: 3, end: None, stride: 2 };
    fn of(clip: &Clip, start: Start) -> Run<'_> {
        Run { target: "a", frames: &[], clip: Some(clip), seed: 0, start }
    }
    let run = of(&clip, start);
    assert!(!store.holds(&run).unwrap());
    let mut trajectory = Trajectory::default();
    trajectory.add(Answer::of_box(Some(bbox), 0.1));
    store.keep(&run, &store.series().write(&run, trajectory, 1, 1)).unwrap();
    assert!(store.holds(&run).unwrap());
    for other in
        [Clip { end: Some(9), ..clip.clone() }, Clip { source: "b.mp4".into(), ..clip.clone() }]
    {
        let error = store.holds(&of(&other, start)).unwrap_err().to_string();
        assert!(error.contains("stride 2, 3 to the end of films/a.mp4"), "{error}");
    }
}
