//! What the verbs print on standard output.

use std::io::{self, Write};
use std::path::Path;

use super::pending::cannot_write;
use crate::complaint::Complaint;

/// Prints all of a text. Whoever reads it may leave early, as `head` does: that is no error.
pub fn print(text: &str) -> Result<(), Complaint> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(cannot_print(&error)),
        _ => Ok(()),
    }
}

/// The complaint about standard output.
pub fn cannot_print(error: &io::Error) -> Complaint {
    cannot_write("to standard output", error)
}

/// A path as it must stand in a command.
pub fn quoted(path: &Path) -> String {
    shell_words::quote(&path.to_string_lossy()).into_owned()
}
