//! Where frames come from: a file, or a live source that the user has typed.

use std::ffi::OsStr;

use clap::Args;
use patchlock_media::live::{Address, LiveSource, Options};
use patchlock_media::{Feed, Limits, Order, Picture};

use crate::failure::{Failure, usage};
use crate::interrupt;

/// How live sources are read.
#[derive(Debug, Args)]
pub struct LiveArgs {
    /// Take the newest frame of standard input, as from a camera
    ///
    /// Those before it are left out. The stream may be of any format that ffmpeg knows.
    #[arg(long)]
    live: bool,

    /// Seconds to wait in all for a stream of the network that was lost
    ///
    /// They are spent between attempts to open it. With 0, tracking ends where the stream ends.
    #[arg(long, value_name = "0..", default_value_t = Options::RECONNECT.as_secs())]
    reconnect: u64,
}

impl LiveArgs {
    /// The address of a live source; `None` for a file.
    pub fn address(&self, source: &OsStr) -> Result<Option<Address>, Failure> {
        if source == "-" {
            return Ok(self.live.then(Address::pipe));
        }
        let address = Address::parse(source)?;
        if self.live && address.is_none() {
            let message = format!("--live is for standard input; {} is a file", source.display());
            return Err(usage(message).hint("the frames of a file are all tracked"));
        }
        Ok(address)
    }

    /// Opens a live source for a range of its frames.
    pub fn open(&self, address: Address, order: &Order, limits: Limits) -> Feed {
        let reconnect = std::time::Duration::from_secs(self.reconnect);
        let options = Options { limits, start: order.start, end: order.end, reconnect };
        Feed::Live(LiveSource::open(address, options))
    }
}

/// Opens a live source to see one frame of it.
pub fn open_once(address: Address, at: usize, limits: Limits) -> Feed {
    let (start, end, reconnect) = (at, None, std::time::Duration::ZERO);
    Feed::Live(LiveSource::open(address, Options { limits, start, end, reconnect }))
}

/// The next frame with its number; `None` at the end or after Ctrl-C.
pub fn next(feed: &mut Feed, note: impl Fn(&str)) -> Result<Option<(usize, Picture)>, Failure> {
    let noted = |happened: patchlock_media::Note| note(&format!("note: {happened}"));
    match feed.next_unless(&interrupt::requested, noted) {
        // What ends the program may also end what it reads from.
        Err(_) if interrupt::requested() => Ok(None),
        next => Ok(next?),
    }
}
