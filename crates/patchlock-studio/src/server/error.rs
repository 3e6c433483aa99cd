//! Why a server does not start, or does not end in order.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;

use crate::project;

/// Why a server cannot start.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The address is taken or not of this machine.
    #[error("cannot listen on {address}: {reason}")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// The reason given by the system.
        reason: std::io::Error,
    },
    /// The system gives no random numbers or threads.
    #[error("cannot start the server: {0}")]
    Start(String),
    /// The folder for projects cannot be made.
    #[error("cannot make the folder {}: {reason}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// The reason given by the system.
        reason: std::io::Error,
    },
    /// The only video or its project cannot be opened.
    #[error(transparent)]
    Clip(Arc<project::Error>),
    /// The program ends, and the last changes of these projects could not be written.
    #[error("the last changes are lost: {}", shown(.0))]
    Unsaved(Vec<project::Error>),
}

/// All errors in one line.
fn shown(errors: &[project::Error]) -> String {
    errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
}
