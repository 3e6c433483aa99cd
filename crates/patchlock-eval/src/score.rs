//! Scores: the runs of each tracker against the truth, per target and seed, and their means.
//!
//! The score of a seed is the mean over targets; the score of a tracker is the mean over seeds, with the standard deviation over
//! seeds beside it. The runs of one target and seed from several starts or first boxes (TRE, SRE) are one pool of frames, as in the
//! benchmark's own program.

use std::collections::{BTreeMap, BTreeSet};

use patchlock::BoundingBox;

use crate::dataset::{self, Dataset, OTB_ATTRIBUTES, Remark, Sequence, Severity};
use crate::metrics::{self, Comparison, Curves, Tally};
use crate::names;
use crate::protocol::Protocol;
use crate::results::{Results, Run};

/// Overlap of the first box with the truth below which a trajectory begins elsewhere.
const SAME_BEGINNING: f64 = 0.5;

/// One pass over one target: what was measured of each frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Pass {
    /// Which start frame (TRE) or first box (SRE) it is; 0 in one-pass evaluation.
    pub variant: usize,
    /// Row of the truth at which it begins, counted from 0.
    pub first: usize,
    /// The boxes, those that were not given filled in with the last that was.
    pub boxes: Vec<Option<BoundingBox>>,
    /// Overlap and distances, frame by frame.
    pub frames: Comparison,
}

/// One seed on one target.
#[derive(Debug, Clone, PartialEq)]
pub struct SeedScore {
    /// The seed.
    pub seed: u64,
    /// One pass in one-pass evaluation, else one for each start or first box.
    pub passes: Vec<Pass>,
    /// Shares over the frames of all passes.
    pub curves: Curves,
    /// Mean overlap over the frames of all passes.
    pub mean_overlap: f64,
    /// Frames and seconds of all passes, where times are known.
    pub time: Option<(usize, f64)>,
}

/// One target.
#[derive(Debug, Clone, PartialEq)]
pub struct TargetScore {
    /// The target's name, as the truth spells it.
    pub target: String,
    /// Its attributes.
    pub attributes: Vec<String>,
    /// Its seeds, rising.
    pub seeds: Vec<SeedScore>,
}

/// A mean over seeds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measure {
    /// The mean.
    pub mean: f64,
    /// The standard deviation of the sample; `None` of one seed.
    pub sd: Option<f64>,
}

/// The numbers of a tracker, over all targets or over some.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// Precision at 20 pixels.
    pub dp20: Measure,
    /// Mean of the success curve.
    pub auc: Measure,
    /// Success at an overlap of 0.5.
    pub success50: Measure,
    /// Mean overlap.
    pub mean_overlap: Measure,
    /// Mean of the curve of normalised precision.
    pub norm_precision: Measure,
    /// Frames a second; `None` where times are not known.
    pub fps: Option<Measure>,
    /// The mean curves.
    pub curves: Curves,
}

/// One tracker.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackerScore {
    /// Its name.
    pub name: String,
    /// The targets that it has results for, in the order of the truth.
    pub targets: Vec<TargetScore>,
    /// The seeds that all targets have: those that count.
    pub seeds: Vec<u64>,
    /// The means.
    pub overall: Summary,
    /// What a reader of the numbers should know.
    pub notes: Vec<String>,
}

/// A tracker that can't be scored.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refused {
    /// Its name.
    pub name: String,
    /// Everything that is wrong with its results.
    pub reasons: Vec<String>,
}

/// All trackers.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scoreboard {
    /// Those that could be scored, in the order in which they were given.
    pub trackers: Vec<TrackerScore>,
    /// The others. Their results are not scored in part: a mean over the targets that happen to be right would mislead.
    pub refused: Vec<Refused>,
    /// The targets whose truth is wrong, with the reason: nobody was scored on them.
    pub without_truth: Vec<String>,
}

/// Scores trackers.
pub fn scoreboard(results: &[Results], truth: &Dataset, protocol: &Protocol) -> Scoreboard {
    let wrong = truth.remarks.iter().filter(|remark| remark.severity == Severity::NoTruth);
    let without_truth = wrong.map(Remark::to_string).collect();
    let mut board = Scoreboard { without_truth, ..Scoreboard::default() };
    for results in results {
        match tracker(results, truth, protocol) {
            Ok(score) => board.trackers.push(score),
            Err(reasons) => board.refused.push(Refused { name: results.name.clone(), reasons }),
        }
    }
    board
}

