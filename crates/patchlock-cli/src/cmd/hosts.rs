//! The option of pages that are read through a proxy.

use clap::Args;
use patchlock_studio::server::{AllowedHost, AllowedHosts};

/// The hosts under which a page is read.
#[derive(Debug, Args)]
pub struct HostArgs {
    /// Also answer for this host, at which a proxy serves the page; may be repeated. Without a port,
    /// any port of it. The token stays necessary. docs/remote.md shows ssh, containers, nginx and
    /// Jupyter
    #[arg(long = "allow-host", value_name = "NAME[:PORT]")]
    allowed: Vec<AllowedHost>,
}

impl HostArgs {
    /// The hosts, with the advice where another one is asked for.
    pub fn hosts(&self) -> AllowedHosts {
        let advice = "start the program with --allow-host and the name of that host";
        AllowedHosts { allowed: self.allowed.clone(), advice }
    }
}
