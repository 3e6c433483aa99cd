//! The `patchlock` command. All code is in the library part of this crate.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(patchlock_cli::run_as_program(std::env::args_os()))
}
