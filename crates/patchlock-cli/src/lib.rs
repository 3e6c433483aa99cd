//! The command line of Patchlock: frames in, tracks out.
//!
//! The way of the data: [`patchlock_media`] gives pictures by number and decodes them ahead, a
//! [`run`](mod@run) asks the tracker, and each sink of [`output`] takes every tracked frame. [`cmd`] has one
//! file a verb. [`trax`] is the same tracker for other programs.

pub mod cmd;
pub mod complaint;
pub mod interrupt;
pub mod output;
pub mod progress;
pub mod run;
pub mod target;
pub mod targets;
pub mod trax;

use std::ffi::OsString;
use std::io::{self, Write};

use clap::Parser;

/// The whole program: reads the command line (the program's name first), works, reports. Gives the exit code.
///
/// It does not end the process, so that the Python package can call it; only a second Ctrl-C does, see
/// [`interrupt`].
pub fn run(args: impl IntoIterator<Item = OsString>) -> u8 {
    let args: Vec<OsString> = args.into_iter().collect();
    let program = args.first().map_or("patchlock".into(), |name| name.to_string_lossy());
    let code = match cmd::Cli::try_parse_from(&args) {
        Ok(cli) => cli.run(&program).map_or_else(|error| complaint::report(&error) as u8, |()| 0),
        Err(message) => {
            // Nothing can be done where even that can't be printed.
            let _ = message.print();
            message.exit_code() as u8
        }
    };
    // Within another program nobody else does that. Who does not read it any more does not miss it.
    let _ = io::stdout().flush();
    code
}
