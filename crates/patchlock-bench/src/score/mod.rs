//! Scores the runs of each tracker against the ground truth, per target and seed, and averages
//! them.
//!
//! The score of a seed is the mean over targets; the score of a tracker is the mean over seeds,
//! with the standard deviation over seeds. The frames of all runs on one target with one seed
//! (several in TRE and SRE) are pooled, as in the OTB toolkit.

mod summary;

use std::collections::BTreeMap;

use patchlock::{BoundingBox, Status};
use serde::Serialize;

use crate::dataset::{self, Dataset, OTB_ATTRIBUTES, Remark, Sequence, Severity};
use crate::metrics::{self, Calibration, Curves, FrameMeasures, StatusCounts};
use crate::results::{Results, Run};
use patchlock_track::names;
pub use summary::{CalibrationSummary, Measure, StatusSummary, Summary, summary};

/// Smallest overlap of the first box with the ground truth; below it, the results are suspect.
const MIN_START_OVERLAP: f64 = 0.5;

/// The measures of one run on one target.
#[derive(Debug, Clone, PartialEq)]
pub struct Pass {
    /// Index of the start (TRE) or first box (SRE); 0 in OPE.
    pub variant: usize,
    /// Index of the first frame of the run in the sequence.
    pub first: usize,
    /// The boxes, with missing ones replaced by the last one before them.
    pub boxes: Vec<Option<BoundingBox>>,
    /// Overlap and distances, frame by frame.
    pub frames: FrameMeasures,
    /// The status that the tracker gave each frame, if it is known.
    pub statuses: Option<Vec<Status>>,
}

/// The scores of one target with one seed.
#[derive(Debug, Clone, PartialEq)]
pub struct SeedScore {
    /// The seed.
    pub seed: u64,
    /// One pass in OPE, otherwise one for each start or first box.
    pub passes: Vec<Pass>,
    /// The curves over the frames of all passes.
    pub curves: Curves,
    /// Mean overlap over the frames of all passes.
    pub mean_overlap: f64,
    /// Share of the frames of all passes in which the target is lost.
    pub lost_share: f64,
    /// Mean overlap over the other frames; `None` if there are none.
    pub overlap_not_lost: Option<f64>,
    /// Number of frames and total seconds of all passes, if times are known.
    pub time: Option<(usize, f64)>,
    /// What the statuses of all passes were worth, if they are known.
    pub status: Option<StatusCounts>,
    /// What the scores that the tracker gave in all passes were worth, if they are known.
    pub calibration: Option<Calibration>,
}

/// The scores of one target.
#[derive(Debug, Clone, PartialEq)]
pub struct TargetScore {
    /// Name of the target, as spelled in the dataset.
    pub target: String,
    /// Attributes of the target.
    pub attributes: Vec<String>,
    /// The scores by seed, in increasing order of the seed.
    pub seeds: Vec<SeedScore>,
}

/// The scores of a tracker.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackerScore {
    /// Name of the tracker.
    pub name: String,
    /// The targets with results, in the order of the dataset.
    pub targets: Vec<TargetScore>,
    /// The seeds that all targets have; only these count.
    pub seeds: Vec<u64>,
    /// The means over all targets.
    pub overall: Summary,
    /// Remarks that readers of the scores should know.
    pub notes: Vec<String>,
}

/// A tracker that cannot be scored.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct UnscoredTracker {
    /// Name of the tracker.
    pub name: String,
    /// Everything that is wrong with its results.
    pub reasons: Vec<String>,
}

/// The scores of all trackers.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scoreboard {
    /// The trackers that could be scored, in the order given.
    pub trackers: Vec<TrackerScore>,
    /// The others. They are not scored on the targets whose results happen to be valid, which would
    /// be misleading.
    pub refused: Vec<UnscoredTracker>,
    /// The targets with invalid ground truth and the reasons; no tracker is scored on them.
    pub without_truth: Vec<String>,
}

impl Scoreboard {
    /// The notes, each once, with the trackers that it applies to.
    pub fn notes(&self) -> Vec<(&str, Vec<&str>)> {
        let mut notes: Vec<(&str, Vec<&str>)> = Vec::new();
        for tracker in &self.trackers {
            for note in &tracker.notes {
                match notes.iter_mut().find(|(text, _)| text == note) {
                    Some((_, trackers)) => trackers.push(&tracker.name),
                    None => notes.push((note, vec![&tracker.name])),
                }
            }
        }
        notes
    }
}

/// Scores trackers.
pub fn scoreboard(results: &[Results], truth: &Dataset) -> Scoreboard {
    let wrong = truth.remarks.iter().filter(|remark| remark.severity == Severity::NoTruth);
    let without_truth = wrong.map(Remark::to_string).collect();
    let mut board = Scoreboard { without_truth, ..Scoreboard::default() };
    for results in results {
        match tracker(results, truth) {
            Ok(score) => board.trackers.push(score),
            Err(reasons) => {
                board.refused.push(UnscoredTracker { name: results.name.clone(), reasons })
            }
        }
    }
    board
}

