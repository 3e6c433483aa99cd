//! Precision and success plots: one line per tracker. The best are named in a ranked legend; the
//! others are pale lines in the background.

use super::Plot;
use super::chart::{Chart, Entry};
use crate::Error;
use crate::metrics;
use crate::protocol::{DP_INDEX, NORMALISED, PRECISION, SUCCESS};
use crate::score::Summary;

/// A measure that is drawn as curves.
pub struct Measure {
    /// Name of the plot's files, without extension.
    pub file: &'static str,
    /// The name in headings.
    pub name: &'static str,
    x_label: &'static str,
    /// Label of the score, in the head of the legend.
    score_label: &'static str,
    /// Labelled positions on the x axis.
    ticks: &'static [f64],
    pub thresholds: &'static [f64],
    /// Shares of frames, 0 to 1, one for each threshold.
    pub curve: fn(&metrics::Curves) -> &[f64],
    pub score: fn(&Summary) -> f64,
    /// The threshold at which the score is taken; `None` if the score is the mean of the values.
    mark: Option<f64>,
}

/// Precision, success and normalised precision.
pub static MEASURES: [Measure; 3] = [
    Measure {
        file: "precision",
        name: "Precision",
        x_label: "centre distance threshold, pixels",
        score_label: "DP at 20 px",
        ticks: &[0.0, 10.0, 20.0, 30.0, 40.0, 50.0],
        thresholds: &PRECISION,
        curve: |curves| &curves.precision,
        score: |summary| summary.dp20.mean,
        mark: Some(DP_INDEX as f64),
    },
    Measure {
        file: "success",
        name: "Success",
        x_label: "overlap threshold",
        score_label: "AUC",
        ticks: &[0.0, 0.2, 0.4, 0.6, 0.8, 1.0],
        thresholds: &SUCCESS,
        curve: |curves| &curves.success,
        score: |summary| summary.auc.mean,
        mark: None,
    },
    Measure {
        file: "normalised_precision",
        name: "Normalised precision",
        x_label: "centre distance threshold, relative to the target's size",
        score_label: "mean",
        ticks: &[0.0, 0.1, 0.2, 0.3, 0.4, 0.5],
        thresholds: &NORMALISED,
        curve: |curves| &curves.normalised,
        score: |summary| summary.norm_precision.mean,
        mark: None,
    },
];

/// The plot of a measure, with the trackers by rank; `file` is the name of its files.
///
/// # Errors
/// [`Error::Picture`], which is a bug.
pub fn plot(
    measure: &Measure,
    file: String,
    title: String,
    entries: Vec<Entry>,
) -> Result<Plot, Error> {
    let names = entries.iter().map(|entry| entry.name.to_string());
    let mut table = vec![["threshold".to_string()].into_iter().chain(names).collect::<Vec<_>>()];
    for (k, threshold) in measure.thresholds.iter().enumerate() {
        let values = entries.iter().map(|entry| format!("{:.6}", entry.points[k][1]));
        table.push([format!("{threshold}")].into_iter().chain(values).collect());
    }
    let chart = Chart {
        file,
        title,
        x_label: measure.x_label,
        y_label: "share of frames",
        score_label: measure.score_label,
        last: measure.thresholds.last().copied().unwrap_or(1.0),
        ticks: measure.ticks,
        mark: measure.mark.map(|mark| [mark; 2]),
        entries,
        table,
    };
    chart.plot()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::SUCCESS;
    use crate::report::palette::LineStyle;

    fn entry(name: &str, style: Option<LineStyle>) -> Entry<'_> {
        let points = SUCCESS.map(|threshold| [threshold, 1.0 - threshold]).to_vec();
        let tooltip = format!("{name} is here");
        Entry { name, score: 0.5, style, width: None, tooltip, points, dots: Vec::new() }
    }

    fn success(entries: Vec<Entry>) -> Plot {
        plot(&MEASURES[1], "success".into(), "Success".into(), entries).unwrap()
    }

    #[test]
    fn the_legend_names_some_lines_and_counts_the_others() {
        let named = [("<ours> & co", LineStyle::FIRST), ("b", LineStyle::other(1, false))];
        let named = named.map(|(name, style)| entry(name, Some(style)));
        let plot = success(named.into_iter().chain(["c", "<d>"].map(|n| entry(n, None))).collect());
        let svg = plot.svg();
        assert!(svg.contains(">&lt;ours&gt; &amp; co</text>") && svg.contains(">b</text>"));
        assert!(!svg.contains(">c</text>") && svg.contains(">2 more</text>"));
        assert!(svg.contains("<title>&lt;d&gt; is here</title>") && !svg.contains("<d>"));
        assert_eq!(svg.matches("[0.500]</text>").count(), 2);
        let half = "0.5,0.500000,0.500000,0.500000,0.500000";
        assert_eq!(plot.csv().lines().nth(11), Some(half));
        assert!(plot.png().unwrap().starts_with(b"\x89PNG"));
    }

    #[test]
    fn a_long_legend_increases_the_height() {
        let many = (0..30).map(|k| entry("tracker", Some(LineStyle::other(k, false)))).collect();
        assert!(success(many).size[1] > success(vec![entry("tracker", None)]).size[1]);
    }
}
