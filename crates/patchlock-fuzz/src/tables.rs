//! Tables of boxes: truth, results, tracks, imports, and those that say which targets to follow.

use std::fs;
use std::path::Path;
use std::sync::LazyLock;

use patchlock::BoundingBox;
use patchlock_bench::bench::store::sha256;
use patchlock_bench::dataset::Dataset;
use patchlock_bench::results as read_results;
use patchlock_bench::score::{self, TrackerScore};
use patchlock_cli::target::Truth;
use patchlock_cli::targets::Targets;
use patchlock_media::{Limits, Picture};
use patchlock_studio::project::{Project, Store, Target};
use patchlock_studio::{export as studio_export, import};
use patchlock_track::export::{self, KeyFrames, Track};
use patchlock_track::text;
use serde_json::json;

use crate::check::{accepted, finite, said};
use crate::scratch::Scratch;
use crate::{choice, parts};

/// Rows beyond which a table is only read: what is made of it takes time for each.
const ROWS: usize = 2_000;

/// The files of the layouts of truth.
const LAYOUTS: &[&[&str]] = &[
    &["X/groundtruth_rect.txt", "X/img/0001.png", "attributes.csv"],
    &["X/groundtruth.txt", "X/00000001.jpg", "X/absence.label"],
    &["X/groundtruth.txt", "X/img/00000001.jpg", "X/full_occlusion.txt", "X/out_of_view.txt"],
    &["anno/set/X.txt", "data_seq/set/X/000001.jpg"],
    &["X/groundtruth.txt", "X/color/00000001.jpg"],
    &["anno/X.txt", "frames/X/0.jpg", "frames/X/1.jpg"],
    &["X.txt", "Y.txt", "attributes.csv"],
];

/// The files of the layouts of results.
const RESULTS: &[&[&str]] = &[
    &["A/X.txt", "A/times/X_time.txt", "B/X.txt"],
    &["A/X/X_001.txt", "A/X/X_002.txt", "A/X/X_time.txt"],
    &["A/baseline/X/X_001.txt", "A/baseline/Y/Y_001.txt"],
    &["A/manifest.json", "A/ope/X/0.json", "A/ope/X/0.txt"],
    &["manifest.json", "tre/X/0.json", "tre/X/0.txt"],
];

/// Writes the parts of an input as these files; a part that is missing is a file that is missing.
/// The word `HASH` becomes the hash of the last part, without which a run would be refused at once.
fn place(scratch: &Scratch, layout: &[&str], data: &[u8]) {
    let hash = sha256(parts(data).last().unwrap_or_default());
    for (name, content) in layout.iter().zip(parts(data)) {
        match std::str::from_utf8(content) {
            Ok(text) if text.contains("HASH") => {
                scratch.file(name, text.replace("HASH", &hash).as_bytes())
            }
            _ => scratch.file(name, content),
        };
    }
}

/// Truth, in the layout that the first byte chooses; the separated parts are its files.
pub fn truth(data: &[u8]) {
    let (first, rest) = choice(data);
    let scratch = Scratch::new();
    place(&scratch, LAYOUTS[usize::from(first) % LAYOUTS.len()], rest);
    let Some(dataset) = accepted(Dataset::open(scratch.folder())) else { return };
    for sequence in &dataset.sequences {
        sequence.truth.iter().flatten().for_each(|bbox| finite(*bbox));
        assert!(sequence.truth.iter().flatten().all(|bbox| bbox.w > 0.0 && bbox.h > 0.0));
    }
    dataset.remarks.iter().for_each(|remark| drop(said(remark)));
    let findings = format!("{:?}", dataset.inspect());
    assert!(!findings.is_empty());
    // The same boxes as text give the same truth.
    for sequence in dataset.sequences.iter().filter(|sequence| sequence.truth.len() <= ROWS) {
        let origin = dataset.origin();
        let again = lines(&sequence.truth, origin);
        let file = scratch.file("again/Z.txt", again.as_bytes());
        let table = text::read(&file).expect("what was read can be written");
        for (row, bbox) in table.rows.iter().zip(&sequence.truth) {
            assert_eq!(text::region(row, origin).expect("a row of ours").is_some(), bbox.is_some());
        }
    }
}

