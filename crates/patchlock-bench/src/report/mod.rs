//! The report: a self-contained HTML page, and every plot with its numbers.
//!
//! [`build`] reads only the frames for thumbnails and writes no files: it returns the page as text,
//! and the plots as values that can be rendered as SVG, PNG and CSV.

mod comparison;
mod failures;
mod outlines;
mod page;
mod palette;
mod plots;
mod rows;
mod svg;
mod tables;

pub use plots::{Plot, csv};
pub use svg::{FAMILY, FONT, png};

use crate::Error;
use crate::bench::store::sha256;
use crate::compare::{BootstrapSamples, DRAWS, MIN_TARGETS, ascending, holm};
use crate::dataset::{Dataset, OTB_ATTRIBUTES};
use crate::metrics::Curves;
use crate::protocol::{DP_INDEX, Protocol};
use crate::score::{self, Scoreboard, Summary, TargetScore};
use comparison::{ComparedTracker, Comparison};
use patchlock_track::names;
use plots::curves::{self, Line};
use plots::intervals::{Intervals, TrackerDifferences};
use plots::reliability::{self, Reliability};
use plots::speed::{Point, Speed};

/// The options of a report.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Options {
    /// Names of trackers that every plot names regardless of their rank. The report is about the
    /// first of them, or by default about the best tracker.
    pub shown: Vec<String>,
    /// How many of the best trackers each plot names.
    pub best: usize,
    /// Largest number of thumbnails per target; they need frames.
    pub thumbnails: usize,
    /// Seed of the bootstrap.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self { shown: Vec::new(), best: 10, thumbnails: 3, seed: 0 }
    }
}

/// The finished report.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// The HTML page; it needs no other file.
    pub html: String,
    /// All plots of the page.
    pub plots: Vec<Plot>,
    /// Tables of numbers: file name without extension, and rows, the first of which is the header.
    pub tables: Vec<(String, Vec<Vec<String>>)>,
}

/// Builds the report.
///
/// # Errors
/// [`Error::NothingToCompare`] if there are no trackers, they have no target in common, or a shown
/// one is unknown.
pub fn build(
    board: &Scoreboard,
    truth: &Dataset,
    protocol: &Protocol,
    options: &Options,
) -> Result<Report, Error> {
    let comparison = Comparison::new(board, truth, &options.shown)?;
    let overall = overall_plots(&comparison, protocol, options);
    let attributes = attribute_plots(&comparison, protocol, options);
    let draws = BootstrapSamples::new(comparison.targets.len(), DRAWS, options.seed);
    let pairs = interval_plot(&comparison, &draws);
    let reliability = reliability_plot(&comparison, options);
    let (sequences, faults) = page::sequences(&comparison, truth, options);
    let html = page::render(&page::Parts {
        board,
        truth,
        comparison: &comparison,
        overall: &overall,
        pairs: pairs.as_ref(),
        reliability: reliability.as_ref(),
        attributes: &attributes,
        sequences: &sequences,
        faults: &faults,
    })?;
    let tables = vec![
        ("trackers".to_string(), tables::trackers(&comparison)),
        ("targets".to_string(), tables::targets(&comparison)),
        ("attributes".to_string(), tables::attributes(&comparison)),
        ("pairs".to_string(), tables::pairs(&comparison, &draws)),
        ("status".to_string(), tables::status(&comparison)),
    ];
    let attributes = attributes.into_iter().flat_map(|attribute| attribute.plots);
    let sequences = sequences.into_iter().map(|sequence| sequence.plot);
    let single = pairs.into_iter().chain(reliability);
    let plots = overall.into_iter().chain(single).chain(attributes).chain(sequences).collect();
    Ok(Report { html, plots, tables })
}

/// A measure that is drawn as curves.
struct Measure {
    file: &'static str,
    name: &'static str,
    x_label: &'static str,
    y_label: &'static str,
    score_label: &'static str,
    ticks: &'static [f64],
    thresholds: fn(&Protocol) -> &[f64],
    curve: fn(&Curves) -> &[f64],
    score: fn(&Summary) -> f64,
    mark: Option<f64>,
}

