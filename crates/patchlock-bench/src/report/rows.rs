//! The tables of the page: one row per tracker.

use serde::Serialize;

use super::comparison::{ComparedTracker, Comparison};
use crate::score::{CalibrationSummary, Measure, StatusSummary};

#[derive(Serialize)]
pub struct Row<'a> {
    rank: usize,
    name: &'a str,
    about: bool,
    swatch: String,
    cells: Vec<Cell>,
}

/// A cell: the value to sort by, and the text to show.
#[derive(Serialize)]
struct Cell {
    value: Option<f64>,
    text: String,
    spread: Option<String>,
    best: bool,
    #[serde(skip)]
    better: BestValue,
}

/// Which values of a column are better.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum BestValue {
    Larger,
    Smaller,
    Neither,
}

impl Cell {
    fn of(measure: Option<Measure>, digits: usize, better: BestValue) -> Self {
        Self {
            value: measure.map(|m| m.mean),
            text: measure.map_or("-".to_string(), |m| format!("{:.digits$}", m.mean)),
            spread: measure.and_then(|m| m.sd).map(|sd| format!("{sd:.digits$}")),
            best: false,
            better,
        }
    }
}

/// The table of accuracy and speed.
pub fn accuracy<'a>(comparison: &'a Comparison) -> Vec<Row<'a>> {
    rows(comparison, |tracker| {
        let all = &tracker.overall;
        let accuracy = [all.auc, all.dp20, all.success50, all.mean_overlap, all.norm_precision];
        let mut cells: Vec<Cell> =
            accuracy.into_iter().map(|m| Cell::of(Some(m), 3, BestValue::Larger)).collect();
        cells.push(Cell::of(Some(all.lost_share), 3, BestValue::Smaller));
        cells.push(Cell::of(all.overlap_not_lost, 3, BestValue::Larger));
        cells.push(Cell::of(all.fps, 1, BestValue::Larger));
        let seeds = Measure { mean: tracker.seeds.len() as f64, sd: None };
        cells.push(Cell::of(Some(seeds), 0, BestValue::Neither));
        Some(cells)
    })
}

/// The table of what trackers say of themselves, with the trackers of which it is known.
pub fn said<'a>(comparison: &'a Comparison) -> Vec<Row<'a>> {
    rows(comparison, |tracker| {
        let (status, score) = (&tracker.overall.status, &tracker.overall.calibration);
        if status.is_none() && score.is_none() {
            return None;
        }
        let status = |value: fn(&StatusSummary) -> Option<Measure>| status.as_ref().and_then(value);
        let score =
            |value: fn(&CalibrationSummary) -> Option<Measure>| score.as_ref().and_then(value);
        Some(vec![
            Cell::of(status(|s| s.precision), 3, BestValue::Larger),
            Cell::of(status(|s| s.recall), 3, BestValue::Larger),
            Cell::of(status(|s| s.false_lost), 3, BestValue::Smaller),
            Cell::of(status(|s| s.first_lost), 1, BestValue::Neither),
            Cell::of(status(|s| Some(s.losses)), 2, BestValue::Neither),
            Cell::of(status(|s| Some(s.recoveries)), 2, BestValue::Neither),
            Cell::of(score(|s| s.ece), 3, BestValue::Smaller),
            Cell::of(score(|s| s.auroc), 3, BestValue::Larger),
        ])
    })
}

/// The rows of the trackers that have cells, with the best values marked.
fn rows<'a>(
    comparison: &'a Comparison,
    cells: fn(&ComparedTracker) -> Option<Vec<Cell>>,
) -> Vec<Row<'a>> {
    let row = |(rank, tracker): (usize, &'a ComparedTracker)| {
        let line = tracker.style.line();
        Some(Row {
            rank: rank + 1,
            name: tracker.name,
            about: rank == comparison.about,
            swatch: format!("<line {line} x1=\"0\" x2=\"34\" y1=\"6\" y2=\"6\"/>"),
            cells: cells(tracker)?,
        })
    };
    let mut rows: Vec<Row> = comparison.trackers.iter().enumerate().filter_map(row).collect();
    for column in 0..rows.first().map_or(0, |row| row.cells.len()) {
        let values = rows.iter().filter_map(|row| row.cells[column].value);
        let best = match rows[0].cells[column].better {
            BestValue::Larger => values.max_by(f64::total_cmp),
            BestValue::Smaller => values.min_by(f64::total_cmp),
            BestValue::Neither => None,
        };
        for cell in rows.iter_mut().map(|row| &mut row.cells[column]) {
            cell.best = best.is_some() && cell.value == best;
        }
    }
    rows
}