/// Scores one tracker; or all that is wrong with its results.
pub fn tracker(
    results: &Results,
    truth: &Dataset,
    protocol: &Protocol,
) -> Result<TrackerScore, Vec<String>> {
    let mut reasons = results.faults.clone();
    let mut notes = results.notes.clone();
    let runs = by_target(results, truth, &mut reasons, &mut notes);
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
                if passes.iter().any(|pass| begins_elsewhere(pass, sequence)) {
                    elsewhere.push(&sequence.name);
                }
                targets.push(target(sequence, runs, passes, protocol, &mut notes));
            }
            Err(reason) => reasons.push(reason),
        }
    }
    if !elsewhere.is_empty() {
        notes.push(format!(
            "its first box is not the truth's on {} of the targets ({}): are these results of another dataset, or of other frames?",
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
    if targets.is_empty() && reasons.is_empty() {
        reasons.push(
            "none of its targets has truth here: are these results of another dataset?".to_string(),
        );
    }
    if !reasons.is_empty() {
        return Err(reasons);
    }
    let seeds = common_seeds(&targets, &mut notes);
    let Some(overall) = summary(targets.iter(), &seeds) else {
        return Err(vec!["no seed was run on all of its targets".to_string()]);
    };
    Ok(TrackerScore { name: results.name.clone(), targets, seeds, overall, notes })
}

/// The runs of each target that has truth; says what is left out and what is missing.
fn by_target<'a>(
    results: &'a Results,
    truth: &Dataset,
    reasons: &mut Vec<String>,
    notes: &mut Vec<String>,
) -> BTreeMap<String, Vec<&'a Run>> {
    let mut runs: BTreeMap<String, Vec<&Run>> = BTreeMap::new();
    let mut strange = BTreeSet::new();
    for run in &results.runs {
        if truth.find(&run.target).is_none() {
            strange.insert(run.target.as_str());
            continue;
        }
        let same = runs.entry(names::key(&run.target)).or_default();
        if let Some(other) = same.iter().find(|o| (o.seed, o.variant) == (run.seed, run.variant)) {
            let (a, b) = (other.file.display(), run.file.display());
            reasons.push(format!("{a} and {b} are the same run of one target"));
        }
        same.push(run);
    }
    let strange: Vec<_> = strange.into_iter().collect();
    if !strange.is_empty() {
        notes.push(format!(
            "{} of its targets have no truth here and do not count: {}",
            strange.len(),
            names::some_of(&strange)
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

/// Compares one run with the truth. The error says what does not fit.
fn pass(run: &Run, sequence: &Sequence) -> Result<Pass, String> {
    let truth = sequence.truth.get(run.first..).unwrap_or_default();
    if run.boxes.len() != truth.len() {
        let (file, boxes, name) = (run.file.display(), run.boxes.len(), &sequence.name);
        let begin =
            if run.first > 0 { format!(" from frame {} on", run.first) } else { String::new() };
        let part = dataset::counted_part(name, truth.len()).map(|part| format!(" ({part})"));
        return Err(format!(
            "{file}: {boxes} boxes, but the truth of {name} has {} frames{begin}{}",
            truth.len(),
            part.unwrap_or_default()
        ));
    }
    Ok(Pass {
        variant: run.variant,
        first: run.first,
        boxes: metrics::last_given(&run.boxes),
        frames: metrics::compare(&run.boxes, truth),
    })
}

/// The first box is given, so it should be the truth's or, in SRE, near it.
fn begins_elsewhere(pass: &Pass, sequence: &Sequence) -> bool {
    let truth = sequence.truth.get(pass.first).copied().flatten();
    let given = pass.boxes.first().copied().flatten();
    truth.zip(given).is_some_and(|(truth, given)| given.overlap(&truth) < SAME_BEGINNING)
}

fn target(
    sequence: &Sequence,
    runs: &[&Run],
    passes: Vec<Pass>,
    protocol: &Protocol,
    notes: &mut Vec<String>,
) -> TargetScore {
    let mut seeds: BTreeMap<u64, (Vec<Pass>, Vec<&Run>)> = BTreeMap::new();
    for (run, pass) in runs.iter().zip(passes) {
        let (passes, runs) = seeds.entry(run.seed).or_default();
        passes.push(pass);
        runs.push(run);
    }
    let mut scores = Vec::new();
    for (seed, (passes, runs)) in seeds {
        let mut tally = Tally::new(protocol);
        passes.iter().for_each(|pass| tally.add(&pass.frames, protocol));
        match tally.curves().zip(tally.mean_overlap()) {
            Some((curves, mean_overlap)) => {
                scores.push(SeedScore { seed, passes, curves, mean_overlap, time: time(&runs) })
            }
            None => notes.push(format!("{}, seed {seed}: no frame of it has truth", sequence.name)),
        }
    }
    TargetScore {
        target: sequence.name.clone(),
        attributes: sequence.attributes.clone(),
        seeds: scores,
    }
}

/// Frames and seconds of all runs together; `None` unless all have times.
fn time(runs: &[&Run]) -> Option<(usize, f64)> {
    runs.iter().try_fold((0, 0.0), |(frames, seconds), run| {
        let times = run.seconds.as_ref()?;
        Some((frames + times.len(), seconds + times.iter().sum::<f64>()))
    })
}

/// The seeds that every target has.
fn common_seeds(targets: &[TargetScore], notes: &mut Vec<String>) -> Vec<u64> {
    let mut counts: BTreeMap<u64, usize> = BTreeMap::new();
    for seed in targets.iter().flat_map(|target| &target.seeds) {
        *counts.entry(seed.seed).or_default() += 1;
    }
    let (whole, part): (Vec<_>, Vec<_>) =
        counts.into_iter().partition(|(_, count)| *count == targets.len());
    for (seed, count) in part {
        notes.push(format!(
            "seed {seed} has only {count} of {} targets and does not count",
            targets.len()
        ));
    }
    whole.into_iter().map(|(seed, _)| seed).collect()
}

/// The attributes that the targets of these trackers carry, with the targets that carry each; the tracker benchmark's own first and in its order.
pub fn attributes(trackers: &[TrackerScore]) -> Vec<(String, Vec<String>)> {
    let known = OTB_ATTRIBUTES.iter().map(|(name, _)| name.to_string());
    let mut parts: Vec<(String, Vec<String>)> = known.map(|name| (name, Vec::new())).collect();
    for target in trackers.iter().flat_map(|tracker| &tracker.targets) {
        for attribute in &target.attributes {
            let place = parts.iter().position(|(name, _)| name == attribute).unwrap_or_else(|| {
                parts.push((attribute.clone(), Vec::new()));
                parts.len() - 1
            });
            if !parts[place].1.contains(&target.target) {
                parts[place].1.push(target.target.clone());
            }
        }
    }
    parts.retain(|(_, targets)| !targets.is_empty());
    parts
}

/// The means over some targets, such as those of one attribute; `None` of no targets or no seeds.
pub fn summary<'a>(
    targets: impl Iterator<Item = &'a TargetScore>,
    seeds: &[u64],
) -> Option<Summary> {
    let targets: Vec<&TargetScore> = targets.collect();
    let rows: Vec<Vec<&SeedScore>> = seeds
        .iter()
        .map(|&seed| {
            targets.iter().filter_map(|t| t.seeds.iter().find(|s| s.seed == seed)).collect()
        })
        .collect();
    let curves: Option<Vec<Curves>> =
        rows.iter().map(|row| Curves::mean(row.iter().map(|score| &score.curves))).collect();
    let curves = curves?;
    let over_seeds = |value: fn(&Curves) -> f64| measure(curves.iter().map(value).collect());
    let overlap = |row: &Vec<&SeedScore>| mean(row.iter().map(|score| score.mean_overlap));
    let fps: Option<Vec<f64>> = rows.iter().map(|row| fps(row)).collect();
    Some(Summary {
        dp20: over_seeds(Curves::dp20)?,
        auc: over_seeds(Curves::auc)?,
        success50: over_seeds(Curves::success50)?,
        mean_overlap: measure(rows.iter().map(overlap).collect())?,
        norm_precision: over_seeds(Curves::norm_precision)?,
        fps: fps.and_then(measure),
        curves: Curves::mean(&curves)?,
    })
}

/// All frames over all time, where all times are known.
fn fps(scores: &[&SeedScore]) -> Option<f64> {
    let times: Option<Vec<(usize, f64)>> = scores.iter().map(|score| score.time).collect();
    let times = times?;
    let (frames, seconds) = (
        times.iter().map(|time| time.0).sum::<usize>(),
        times.iter().map(|time| time.1).sum::<f64>(),
    );
    (seconds > 0.0).then(|| frames as f64 / seconds)
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len().max(1) as f64;
    values.sum::<f64>() / count
}

/// `None` of no values.
fn measure(values: Vec<f64>) -> Option<Measure> {
    if values.is_empty() {
        return None;
    }
    let mean = mean(values.iter().copied());
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    let sd = (values.len() > 1).then(|| (squares / (values.len() - 1) as f64).sqrt());
    Some(Measure { mean, sd })
}
