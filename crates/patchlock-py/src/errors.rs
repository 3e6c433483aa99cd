//! Errors of the Rust side as the Python exceptions that one expects.

use patchlock::Error;
use patchlock_cli::complaint::{Complaint, Exit};
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

/// An error of a source of frames, with its advice.
pub fn of_source(error: &anyhow::Error) -> PyErr {
    let complaint = error.chain().find_map(|cause| cause.downcast_ref::<Complaint>());
    let text = match complaint.and_then(Complaint::advice) {
        Some(advice) => format!("{error:#} ({advice})"),
        None => format!("{error:#}"),
    };
    match complaint {
        Some(complaint) if complaint.exit == Exit::Usage => PyValueError::new_err(text),
        _ => PyOSError::new_err(text),
    }
}
