//! Ctrl-C: the first one asks the work to end in order, the second one ends the process at once.

use std::io::IsTerminal;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context, Result};

use crate::complaint::Exit;
use crate::output::unfinished::{self, Abandoned};

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// Starts to listen, once for the whole program.
pub fn listen() -> Result<()> {
    ctrlc::set_handler(|| {
        if REQUESTED.swap(true, Ordering::SeqCst) {
            end_at_once();
        }
    })
    .context("cannot listen for Ctrl-C")
}

/// Whether the user asked for the end.
pub fn requested() -> bool {
    REQUESTED.load(Ordering::SeqCst)
}

/// Ends the process without waiting for the work, but leaves no half files behind.
fn end_at_once() -> ! {
    let line = last_line(&unfinished::abandon());
    // Below the progress bar, which nobody takes away any more.
    let gap = if std::io::stderr().is_terminal() { "\n" } else { "" };
    eprintln!("{gap}{line}");
    std::process::exit(Exit::Interrupted as i32);
}

fn last_line(files: &Abandoned) -> String {
    let names = |files: &[PathBuf]| {
        files.iter().map(|file| file.display().to_string()).collect::<Vec<_>>().join(", ")
    };
    let mut line = "ended at once by a second Ctrl-C".to_string();
    if !files.kept.is_empty() {
        line += &format!("; what was tracked is in {}", names(&files.kept));
    }
    if !files.lost.is_empty() {
        line += &format!("; not written: {}", names(&files.lost));
    }
    line
}
