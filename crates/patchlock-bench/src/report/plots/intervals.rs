//! Plots the differences between one tracker and the others, with their confidence intervals.

use super::{Axis, Plot};
use crate::compare::Difference;
use crate::report::svg::{Anchor, Svg, width};

const TOP: f64 = 74.0;
const ROW: f64 = 24.0;
const NAME_WIDTH: f64 = 150.0;
const PANEL: f64 = 210.0;
/// Width of the numbers beside a panel.
const NUMBERS: f64 = 240.0;

/// The differences from one other tracker.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackerDifferences<'a> {
    pub name: &'a str,
    /// The difference in each measure, in the order of [`Intervals::measures`].
    pub differences: Vec<Difference>,
    /// The p-values, corrected for the number of trackers.
    pub corrected: Vec<f64>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Intervals<'a> {
    pub title: String,
    pub measures: [&'a str; 2],
    /// The other trackers, from top to bottom.
    pub rows: Vec<TrackerDifferences<'a>>,
}

impl Intervals<'_> {
    /// Draws the plot: one panel per measure, one row per tracker.
    pub fn plot(self) -> Plot {
        let size = [
            16.0 + NAME_WIDTH + 2.0 * (PANEL + NUMBERS),
            TOP + ROW * self.rows.len() as f64 + 34.0,
        ];
        let mut svg = Svg::default();
        svg.text([16.0, 28.0], 16.0, "ink", Anchor::Start, &self.title);
        for (k, row) in self.rows.iter().enumerate() {
            let y = row_middle(k);
            if k % 2 == 0 {
                svg.rect("faint", [8.0, y - ROW / 2.0], [size[0] - 16.0, ROW]);
            }
            svg.name([16.0, y + 4.5], 13.0, NAME_WIDTH - 12.0, row.name);
        }
        for (m, measure) in self.measures.iter().enumerate() {
            self.panel(&mut svg, m, measure, 16.0 + NAME_WIDTH + m as f64 * (PANEL + NUMBERS));
        }
        let (name, table) = ("differences".to_string(), self.table());
        Plot { name, title: self.title, table, picture: svg, size, head: 0.0 }
    }

    fn panel(&self, svg: &mut Svg, m: usize, measure: &str, left: f64) {
        let x = Axis { values: self.reach(m), pixels: [left, left + PANEL] };
        let heading = format!("difference in {measure}");
        svg.text([left, TOP - 22.0], 13.0, "ink", Anchor::Start, &heading);
        let numbers = "mean [95 % interval] p";
        svg.text([x.pixels[1] + 14.0, TOP - 6.0], 12.0, "soft", Anchor::Start, numbers);
        self.draw_axis(svg, x);
        for (k, row) in self.rows.iter().enumerate() {
            if let (Some(difference), Some(&p)) = (row.differences.get(m), row.corrected.get(m)) {
                draw_difference(svg, x, row_middle(k), difference, p);
            }
        }
    }

    /// Vertical lines and labels at 0 and at both ends of the axis.
    fn draw_axis(&self, svg: &mut Svg, x: Axis) {
        let bottom = TOP + ROW * self.rows.len() as f64;
        for value in [x.values[0], 0.0, x.values[1]] {
            let class = if value == 0.0 { "axis" } else { "grid" };
            svg.line(class, [x.at(value), TOP], [x.at(value), bottom]);
            let text = if value == 0.0 { "0".to_string() } else { format!("{value:+}") };
            svg.text([x.at(value), bottom + 18.0], 12.0, "soft", Anchor::Middle, &text);
        }
    }

    /// Round numbers below and above 0 that enclose all intervals, far enough from 0 that the
    /// labels do not overlap.
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

/// Draws one difference: the interval, the mean and, beside the panel, the numbers.
fn draw_difference(svg: &mut Svg, x: Axis, y: f64, d: &Difference, p: f64) {
    let class = match (p < 0.05, d.mean > 0.0) {
        (false, _) => 6,
        (true, true) => 1,
        (true, false) => 0,
    };
    svg.put(format_args!(
        "<line class=\"c{class}\" stroke-width=\"2.4\" x1=\"{:.1}\" x2=\"{:.1}\" \
         y1=\"{y:.1}\" y2=\"{y:.1}\"/>\
         <circle class=\"f{class}\" cx=\"{:.1}\" cy=\"{y:.1}\" r=\"4.2\"/>",
        x.at(d.low),
        x.at(d.high),
        x.at(d.mean)
    ));
    let numbers = format!("{:+.3} [{:+.3} {:+.3}]", d.mean, d.low, d.high);
    let left = x.pixels[1] + 14.0;
    svg.text([left, y + 4.0], 11.0, "ink", Anchor::Start, &numbers);
    let right = left + width(&numbers, 11.0) + 6.0;
    svg.text([right, y + 4.0], 11.0, "soft", Anchor::Start, &format_p(p));
}

fn row_middle(row: usize) -> f64 {
    TOP + ROW * (row as f64 + 0.5)
}

/// Formats a p-value: `p 0.012`, or `p<0.001`.
fn format_p(p: f64) -> String {
    if p < 0.001 { "p<0.001".to_string() } else { format!("p {p:.3}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_show_their_numbers() {
        let d = Difference { targets: 3, mean: 0.05, low: 0.01, high: 0.09, p: 0.004 };
        let row = TrackerDifferences {
            name: "other",
            differences: vec![d, d],
            corrected: vec![0.0004, 0.5],
        };
        let plot = Intervals { title: "t".into(), measures: ["AUC", "DP"], rows: vec![row] }.plot();
        let svg = plot.svg();
        assert!(
            svg.contains("+0.050 [+0.010 +0.090]")
                && svg.contains("p&lt;0.001")
                && svg.contains("p 0.500")
        );
        assert_eq!(plot.table[1][..4], ["other", "3", "0.050000", "0.010000"]);
    }
}
