//! The process that decodes.

use std::fs::File;
use std::io::{self, Write};
use std::os::fd::AsFd;

use super::wire::{self, Kind, Reply, Request};
use crate::find::{OpenedSource, find_guarded};
use crate::{Error, Limits, Picture, Pixels, ffmpeg, guard};

/// Pictures that are decoded between two signs of life.
const LIFE: usize = 32;

/// Decodes one file for the program that has started this one as a [`Helper`](crate::Helper), until
/// that wants no more. Nothing else may use standard input and output.
///
/// # Errors
/// An error of the two, or of a request that is none.
pub fn serve() -> io::Result<()> {
    let mut input = File::from(io::stdin().as_fd().try_clone_to_owned()?);
    let mut output = File::from(io::stdout().as_fd().try_clone_to_owned()?);
    output.write_all(&wire::HELLO)?;
    let Request::Open { name, reverse, pixels } = wire::receive(&mut input)? else {
        return Err(io::ErrorKind::InvalidData.into());
    };
    let (mut life, mut count) = (output.try_clone()?, 0_usize);
    guard::after_each(move || {
        count += 1;
        if count.is_multiple_of(LIFE) {
            // If nobody listens, the reply says so.
            let _ = wire::send_life(&mut life);
        }
    });
    let limits = Limits { pixels, helper: None };
    let program = ffmpeg::Program { is_of_group: true, ..ffmpeg::Program::default() };
    let mut source = match find_guarded(&name, reverse, limits, Some(program)) {
        Ok(OpenedSource::Source(source)) => source,
        Ok(OpenedSource::ForFfmpeg { reason, times }) => {
            let reply = Reply::ForFfmpeg { reason, times: times.as_ref().map(Vec::len) };
            let times = times.unwrap_or_default();
            let times: Vec<u8> = times.into_iter().flat_map(i64::to_ne_bytes).collect();
            return wire::send(&mut output, &reply, &times);
        }
        Err(error) => return wire::send(&mut output, &Reply::Failed(error), &[]),
    };
    let (info, notes) = (source.info(), source.notes());
    wire::send(&mut output, &Reply::Opened { info, notes }, &[])?;
    loop {
        match wire::receive(&mut input) {
            Ok(Request::Announce { first, span }) => source.announce(first, span),
            Ok(Request::Frame(index)) => answer(&mut output, source.frame(index))?,
            Ok(Request::Open { .. }) => return Err(io::ErrorKind::InvalidData.into()),
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => return Ok(()),
            Err(error) => return Err(error),
        }
    }
}

fn answer(output: &mut File, frame: Result<Option<Picture>, Error>) -> io::Result<()> {
    let Picture { width, height, pixels, time } = match frame {
        Ok(Some(picture)) => picture,
        Ok(None) => return wire::send(output, &Reply::End, &[]),
        Err(error) => return wire::send(output, &Reply::Failed(error), &[]),
    };
    let head = |kind| Reply::Frame { width, height, kind, time };
    match pixels {
        Pixels::Grey8(grey) => wire::send(output, &head(Kind::Grey8), &grey),
        Pixels::Rgb8(rgb) => wire::send(output, &head(Kind::Rgb8), &rgb),
        Pixels::Grey16(grey) => {
            let bytes: Vec<u8> = grey.into_iter().flat_map(u16::to_ne_bytes).collect();
            wire::send(output, &head(Kind::Grey16), &bytes)
        }
    }
}
