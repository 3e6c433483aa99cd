//! The report: one page to look at, and every plot with its numbers.
//!
//! [`build`] reads nothing but frames for thumbnails and writes nothing: it gives the page as text and the plots as values, which draw themselves as SVG,
//! PNG and CSV.

mod failures;
mod field;
mod page;
mod palette;
mod plots;
mod svg;
mod tables;

use std::collections::BTreeSet;

pub use plots::{Plot, csv};
pub use svg::{FAMILY, FONT, Rasteriser};

use crate::Error;
use crate::compare::{DRAWS, Draws, LEAST_TARGETS, holm};
use crate::dataset::{Dataset, OTB_ATTRIBUTES};
use crate::metrics::Curves;
use crate::protocol::{DP_PLACE, Protocol};
use crate::score::{self, Scoreboard, Summary, TargetScore};
use field::{Entrant, Field};
use plots::curves::{self, Line};
use plots::intervals::{Intervals, Row};
use plots::speed::{Point, Speed};

/// What the report shows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Options {
    /// Trackers that every plot names, whatever their rank. The report is about the first of them; of none, about the best tracker.
    pub shown: Vec<String>,
    /// How many of the best each plot names.
    pub best: usize,
    /// Thumbnails a target, at most; they need frames.
    pub thumbnails: usize,
    /// Seed of the draws that the intervals come from.
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
    /// The page, whole: it needs no other file.
    pub html: String,
    /// Every plot of the page.
    pub plots: Vec<Plot>,
    /// Tables of numbers: name of the file without its end, and rows.
    pub tables: Vec<(String, Vec<Vec<String>>)>,
}

/// Makes the report.
///
/// # Errors
/// [`Error::NothingToCompare`] where the trackers have no target in common, or a shown one is not there.
pub fn build(
    board: &Scoreboard,
    truth: &Dataset,
    protocol: &Protocol,
    options: &Options,
) -> Result<Report, Error> {
    let field = Field::new(board, truth, &options.shown)?;
    let overall = overall_plots(&field, protocol, options);
    let attributes = attribute_plots(&field, protocol, options);
    let draws = Draws::new(field.targets.len(), DRAWS, options.seed);
    let pairs = interval_plot(&field, &draws);
    let (sequences, faults) = page::sequences(&field, truth, options);
    let html = page::render(&page::Parts {
        board,
        truth,
        field: &field,
        overall: &overall,
        pairs: pairs.as_ref(),
        attributes: &attributes,
        sequences: &sequences,
        faults: &faults,
    })?;
    let tables = vec![
        ("trackers".to_string(), tables::trackers(&field)),
        ("targets".to_string(), tables::targets(&field)),
        ("attributes".to_string(), tables::attributes(&field)),
        ("pairs".to_string(), tables::pairs(&field, &draws)),
    ];
    let attributes = attributes.into_iter().flat_map(|attribute| attribute.plots);
    let sequences = sequences.into_iter().map(|sequence| sequence.plot);
    let plots = overall.into_iter().chain(pairs).chain(attributes).chain(sequences).collect();
    Ok(Report { html, plots, tables })
}

/// What is drawn as curves.
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
    x_label: "centre distance at most, pixels",
    y_label: "share of frames",
    score_label: "DP at 20 px",
    ticks: &[0.0, 10.0, 20.0, 30.0, 40.0, 50.0],
    thresholds: |protocol| &protocol.precision,
    curve: |curves| &curves.precision,
    score: |summary| summary.dp20.mean,
    mark: Some(DP_PLACE as f64),
};
const SUCCESS: Measure = Measure {
    file: "success",
    name: "Success",
    x_label: "overlap more than",
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
    x_label: "centre distance at most, sizes of the target",
    y_label: "share of frames",
    score_label: "mean",
    ticks: &[0.0, 0.1, 0.2, 0.3, 0.4, 0.5],
    thresholds: |protocol| &protocol.normalised,
    curve: |curves| &curves.normalised,
    score: |summary| summary.norm_precision.mean,
    mark: None,
};

fn overall_plots(field: &Field, protocol: &Protocol, options: &Options) -> Vec<Plot> {
    let all: Vec<(&Entrant, Summary)> =
        field.entrants.iter().map(|entrant| (entrant, entrant.overall.clone())).collect();
    let plot = |measure: &Measure| {
        let title = format!("{} plots of {}, {}", measure.name, field.kind.name(), field.size());
        curve_plot(measure, &all, protocol, options, measure.file.to_string(), title)
    };
    [PRECISION, SUCCESS, NORMALISED].iter().map(plot).chain(speed_plot(field)).collect()
}