/// Scores one tracker.
///
/// # Errors
/// Everything that is wrong with its results.
pub fn tracker(results: &Results, truth: &Dataset) -> Result<TrackerScore, Vec<String>> {
    let mut reasons = results.faults.clone();
    let mut notes = results.notes.clone();
    let runs = runs_by_target(results, truth, &mut reasons, &mut notes);
    let targets = score_targets(&runs, truth, &mut reasons, &mut notes);
    if targets.is_empty() && reasons.is_empty() {
        reasons.push(
            "none of its targets has truth here: are these results of another dataset?".to_string(),
        );
    }
    if !reasons.is_empty() {
        return Err(reasons);
    }
    let seeds = common_seeds(&targets, &mut notes);
    let Some(overall) = summary(&targets.iter().collect::<Vec<_>>(), &seeds) else {
        return Err(vec!["no seed was run on all of its targets".to_string()]);
    };
    Ok(TrackerScore { name: results.name.clone(), targets, seeds, overall, notes })
}

/// Scores each target that has runs and can be scored. Faults are added to `reasons`.
fn score_targets(
    runs: &BTreeMap<String, Vec<&Run>>,
    truth: &Dataset,
    reasons: &mut Vec<String>,
    notes: &mut Vec<String>,
) -> Vec<TargetScore> {
    let (mut targets, mut elsewhere, mut first_only) = (Vec::new(), Vec::new(), Vec::new());
    for sequence in &truth.sequences {
        let Some(runs) = runs.get(&names::key(&sequence.name)) else { continue };
        if !Dataset::can_be_scored(sequence) {
            first_only.push(&sequence.name);
            continue;
        }
        let passes: Result<Vec<_>, String> = runs.iter().map(|run| pass(run, sequence)).collect();
        match passes {
            Ok(passes) => {
                if passes.iter().any(|pass| starts_elsewhere(pass, sequence)) {
                    elsewhere.push(&sequence.name);
                }
                targets.push(target_score(sequence, runs, passes, notes));
            }
            Err(reason) => reasons.push(reason),
        }
    }
    if !elsewhere.is_empty() {
        notes.push(format!(
            "its first box differs from the truth on {} of the targets ({}): are these results of \
             another dataset, or of other frames?",
            elsewhere.len(),
            names::some_of(&elsewhere)
        ));
    }
    if !first_only.is_empty() {
        notes.push(format!(
            "only the first frame of {} has truth: not scored",
            names::some_of(&first_only)
        ));
    }
    targets
}

/// Groups the runs by the normal form of the target's name. Notes the targets that are ignored or
/// missing.
fn runs_by_target<'a>(
    results: &'a Results,
    truth: &Dataset,
    reasons: &mut Vec<String>,
    notes: &mut Vec<String>,
) -> BTreeMap<String, Vec<&'a Run>> {
    let mut runs: BTreeMap<String, Vec<&Run>> = BTreeMap::new();
    let mut unknown = Vec::new();
    for run in &results.runs {
        if truth.find(&run.target).is_none() {
            unknown.push(run.target.as_str());
            continue;
        }
        let same = runs.entry(names::key(&run.target)).or_default();
        if let Some(other) = same.iter().find(|o| (o.seed, o.variant) == (run.seed, run.variant)) {
            let (a, b) = (other.file.display(), run.file.display());
            reasons.push(format!("{a} and {b} are the same run of the same target"));
        }
        same.push(run);
    }
    let unknown = names::distinct(unknown);
    if !unknown.is_empty() {
        notes.push(format!(
            "{} of its targets have no truth here and do not count: {}",
            unknown.len(),
            names::some_of(&unknown)
        ));
    }
    let missing: Vec<_> = truth
        .sequences
        .iter()
        .map(|s| &s.name)
        .filter(|name| !runs.contains_key(&names::key(name)))
        .collect();
    if !missing.is_empty() && missing.len() < truth.sequences.len() {
        notes.push(format!(
            "no results for {} of the {} targets: {}",
            missing.len(),
            truth.sequences.len(),
            names::some_of(&missing)
        ));
    }
    runs
}

/// Compares one run with the ground truth. The error says how they do not match.
fn pass(run: &Run, sequence: &Sequence) -> Result<Pass, String> {
    let truth = sequence.truth.get(run.first..).unwrap_or_default();
    if run.boxes.len() != truth.len() {
        let (file, boxes, name) = (run.file.display(), run.boxes.len(), &sequence.name);
        let start = match run.first {
            0 => String::new(),
            first => format!(" from frame {first} on"),
        };
        let part = dataset::counted_part(name, truth.len()).map(|part| format!(" ({part})"));
        return Err(format!(
            "{file}: {boxes} boxes, but the truth of {name} has {} frames{start}{}",
            truth.len(),
            part.unwrap_or_default()
        ));
    }
    Ok(Pass {
        variant: run.variant,
        first: run.first,
        boxes: metrics::last_given(&run.boxes),
        frames: metrics::compare(&run.boxes, truth),
        statuses: run.statuses.clone(),
    })
}

