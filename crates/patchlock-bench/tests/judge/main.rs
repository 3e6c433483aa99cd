//! Compares our scores with an independent implementation: the got10k toolkit 0.1.3 scores the same
//! boxes against the same ground truth, and every difference is explained.
//!
//! Its definition of the centre of a box, its thresholds and its comparisons (`<=` for distances,
//! `>` for overlaps) are the same as ours. It differs in four conventions:
//!
//! - [`Difference::FirstFrame`]: it replaces the first box by the true one.
//! - [`Difference::MissingBox`]: a frame without a box counts as a failure; we use the last box
//!   before it.
//! - [`Difference::NoTruth`]: a frame without ground truth counts, with an overlap of 0; for us it
//!   does not count.
//! - [`Difference::Thresholds`]: its overlap thresholds are multiples of 0.05, which are not the
//!   closest numbers to 0.15, 0.3 and so on. Only overlaps within this rounding error are affected.
//!
//! With these conventions applied, the curves are equal for every target, except for frames whose
//! value equals a threshold up to rounding; these are counted. (Its speed, which is not tested
//! here, is the mean of 1 / t over frames; ours is the number of frames divided by the total time.)
//!
//! The tests on the golden file need only that file, which `tools/judge` generates. The others need
//! its virtual environment (`tools/judge/setup.sh`); without it they print a note and pass, or fail
//! if `PATCHLOCK_JUDGE` is `required`.

use std::array;
use std::collections::BTreeMap;
use std::env;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use patchlock::BoundingBox;
use patchlock_bench::dataset::Dataset;
use patchlock_bench::metrics;
use patchlock_bench::protocol::{PRECISION, SUCCESS};
use patchlock_bench::results::{self, Run};
use patchlock_bench::score;
use patchlock_testdata::real;
use patchlock_track::text;
use serde_json::Value;

/// A convention in which got10k differs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Difference {
    FirstFrame,
    MissingBox,
    NoTruth,
    Thresholds,
}

const ALL: [Difference; 4] =
    [Difference::FirstFrame, Difference::MissingBox, Difference::NoTruth, Difference::Thresholds];
/// Values this close to a threshold may fall on either side by rounding.
const ROUNDING: f64 = 1e-9;

/// Writes to standard error directly, since the test harness captures `eprintln!`.
fn log(text: &str) {
    let _ = writeln!(std::io::stderr(), "{text}");
}

fn here() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/judge")
}

/// A frame as got10k sees it. NaN is on no side of any threshold.
struct Frame {
    overlap: f64,
    distance: f64,
}

/// The frames of a run by our metrics, with these differences applied.
fn frames(run: &Run, truth: &Truth, differences: &[Difference]) -> Vec<Frame> {
    let mut boxes = run.boxes.clone();
    if differences.contains(&Difference::FirstFrame) {
        boxes[0] = truth.boxes[0];
    }
    let measured = metrics::compare(&boxes, &truth.boxes);
    let mut frames = Vec::new();
    for (k, given) in boxes.iter().enumerate() {
        let fails = given.is_none() && differences.contains(&Difference::MissingBox);
        match (measured.overlaps[k], measured.distances[k]) {
            (Some(_), Some(_)) if fails => {
                frames.push(Frame { overlap: f64::NAN, distance: f64::NAN });
            }
            (Some(overlap), Some(distance)) => frames.push(Frame { overlap, distance }),
            _ if differences.contains(&Difference::NoTruth) => {
                let distance = given.map_or(f64::NAN, |given| distance(&given, truth.rows[k]));
                frames.push(Frame { overlap: 0.0, distance });
            }
            _ => {}
        }
    }
    frames
}

/// Centre distance to a row of ground truth, which counts from 1 and may have no size or no
/// numbers.
fn distance(bbox: &BoundingBox, [x, y, w, h]: [f64; 4]) -> f64 {
    let [cx, cy] = bbox.centre();
    (cx - (x - 1.0 + (w - 1.0) / 2.0)).hypot(cy - (y - 1.0 + (h - 1.0) / 2.0))
}

/// Shares of frames at the thresholds, and shares of frames that equal each threshold up to
/// rounding.
struct Curve {
    shares: Vec<f64>,
    ties: Vec<f64>,
}

fn curve(values: &[f64], thresholds: &[f64], passes: fn(f64, f64) -> bool) -> Curve {
    let count = values.len() as f64;
    let share =
        |holds: &dyn Fn(f64) -> bool| values.iter().filter(|v| holds(**v)).count() as f64 / count;
    Curve {
        shares: thresholds.iter().map(|&t| share(&|v| passes(v, t))).collect(),
        ties: thresholds.iter().map(|&t| share(&|v| (v - t).abs() < ROUNDING)).collect(),
    }
}

