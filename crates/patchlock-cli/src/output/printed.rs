//! Printing to standard output.

use std::io::{self, Write};
use std::path::Path;

use patchlock_track::names::plain;

use super::pending::cannot_write;
use crate::failure::Failure;

/// Prints lines of text. Names in them cannot command the terminal. It is not an error if the
/// reader closes the pipe early, as `head` does.
pub fn print(text: &str) -> Result<(), Failure> {
    let lines: Vec<String> = text.split('\n').map(plain).collect();
    print_as_it_is(&lines.join("\n"))
}

/// Prints a text that has no names in it, as [`print()`] does.
pub fn print_as_it_is(text: &str) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(cannot_print(&error)),
        _ => Ok(()),
    }
}

/// The error for a failed write to standard output.
pub fn cannot_print(error: &io::Error) -> Failure {
    cannot_write("to standard output", error)
}

/// A text in lines of at most `width` characters, of which all but the first begin with `indent`.
/// The width is without the indent.
pub fn wrapped(text: &str, width: usize, indent: &str) -> String {
    let (mut lines, mut column) = (String::new(), 0);
    for word in text.split_whitespace() {
        let length = word.chars().count();
        if column > 0 && column + 1 + length > width {
            lines.extend(["\n", indent]);
            column = 0;
        } else if column > 0 {
            lines.push(' ');
            column += 1;
        }
        lines += word;
        column += length;
    }
    lines
}

/// A path, quoted for use in a shell command.
pub fn quoted(path: &Path) -> String {
    shell_words::quote(&path.to_string_lossy()).into_owned()
}
