//! Plots the differences between one tracker and the others, with their confidence intervals.

use minijinja::{Value, context};

use super::{Axis, Plot, drawn};
use crate::Error;
use crate::compare::Difference;
use crate::report::svg::width;

const TOP: f64 = 74.0;
const ROW: f64 = 24.0;
const NAME_WIDTH: f64 = 150.0;
const PANEL: f64 = 210.0;
/// Width of the numbers beside a panel.
const NUMBERS: f64 = 240.0;
const NUMBER_SIZE: f64 = 11.0;

/// The differences from one other tracker.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackerDifferences<'a> {
    pub name: &'a str,
    /// The difference in each measure.
    pub differences: Vec<Difference>,
    /// The p-values, corrected for the number of trackers.
    pub corrected: Vec<f64>,
}

/// Draws the plot: one panel per measure, one row per tracker.
///
/// # Errors
/// [`Error::Picture`], which is a bug.
pub fn plot(
    title: String,
    measures: [&str; 2],
    rows: &[TrackerDifferences],
) -> Result<Plot, Error> {
    let size = [16.0 + NAME_WIDTH + 2.0 * (PANEL + NUMBERS), TOP + ROW * rows.len() as f64 + 34.0];
    let panel = |(k, measure): (usize, &&str)| {
        let ends = reach(rows, k);
        let left = 16.0 + NAME_WIDTH + k as f64 * (PANEL + NUMBERS);
        let right = left + PANEL;
        let x = Axis { values: ends, pixels: [left, right] };
        let difference = |row: &TrackerDifferences| {
            let (d, p) = (&row.differences[k], row.corrected[k]);
            let class = match (p < 0.05, d.mean > 0.0) {
                (false, _) => 6,
                (true, true) => 1,
                (true, false) => 0,
            };
            let numbers = format!("{:+.3} [{:+.3} {:+.3}]", d.mean, d.low, d.high);
            let (width, p) = (width(&numbers, NUMBER_SIZE), format_p(p));
            context! { class, numbers, width, p, mean => d.mean, low => d.low, high => d.high }
        };
        let tick = |value: f64| match value {
            0.0 => context! { value, class => "axis", label => "0" },
            _ => context! { value, class => "grid", label => format!("{value:+}") },
        };
        context! {
            left, right, x => x.function(), measure => *measure,
            ticks => [ends[0], 0.0, ends[1]].map(tick),
            differences => rows.iter().map(difference).collect::<Vec<_>>(),
        }
    };
    let values = context! {
        top => TOP, row => ROW, width => size[0], name_width => NAME_WIDTH,
        number_size => NUMBER_SIZE, title => &title,
        names => rows.iter().map(|row| Value::from(row.name)).collect::<Vec<_>>(),
        panels => measures.iter().enumerate().map(panel).collect::<Vec<_>>(),
    };
    let body = drawn(include_str!("intervals.xml"), values)?;
    let (name, table) = ("differences".to_string(), table(measures, rows));
    Ok(Plot { name, title, table, body, size, head: 0.0 })
}

/// Round numbers below and above 0 that enclose all intervals of a measure, far enough from 0 that
/// the labels do not overlap.
fn reach(rows: &[TrackerDifferences], measure: usize) -> [f64; 2] {
    let all = || rows.iter().filter_map(|row| row.differences.get(measure));
    let steps = [0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8];
    let round = |most: f64| steps.into_iter().find(|&step| step >= most).unwrap_or(1.0);
    let below = round(all().map(|d| -d.low).fold(0.0, f64::max));
    let above = round(all().map(|d| d.high).fold(0.0, f64::max));
    [-below.max(above / 4.0), above.max(below / 4.0)]
}

fn table(measures: [&str; 2], rows: &[TrackerDifferences]) -> Vec<Vec<String>> {
    let mut head = vec!["tracker".to_string(), "targets".to_string()];
    for measure in measures {
        head.extend(
            ["mean", "low", "high", "p", "p_corrected"].map(|part| format!("{measure}_{part}")),
        );
    }
    let mut table = vec![head];
    for row in rows {
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
        let plot = plot("t".into(), ["AUC", "DP"], &[row]).unwrap();
        let svg = plot.svg();
        assert!(
            svg.contains("+0.050 [+0.010 +0.090]")
                && svg.contains("p&lt;0.001")
                && svg.contains("p 0.500")
        );
        assert_eq!(plot.table[1][..4], ["other", "3", "0.050000", "0.010000"]);
    }
}
