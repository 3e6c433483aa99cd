//! `patchlock score`: scores results against the truth.

use std::path::PathBuf;

use anyhow::Result;
use clap::{Args, ValueEnum};
use patchlock_bench::compare::ascending;
use patchlock_bench::dataset::Dataset;
use patchlock_bench::results;
use patchlock_bench::score::{
    self, CalibrationSummary, Measure, Scoreboard, StatusSummary, Summary, TrackerScore,
};
use patchlock_track::names;
use serde_json::{Value, json};

use crate::failure::{Failure, failed, say};
use crate::output::printed::print;
use crate::output::text_table::TextTable;

const EXAMPLES: &str = "\
EXAMPLES:
  patchlock score out --truth OTB
      every tracker whose results are in the folder out, as patchlock bench
      writes them
  patchlock score published/SCM published/Struck --truth published/annotations
      published results of two trackers, with the truth in a folder of text
      files, one per target
  patchlock score out --truth OTB --by attribute
      also scores the targets of each attribute separately
  patchlock score out --truth OTB --json > scores.json

The layout of RESULTS is detected: the output of patchlock bench; <target>.txt
with x,y,w,h per line (OTB, got10k); <target>/<target>_001.txt (got10k, VOT with
its codes and polygons); <target>.txt with frame,id,x,y,w,h,... (MOT). Names of
targets may differ in case and in - _ . before a number.

DP is the share of frames in which the centre is within 20 pixels of the truth,
AUC the mean success over 21 overlap thresholds, lost share the share of frames
with an overlap below 0.1, not lost the mean overlap of the others.

For trackers that report a status and a score in each frame: the precision and
recall of lost (correct where the target is absent or the overlap below 0.1),
the share of frames called lost among those with an overlap of 0.5 or more
(false lost), recoveries per target, and how well the score predicts an overlap
of 0.5: expected calibration error (ECE) and area under the ROC curve (AUROC).

METHODOLOGY.md documents all conventions.";

/// Scores results against the truth: precision, success, overlap, speed, and their spread over
/// seeds
///
/// Scores are averaged over targets, then over seeds; +- is the standard deviation over seeds. A
/// tracker with a trajectory that can't be read or has the wrong length is not scored, and the exit
/// code is 1.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct ScoreArgs {
    /// Folders of trackers, or folders that contain such folders
    #[arg(required = true)]
    results: Vec<PathBuf>,

    /// The dataset, or a folder of text files with the true boxes, one file per target
    #[arg(long, value_name = "DATASET|DIR")]
    truth: PathBuf,

    /// Also score parts of the dataset
    #[arg(long, value_name = "WHAT")]
    by: Option<Grouping>,

    /// Print JSON instead of tables
    #[arg(long)]
    json: bool,
}

/// Parts of a dataset.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Grouping {
    /// The targets that share an attribute
    Attribute,
    /// Each target
    Target,
}

pub fn run(args: &ScoreArgs) -> Result<()> {
    let truth = Dataset::open(&args.truth).map_err(Failure::from)?;
    let results = results::read_all(&args.results, &truth).map_err(Failure::from)?;
    let board = score::scoreboard(&results, &truth);
    let text = if args.json {
        serde_json::to_string_pretty(&json_of(&board, args.by))? + "\n"
    } else {
        tables(&board, args.by)
    };
    print(&text)?;
    print_notes(&board, truth.sequences.len());
    conclude(&board)
}

/// Prints notes on standard error, to keep them out of the tables.
fn print_notes(board: &Scoreboard, targets: usize) {
    for (note, trackers) in board.notes() {
        say(&format!("note: {}: {note}", names::some_of(&trackers)));
    }
    let differ = board.trackers.iter().any(|tracker| {
        let names =
            |t: &TrackerScore| t.targets.iter().map(|t| t.target.clone()).collect::<Vec<_>>();
        names(tracker) != names(&board.trackers[0])
    });
    if differ {
        say(&format!(
            "note: the trackers were scored on different subsets of the {targets} targets; \
             their means are not directly comparable"
        ));
    }
}

fn conclude(board: &Scoreboard) -> Result<()> {
    for invalid in &board.without_truth {
        say(&format!("error: truth of {invalid}"));
    }
    for refused in &board.refused {
        for reason in &refused.reasons {
            say(&format!("error: {}: {reason}", refused.name));
        }
    }
    if board.refused.is_empty() && board.without_truth.is_empty() {
        return Ok(());
    }
    if board.refused.is_empty() {
        let count = names::counted(board.without_truth.len(), "target");
        return Err(failed(format!("the truth of {count} is invalid; no tracker is scored there"))
            .hint("correct the truth files; patchlock dataset DIR lists all problems")
            .into());
    }
    let names: Vec<&str> = board.refused.iter().map(|refused| refused.name.as_str()).collect();
    Err(failed(format!("not scored: {}", names.join(", ")))
        .hint(
            "a result must have one box for each row of the truth: correct the files or leave the \
             tracker out",
        )
        .into())
}

