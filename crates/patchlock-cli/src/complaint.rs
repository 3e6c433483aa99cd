//! Errors as the user meets them: one line that says what and where, a hint that says what to do, an exit
//! code.

use std::fmt;

/// How a run ends, as the shell sees it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Exit {
    /// The command line was right, the work was not possible.
    Failed = 1,
    /// The command line is wrong in itself, or does not fit to the source.
    Usage = 2,
    /// Ended by Ctrl-C; what was tracked is in complete files.
    Interrupted = 130,
}

/// An error with the exit code it leads to and, mostly, advice.
#[derive(Debug)]
pub struct Complaint {
    /// The exit code of the program.
    pub exit: Exit,
    message: String,
    hint: Option<String>,
}

impl Complaint {
    /// Adds one line of advice.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }

    /// The advice, if there is any.
    pub fn advice(&self) -> Option<&str> {
        self.hint.as_deref()
    }
}

/// The work was not possible: exit code 1.
pub fn failed(message: impl Into<String>) -> Complaint {
    Complaint { exit: Exit::Failed, message: message.into(), hint: None }
}

/// The command line is wrong: exit code 2.
pub fn usage(message: impl Into<String>) -> Complaint {
    Complaint { exit: Exit::Usage, message: message.into(), hint: None }
}

/// Ctrl-C: exit code 130.
pub fn interrupted(message: impl Into<String>) -> Complaint {
    Complaint { exit: Exit::Interrupted, message: message.into(), hint: None }
}

/// A name as it can be seen in a message, also where it is empty.
pub fn named(name: &str) -> &str {
    if name.is_empty() { "\"\"" } else { name }
}

impl fmt::Display for Complaint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Complaint {}

impl From<patchlock_eval::Error> for Complaint {
    fn from(error: patchlock_eval::Error) -> Self {
        let exit = if error.is_misuse() { Exit::Usage } else { Exit::Failed };
        Self { exit, message: error.to_string(), hint: error.advice() }
    }
}

impl From<patchlock_eval::settings::SettingsError> for Complaint {
    fn from(error: patchlock_eval::settings::SettingsError) -> Self {
        patchlock_eval::Error::from(error).into()
    }
}

impl From<patchlock_media::Error> for Complaint {
    fn from(error: patchlock_media::Error) -> Self {
        patchlock_eval::Error::from(error).into()
    }
}

/// Prints an error as `error: ...` and `hint: ...`, and gives the exit code that belongs to it.
pub fn report(error: &anyhow::Error) -> Exit {
    let mut text = format!("{error:#}");
    // One line: what a library says over several lines is still one message.
    text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    let complaint = error.chain().find_map(|cause| cause.downcast_ref::<Complaint>());
    match complaint {
        Some(complaint) if complaint.exit == Exit::Interrupted => eprintln!("{text}"),
        _ => eprintln!("error: {text}"),
    }
    if let Some(hint) = complaint.and_then(Complaint::advice) {
        eprintln!("hint: {hint}");
    }
    complaint.map_or(Exit::Failed, |complaint| complaint.exit)
}