const PRECISION: Measure = Measure {
    file: "precision",
    name: "Precision",
    x_label: "centre distance threshold, pixels",
    y_label: "share of frames",
    score_label: "DP at 20 px",
    ticks: &[0.0, 10.0, 20.0, 30.0, 40.0, 50.0],
    thresholds: |protocol| &protocol.precision,
    curve: |curves| &curves.precision,
    score: |summary| summary.dp20.mean,
    mark: Some(DP_INDEX as f64),
};
const SUCCESS: Measure = Measure {
    file: "success",
    name: "Success",
    x_label: "overlap threshold",
    y_label: "share of frames",
    score_label: "AUC",
    ticks: &[0.0, 0.2, 0.4, 0.6, 0.8, 1.0],
    thresholds: |protocol| &protocol.success,
    curve: |curves| &curves.success,
    score: |summary| summary.auc.mean,
    mark: None,
};
const NORMALISED: Measure = Measure {
    file: "normalised_precision",
    name: "Normalised precision",
    x_label: "centre distance threshold, relative to the target's size",
    y_label: "share of frames",
    score_label: "mean",
    ticks: &[0.0, 0.1, 0.2, 0.3, 0.4, 0.5],
    thresholds: |protocol| &protocol.normalised,
    curve: |curves| &curves.normalised,
    score: |summary| summary.norm_precision.mean,
    mark: None,
};

fn overall_plots(comparison: &Comparison, protocol: &Protocol, options: &Options) -> Vec<Plot> {
    let all: Vec<(&ComparedTracker, Summary)> =
        comparison.trackers.iter().map(|tracker| (tracker, tracker.overall.clone())).collect();
    let plot = |measure: &Measure| {
        let title =
            format!("{} plots of {}, {}", measure.name, comparison.kind.name(), comparison.size());
        curve_plot(measure, &all, protocol, options, measure.file.to_string(), title)
    };
    [PRECISION, SUCCESS, NORMALISED].iter().map(plot).chain(speed_plot(comparison)).collect()
}

/// The plot of accuracy and speed; `None` unless the times of at least two trackers are known.
fn speed_plot(comparison: &Comparison) -> Option<Plot> {
    let point = |tracker| {
        let tracker: &ComparedTracker = tracker;
        let fps = tracker.overall.fps.map(|fps| fps.mean).filter(|fps| *fps > 0.0)?;
        Some((tracker.name.to_string(), fps, tracker.overall.auc.mean, tracker.style))
    };
    let known: Vec<_> = comparison.trackers.iter().filter_map(point).collect();
    let title = format!("Accuracy and speed, {}", comparison.size());
    let points = known.iter().map(|(name, fps, auc, style)| Point {
        name,
        fps: *fps,
        auc: *auc,
        style: *style,
    });
    (known.len() > 1).then(|| Speed { title, points: points.collect() }.plot())
}

/// The reliability diagram of the best and the shown trackers; `None` if no scores are known.
fn reliability_plot(comparison: &Comparison, options: &Options) -> Option<Plot> {
    let known = comparison.trackers.iter().filter_map(|tracker| {
        let pooled = &tracker.overall.calibration.as_ref()?.pooled;
        let (bins, ece) = (pooled.bins(), pooled.ece()?);
        Some(reliability::Line { name: tracker.name, bins, ece, style: tracker.style })
    });
    let mut lines: Vec<_> = known.collect();
    lines.sort_by(|a, b| a.ece.total_cmp(&b.ece));
    let mut rank = 0..;
    lines.retain(|line| rank.next().is_some_and(|rank| rank < options.best) || line.style.strong);
    let title = format!("Reliability of the score, {}", comparison.size());
    (!lines.is_empty()).then(|| Reliability { title, lines }.plot())
}

/// The curves of the trackers, ranked by the score of the measure. The best and the shown trackers
/// are named.
fn curve_plot(
    measure: &Measure,
    trackers: &[(&ComparedTracker, Summary)],
    protocol: &Protocol,
    options: &Options,
    file: String,
    title: String,
) -> Plot {
    let scores: Vec<f64> = trackers.iter().map(|(_, summary)| -(measure.score)(summary)).collect();
    let ranked = ascending(&scores).into_iter().map(|k| &trackers[k]);
    let lines = ranked.enumerate().map(|(rank, (tracker, summary))| Line {
        name: tracker.name,
        values: (measure.curve)(&summary.curves),
        score: (measure.score)(summary),
        style: (rank < options.best || tracker.style.strong).then_some(tracker.style),
    });
    curves::Curves {
        file,
        title,
        x_label: measure.x_label,
        y_label: measure.y_label,
        score_label: measure.score_label,
        thresholds: (measure.thresholds)(protocol),
        ticks: measure.ticks,
        mark: measure.mark,
        lines: lines.collect(),
    }
    .plot()
}

