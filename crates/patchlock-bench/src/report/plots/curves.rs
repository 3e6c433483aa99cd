//! Precision and success plots: one line per tracker. The best are named in a ranked legend; the
//! others are pale lines in the background.

use super::chart::{Chart, Entry, PALE};
use super::{Axis, Plot};
use crate::metrics;
use crate::protocol::{DP_INDEX, NORMALISED, PRECISION, SUCCESS};
use crate::report::palette::LineStyle;
use crate::report::svg::Svg;
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

#[derive(Debug, Clone, PartialEq)]
pub struct Line<'a> {
    pub name: &'a str,
    /// Shares of frames, 0 to 1, one for each threshold.
    pub values: &'a [f64],
    pub score: f64,
    /// The line style; `None` for a pale line without a name.
    pub style: Option<LineStyle>,
}

pub struct Curves<'a> {
    /// Name of the plot's files, without extension.
    pub file: String,
    pub title: String,
    pub measure: &'a Measure,
    pub thresholds: &'a [f64],
    /// The lines, best tracker first.
    pub lines: Vec<Line<'a>>,
}

impl Curves<'_> {
    pub fn plot(self) -> Plot {
        let lines = self.lines.iter();
        let chart = Chart {
            title: &self.title,
            x_label: self.measure.x_label,
            y_label: "share of frames",
            score_label: self.measure.score_label,
            last: self.thresholds.last().copied().unwrap_or(1.0),
            ticks: self.measure.ticks,
            entries: lines
                .map(|line| Entry { name: line.name, score: line.score, style: line.style })
                .collect(),
        };
        let mut svg = Svg::default();
        let (x, y) = chart.draw(&mut svg);
        if let Some(mark) = self.measure.mark {
            svg.put(format_args!(
                "<line class=\"axis\" stroke-dasharray=\"3 3\" x1=\"{0:.1}\" x2=\"{0:.1}\" \
                 y1=\"{1:.1}\" y2=\"{2:.1}\"/>",
                x.at(mark),
                y.at(0.0),
                y.at(1.0)
            ));
        }
        self.draw_lines(&mut svg, x, y);
        let (size, table) = (chart.size(), self.table());
        Plot { name: self.file, title: self.title, table, picture: svg, size, head: 0.0 }
    }

    /// Draws pale lines first, then the named ones from worst to best, the strong ones on top.
    fn draw_lines(&self, svg: &mut Svg, x: Axis, y: Axis) {
        let depth = |line: &Line| line.style.map_or(0, |style| if style.strong { 2 } else { 1 });
        for layer in 0..=2 {
            for line in self.lines.iter().rev().filter(|line| depth(line) == layer) {
                let points = self.thresholds.iter().zip(line.values);
                let points: Vec<_> = points.map(|(&t, &v)| [x.at(t), y.at(v)]).collect();
                let attributes = line.style.map_or(PALE.to_string(), LineStyle::line);
                svg.polyline(&attributes, &points, &format!("{} [{:.3}]", line.name, line.score));
            }
        }
    }

    fn table(&self) -> Vec<Vec<String>> {
        let names = self.lines.iter().map(|line| line.name.to_string());
        let mut table =
            vec![["threshold".to_string()].into_iter().chain(names).collect::<Vec<_>>()];
        for (k, threshold) in self.thresholds.iter().enumerate() {
            let values = self
                .lines
                .iter()
                .map(|line| line.values.get(k).map_or(String::new(), |v| format!("{v:.6}")));
            table.push([format!("{threshold}")].into_iter().chain(values).collect());
        }
        table
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curves<'a>(names: &'a [String], values: &'a [f64]) -> Curves<'a> {
        let style = |k: usize| {
            (k < 2).then(|| if k == 0 { LineStyle::FIRST } else { LineStyle::other(k, false) })
        };
        Curves {
            file: "success".into(),
            title: "Success".into(),
            measure: &MEASURES[1],
            thresholds: &[0.0, 0.5, 1.0],
            lines: names
                .iter()
                .enumerate()
                .map(|(k, name)| Line { name, values, score: 0.5, style: style(k) })
                .collect(),
        }
    }

    #[test]
    fn the_legend_names_some_lines_and_counts_the_others() {
        let names: Vec<String> = ["ours & co", "b", "c", "d"].map(String::from).to_vec();
        let plot = curves(&names, &[1.0, 0.5, 0.0]).plot();
        let svg = plot.svg();
        assert!(svg.contains(">ours &amp; co</text>") && svg.contains(">b</text>"));
        assert!(!svg.contains(">c</text>") && svg.contains(">2 more</text>"));
        assert_eq!(svg.matches("[0.500]</text>").count(), 2);
        assert_eq!(plot.csv().lines().nth(2), Some("0.5,0.500000,0.500000,0.500000,0.500000"));
        assert!(plot.png().unwrap().starts_with(b"\x89PNG"));
    }

    #[test]
    fn a_long_legend_increases_the_height() {
        let names: Vec<String> = (0..30).map(|k| format!("tracker {k}")).collect();
        let mut many = curves(&names, &[1.0, 0.5, 0.0]);
        many.lines
            .iter_mut()
            .enumerate()
            .for_each(|(k, line)| line.style = Some(LineStyle::other(k, false)));
        assert!(many.plot().size[1] > curves(&names, &[1.0]).plot().size[1]);
    }
}