/// Whether the first box is not that of the ground truth or, in SRE, near it.
fn starts_elsewhere(pass: &Pass, sequence: &Sequence) -> bool {
    let truth = sequence.truth.get(pass.first).copied().flatten();
    let given = pass.boxes.first().copied().flatten();
    truth.zip(given).is_some_and(|(truth, given)| given.overlap(&truth) < MIN_START_OVERLAP)
}

fn target_score(
    sequence: &Sequence,
    runs: &[&Run],
    passes: Vec<Pass>,
    notes: &mut Vec<String>,
) -> TargetScore {
    let mut seeds: Vec<u64> = runs.iter().map(|run| run.seed).collect();
    seeds.sort_unstable();
    seeds.dedup();
    let mut left: Vec<(&Run, Pass)> = runs.iter().copied().zip(passes).collect();
    let mut scores = Vec::new();
    for seed in seeds {
        let own = left.extract_if(.., |(run, _)| run.seed == seed);
        let (runs, passes): (Vec<&Run>, Vec<Pass>) = own.unzip();
        let frames: Vec<&FrameMeasures> = passes.iter().map(|pass| &pass.frames).collect();
        let Some(curves) = Curves::of(&frames) else {
            notes.push(format!("{}, seed {seed}: no frame has truth", sequence.name));
            continue;
        };
        let overlaps = frames.iter().flat_map(|frames| frames.overlaps.iter().flatten().copied());
        let overlaps: Vec<f64> = overlaps.collect();
        let (lost_share, overlap_not_lost) = metrics::loss(&overlaps);
        scores.push(SeedScore {
            seed,
            mean_overlap: metrics::mean(&overlaps),
            status: status(&passes),
            calibration: calibration(&passes, &runs),
            passes,
            curves,
            lost_share,
            overlap_not_lost,
            time: time(&runs),
        });
    }
    TargetScore {
        target: sequence.name.clone(),
        attributes: sequence.attributes.clone(),
        seeds: scores,
    }
}

/// The statuses of all passes beside the truth; `None` unless all of them have statuses.
fn status(passes: &[Pass]) -> Option<StatusCounts> {
    passes.iter().try_fold(StatusCounts::default(), |mut counts, pass| {
        counts.add(pass.statuses.as_ref()?, &pass.frames.overlaps);
        Some(counts)
    })
}

/// The scores of all runs beside the truth; `None` unless all of them have scores.
fn calibration(passes: &[Pass], runs: &[&Run]) -> Option<Calibration> {
    passes.iter().zip(runs).try_fold(Calibration::default(), |mut calibration, (pass, run)| {
        calibration.add(run.scores.as_ref()?, &pass.frames.overlaps);
        Some(calibration)
    })
}

/// Number of frames and total seconds of all runs; `None` unless all of them have times.
fn time(runs: &[&Run]) -> Option<(usize, f64)> {
    runs.iter().try_fold((0, 0.0), |(frames, seconds), run| {
        let times = run.seconds.as_ref()?;
        Some((frames + times.len(), seconds + times.iter().sum::<f64>()))
    })
}

/// The seeds that every target has.
fn common_seeds(targets: &[TargetScore], notes: &mut Vec<String>) -> Vec<u64> {
    let all = targets.iter().flat_map(|target| &target.seeds);
    let mut all: Vec<u64> = all.map(|score| score.seed).collect();
    all.sort_unstable();
    let mut whole = Vec::new();
    for same in all.chunk_by(|a, b| a == b) {
        match (same[0], same.len(), targets.len()) {
            (seed, count, most) if count == most => whole.push(seed),
            (seed, count, most) => notes
                .push(format!("seed {seed} has only {count} of {most} targets and does not count")),
        }
    }
    whole
}

/// The attributes of the trackers' targets, each with the targets that have it: those of OTB first
/// and in its order.
pub fn attributes(trackers: &[TrackerScore]) -> Vec<(String, Vec<String>)> {
    let known = OTB_ATTRIBUTES.iter().map(|(name, _)| name.to_string());
    let mut parts: Vec<(String, Vec<String>)> = known.map(|name| (name, Vec::new())).collect();
    for target in trackers.iter().flat_map(|tracker| &tracker.targets) {
        for attribute in &target.attributes {
            let index = parts.iter().position(|(name, _)| name == attribute).unwrap_or_else(|| {
                parts.push((attribute.clone(), Vec::new()));
                parts.len() - 1
            });
            if !parts[index].1.contains(&target.target) {
                parts[index].1.push(target.target.clone());
            }
        }
    }
    parts.retain(|(_, targets)| !targets.is_empty());
    parts
}