/// Success and precision curves of a run, with these differences applied.
fn curves(run: &Run, truth: &Truth, differences: &[Difference]) -> [Curve; 2] {
    let success = match differences.contains(&Difference::Thresholds) {
        true => array::from_fn(|k| k as f64 * 0.05),
        false => SUCCESS,
    };
    let frames = frames(run, truth, differences);
    let overlaps: Vec<f64> = frames.iter().map(|frame| frame.overlap).collect();
    let distances: Vec<f64> = frames.iter().map(|frame| frame.distance).collect();
    [
        curve(&overlaps, &success, |overlap, threshold| overlap > threshold),
        curve(&distances, &PRECISION, |distance, threshold| distance <= threshold),
    ]
}

/// Ground truth as we read it, and the raw rows of the file.
struct Truth {
    boxes: Vec<Option<BoundingBox>>,
    rows: Vec<[f64; 4]>,
}

/// Largest difference between the curves of got10k and ours.
fn largest_gap(run: &Run, truth: &Truth, judged: &Value, differences: &[Difference]) -> f64 {
    gaps(run, truth, judged, differences).map(|(gap, _)| gap).fold(0.0, f64::max)
}

/// Largest gap that is not explained by frames on a threshold, and the number of explained gaps.
fn largest_unexplained_gap(run: &Run, truth: &Truth, judged: &Value) -> (f64, usize) {
    let (mut most, mut rounded) = (0.0_f64, 0);
    for (gap, ties) in gaps(run, truth, judged, &ALL) {
        if gap > 1e-9 && gap <= ties + 1e-9 {
            rounded += 1;
        } else {
            most = most.max(gap);
        }
    }
    (most, rounded)
}

/// For each threshold, the difference between the curves and the share of frames on the threshold.
fn gaps(
    run: &Run,
    truth: &Truth,
    judged: &Value,
    differences: &[Difference],
) -> impl Iterator<Item = (f64, f64)> {
    let [success, precision] = curves(run, truth, differences);
    let mut all = Vec::new();
    for (ours, name) in [(success, "success_curve"), (precision, "precision_curve")] {
        let theirs = judged[name].as_array().unwrap();
        assert_eq!(theirs.len(), ours.shares.len(), "{name}");
        for (k, share) in ours.shares.iter().enumerate() {
            all.push(((share - theirs[k].as_f64().unwrap()).abs(), ours.ties[k]));
        }
    }
    all.into_iter()
}

/// Ground truth and results in a folder.
struct Input {
    dataset: Dataset,
    truth: BTreeMap<String, Truth>,
    trackers: Vec<results::Results>,
}

fn read(folder: &Path) -> Input {
    let dataset = Dataset::open(&folder.join("truth")).unwrap();
    let trackers = results::read_all(&[folder.join("results")], &dataset).unwrap();
    let mut truth = BTreeMap::new();
    for sequence in &dataset.sequences {
        let file = folder.join("truth").join(format!("{}.txt", sequence.name));
        let table = text::read(&file).unwrap();
        let rows = table.rows.iter().map(|row| [row[0], row[1], row[2], row[3]]).collect();
        truth.insert(sequence.name.clone(), Truth { boxes: sequence.truth.clone(), rows });
    }
    Input { dataset, truth, trackers }
}

/// The Python interpreter of the virtual environment; without one, logs the reason and returns
/// `None`.
fn judge(test: &str) -> Option<PathBuf> {
    let venv = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/judge-venv");
    let python = venv.join("bin/python");
    if venv.join("requirements.txt").is_file() && python.is_file() {
        return Some(python);
    }
    let required = env::var_os("PATCHLOCK_JUDGE").is_some_and(|value| value == "required");
    assert!(!required, "PATCHLOCK_JUDGE is required, but there is no {}", venv.display());
    log(&format!(
        "{test}: SKIPPED, the got10k toolkit is not installed (run tools/judge/setup.sh)"
    ));
    None
}

/// Scores a folder with got10k.
fn judged(python: &Path, folder: &Path) -> Value {
    let out = tempfile::tempdir().unwrap();
    let file = out.path().join("judged.json");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tools/judge/judge.py");
    let run = Command::new(python).arg(script).arg(folder).arg(&file).output().unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    serde_json::from_slice(&fs::read(&file).unwrap()).unwrap()
}

fn golden() -> Value {
    serde_json::from_slice(&fs::read(here().join("got10k.json")).unwrap()).unwrap()
}

/// Largest gap over all runs of the made-up trackers. Their numbers are chosen so that rounding has
/// no effect.
fn made_up_gap(judged: &Value, differences: &[Difference], only: Option<&str>) -> f64 {
    let input = read(&here().join("made_up"));
    let mut most = 0.0_f64;
    for tracker in &input.trackers {
        assert_eq!((tracker.runs.len(), &tracker.faults), (4, &vec![]), "{}", tracker.name);
        for run in tracker.runs.iter().filter(|run| only.is_none_or(|name| name == run.target)) {
            let judged = &judged["trackers"][&tracker.name]["seq_wise"][&run.target];
            most = most.max(largest_gap(run, &input.truth[&run.target], judged, differences));
        }
    }
    most
}