fn tables(board: &Scoreboard, by: Option<Grouping>) -> String {
    let mut text = String::new();
    if !board.trackers.is_empty() {
        let trackers = ranked(board);
        text += &format!("{}\n{}", overall(&trackers).text(), lost(&trackers).text());
        text += &said(&trackers).map_or(String::new(), |table| {
            format!("\nStatus and score, where known\n\n{}", table.text())
        });
    }
    let (what, parts) = match by {
        None => return text,
        Some(Grouping::Attribute) => ("attribute", score::attributes(&board.trackers)),
        Some(Grouping::Target) => ("target", each_target(board)),
    };
    for (title, number) in NUMBERS {
        text +=
            &format!("\n{title} by {what}\n\n{}", part_table(board, what, &parts, number).text());
    }
    text
}

type Number = fn(&Summary) -> Measure;

/// The two measures in the tables of parts.
const NUMBERS: [(&str, Number); 2] = [("DP", |s| s.dp20), ("AUC", |s| s.auc)];

/// The trackers in decreasing order of AUC.
fn ranked(board: &Scoreboard) -> Vec<&TrackerScore> {
    let auc: Vec<f64> = board.trackers.iter().map(|tracker| -tracker.overall.auc.mean).collect();
    ascending(&auc).into_iter().map(|k| &board.trackers[k]).collect()
}

// With spreads, more columns than in one of these tables do not fit in a terminal.
fn overall(trackers: &[&TrackerScore]) -> TextTable {
    let mut table =
        TextTable::new(&["tracker", "targets", "seeds", "DP", "AUC", "success 0.5", "fps"]);
    for tracker in trackers {
        let s = &tracker.overall;
        table.row(&[
            tracker.name.clone(),
            tracker.targets.len().to_string(),
            tracker.seeds.len().to_string(),
            with_spread(s.dp20),
            with_spread(s.auc),
            with_spread(s.success50),
            s.fps.map_or("-".to_string(), |fps| format!("{:.1}", fps.mean)),
        ]);
    }
    table
}

fn lost(trackers: &[&TrackerScore]) -> TextTable {
    let mut table =
        TextTable::new(&["tracker", "lost share", "not lost", "overlap", "norm. prec."]);
    for tracker in trackers {
        let s = &tracker.overall;
        table.row(&[
            tracker.name.clone(),
            with_spread(s.lost_share),
            s.overlap_not_lost.map_or("-".to_string(), with_spread),
            with_spread(s.mean_overlap),
            with_spread(s.norm_precision),
        ]);
    }
    table
}

/// What the trackers said of themselves; `None` if none did. Without spreads, which would not fit.
fn said(trackers: &[&TrackerScore]) -> Option<TextTable> {
    let mut table = TextTable::new(&[
        "tracker",
        "lost prec.",
        "lost recall",
        "false lost",
        "recoveries",
        "ECE",
        "AUROC",
    ]);
    let is_known = |tracker: &&&TrackerScore| {
        tracker.overall.status.is_some() || tracker.overall.calibration.is_some()
    };
    let known: Vec<_> = trackers.iter().filter(is_known).collect();
    for tracker in &known {
        let (status, score) = (&tracker.overall.status, &tracker.overall.calibration);
        let status = |value: fn(&StatusSummary) -> Option<Measure>| status.as_ref().and_then(value);
        let score =
            |value: fn(&CalibrationSummary) -> Option<Measure>| score.as_ref().and_then(value);
        let values = [
            status(|s| s.precision),
            status(|s| s.recall),
            status(|s| s.false_lost),
            status(|s| Some(s.recoveries)),
            score(|s| s.ece),
            score(|s| s.auroc),
        ];
        let cell = |m: Option<Measure>| m.map_or("-".to_string(), |m| format!("{:.3}", m.mean));
        let cells = [tracker.name.clone()].into_iter().chain(values.map(cell));
        table.row(&cells.collect::<Vec<_>>());
    }
    (!known.is_empty()).then_some(table)
}

fn with_spread(measure: Measure) -> String {
    match measure.sd {
        Some(sd) => format!("{:.3} +- {sd:.3}", measure.mean),
        None => format!("{:.3}", measure.mean),
    }
}

/// A part of the dataset: its name and its targets.
type TargetGroup = (String, Vec<String>);

