//! Ctrl-C: the first requests a clean stop, the second exits immediately.

use std::io::IsTerminal;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context, Result};

use crate::failure::{Exit, say};
use crate::output::partial_files::{self, ExitCleanup};

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// Installs the handler, once for the whole process: Python may run several commands in one.
pub fn listen() -> Result<()> {
    let installed = ctrlc::set_handler(|| {
        if REQUESTED.swap(true, Ordering::SeqCst) {
            exit_now();
        }
    });
    match installed {
        Err(ctrlc::Error::MultipleHandlers) => Ok(()),
        installed => installed.context("cannot listen for Ctrl-C"),
    }
}

/// Whether the user has pressed Ctrl-C.
pub fn requested() -> bool {
    REQUESTED.load(Ordering::SeqCst)
}

/// Exits without waiting for the current frame, but leaves no partly written files.
fn exit_now() -> ! {
    patchlock_media::stop_decoders();
    let line = last_line(&partial_files::clean_up());
    // The progress bar is still on the terminal; print below it.
    if std::io::stderr().is_terminal() {
        say("");
    }
    say(&line);
    std::process::exit(Exit::Interrupted as i32);
}

fn last_line(files: &ExitCleanup) -> String {
    let names = |files: &[PathBuf]| {
        files.iter().map(|file| file.display().to_string()).collect::<Vec<_>>().join(", ")
    };
    let mut line = "stopped immediately by a second Ctrl-C".to_string();
    if !files.kept.is_empty() {
        line += &format!("; the frames tracked so far are in {}", names(&files.kept));
    }
    if !files.removed.is_empty() {
        line += &format!("; not written: {}", names(&files.removed));
    }
    line
}
