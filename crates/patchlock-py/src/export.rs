//! Exports tracks to the formats of other tools, with the same code as the command `patchlock export`.

use std::path::PathBuf;

use patchlock::BoundingBox;
use patchlock_track::export::{
    Entry, ExportSummary, Format, KeyFrames, Options, Selection, Track, write,
};
use pyo3::exceptions::{PyOSError, PyUserWarning, PyValueError};
use pyo3::prelude::*;

use crate::advice;
use crate::estimate::to_status;

/// One target in one frame: frame, id, box, score, corners, status.
type Row = (usize, u64, [f64; 4], f64, [[f64; 2]; 4], String);

/// Where a track comes from.
#[derive(FromPyObject)]
pub enum Source {
    Rows(Vec<Row>),
    File(PathBuf),
}

/// One status, or several with commas between them or as a list.
#[derive(FromPyObject)]
pub enum Statuses {
    Text(String),
    List(Vec<String>),
}

/// The choice of boxes and of key frames.
pub fn choice(
    status: Option<Statuses>,
    min_score: Option<f64>,
    every: usize,
    key_frames: f64,
) -> Result<(Selection, KeyFrames), patchlock_track::Error> {
    let text = status.map(|status| match status {
        Statuses::Text(text) => text,
        Statuses::List(list) => list.join(","),
    });
    let status = text.as_deref().map(Selection::statuses).transpose()?;
    Ok((Selection { status, min_score, every }, KeyFrames::of(key_frames)?))
}

/// Warns of boxes that are left out although the caller has not chosen the statuses. The caller is
/// so many frames of Python up.
pub fn warn(
    py: Python<'_>,
    selection: &Selection,
    written: &ExportSummary,
    level: i32,
) -> PyResult<()> {
    let by_status: usize = written.boxes.left_by_status.iter().sum();
    if selection.status.is_some() || by_status == 0 {
        return Ok(());
    }
    let text = format!(
        "{}. Give status to choose the boxes, such as status=\"tracked,uncertain\"",
        written.boxes.remarks().join("; ")
    );
    warn_of(py, &text, level)
}

/// Warns the caller, who is so many frames of Python up.
pub fn warn_of(py: Python<'_>, text: &str, level: i32) -> PyResult<()> {
    PyErr::warn(py, &py.get_type::<PyUserWarning>(), &std::ffi::CString::new(text)?, level)
}

/// The names of all formats, each with what it writes.
#[pyfunction]
pub fn _export_formats() -> Vec<(&'static str, &'static str)> {
    Format::all(false).map(|format| (format.name, format.content)).collect()
}

/// Writes a track in another format; returns the number of files written.
#[pyfunction]
#[pyo3(name = "_export")]
#[expect(clippy::too_many_arguments, reason = "Python calls it with keywords")]
pub fn export(
    py: Python<'_>,
    track: Source,
    format: &str,
    out: PathBuf,
    size: Option<(usize, usize)>,
    images: Option<PathBuf>,
    label: String,
    name: String,
    status: Option<Statuses>,
    min_score: Option<f64>,
    every: usize,
    key_frames: f64,
    overwrite: bool,
) -> PyResult<usize> {
    let format = Format::named(format, false).map_err(to_python)?;
    let (selection, key_frames) =
        choice(status, min_score, every, key_frames).map_err(to_python)?;
    let options =
        Options { label, size, images, selection, key_frames, ..Options::new(format, name) };
    let written = py.detach(|| {
        let track = match track {
            Source::File(path) => Track::read(&path),
            Source::Rows(rows) => Track::new(rows.into_iter().map(entry).collect::<PyResult<_>>()?),
        };
        track.and_then(|track| write(&track, &options, &out, overwrite)).map_err(to_python)
    })?;
    warn(py, &options.selection, &written, 2)?;
    Ok(written.files)
}

fn entry((frame, id, [x, y, w, h], score, corners, status): Row) -> PyResult<Entry> {
    let (bbox, status) = (Some(BoundingBox { x, y, w, h }), Some(to_status(&status)?));
    let (score, corners) = (Some(score), Some(corners));
    Ok(Entry { frame, id, bbox, score, corners, status, ..Entry::default() })
}

/// File system errors become `OSError`, all others `ValueError`.
fn to_python(error: patchlock_track::Error) -> PyErr {
    use patchlock_track::Error;
    let text = advice::track(&error);
    match error {
        Error::Read(..) | Error::Write(..) | Error::Frame(..) => PyOSError::new_err(text),
        _ => PyValueError::new_err(text),
    }
}