#[test]
fn made_up_boxes_are_scored_as_by_got10k() {
    let golden = golden();
    assert!(golden["header"]["made_by"].as_str().unwrap().starts_with("got10k 0.1.3"));
    assert!(made_up_gap(&golden, &ALL, None) < 1e-12);
    // Nothing has to be explained where the conventions do not matter.
    for plain in ["plain", "edges"] {
        assert!(made_up_gap(&golden, &[], Some(plain)) < 1e-12, "{plain}");
    }
}

#[test]
fn every_difference_has_an_effect() {
    let golden = golden();
    for left_out in [Difference::FirstFrame, Difference::MissingBox, Difference::NoTruth] {
        let others: Vec<Difference> = ALL.into_iter().filter(|d| *d != left_out).collect();
        let gap = made_up_gap(&golden, &others, None);
        assert!(gap > 1e-3, "{left_out:?} explains nothing: {gap}");
    }
    let differs = |k: &usize| SUCCESS[*k] != *k as f64 * 0.05;
    let differing: Vec<usize> = (0..=20).filter(differs).collect();
    assert!(
        differing.contains(&3)
            && differing.iter().all(|&k| (SUCCESS[k] - k as f64 * 0.05).abs() < 1e-15),
        "{differing:?}"
    );
}

#[test]
fn got10k_still_matches_the_golden_file() {
    let Some(python) = judge("got10k_still_matches_the_golden_file") else { return };
    let now = judged(&python, &here().join("made_up"));
    assert!(made_up_gap(&now, &ALL, None) < 1e-12);
    let golden = golden();
    for tracker in ["steady", "broken"] {
        for name in ["success_score", "precision_score", "success_rate"] {
            let score = |of: &Value| of["trackers"][tracker]["overall"][name].as_f64().unwrap();
            assert!((score(&now) - score(&golden)).abs() < 1e-12, "{tracker} {name}");
        }
    }
}

/// The folder of the published boxes, if it is available.
fn published(test: &str) -> Option<PathBuf> {
    let truth = real(test, "otb2013-published/annotations")?;
    truth.parent().map(Path::to_owned)
}

/// Copies text files with commas between the numbers, the only separator that got10k reads.
fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let file = entry.unwrap().path();
        let text = fs::read_to_string(&file).unwrap();
        let words = |line: &str| -> String {
            line.split(|c: char| c == ',' || c.is_whitespace())
                .filter(|w| !w.is_empty())
                .collect::<Vec<_>>()
                .join(",")
        };
        let lines: String =
            text.lines().filter(|l| !l.trim().is_empty()).map(|l| words(l) + "\n").collect();
        fs::write(to.join(file.file_name().unwrap()), lines).unwrap();
    }
}

#[test]
fn published_boxes_are_scored_as_by_got10k() {
    let test = "published_boxes_are_scored_as_by_got10k";
    let (Some(python), Some(data)) = (judge(test), published(test)) else { return };
    let folder = tempfile::tempdir().unwrap();
    copy(&data.join("annotations"), &folder.path().join("truth"));
    // LSK is not used: two of its files are longer than the ground truth, which both programs
    // reject.
    for name in ["SCM", "Struck", "TLD", "ASLA", "IVT", "CXT", "VTD", "MIL", "CPF", "L1APG"] {
        copy(&data.join(name), &folder.path().join("results").join(name));
    }
    let judged = judged(&python, folder.path());
    let input = read(folder.path());
    let board = score::scoreboard(&input.trackers, &input.dataset);
    assert_eq!((board.trackers.len(), board.refused.len()), (10, 0));
    log("tracker   DP ours got10k   AUC ours got10k   \
         reasons: other first boxes, missing boxes; values on a threshold");
    for (tracker, scored) in input.trackers.iter().zip(&board.trackers) {
        let theirs = &judged["trackers"][&tracker.name];
        let (mut first, mut missing, mut rounded) = (0, 0, 0);
        assert_eq!(tracker.runs.len(), 51, "{}", tracker.name);
        for run in &tracker.runs {
            let truth = &input.truth[&run.target];
            let (gap, ties) = largest_unexplained_gap(run, truth, &theirs["seq_wise"][&run.target]);
            assert!(gap < 1e-9, "{} on {}: {gap} is not explained", tracker.name, run.target);
            first += usize::from(run.boxes[0] != truth.boxes[0]);
            missing += run.boxes.iter().filter(|bbox| bbox.is_none()).count();
            rounded += ties;
        }
        let their = |name: &str| theirs["overall"][name].as_f64().unwrap();
        let (dp, auc) = (scored.overall.dp20.mean, scored.overall.auc.mean);
        log(&format!(
            "{:<8}   {dp:.4} {:.4}    {auc:.4} {:.4}     {first} {missing}; {rounded}",
            tracker.name,
            their("precision_score"),
            their("success_score"),
        ));
        // Where no convention matters, the scores themselves are equal.
        if first == 0 && missing == 0 && rounded == 0 {
            assert!((dp - their("precision_score")).abs() < 1e-9, "{}", tracker.name);
            assert!((auc - their("success_score")).abs() < 1e-9, "{}", tracker.name);
        }
    }
}
