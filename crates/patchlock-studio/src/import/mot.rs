//! MOTChallenge: one box per line, counted from 1.

use patchlock::{BoundingBox, Status};

use super::{ImportBuilder, Outcome, Row};

/// The columns of ground truth, which has a class and the visible share; results have ten.
const TRUTH: usize = 9;

pub fn read(text: &str, found: &mut ImportBuilder<'_>) -> Outcome {
    for (k, line) in text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
        row(line)
            .and_then(|row| found.add(&row))
            .map_err(|reason| format!("line {}: {reason}", k + 1))?;
    }
    Ok(())
}

fn row(line: &str) -> Outcome<Row> {
    let cells: Vec<&str> = line.split(',').map(str::trim).collect();
    ensure!(
        cells.len() >= 6,
        "there are {} columns; at least six are needed: frame,id,left,top,width,height",
        cells.len()
    );
    let number = |k: usize| {
        let cell = cells[k];
        cell.parse::<f64>().map_err(|_| format!("column {} is {cell:?}, not a number", k + 1))
    };
    let frame = number(0)?;
    if frame < 1.0 || frame.fract() != 0.0 {
        return Err(format!("the frame is {frame}; frames count from 1"));
    }
    let confidence = if cells.len() > 6 { Some(number(6)?) } else { None };
    let (class, visible) = match cells.len() {
        TRUTH => (Some(number(7)?), Some(number(8)?)),
        _ => (None, None),
    };
    let bbox =
        BoundingBox { x: number(2)? - 1.0, y: number(3)? - 1.0, w: number(4)?, h: number(5)? };
    let share = |value: &f64| (0.0..=1.0).contains(value);
    Ok(Row {
        frame: frame as usize - 1,
        // Detections, which belong to no target, have the id -1.
        track: Some(cells[1].to_owned()).filter(|id| id != "-1"),
        label: class.filter(|class| *class >= 0.0).map(|class| format!("class {class}")),
        bbox: Some(bbox),
        // Some trackers write other numbers, which say nothing here.
        score: confidence.filter(share),
        status: confidence.filter(|confidence| *confidence == 0.0).map(|_| Status::Lost),
        visible: visible.filter(share),
        ..Row::default()
    })
}
