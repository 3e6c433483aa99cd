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

pub use plots::{Plot, csv, overlap, round_step};
pub use svg::{FONT, png};

use crate::Error;
use crate::bench::store::sha256;
use crate::compare::{BootstrapSamples, DRAWS, MIN_TARGETS, ascending, holm};
use crate::dataset::{Dataset, OTB_ATTRIBUTES};
use crate::metrics::Curves;
use crate::score::{self, Scoreboard, Summary, TargetScore};
use comparison::{ComparedTracker, Comparison};
use page::SequenceRow;
use patchlock_track::names;
use plots::chart::Entry;
use plots::curves::{self, MEASURES, Measure};
use plots::intervals::{self, TrackerDifferences};
use plots::reliability;
use plots::speed::{self, Point};

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
pub fn build(board: &Scoreboard, truth: &Dataset, options: &Options) -> Result<Report, Error> {
    let comparison = Comparison::new(board, truth, &options.shown)?;
    let draws = BootstrapSamples::new(comparison.targets.len(), DRAWS, options.seed);
    let (sequences, faults) = page::sequences(&comparison, truth, options)?;
    let figures = Figures {
        overall: overall_plots(&comparison, options)?,
        pairs: interval_plot(&comparison, &draws)?,
        reliability: reliability_plot(&comparison, options)?,
        attributes: attribute_plots(&comparison, options)?,
        sequences,
    };
    let html = page::render(board, truth, &comparison, &figures, &faults)?;
    let tables = vec![
        ("trackers".to_string(), tables::trackers(&comparison)),
        ("targets".to_string(), tables::targets(&comparison)),
        ("attributes".to_string(), tables::attributes(&comparison)),
        ("pairs".to_string(), tables::pairs(&comparison, &draws)),
        ("status".to_string(), tables::status(&comparison)),
    ];
    Ok(Report { html, plots: figures.into_plots(), tables })
}

/// The plots of the page.
struct Figures {
    /// Over all targets.
    overall: Vec<Plot>,
    /// The differences with their intervals.
    pairs: Option<Plot>,
    reliability: Option<Plot>,
    /// Precision and success of each attribute.
    attributes: Vec<Plot>,
    sequences: Vec<SequenceRow>,
}

impl Figures {
    fn into_plots(self) -> Vec<Plot> {
        let sequences = self.sequences.into_iter().map(|sequence| sequence.plot);
        let single = self.pairs.into_iter().chain(self.reliability);
        self.overall.into_iter().chain(single).chain(self.attributes).chain(sequences).collect()
    }
}

fn overall_plots(comparison: &Comparison, options: &Options) -> Result<Vec<Plot>, Error> {
    let all: Vec<(&ComparedTracker, Summary)> =
        comparison.trackers.iter().map(|tracker| (tracker, tracker.overall.clone())).collect();
    let plot = |measure: &Measure| {
        let title = format!(
            "{} plots of {}, {}",
            measure.name,
            comparison.scheme.title(),
            comparison.size()
        );
        curve_plot(measure, &all, options, measure.file.to_string(), title)
    };
    MEASURES.iter().map(plot).chain(speed_plot(comparison)).collect()
}

/// The plot of accuracy and speed; `None` unless the times of at least two trackers are known.
fn speed_plot<'a>(comparison: &Comparison<'a>) -> Option<Result<Plot, Error>> {
    let point = |tracker: &ComparedTracker<'a>| {
        let fps = tracker.overall.fps.map(|fps| fps.mean).filter(|fps| *fps > 0.0)?;
        let auc = tracker.overall.auc.mean;
        Some(Point { name: tracker.name, fps, auc, style: tracker.style })
    };
    let points: Vec<Point> = comparison.trackers.iter().filter_map(point).collect();
    let title = format!("Accuracy and speed, {}", comparison.size());
    (points.len() > 1).then(|| speed::plot(title, &points))
}

/// The reliability diagram of the best and the shown trackers; `None` if no scores are known.
fn reliability_plot(comparison: &Comparison, options: &Options) -> Result<Option<Plot>, Error> {
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
    (!lines.is_empty()).then(|| reliability::plot(title, &lines)).transpose()
}

/// The curves of the trackers, ranked by the score of the measure. The best and the shown trackers
/// are named.
fn curve_plot<'a>(
    measure: &Measure,
    trackers: &'a [(&ComparedTracker<'a>, Summary)],
    options: &Options,
    file: String,
    title: String,
) -> Result<Plot, Error> {
    let scores: Vec<f64> = trackers.iter().map(|(_, summary)| -(measure.score)(summary)).collect();
    let ranked = ascending(&scores).into_iter().map(|k| &trackers[k]);
    let entry = |(rank, (tracker, summary)): (usize, &'a (&ComparedTracker<'a>, Summary))| {
        let score = (measure.score)(summary);
        let values = measure.thresholds.iter().zip((measure.curve)(&summary.curves));
        Entry {
            name: tracker.name,
            score,
            style: (rank < options.best || tracker.style.strong).then_some(tracker.style),
            width: None,
            tooltip: format!("{} [{score:.3}]", tracker.name),
            points: values.map(|(&threshold, &share)| [threshold, share]).collect(),
            dots: Vec::new(),
        }
    };
    curves::plot(measure, file, title, ranked.enumerate().map(entry).collect())
}

/// Precision and success of each attribute that several targets have.
fn attribute_plots(comparison: &Comparison, options: &Options) -> Result<Vec<Plot>, Error> {
    let mut all = Vec::new();
    for (short, name) in attributes_of(comparison) {
        let has = |target: &&&TargetScore| target.attributes.contains(&short);
        let count = comparison.about().targets.iter().filter(has).count();
        if count < 2 {
            continue; // the plot of the target itself shows more
        }
        let trackers = comparison.trackers.iter().filter_map(|tracker| {
            let own: Vec<&TargetScore> = tracker.targets.iter().filter(has).copied().collect();
            Some((tracker, score::summary(&own, tracker.seeds)?))
        });
        let trackers: Vec<(&ComparedTracker, Summary)> = trackers.collect();
        let plot = |measure: &Measure| {
            let title = format!("{}: {name} ({count})", measure.name);
            let file = format!("{}_{}", measure.file, file_name(&short));
            curve_plot(measure, &trackers, options, file, title)
        };
        all.extend(MEASURES[..2].iter().map(plot));
    }
    all.into_iter().collect()
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
fn interval_plot(comparison: &Comparison, draws: &BootstrapSamples) -> Result<Option<Plot>, Error> {
    if comparison.targets.len() < MIN_TARGETS {
        return Ok(None);
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
    let count = comparison.targets.len();
    let title = format!("{} compared with each other tracker, {count} targets", about.name);
    (!rows.is_empty()).then(|| intervals::plot(title, ["AUC", "DP"], &rows)).transpose()
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
