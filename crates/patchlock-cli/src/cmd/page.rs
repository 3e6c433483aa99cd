//! The options of pages in the browser.

use clap::Args;
use patchlock_studio::server::{AllowedHost, AllowedHosts};

/// How a page is served and opened.
#[derive(Debug, Args)]
pub struct PageArgs {
    /// Port of the page; with 0 the system chooses a free one
    #[arg(long, value_name = "0..65535", default_value = "0")]
    pub port: u16,

    /// Print the address of the page without opening a browser
    #[arg(long)]
    pub no_open: bool,

    /// Also answer for this host, at which a proxy serves the page; may be repeated. Without a port,
    /// any port of it. The token stays necessary. docs/remote.md shows ssh, containers, nginx and
    /// Jupyter
    #[arg(long = "allow-host", value_name = "NAME[:PORT]")]
    allowed: Vec<AllowedHost>,
}

impl PageArgs {
    /// The hosts, with the advice where another one is asked for.
    pub fn hosts(&self) -> AllowedHosts {
        let advice = "start the program with --allow-host and the name of that host";
        AllowedHosts { allowed: self.allowed.clone(), advice }
    }
}
