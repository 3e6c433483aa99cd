//! Opens a page of this program in the browser.

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
