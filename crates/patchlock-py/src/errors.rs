//! Converts Rust errors to the usual Python exceptions.

use patchlock::Error;
use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;

use crate::advice;

/// An error of a value that needs no advice.
pub fn of_value(error: impl ToString) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// An object in a message.
pub fn shown(object: &Bound<'_, PyAny>) -> String {
    object.repr().map_or("this".to_owned(), |text| text.to_string())
}

/// An error of the tracker: a value that is not allowed.
pub fn of_tracker(error: Error) -> PyErr {
    PyValueError::new_err(advice::tracker(&error))
}

/// An error of a session, a setting or an export, with its advice.
pub fn of_track(error: patchlock_track::Error) -> PyErr {
    exception(advice::track(&error), error.is_misuse())
}

/// An error of the benchmark, with its advice.
pub fn of_bench(error: patchlock_bench::Error) -> PyErr {
    exception(advice::bench(&error), error.is_misuse())
}

/// An error of a frame source, with its advice.
pub fn of_media(error: patchlock_media::Error) -> PyErr {
    exception(advice::media(&error), error.is_misuse())
}

fn exception(text: String, is_misuse: bool) -> PyErr {
    if is_misuse { PyValueError::new_err(text) } else { PyOSError::new_err(text) }
}
