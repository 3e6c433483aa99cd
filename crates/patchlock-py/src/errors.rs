//! Converts Rust errors to the usual Python exceptions.

use patchlock::Error;
use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;

/// An error of the tracker: a value that is not allowed.
pub fn of_tracker(error: Error) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// An error of a session, a setting or an export, with its advice.
pub fn of_track(error: patchlock_track::Error) -> PyErr {
    with_advice(&error, error.advice(), error.is_misuse())
}

/// An error of the benchmark, with its advice.
pub fn of_bench(error: patchlock_bench::Error) -> PyErr {
    with_advice(&error, error.advice(), error.is_misuse())
}

fn with_advice(error: &dyn std::error::Error, advice: Option<String>, is_misuse: bool) -> PyErr {
    let text = match advice {
        Some(advice) => format!("{error} ({advice})"),
        None => error.to_string(),
    };
    let text = keywords(&text);
    if is_misuse { PyValueError::new_err(text) } else { PyOSError::new_err(text) }
}

/// Command line options in messages, and the keyword arguments that correspond to them.
const KEYWORDS: [(&str, &str); 9] = [
    ("attributes", "attributes"),
    ("cmd", "command"),
    ("end", "end"),
    ("name", "name"),
    ("out", "out"),
    ("reverse", "reverse"),
    ("sequences", "sequences"),
    ("start", "start"),
    ("stride", "stride"),
];

/// Replaces command line options by keyword arguments: `--start 99` becomes `start=99`.
fn keywords(text: &str) -> String {
    let mut words: Vec<String> = Vec::new();
    let mut after_keyword = false;
    for word in text.split(' ') {
        let is_value = after_keyword && word.starts_with(|c: char| c.is_ascii_digit());
        after_keyword = false;
        let keyword = KEYWORDS.iter().find_map(|(option, keyword)| {
            let (before, after) = word.split_once("--")?;
            let punctuation = after.strip_prefix(option)?;
            let is_whole = before.is_empty() || before == "(";
            (is_whole && !punctuation.starts_with(|c: char| c.is_alphanumeric() || c == '-'))
                .then(|| (format!("{before}{keyword}{punctuation}"), punctuation.is_empty()))
        });
        match (keyword, words.last_mut()) {
            (Some((replaced, ends)), _) => {
                after_keyword = ends;
                words.push(replaced);
            }
            (None, Some(keyword)) if is_value => *keyword += &format!("={word}"),
            (None, _) => words.push(word.to_owned()),
        }
    }
    words.join(" ")
}

/// An error of a frame source, with its advice.
pub fn of_media(error: patchlock_media::Error) -> PyErr {
    of_track(error.into())
}
