//! The command `patchlock`: the same code as the binary.

use std::ffi::OsString;

use pyo3::prelude::*;

/// Runs the command with these arguments, program name first; returns the exit code.
#[pyfunction]
pub fn run(py: Python<'_>, args: Vec<OsString>) -> u8 {
    py.detach(|| patchlock_cli::run(args))
}
