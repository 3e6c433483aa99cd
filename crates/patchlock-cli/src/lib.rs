//! The command line of Patchlock: frames in, tracks out.
//!
//! The way of the data: [`source`] gives pictures by number, a thread decodes them ahead, [`engine`] asks the tracker,
//! and each sink of [`output`] takes every tracked frame. [`cmd`] has one file a verb.

pub mod cmd;
pub mod colour;
pub mod complaint;
pub mod engine;
pub mod interrupt;
pub mod job;
pub mod output;
pub mod progress;
pub mod selection;
pub mod settings;
pub mod source;
pub mod target;

use std::process::ExitCode;

use clap::Parser;

/// The whole program: reads the command line, works, reports.
pub fn run() -> ExitCode {
    match cmd::Cli::parse().run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => ExitCode::from(complaint::report(&error) as u8),
    }
}
