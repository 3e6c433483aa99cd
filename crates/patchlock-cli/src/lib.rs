//! The command line of Patchlock: frames in, tracks out. The tracker itself is the library
//! [`patchlock`].
//!
//! Data flow: [`patchlock_media`] decodes numbered pictures ahead of time, `run.rs` passes them to the
//! tracker, and each sink of [`output`] receives every tracked frame. `cmd` has one file per
//! subcommand. [`trax`] offers the tracker to other programs.

mod advice;
mod browser;
mod cmd;
pub mod failure;
mod helper;
mod interrupt;
pub mod output;
mod preview;
mod progress;
mod project;
mod run;
pub mod target;
pub mod targets;
pub mod trax;

use std::ffi::OsString;
use std::io::{self, Write};

use clap::Parser;

use patchlock_media::Helper;

/// Runs the whole program with this command line (program name first) and returns the exit code.
///
/// It does not exit the process, so that the Python package can call it. The only exception is a
/// second Ctrl-C.
pub fn run(args: impl IntoIterator<Item = OsString>) -> u8 {
    run_with(args.into_iter().collect(), None)
}

/// Does the same for a process that has no other task. Another process of the same program may
/// then decode the files of strangers.
pub fn run_as_program(args: impl IntoIterator<Item = OsString>) -> u8 {
    let args: Vec<OsString> = args.into_iter().collect();
    match helper::is_wanted(&args) {
        true => helper::run(),
        false => run_with(args, helper::itself()),
    }
}

fn run_with(args: Vec<OsString>, helper: Option<Helper>) -> u8 {
    patchlock_media::silence_decoders();
    let program = args.first().map_or("patchlock".into(), |name| name.to_string_lossy());
    let code = match cmd::Cli::try_parse_from(&args) {
        Ok(cli) => {
            let done = cli.run(&program, helper);
            done.map_or_else(|error| failure::report(&error) as u8, |()| 0)
        }
        Err(message) => {
            // If even this can't be printed, there is no way to report it.
            let _ = message.print();
            message.exit_code() as u8
        }
    };
    patchlock_media::stop_decoders();
    // Inside another process nothing else flushes the buffer. A closed pipe is not an error here.
    let _ = io::stdout().flush();
    code
}
