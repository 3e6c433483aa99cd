//! Converts Rust errors to the usual Python exceptions.

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
    let text = keywords(&text);
    if error.is_misuse() { PyValueError::new_err(text) } else { PyOSError::new_err(text) }
}

/// Writes the options of the command line as keyword arguments: `--start 99` becomes `start=99`.
fn keywords(text: &str) -> String {
    let mut words: Vec<String> = Vec::new();
    let mut pending = false;
    for word in text.split(' ') {
        let is_value = pending && word.starts_with(|c: char| c.is_ascii_digit());
        pending = false;
        let (bracket, rest) = word.strip_prefix('(').map_or(("", word), |rest| ("(", rest));
        match rest.strip_prefix("--").filter(|name| name.starts_with(char::is_lowercase)) {
            Some(name) => {
                pending = name.ends_with(char::is_lowercase);
                words.push(bracket.to_owned() + &name.replace('-', "_"));
            }
            None => match words.last_mut() {
                Some(name) if is_value => *name += &format!("={word}"),
                _ => words.push(word.to_owned()),
            },
        }
    }
    words.join(" ")
}

/// An error of a frame source, with its advice.
pub fn of_media(error: patchlock_media::Error) -> PyErr {
    of_eval(error.into())
}
