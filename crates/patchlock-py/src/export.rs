//! Exports tracks to the formats of other tools, with the same code as the command `patchlock export`.

use std::path::PathBuf;

use patchlock::BoundingBox;
use patchlock_media::Limits;
use patchlock_track::export::{Entry, Format, Options, Track, write};
use pyo3::exceptions::{PyOSError, PyValueError};
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
    key_frames: usize,
    overwrite: bool,
) -> PyResult<usize> {
    let format = Format::named(format).map_err(|error| to_python(&error))?;
    let limits = Limits::default();
    let follow_links = false;
    let labels = Vec::new();
    let options =
        Options { format, name, label, labels, size, images, follow_links, key_frames, limits };
    let track = match track {
        Source::File(path) => Err(path),
        Source::Rows(rows) => Ok(rows.into_iter().map(entry).collect::<PyResult<Vec<_>>>()?),
    };
    let written = py.detach(|| {
        let track = match track {
            Err(path) => Track::read(&path),
            Ok(entries) => Track::new(entries),
        };
        write(&track?, &options, &out, overwrite)
    });
    written.map_err(|error| to_python(&error))
}

fn entry((frame, id, [x, y, w, h], score, corners, status): Row) -> PyResult<Entry> {
    let (bbox, status) = (Some(BoundingBox { x, y, w, h }), Some(to_status(&status)?));
    Ok(Entry { frame, id, bbox, score: Some(score), corners: Some(corners), status, said: None })
}

/// File system errors become `OSError`, all others `ValueError`.
fn to_python(error: &patchlock_track::Error) -> PyErr {
    use patchlock_track::Error;
    match error {
        Error::Read { .. } | Error::Write { .. } | Error::Frame { .. } => {
            PyOSError::new_err(advice::track(error))
        }
        _ => PyValueError::new_err(advice::track(error)),
    }
}
