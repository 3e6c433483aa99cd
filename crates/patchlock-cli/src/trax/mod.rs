//! The tracker as a TraX server: it greets, takes requests line by line, and answers each with a state a target.

mod requests;
mod targets;

use std::fmt;
use std::io::{self, BufRead, Write};

use anyhow::Result;
use patchlock_eval::trax::image;
use patchlock_eval::trax::message::Message;
use patchlock_eval::trax::region::{POLYGON, RECTANGLE};

use crate::complaint::failed;
use requests::{Request, Requests};
pub use targets::Targets;

/// What the tracker is, for lists of trackers.
const DESCRIPTION: &str = "Visual object tracker by structural local sparse appearance";

/// How client and server speak.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Protocol {
    /// One target; `initialize` has image and region.
    Three,
    /// Many targets, that may come with any frame; `initialize` has the region, `frame` the image.
    Four,
}

/// Answers until the client quits or leaves.
///
/// # Errors
/// What is wrong with a request, after the client was told the same as the reason of a `quit`.
pub fn serve(
    input: impl BufRead,
    mut output: impl Write,
    protocol: Protocol,
    mut targets: Targets,
) -> Result<()> {
    let mut requests = Requests::new(input, protocol);
    if !sent(&mut output, [hello(protocol)])? {
        return Ok(());
    }
    loop {
        let states = match requests.next() {
            Ok(Request::Look { anew, begin, image }) => {
                if anew {
                    targets.forget()?;
                }
                image.picture().and_then(|picture| targets.look(&picture, begin))
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

/// What the client learns first.
fn hello(protocol: Protocol) -> Message {
    let list = |items: &[&str]| items.iter().map(|item| format!("{item};")).collect::<String>();
    let hello = Message::new("hello", &[])
        .with("trax.version", protocol)
        .with("trax.name", "Patchlock")
        .with("trax.identifier", "patchlock")
        .with("trax.description", DESCRIPTION)
        .with("trax.family", "sparse appearance")
        .with("trax.image", list(&image::FORMATS))
        .with("trax.region", list(&[RECTANGLE, POLYGON]))
        .with("trax.channels", list(&["color"]))
        .with("patchlock.version", env!("CARGO_PKG_VERSION"));
    match protocol {
        Protocol::Three => hello,
        Protocol::Four => hello.with("trax.multiobject", 1),
    }
}

/// Sends messages; `false` where the client is gone, which is no error.
fn sent(output: &mut impl Write, messages: impl IntoIterator<Item = Message>) -> Result<bool> {
    let lines: String = messages.into_iter().map(|message| message.to_string()).collect();
    match output.write_all(lines.as_bytes()).and_then(|()| output.flush()) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(false),
        Err(error) => Err(failed(format!("cannot write to the client: {error}")).into()),
    }
}

/// The number that the protocol gives itself.
impl fmt::Display for Protocol {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Three => "3",
            Self::Four => "4",
        })
    }
}
