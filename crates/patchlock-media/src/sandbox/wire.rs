//! What the two processes say: requests one way, replies the other. Each is JSON after its length in
//! four bytes. Pixels and times follow their reply as they are in memory. A length of 0 is a sign of
//! life.

use std::ffi::OsString;
use std::io::{self, IoSlice, Read, Write};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::{Error, Note, SourceInfo};

/// The first bytes of a helper, before it has opened anything.
pub const HELLO: [u8; 16] = *b"patchlock helper";
/// Longest JSON.
const LONGEST: usize = 1 << 16;

#[derive(Serialize, Deserialize)]
pub enum Request {
    Open { name: OsString, reverse: bool, pixels: usize },
    Announce { first: usize, span: usize },
    Frame(usize),
}

#[derive(Serialize, Deserialize)]
pub enum Reply {
    Opened {
        info: SourceInfo,
        notes: Vec<Note>,
    },
    /// So many times follow, if there are any.
    ForFfmpeg {
        reason: String,
        times: Option<usize>,
    },
    /// Its pixels follow.
    Frame {
        width: usize,
        height: usize,
        kind: Kind,
        time: Option<f64>,
    },
    End,
    Failed(Error),
}

/// What pixels are.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub enum Kind {
    Grey8,
    Grey16,
    Rgb8,
}

impl Kind {
    /// Bytes of a pixel.
    pub fn bytes(self) -> usize {
        match self {
            Self::Grey8 => 1,
            Self::Grey16 => 2,
            Self::Rgb8 => 3,
        }
    }
}

/// Sends a message and what follows it.
pub fn send(output: &mut impl Write, message: &impl Serialize, after: &[u8]) -> io::Result<()> {
    let json = serde_json::to_vec(message)?;
    let length = u32::try_from(json.len()).map_err(io::Error::other)?;
    let head = [&length.to_ne_bytes(), json.as_slice()].concat();
    let sent = output.write_vectored(&[IoSlice::new(&head), IoSlice::new(after)])?;
    output.write_all(&head[sent.min(head.len())..])?;
    output.write_all(&after[sent.saturating_sub(head.len())..])
}

/// Says that the work goes on.
pub fn send_life(output: &mut impl Write) -> io::Result<()> {
    output.write_all(&0_u32.to_ne_bytes())
}

/// Receives a message.
pub fn receive<T: DeserializeOwned>(input: &mut impl Read) -> io::Result<T> {
    let mut length = [0; 4];
    while u32::from_ne_bytes(length) == 0 {
        input.read_exact(&mut length)?;
    }
    let length = u32::from_ne_bytes(length) as usize;
    if length > LONGEST {
        return Err(io::ErrorKind::InvalidData.into());
    }
    let mut json = vec![0; length];
    input.read_exact(&mut json)?;
    Ok(serde_json::from_slice(&json)?)
}