/// The plots of one attribute that several targets have.
struct AttributePlots {
    /// Short name.
    short: String,
    /// Precision and success.
    plots: Vec<Plot>,
}

fn attribute_plots(
    comparison: &Comparison,
    protocol: &Protocol,
    options: &Options,
) -> Vec<AttributePlots> {
    let mut all = Vec::new();
    for (short, name) in attributes_of(comparison) {
        let has = |target: &&&TargetScore| target.attributes.contains(&short);
        let count = comparison.about().targets.iter().filter(has).count();
        if count < 2 {
            continue; // the plot of the target itself shows more
        }
        let on = |tracker| -> Option<(&ComparedTracker, Summary)> {
            let tracker: &ComparedTracker = tracker;
            let own: Vec<&TargetScore> = tracker.targets.iter().filter(has).copied().collect();
            Some((tracker, score::summary(&own, tracker.seeds)?))
        };
        let trackers: Vec<(&ComparedTracker, Summary)> =
            comparison.trackers.iter().filter_map(on).collect();
        let plot = |measure: &Measure| {
            let title = format!("{}: {name} ({count})", measure.name);
            let file = format!("{}_{}", measure.file, file_name(&short));
            curve_plot(measure, &trackers, protocol, options, file, title)
        };
        let plots = [PRECISION, SUCCESS].iter().map(plot).collect();
        all.push(AttributePlots { short, plots });
    }
    all
}

/// The attributes of the compared targets with their meanings: those of OTB in its order, then
/// others.
fn attributes_of(comparison: &Comparison) -> Vec<(String, String)> {
    let targets = comparison.about().targets.iter();
    let mut present =
        names::distinct(targets.flat_map(|t| t.attributes.iter().map(String::as_str)).collect());
    let known = OTB_ATTRIBUTES.iter().filter(|(short, _)| present.contains(short));
    let mut all: Vec<(String, String)> =
        known.map(|(s, n)| (s.to_string(), n.to_string())).collect();
    present.retain(|short| all.iter().all(|(known, _)| known != short));
    all.extend(present.into_iter().map(|short| (short.to_string(), short.to_string())));
    all
}

/// The differences between the tracker of the report and each other one; `None` if there is no
/// other, or there are too few targets.
fn interval_plot(comparison: &Comparison, draws: &BootstrapSamples) -> Option<Plot> {
    if comparison.targets.len() < MIN_TARGETS {
        return None;
    }
    let measures: [fn(&Curves) -> f64; 2] = [Curves::auc, Curves::dp20];
    let about = comparison.about();
    let mut rows = Vec::new();
    for tracker in comparison.trackers.iter().filter(|tracker| tracker.name != about.name) {
        let difference = |measure: &fn(&Curves) -> f64| {
            draws.difference(&about.each(*measure), &tracker.each(*measure))
        };
        let differences: Vec<_> = measures.iter().filter_map(difference).collect();
        rows.push(TrackerDifferences { name: tracker.name, differences, corrected: Vec::new() });
    }
    for k in 0..measures.len() {
        let p: Vec<f64> =
            rows.iter().filter_map(|row| row.differences.get(k)).map(|d| d.p).collect();
        rows.iter_mut().zip(holm(&p)).for_each(|(row, p)| row.corrected.push(p));
    }
    let title = format!(
        "{} compared with each other tracker, {} targets",
        about.name,
        comparison.targets.len()
    );
    let plot = Intervals { file: "differences".to_string(), title, measures: ["AUC", "DP"], rows };
    (!plot.rows.is_empty()).then(|| plot.plot())
}

/// A name with all characters replaced that are unusual in file names. A long one is cut, and then
/// ends with a hash of the whole.
fn file_name(name: &str) -> String {
    const LONGEST: usize = 60;
    let usual = |c: char| c.is_alphanumeric() || matches!(c, '.' | '-' | '_');
    let mut plain: String = name.chars().map(|c| if usual(c) { c } else { '_' }).collect();
    if plain.chars().count() > LONGEST {
        let hash = sha256(name.as_bytes());
        plain = plain
            .chars()
            .take(LONGEST - 9)
            .chain("-".chars())
            .chain(hash.chars().take(8))
            .collect();
    }
    plain
}