fn each_target(board: &Scoreboard) -> Vec<TargetGroup> {
    let mut parts: Vec<TargetGroup> = Vec::new();
    for target in board.trackers.iter().flat_map(|tracker| &tracker.targets) {
        if !parts.iter().any(|(name, _)| *name == target.target) {
            parts.push((target.target.clone(), vec![target.target.clone()]));
        }
    }
    parts
}

/// One row per part, one column per tracker.
fn part_table(board: &Scoreboard, what: &str, parts: &[TargetGroup], number: Number) -> TextTable {
    let mut titles = vec![what, "targets"];
    titles.extend(board.trackers.iter().map(|tracker| tracker.name.as_str()));
    let mut table = TextTable::new(&titles);
    for (name, targets) in parts {
        let mut row = vec![name.clone(), targets.len().to_string()];
        row.extend(board.trackers.iter().map(|tracker| {
            part(tracker, targets).map_or("-".to_string(), |s| with_spread(number(&s)))
        }));
        table.row(&row);
    }
    table
}

fn part(tracker: &TrackerScore, targets: &[String]) -> Option<Summary> {
    let inside = tracker.targets.iter().filter(|target| targets.contains(&target.target));
    score::summary(&inside.collect::<Vec<_>>(), &tracker.seeds)
}

fn json_of(board: &Scoreboard, by: Option<Grouping>) -> Value {
    let trackers: Vec<Value> =
        board.trackers.iter().map(|tracker| tracker_json(board, tracker, by)).collect();
    json!({"trackers": trackers, "refused": board.refused, "without_truth": board.without_truth})
}

fn tracker_json(board: &Scoreboard, tracker: &TrackerScore, by: Option<Grouping>) -> Value {
    let mut value = summary_json(&tracker.overall);
    value["name"] = json!(tracker.name);
    value["targets"] = json!(tracker.targets.len());
    value["seeds"] = json!(tracker.seeds.len());
    value["notes"] = json!(tracker.notes);
    let parts = match by {
        None => return value,
        Some(Grouping::Attribute) => ("attributes", score::attributes(&board.trackers)),
        Some(Grouping::Target) => ("by_target", each_target(board)),
    };
    let mut object = serde_json::Map::new();
    for (name, targets) in parts.1 {
        let Some(summary) = part(tracker, &targets) else { continue };
        let mut part = summary_json(&summary);
        part["targets"] = json!(targets.len());
        object.insert(name, part);
    }
    value[parts.0] = Value::Object(object);
    value
}

/// The measures; `_sd` is null for a single seed, `fps`, `status` and `calibration` if they are
/// unknown.
fn summary_json(s: &Summary) -> Value {
    let mut value = measures_json(&[
        ("dp20", Some(s.dp20)),
        ("auc", Some(s.auc)),
        ("success50", Some(s.success50)),
        ("mean_overlap", Some(s.mean_overlap)),
        ("norm_precision", Some(s.norm_precision)),
        ("lost_share", Some(s.lost_share)),
        ("overlap_not_lost", s.overlap_not_lost),
        ("fps", s.fps),
    ]);
    value["status"] = s.status.as_ref().map_or(Value::Null, status_json);
    value["calibration"] = s.calibration.as_ref().map_or(Value::Null, calibration_json);
    value
}

fn status_json(s: &StatusSummary) -> Value {
    let mut value = measures_json(&[
        ("lost_precision", s.precision),
        ("lost_recall", s.recall),
        ("false_lost", s.false_lost),
        ("first_lost", s.first_lost),
        ("losses", Some(s.losses)),
        ("recoveries", Some(s.recoveries)),
    ]);
    let pooled = &s.pooled;
    value["pooled"] = json!({
        "lost_precision": pooled.precision(),
        "lost_recall": pooled.recall(),
        "false_lost": pooled.false_lost(),
        "first_lost": pooled.first_lost(),
        "losses": pooled.losses,
        "recoveries": pooled.recoveries,
    });
    value
}

fn calibration_json(s: &CalibrationSummary) -> Value {
    let mut value = measures_json(&[("ece", s.ece), ("auroc", s.auroc)]);
    let pooled = &s.pooled;
    value["pooled"] = json!({"ece": pooled.ece(), "auroc": pooled.auroc(), "bins": pooled.bins()});
    value
}

fn measures_json(measures: &[(&str, Option<Measure>)]) -> Value {
    let mut value = json!({});
    for (name, measure) in measures {
        value[*name] = json!(measure.map(|m| m.mean));
        value[format!("{name}_sd")] = json!(measure.and_then(|m| m.sd));
    }
    value
}
