//! Opens a page of this program in the browser.

use std::env;
use std::io;
use std::process::{Command, Stdio};

/// Asks the desktop to open an address. The messages of the desktop are not ours. The list of
/// processes shows the address to all users of the machine, so it must hold no token.
pub fn open(address: &str) -> io::Result<()> {
    let mut command = if cfg!(target_os = "macos") {
        Command::new("open")
    } else if cfg!(windows) {
        Command::new("explorer")
    } else {
        Command::new("xdg-open")
    };
    command.arg(address).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    let mut child = command.spawn()?;
    // Nothing is waited for, but the process must be collected.
    std::thread::spawn(move || child.wait());
    Ok(())
}

/// How a browser of the machine from which the user has logged in by ssh reaches a page of this one,
/// if the user has.
pub fn tunnel(port: u16) -> Option<String> {
    let connection = env::var("SSH_CONNECTION").ok()?;
    let host = connection.split_whitespace().nth(2)?;
    let user = env::var("USER").map(|user| format!("{user}@")).unwrap_or_default();
    Some(format!(
        "note: for a browser on the machine from which you came, run there: \
         ssh -N -L {port}:localhost:{port} {user}{host}"
    ))
}
