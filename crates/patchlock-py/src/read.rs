//! Reads tables that `patchlock track` has saved, with the same code as exports.

use std::collections::HashMap;
use std::path::PathBuf;

use patchlock::{BoundingBox, Status};
use patchlock_track::Error;
use patchlock_track::export::{Entry, Track};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::errors;
use crate::estimate::Estimate;

/// The ids and estimates of a table, ordered by frame, then by id.
#[pyfunction]
#[pyo3(name = "_read_estimates")]
pub fn read_estimates(py: Python<'_>, file: PathBuf) -> PyResult<Vec<(u64, Estimate)>> {
    let shown = file.display();
    let extension = file.extension().map(|extension| extension.to_ascii_lowercase());
    match extension.as_ref().and_then(|extension| extension.to_str()) {
        Some("csv" | "jsonl") => {}
        Some("txt") => {
            return Err(PyValueError::new_err(format!(
                "{shown}: a .txt file has boxes only, without scores; numpy.loadtxt reads it, and its pixels \
                 count from 1"
            )));
        }
        _ => {
            return Err(PyValueError::new_err(format!(
                "{shown}: unknown extension; allowed: .csv, .jsonl"
            )));
        }
    }
    let track = py.detach(|| Track::read(&file)).map_err(|error| match error {
        Error::Export(reason) => PyValueError::new_err(format!("{shown}: {reason}")),
        // Its advice is for text without columns.
        error @ Error::Line(..) => errors::of_value(error),
        error => errors::of_track(error),
    })?;
    let mut last = HashMap::new();
    let mut estimates = Vec::with_capacity(track.entries().len());
    for entry in track.entries() {
        let found = estimate(entry, last.get(&entry.id));
        let found = found.map_err(|missing| {
            PyValueError::new_err(format!(
                "{shown}: target {} has no {missing} in frame {}; a table of patchlock track has a score and \
                 a status in each line",
                entry.id, entry.frame
            ))
        })?;
        // Before its first box, nothing is known of a target.
        if let Some(found) = found {
            last.insert(entry.id, found.clone());
            let ms = track.ms(entry.frame).unwrap_or(0.0);
            estimates.push((entry.id, Estimate::from_rust(found, entry.frame as u64, ms)));
        }
    }
    Ok(estimates)
}

/// The estimate of a line, with the last known box where it has none; or what the line lacks.
fn estimate(
    entry: &Entry,
    last: Option<&patchlock::Estimate>,
) -> Result<Option<patchlock::Estimate>, &'static str> {
    let (score, status) = (entry.score.ok_or("score")?, entry.status.ok_or("status")?);
    let place = match (entry.bbox, last) {
        (Some(bbox), _) => (bbox, entry.corners.unwrap_or_else(|| corners(&bbox))),
        (None, Some(last)) if status == Status::Lost => (last.bbox, last.corners),
        (None, _) if status == Status::Lost => return Ok(None),
        (None, _) => return Err("box"),
    };
    let (bbox, corners) = place;
    Ok(Some(patchlock::Estimate { bbox, corners, score, status, visibility: None }))
}

/// The corners of an upright box, which are points: pixel centres are at whole numbers.
fn corners(bbox: &BoundingBox) -> [[f64; 2]; 4] {
    let [left, top] = [bbox.x - 0.5, bbox.y - 0.5];
    let [right, bottom] = [left + bbox.w, top + bbox.h];
    [[left, top], [right, top], [right, bottom], [left, bottom]]
}