/// Boxes as lines; NaN where there is none.
fn lines(boxes: &[Option<BoundingBox>], origin: f64) -> String {
    let line = |bbox: &Option<BoundingBox>| match bbox {
        Some(b) => format!("{},{},{},{}\n", b.x, b.y, b.w, b.h),
        None => "NaN,NaN,NaN,NaN\n".to_owned(),
    };
    let moved = |b: BoundingBox| BoundingBox { x: b.x + origin, y: b.y + origin, ..b };
    boxes.iter().map(|bbox| line(&bbox.map(moved))).collect()
}

/// Results of trackers, in the layout that the first byte chooses, scored against a fixed truth.
pub fn results(data: &[u8]) {
    static TRUTH: LazyLock<(Scratch, Dataset)> = LazyLock::new(|| {
        let scratch = Scratch::new();
        let rows: String = (0..12).map(|k| format!("{},{},30,20\n", 10 + k, 5 + k)).collect();
        scratch.file("X.txt", rows.as_bytes());
        scratch.file("Y.txt", rows.as_bytes());
        let dataset = Dataset::open(scratch.folder()).expect("is truth");
        (scratch, dataset)
    });
    let (first, rest) = choice(data);
    let scratch = Scratch::new();
    place(&scratch, RESULTS[usize::from(first) % RESULTS.len()], rest);
    let truth = &TRUTH.1;
    let Some(read) = accepted(read_results::read(scratch.folder(), truth)) else { return };
    for results in &read {
        results.runs.iter().flat_map(|run| run.boxes.iter().flatten()).for_each(|b| finite(*b));
        results.faults.iter().chain(&results.notes).for_each(|text| drop(said(text)));
    }
    let board = score::scoreboard(&read, truth);
    board.refused.iter().flat_map(|r| &r.reasons).for_each(|reason| drop(said(reason)));
    board.trackers.iter().for_each(shares);
}

/// Scores are shares from 0 to 1.
fn shares(tracker: &TrackerScore) {
    let all = &tracker.overall;
    let all = [all.dp20.mean, all.auc.mean, all.success50.mean, all.mean_overlap.mean];
    assert!(all.iter().all(|v| (0.0..=1.0).contains(v)), "{all:?}");
}

/// Which targets to follow: `--boxes` with an even first byte, `--box-from` with an odd one.
pub fn boxes(data: &[u8]) {
    let (first, rest) = choice(data);
    let scratch = Scratch::new();
    let file = scratch.file("boxes.csv", rest);
    if first % 2 == 1 {
        let Some(truth) = accepted(Truth::read(&file)) else { return };
        for frame in [0, 1, 7] {
            accepted(truth.at(frame)).into_iter().for_each(finite);
        }
        return;
    }
    let Some(mut targets) = accepted(Targets::from_table(&file)) else { return };
    let starts: Vec<_> = targets.starts().take(ROWS).collect();
    let picture = Picture::rgb(16, 16, vec![0; 16 * 16 * 3]);
    for frame in starts.iter().filter_map(|(frame, _)| *frame) {
        accepted(targets.check_boxes(frame, &picture));
        targets.due(frame).iter().filter_map(|event| event.bbox).for_each(finite);
    }
    accepted(targets.check_all_done());
}