/// `None` unless the times of two trackers are known.
fn speed_plot(field: &Field) -> Option<Plot> {
    let point = |entrant| {
        let entrant: &Entrant = entrant;
        let fps = entrant.overall.fps.map(|fps| fps.mean).filter(|fps| *fps > 0.0)?;
        Some((entrant.name.to_string(), fps, entrant.overall.auc.mean, entrant.look))
    };
    let known: Vec<_> = field.entrants.iter().filter_map(point).collect();
    let title = format!("Accuracy and speed, {}", field.size());
    let points = known.iter().map(|(name, fps, auc, look)| Point {
        name,
        fps: *fps,
        auc: *auc,
        look: *look,
    });
    (known.len() > 1).then(|| Speed { title, points: points.collect() }.plot())
}

/// The trackers' curves, ranked by the measure's own score. The best are named, and the shown.
fn curve_plot(
    measure: &Measure,
    trackers: &[(&Entrant, Summary)],
    protocol: &Protocol,
    options: &Options,
    file: String,
    title: String,
) -> Plot {
    let mut ranked: Vec<&(&Entrant, Summary)> = trackers.iter().collect();
    ranked.sort_by(|a, b| (measure.score)(&b.1).total_cmp(&(measure.score)(&a.1)));
    let lines = ranked.iter().enumerate().map(|(rank, (entrant, summary))| Line {
        name: entrant.name,
        values: (measure.curve)(&summary.curves),
        score: (measure.score)(summary),
        look: (rank < options.best || entrant.look.strong).then_some(entrant.look),
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

/// The plots of one attribute.
struct AttributePlots {
    /// Short name.
    short: String,
    /// Precision and success.
    plots: Vec<Plot>,
}

fn attribute_plots(field: &Field, protocol: &Protocol, options: &Options) -> Vec<AttributePlots> {
    let mut all = Vec::new();
    for (short, name) in attributes_of(field) {
        let has = |target: &&&TargetScore| target.attributes.contains(&short);
        let count = field.about().targets.iter().filter(has).count();
        let on = |entrant| -> Option<(&Entrant, Summary)> {
            let entrant: &Entrant = entrant;
            let own = entrant.targets.iter().filter(has).copied();
            Some((entrant, score::summary(own, entrant.seeds)?))
        };
        let trackers: Vec<(&Entrant, Summary)> = field.entrants.iter().filter_map(on).collect();
        let plot = |measure: &Measure| {
            let title = format!("{}: {name} ({count})", measure.name);
            let file = format!("{}_{}", measure.file, plain(&short));
            curve_plot(measure, &trackers, protocol, options, file, title)
        };
        let plots = [PRECISION, SUCCESS].iter().map(plot).collect();
        all.push(AttributePlots { short, plots });
    }
    all
}

/// The attributes that targets of the comparison have, with their meaning: those of the tracker benchmark in its order, then others.
fn attributes_of(field: &Field) -> Vec<(String, String)> {
    let targets = field.about().targets.iter();
    let mut there: BTreeSet<&str> =
        targets.flat_map(|t| t.attributes.iter().map(String::as_str)).collect();
    let known = OTB_ATTRIBUTES.iter().filter(|(short, _)| there.remove(short));
    let mut all: Vec<(String, String)> =
        known.map(|(s, n)| (s.to_string(), n.to_string())).collect();
    all.extend(there.into_iter().map(|short| (short.to_string(), short.to_string())));
    all
}

/// The tracker that the report is about against each other one; `None` where there is no other, or too few targets.
fn interval_plot(field: &Field, draws: &Draws) -> Option<Plot> {
    if field.targets.len() < LEAST_TARGETS {
        return None;
    }
    let measures: [fn(&Curves) -> f64; 2] = [Curves::auc, Curves::dp20];
    let about = field.about();
    let mut rows = Vec::new();
    for entrant in field.entrants.iter().filter(|entrant| entrant.name != about.name) {
        let difference = |measure: &fn(&Curves) -> f64| {
            draws.difference(&about.each(measure), &entrant.each(measure))
        };
        let differences: Vec<_> = measures.iter().filter_map(difference).collect();
        rows.push(Row { name: entrant.name, differences, corrected: Vec::new() });
    }
    for k in 0..measures.len() {
        let p: Vec<f64> =
            rows.iter().filter_map(|row| row.differences.get(k)).map(|d| d.p).collect();
        rows.iter_mut().zip(holm(&p)).for_each(|(row, p)| row.corrected.push(p));
    }
    let title =
        format!("{} against each other tracker, {} targets", about.name, field.targets.len());
    let plot = Intervals { file: "differences".to_string(), title, measures: ["AUC", "DP"], rows };
    (!plot.rows.is_empty()).then(|| plot.plot())
}

/// A name as a part of a file's name.
fn plain(name: &str) -> String {
    name.chars()
        .map(|c| if c.is_alphanumeric() || matches!(c, '.' | '-' | '_') { c } else { '_' })
        .collect()
}
