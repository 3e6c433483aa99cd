//! Our own tables: of `patchlock track`, and of projects.

use std::collections::HashSet;

use patchlock::{BoundingBox, Status};
use patchlock_track::export::ATTRIBUTE;
use patchlock_track::text::of_cell;
use serde::Deserialize;

use super::{ImportBuilder, Outcome, Row};

/// The columns that are read. Cells may be empty.
#[derive(Deserialize)]
struct Line {
    frame: usize,
    id: Option<u64>,
    label: Option<String>,
    x: Option<f64>,
    y: Option<f64>,
    w: Option<f64>,
    h: Option<f64>,
    score: Option<f64>,
    status: Option<Status>,
    key: Option<bool>,
    occluded: Option<bool>,
    truncated: Option<bool>,
    hidden: Option<bool>,
    visible: Option<f64>,
    agreement: Option<f64>,
    frame_w: Option<usize>,
    frame_h: Option<usize>,
    outline: Option<String>,
}

/// Reads CSV, or JSON lines if the text begins with a brace.
pub fn read(text: &str, found: &mut ImportBuilder<'_>) -> Outcome {
    let mut begun = HashSet::new();
    let mut add = |number: usize, line: Line, values: Vec<(String, String)>| {
        let size = line.frame_w.zip(line.frame_h);
        found
            .check_size(size)
            .and_then(|()| line.row(&mut begun))
            .and_then(|row| found.add(&Row { values, ..row }))
            .map_err(|reason| format!("line {number}: {reason}"))
    };
    if text.trim_start().starts_with('{') {
        let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
        for (k, line) in lines {
            let line = serde_json::from_slice(line.as_bytes());
            add(k + 1, line.map_err(|error| format!("line {}: {error}", k + 1))?, Vec::new())?;
        }
        return Ok(());
    }
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text.as_bytes());
    let columns = reader.headers().map_err(|error| error.to_string())?;
    for name in ["frame", "x", "y", "w", "h"] {
        ensure!(columns.iter().any(|column| column == name), "there is no column {name}");
    }
    let columns = columns.clone();
    let mut record = csv::StringRecord::new();
    while reader.read_record(&mut record).map_err(|error| error.to_string())? {
        let number = record.position().map_or(0, csv::Position::line) as usize;
        let line = record.deserialize(Some(&columns));
        let mut line: Line = line.map_err(|error| format!("line {number}: {}", reason(&error)))?;
        line.label = line.label.map(|label| of_cell(&label).to_owned());
        let of_column = |(column, cell): (&str, &str)| {
            Some((column.strip_prefix(ATTRIBUTE)?.to_owned(), of_cell(cell).to_owned()))
        };
        let values = columns.iter().zip(&record).filter_map(of_column).collect();
        add(number, line, values)?;
    }
    found.forget_empty();
    Ok(())
}

/// The reason of an error in a record.
fn reason(error: &csv::Error) -> String {
    match error.kind() {
        csv::ErrorKind::Deserialize { err, .. } => err.to_string(),
        _ => error.to_string(),
    }
}

impl Line {
    /// The row. `begun` has the ids of the targets that had a box already.
    fn row(self, begun: &mut HashSet<u64>) -> Outcome<Row> {
        let bbox = match (self.x, self.y, self.w, self.h) {
            (Some(x), Some(y), Some(w), Some(h)) => Some(BoundingBox { x, y, w, h }),
            (None, None, None, None) => None,
            _ => return Err("the box is incomplete: give all of x, y, w and h, or none".to_owned()),
        };
        let id = self.id.unwrap_or(1);
        // A tracker begins with a box that somebody has drawn.
        let first =
            bbox.is_some() && begun.insert(id) && self.score.is_none_or(|score| score == 1.0);
        let hidden = self.hidden.unwrap_or(false);
        ensure!(!hidden || bbox.is_none(), "the target is hidden and has a box");
        let outline = self.outline.filter(|text| !text.is_empty());
        Ok(Row {
            outline: outline.map(|text| text.parse()).transpose()?,
            frame: self.frame,
            track: Some(id.to_string()),
            label: self.label.filter(|label| !label.is_empty()),
            bbox,
            hidden,
            key: self.key.or(first.then_some(true)),
            occluded: self.occluded.unwrap_or(false),
            truncated: self.truncated.unwrap_or(false),
            score: self.score,
            status: self.status,
            visible: self.visible,
            agreement: self.agreement,
            values: Vec::new(),
        })
    }
}
