//! Opens a page of this program in the browser.

use std::env;
use std::fmt::Display;
use std::io;
use std::process::{Command, Stdio};

use crate::failure::say;

/// Opens a page in the browser, or says that the user has to. This address of it works once.
pub fn show<E: Display>(address: Result<String, E>) {
    let address = address.map_err(|error| error.to_string());
    let opened = address.and_then(|address| open(&address).map_err(|error| error.to_string()));
    if let Err(reason) = opened {
        say(&format!("note: no browser was opened ({reason}): open the address yourself"));
    }
}

/// Asks the desktop to open an address. The messages of the desktop are not ours. The list of
/// processes shows the address to all users of the machine, so it must hold no token.
fn open(address: &str) -> io::Result<()> {
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

/// Says how a browser of the machine from which the user has logged in by ssh reaches a page of this
/// one, if the user has.
pub fn say_tunnel(port: u16) {
    let connection = env::var("SSH_CONNECTION").unwrap_or_default();
    let Some(host) = connection.split_whitespace().nth(2) else { return };
    let user = env::var("USER").map(|user| format!("{user}@")).unwrap_or_default();
    say(&format!(
        "note: for a browser on the machine from which you came, run there: \
         ssh -N -L {port}:localhost:{port} {user}{host}"
    ));
}