/// Saved tracks, of the extension that the first byte chooses; what is read is written in every
/// format.
pub fn tracks(data: &[u8]) {
    let (first, rest) = choice(data);
    let scratch = Scratch::new();
    let ending = ["csv", "jsonl", "txt"][usize::from(first) % 3];
    let file = scratch.file(&format!("track.{ending}"), rest);
    let Some(track) = accepted(Track::read(&file)) else { return };
    track.entries().iter().filter_map(|entry| entry.bbox).for_each(finite);
    if track.entries().len() > ROWS {
        return;
    }
    for (k, format) in export::Format::ALL.into_iter().enumerate() {
        let key_frames = match (format.has_key_frames, first / 3) {
            (false, _) => KeyFrames::Every(1),
            (true, step @ 0..64) => KeyFrames::Every(1 + usize::from(step)),
            (true, share) => KeyFrames::Overlap(f64::from(share) / 100.0),
        };
        let options = export::Options {
            size: Some((640, 480)),
            key_frames,
            ..export::Options::new(format, "clip")
        };
        let out = scratch.folder().join(format!("out{k}"));
        if accepted(export::write(&track, &options, &out, false)).is_some() && format.is_file() {
            readable(format.name, &out);
        }
    }
}

/// What was exported for a format that is also imported is read, unless the project cannot have it.
fn readable(format: &str, file: &Path) {
    if let Some(format) = import::Format::ALL.into_iter().find(|known| known.name() == format) {
        let text = fs::read(file).expect("was written");
        accepted(import::read(format, &text, empty_project(&Scratch::new()).project(), &[]));
    }
}

/// Annotations of the format that the first byte chooses, added to a project, which is exported in
/// every format.
pub fn imports(data: &[u8]) {
    let (first, rest) = choice(data);
    let format = import::Format::ALL[usize::from(first) % import::Format::ALL.len()];
    let scratch = Scratch::new();
    let mut store = empty_project(&scratch);
    let Some(imported) = accepted(import::read(format, rest, store.project(), &[])) else { return };
    let edits = imported.edits(&store.project().labels);
    if accepted(store.apply(edits)).is_some() {
        store.project().targets.iter().for_each(finite_boxes);
        exported(store.project());
    }
}

pub fn finite_boxes(target: &Target) {
    target.keys.values().for_each(|key| finite(key.bbox));
    target.tracked.values().for_each(|tracked| finite(tracked.bbox));
}

/// Writes a project in every format. Its own table gives the same targets.
pub fn exported(project: &Project) {
    let frames: usize = project.targets.iter().map(known_frames).sum();
    // Millions of hidden frames are refused at once; fewer take their time.
    if (ROWS..5_000_000).contains(&frames) {
        return;
    }
    let scratch = Scratch::new();
    for (k, format) in export::Format::all(true).enumerate() {
        let options = export::Options::new(format, "clip");
        let out = scratch.folder().join(format!("out{k}"));
        let written = accepted(studio_export::write(project, &options, &out, false));
        if written.is_none() || format.name != "csv" {
            continue;
        }
        let table = fs::read(out).expect("was written");
        let again = import::read(import::Format::Csv, &table, project, &[]);
        let again = again.expect("the own table can be read").targets;
        let with_boxes = |t: &&Target| !t.keys.is_empty() || !t.tracked.is_empty();
        let mut own: Vec<&Target> = project.targets.iter().filter(with_boxes).collect();
        own.sort_by_key(|target| target.id);
        assert_eq!(again.len(), own.len());
        for (again, target) in again.iter().zip(own) {
            assert_eq!((&again.keys, &again.tracked), (&target.keys, &target.tracked));
            assert_eq!(again.hidden, target.hidden);
        }
    }
}

fn known_frames(target: &Target) -> usize {
    let hidden: usize = target.hidden.iter().map(|[from, to]| to - from + 1).sum();
    target.keys.len() + target.tracked.len() + hidden
}

/// A project of a video that is not there.
fn empty_project(scratch: &Scratch) -> Store {
    let video = json!({
        "path": "clip.mp4", "bytes": 1000, "hash": "0".repeat(64), "frames": 40, "width": 640,
        "height": 480,
    });
    let text = json!({
        "format": "patchlock-project", "version": 1, "video": video,
        "labels": [{ "name": "target", "colour": "#e69f00" }], "targets": [],
    });
    let file = scratch.file("project.json", text.to_string().as_bytes());
    Store::open_shared(&file, None, Limits::default()).expect("is a project")
}
