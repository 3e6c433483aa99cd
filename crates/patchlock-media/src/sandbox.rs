//! Sources whose decoders run in a process of their own, which the system keeps to the file: see
//! [`Helper`].

#[cfg(target_os = "linux")]
mod client;
#[cfg(target_os = "linux")]
pub mod serve;
#[cfg(target_os = "linux")]
mod wire;

use std::ffi::OsString;
use std::path::PathBuf;
use std::time::Duration;

#[cfg(target_os = "linux")]
pub use client::find;

use crate::limits;

/// Elsewhere, no helper is started.
#[cfg(not(target_os = "linux"))]
pub fn find(
    _: &std::ffi::OsStr,
    _: bool,
    _: crate::Limits,
) -> Option<Result<crate::find::OpenedSource, crate::Error>> {
    None
}

/// A program that decodes files of strangers for this one. It calls `serve`, which is there on Linux;
/// elsewhere, nothing starts it.
///
/// It is started for each file that is opened, and ends with it. It reads this file, programs and
/// libraries, changes one temporary folder, opens no connection and has limited memory, as far as
/// the kernel sees to that. If it cannot be started, files are decoded in this process.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Helper {
    /// The program. It needs no libraries but those of the system.
    pub program: PathBuf,
    /// Its arguments.
    pub arguments: Vec<OsString>,
    /// How long it may be silent before it is stopped.
    pub timeout: Duration,
}

impl Helper {
    /// A program with the usual time limit.
    pub fn new(
        program: impl Into<PathBuf>,
        arguments: impl IntoIterator<Item = impl Into<OsString>>,
    ) -> Self {
        let arguments = arguments.into_iter().map(Into::into).collect();
        Self { program: program.into(), arguments, timeout: limits::HELPER_SILENCE }
    }
}
