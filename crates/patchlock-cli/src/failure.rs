//! Errors shown to the user: one line that says what failed and where, a hint what to do, an exit
//! code.

use std::fmt;
use std::io::{self, Write as _};

use patchlock_track::names::plain;

use crate::advice;

/// Exit codes of the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Exit {
    /// The command line is valid, but the work failed.
    Failed = 1,
    /// The command line is invalid, or does not fit the source.
    Usage = 2,
    /// Stopped by Ctrl-C; the files are complete up to that point.
    Interrupted = 130,
}

impl Exit {
    /// The exit code of an error of a library.
    fn of(is_misuse: bool) -> Self {
        if is_misuse { Self::Usage } else { Self::Failed }
    }
}

/// An error with its exit code and, usually, advice.
#[derive(Debug)]
pub struct Failure {
    /// The exit code of the program.
    pub exit: Exit,
    message: String,
    hint: Option<String>,
}

impl Failure {
    /// Adds one line of advice.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }

    /// The failure that an error is or was caused by.
    pub fn of(error: &anyhow::Error) -> Option<&Self> {
        error.chain().find_map(|cause| cause.downcast_ref())
    }

    /// The advice, if there is any.
    pub fn advice(&self) -> Option<&str> {
        self.hint.as_deref()
    }
}

/// The work failed: exit code 1.
pub fn failed(message: impl Into<String>) -> Failure {
    Failure { exit: Exit::Failed, message: message.into(), hint: None }
}

/// The command line is invalid: exit code 2.
pub fn usage(message: impl Into<String>) -> Failure {
    Failure { exit: Exit::Usage, message: message.into(), hint: None }
}

/// Ctrl-C: exit code 130.
pub fn interrupted(message: impl Into<String>) -> Failure {
    Failure { exit: Exit::Interrupted, message: message.into(), hint: None }
}

/// A name for use in a message; an empty one is shown as `""`.
pub fn named(name: &str) -> &str {
    if name.is_empty() { "\"\"" } else { name }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Failure {}

impl From<patchlock_track::Error> for Failure {
    fn from(error: patchlock_track::Error) -> Self {
        let (message, hint) = (advice::track_message(&error), advice::track_hint(&error));
        Self { exit: Exit::of(error.is_misuse()), message, hint }
    }
}

impl From<patchlock_bench::Error> for Failure {
    fn from(error: patchlock_bench::Error) -> Self {
        let (message, hint) = (advice::bench_message(&error), advice::bench_hint(&error));
        Self { exit: Exit::of(error.is_misuse()), message, hint }
    }
}

impl From<patchlock_studio::project::Error> for Failure {
    fn from(error: patchlock_studio::project::Error) -> Self {
        let (message, hint) = (advice::project_message(&error), advice::project_hint(&error));
        Self { exit: Exit::of(error.is_misuse()), message, hint }
    }
}

impl From<patchlock_media::Error> for Failure {
    fn from(error: patchlock_media::Error) -> Self {
        patchlock_track::Error::from(error).into()
    }
}

/// Prints a line on standard error. Names and messages of others cannot command the terminal.
pub fn say(line: &str) {
    // Where standard error is closed or on a full disk, there is no way to report it.
    let _ = writeln!(io::stderr(), "{}", plain(line));
}

/// How the operating system says that the program has as many open files as it may have.
const TOO_MANY_FILES: &str = "(os error 24)";
/// What helps against it.
const MORE_FILES: &str =
    "the limit of open files is too low: ulimit -n 1024 raises it in this shell";

/// Prints an error as `error: ...` and `hint: ...`, and returns its exit code.
pub fn report(error: &anyhow::Error) -> Exit {
    let mut text = format!("{error:#}");
    // Messages of libraries may span several lines; join them into one.
    text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    let failure = Failure::of(error);
    match failure {
        Some(failure) if failure.exit == Exit::Interrupted => say(&text),
        _ => say(&format!("error: {text}")),
    }
    let files = cfg!(unix) && text.contains(TOO_MANY_FILES);
    let hint = failure.and_then(Failure::advice).filter(|_| !files);
    if let Some(hint) = hint.or(files.then_some(MORE_FILES)) {
        say(&format!("hint: {hint}"));
    }
    failure.map_or(Exit::Failed, |failure| failure.exit)
}
