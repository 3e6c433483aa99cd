//! Differences between one tracker and the others, with their intervals.

use super::{Axis, Plot};
use crate::compare::Difference;
use crate::report::svg::{Anchor, Svg, shorten, width};

const TOP: f64 = 74.0;
const ROW: f64 = 24.0;
const NAMES: f64 = 150.0;
const FIELD: f64 = 210.0;
/// Room for the figures behind a field.
const FIGURES: f64 = 240.0;
const NAME_LETTERS: usize = 17;

/// One other tracker.
#[derive(Debug, Clone, PartialEq)]
pub struct Row<'a> {
    /// Its name.
    pub name: &'a str,
    /// The difference in each measure, in the order of [`Intervals::measures`].
    pub differences: Vec<Difference>,
    /// The probabilities, corrected for the number of rows.
    pub corrected: Vec<f64>,
}

/// What is drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Intervals<'a> {
    /// Name of the files.
    pub file: String,
    /// The line above.
    pub title: String,
    /// Names of the measures.
    pub measures: [&'a str; 2],
    /// The other trackers, from the top.
    pub rows: Vec<Row<'a>>,
}

impl Intervals<'_> {
    /// Draws it: a field for each measure, a row for each other tracker.
    pub fn plot(&self) -> Plot {
        let size =
            [16.0 + NAMES + 2.0 * (FIELD + FIGURES), TOP + ROW * self.rows.len() as f64 + 34.0];
        let mut svg = Svg::default();
        svg.text([16.0, 28.0], 16.0, "ink", Anchor::Start, &self.title);
        for (k, row) in self.rows.iter().enumerate() {
            let y = TOP + ROW * (k as f64 + 0.5);
            if k % 2 == 0 {
                svg.rect("faint", [8.0, y - ROW / 2.0], [size[0] - 16.0, ROW]);
            }
            svg.text([16.0, y + 4.5], 13.0, "ink", Anchor::Start, &shorten(row.name, NAME_LETTERS));
        }
        for (m, measure) in self.measures.iter().enumerate() {
            self.field(&mut svg, m, measure, 16.0 + NAMES + m as f64 * (FIELD + FIGURES));
        }
        Plot {
            name: self.file.clone(),
            title: self.title.clone(),
            table: self.table(),
            picture: svg,
            size,
            head: 0.0,
        }
    }

    fn field(&self, svg: &mut Svg, m: usize, measure: &str, left: f64) {
        let [low, high] = self.reach(m);
        let x = Axis { values: [low, high], places: [left, left + FIELD] };
        let bottom = TOP + ROW * self.rows.len() as f64;
        svg.text(
            [left, TOP - 22.0],
            13.0,
            "ink",
            Anchor::Start,
            &format!("difference in {measure}"),
        );
        svg.text(
            [left + FIELD + 14.0, TOP - 6.0],
            12.0,
            "soft",
            Anchor::Start,
            "mean [95 % interval] p",
        );
        for value in [low, 0.0, high] {
            let class = if value == 0.0 { "axis" } else { "grid" };
            svg.line(class, [x.at(value), TOP], [x.at(value), bottom]);
            let text = if value == 0.0 { "0".to_string() } else { format!("{value:+}") };
            svg.text([x.at(value), bottom + 18.0], 12.0, "soft", Anchor::Middle, &text);
        }
        for (k, row) in self.rows.iter().enumerate() {
            let (Some(d), Some(&p)) = (row.differences.get(m), row.corrected.get(m)) else {
                continue;
            };
            let y = TOP + ROW * (k as f64 + 0.5);
            let class = match (p < 0.05, d.mean > 0.0) {
                (false, _) => 6,
                (true, true) => 1,
                (true, false) => 0,
            };
            svg.put(format_args!(
                "<line class=\"c{class}\" stroke-width=\"2.4\" x1=\"{:.1}\" x2=\"{:.1}\" y1=\"{y:.1}\" y2=\"{y:.1}\"/>\
                 <circle class=\"f{class}\" cx=\"{:.1}\" cy=\"{y:.1}\" r=\"4.2\"/>",
                x.at(d.low),
                x.at(d.high),
                x.at(d.mean)
            ));
            let figures = format!("{:+.3} [{:+.3} {:+.3}]", d.mean, d.low, d.high);
            let place = left + FIELD + 14.0;
            svg.text([place, y + 4.0], 11.0, "ink", Anchor::Start, &figures);
            svg.text(
                [place + width(&figures, 11.0) + 6.0, y + 4.0],
                11.0,
                "soft",
                Anchor::Start,
                &probability(p),
            );
        }
    }

    /// Round numbers below and above 0 that no interval passes, far enough from 0 that their labels stay apart.
    fn reach(&self, m: usize) -> [f64; 2] {
        let all = || self.rows.iter().filter_map(|row| row.differences.get(m));
        let steps = [0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8];
        let round = |most: f64| steps.into_iter().find(|&step| step >= most).unwrap_or(1.0);
        let below = round(all().map(|d| -d.low).fold(0.0, f64::max));
        let above = round(all().map(|d| d.high).fold(0.0, f64::max));
        [-below.max(above / 4.0), above.max(below / 4.0)]
    }

    fn table(&self) -> Vec<Vec<String>> {
        let mut head = vec!["tracker".to_string(), "targets".to_string()];
        for measure in self.measures {
            head.extend(
                ["mean", "low", "high", "p", "p_corrected"].map(|part| format!("{measure}_{part}")),
            );
        }
        let mut table = vec![head];
        for row in &self.rows {
            let targets = row.differences.first().map_or(0, |d| d.targets);
            let mut cells = vec![row.name.to_string(), targets.to_string()];
            for (d, corrected) in row.differences.iter().zip(&row.corrected) {
                cells.extend([d.mean, d.low, d.high].map(|value| format!("{value:.6}")));
                cells.extend([d.p, *corrected].map(|value| format!("{value:.5}")));
            }
            table.push(cells);
        }
        table
    }
}

/// `p 0.012`, or `p<0.001`.
pub fn probability(p: f64) -> String {
    if p < 0.001 { "p<0.001".to_string() } else { format!("p {p:.3}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_have_their_figures() {
        let d = Difference { targets: 3, mean: 0.05, low: 0.01, high: 0.09, p: 0.004 };
        let row = Row { name: "other", differences: vec![d, d], corrected: vec![0.0004, 0.5] };
        let plot = Intervals {
            file: "f".into(),
            title: "t".into(),
            measures: ["AUC", "DP"],
            rows: vec![row],
        }
        .plot();
        let svg = plot.svg();
        assert!(
            svg.contains("+0.050 [+0.010 +0.090]")
                && svg.contains("p&lt;0.001")
                && svg.contains("p 0.500")
        );
        assert_eq!(plot.table[1][..4], ["other", "3", "0.050000", "0.010000"]);
    }
}
