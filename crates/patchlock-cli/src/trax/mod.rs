//! The tracker as a TraX server: sends a greeting, reads requests line by line, and answers each
//! with one state per target.

mod requests;
mod targets;

use std::fmt;
use std::io::{self, BufRead, Write};

use anyhow::Result;
use patchlock::{MethodInfo, NetworkUse};
use patchlock_bench::trax::image;
use patchlock_bench::trax::message::Message;
use patchlock_bench::trax::region::{POLYGON, RECTANGLE};

use patchlock_track::UsedNetwork;

use crate::failure::failed;
use requests::{Request, Requests};
pub use targets::Targets;

/// The family of the tracker and its description, for lists of trackers.
fn known_as(info: &MethodInfo, network: Option<UsedNetwork>) -> (String, &'static str) {
    let family = match (info.network, network) {
        (NetworkUse::Required, Some(network)) => network.to_string(),
        (_, Some(network)) => format!("{}, {network}", info.family),
        (_, None) => info.family.to_owned(),
    };
    (family, info.title)
}

/// Supported versions of the TraX protocol.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Protocol {
    /// One target; `initialize` has image and region.
    Three,
    /// Many targets, added at any frame; `initialize` has the region, `frame` the image.
    Four,
}

/// Answers requests until the client quits or closes the connection.
///
/// # Errors
/// An invalid request. The client receives the same text as the reason of a `quit`.
pub fn serve(
    input: impl BufRead,
    mut output: impl Write,
    protocol: Protocol,
    mut targets: Targets,
) -> Result<()> {
    let mut requests = Requests::new(input, protocol);
    if !sent(&mut output, [hello(protocol, known_as(targets.method().info(), targets.network()))])?
    {
        return Ok(());
    }
    loop {
        let states = match requests.next() {
            Ok(Request::Frame { reset, begin, image }) => {
                if reset {
                    targets.forget()?;
                }
                image.picture().and_then(|picture| targets.track(&picture, begin))
            }
            Ok(Request::Quit) => return Ok(()),
            Err(reason) => Err(reason),
        };
        match states {
            Ok(states) => {
                if !sent(&mut output, states)? {
                    return Ok(());
                }
            }
            Err(reason) => {
                sent(&mut output, [Message::new("quit", &[]).with("trax.reason", &reason)])?;
                return Err(failed(reason).into());
            }
        }
    }
}

/// The greeting, which lists what the server supports.
fn hello(protocol: Protocol, (family, description): (String, &str)) -> Message {
    let list = |items: &[&str]| items.iter().map(|item| format!("{item};")).collect::<String>();
    let hello = Message::new("hello", &[])
        .with("trax.version", protocol)
        .with("trax.name", "Patchlock")
        .with("trax.identifier", "patchlock")
        .with("trax.description", description)
        .with("trax.family", family)
        .with("trax.image", list(&image::FORMATS))
        .with("trax.region", list(&[RECTANGLE, POLYGON]))
        .with("trax.channels", list(&["color"]))
        .with("patchlock.version", env!("CARGO_PKG_VERSION"));
    match protocol {
        Protocol::Three => hello,
        Protocol::Four => hello.with("trax.multiobject", 1),
    }
}

/// Sends messages; returns `false` if the client has closed the connection, which is not an error.
fn sent(output: &mut impl Write, messages: impl IntoIterator<Item = Message>) -> Result<bool> {
    let lines: String = messages.into_iter().map(|message| message.to_string()).collect();
    match output.write_all(lines.as_bytes()).and_then(|()| output.flush()) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(false),
        Err(error) => Err(failed(format!("cannot write to the client: {error}")).into()),
    }
}

/// The version number in messages.
impl fmt::Display for Protocol {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Three => "3",
            Self::Four => "4",
        })
    }
}
