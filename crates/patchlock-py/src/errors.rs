//! Errors of the Rust side as the Python exceptions that one expects.

use patchlock::Error;
use pyo3::exceptions::{PyOSError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;

/// An error of the tracker: a value that is not allowed, or a call at the wrong time.
pub fn of_tracker(error: Error) -> PyErr {
    match error {
        Error::NotInitialised => {
            PyRuntimeError::new_err("the tracker has no target yet: call init(frame, box) first")
        }
        error => PyValueError::new_err(error.to_string()),
    }
}

/// An error of the benchmark, with its advice.
pub fn of_eval(error: patchlock_eval::Error) -> PyErr {
    let text = match error.advice() {
        Some(advice) => format!("{error} ({advice})"),
        None => error.to_string(),
    };
    if error.is_misuse() { PyValueError::new_err(text) } else { PyOSError::new_err(text) }
}

/// An error of a source of frames, with its advice.
pub fn of_media(error: patchlock_media::Error) -> PyErr {
    of_eval(error.into())
}
