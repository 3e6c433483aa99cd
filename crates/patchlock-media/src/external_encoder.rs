//! H.264 by an installed ffmpeg with libx264: several times as fast as the encoder in Rust.

use std::collections::VecDeque;
use std::io::{Read, Write};
use std::process::{ChildStdin, Command, Stdio};
use std::sync::OnceLock;
use std::sync::mpsc::{self, Receiver};
use std::thread;

use rusty_h264::YuvFrame;

use crate::child::{ChildGuard, own_process_group};
use crate::{Error, limits};

/// What begins each picture in the stream: an access unit delimiter.
const BEGIN: [u8; 4] = [0, 0, 1, 9];
/// Bytes that are read at once.
const PIECE: usize = 1 << 16;

/// A running ffmpeg. Pictures come out in the order in which they went in, some of them later.
pub struct ExternalEncoder {
    process: ChildGuard,
    /// `None` after the last frame.
    input: Option<ChildStdin>,
    units: Receiver<Vec<u8>>,
    /// Those of the frames that have not come out.
    times: VecDeque<Option<f64>>,
}

/// An encoded picture, and when it is shown in seconds.
type EncodedPicture = (Vec<u8>, Option<f64>);

impl ExternalEncoder {
    /// Starts an encoder for frames of this size, which is even; `None` if there is none on this
    /// machine.
    pub fn start(size: [usize; 2], quantiser: u8, keyframe_every: u32) -> Option<Self> {
        static WORKS: OnceLock<bool> = OnceLock::new();
        let works = *WORKS.get_or_init(|| Self::works().is_some());
        works.then(|| Self::run(size, quantiser, keyframe_every)).flatten()
    }

    /// Encodes a small picture.
    fn works() -> Option<()> {
        let mut encoder = Self::run([64, 64], 30, 1)?;
        encoder.push(&YuvFrame::black(64, 64), None).ok()?;
        encoder.finish().map(drop).ok()
    }

    fn run([width, height]: [usize; 2], quantiser: u8, keyframe_every: u32) -> Option<Self> {
        let mut command = Command::new("ffmpeg");
        command
            .args(["-hide_banner", "-v", "quiet", "-nostats", "-protocol_whitelist", "pipe"])
            .args(["-f", "rawvideo", "-pix_fmt", "yuv420p"])
            .args(["-s", &format!("{width}x{height}"), "-i", "pipe:0"])
            .args(["-c:v", "libx264", "-preset", "ultrafast", "-bf", "0"])
            .args(["-qp", &quantiser.to_string(), "-g", &keyframe_every.to_string()])
            .args(["-x264-params", "aud=1:scenecut=0:sliced-threads=0:slices=1"])
            .args(["-flush_packets", "1", "-f", "h264", "pipe:1"]);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut child = own_process_group(&mut command).spawn().ok()?;
        let (input, output) = (child.stdin.take(), child.stdout.take());
        let process = ChildGuard::new(child);
        let units = split(output?);
        Some(Self { process, input: Some(input?), units, times: VecDeque::new() })
    }

    /// Encodes a frame more.
    ///
    /// # Errors
    /// [`Error::Encode`] if ffmpeg has ended.
    pub fn push(&mut self, frame: &YuvFrame, time: Option<f64>) -> Result<(), Error> {
        let Some(input) = &mut self.input else { return Err(ended()) };
        let planes = [&frame.y, &frame.u, &frame.v];
        planes.into_iter().try_for_each(|plane| input.write_all(plane)).map_err(|_| ended())?;
        self.times.push_back(time);
        Ok(())
    }

    /// The pictures that are ready.
    pub fn ready(&mut self) -> Vec<EncodedPicture> {
        self.units.try_iter().map(|unit| (unit, self.times.pop_front().flatten())).collect()
    }

    /// Waits for the pictures that are not ready yet.
    ///
    /// # Errors
    /// [`Error::Encode`] if ffmpeg has failed, or left out frames.
    pub fn finish(&mut self) -> Result<Vec<EncodedPicture>, Error> {
        self.input = None;
        let mut units = Vec::new();
        loop {
            match self.units.recv_timeout(limits::SILENCE) {
                Ok(unit) => units.push(unit),
                Err(mpsc::RecvTimeoutError::Disconnected) => break,
                Err(mpsc::RecvTimeoutError::Timeout) => return Err(ended()),
            }
        }
        match self.process.end(limits::SILENCE) {
            Ok(status) if status.success() => {}
            _ => return Err(ended()),
        }
        let waiting = self.times.len();
        if units.len() != waiting {
            let lost = format!("ffmpeg has encoded {} of {waiting} frames", units.len());
            return Err(Error::Encode(lost));
        }
        Ok(units.into_iter().zip(self.times.drain(..)).collect())
    }
}

fn ended() -> Error {
    Error::Encode("ffmpeg, which encodes the video, has failed".to_string())
}

/// Reads a stream on a thread and cuts it where pictures begin.
fn split(mut output: impl Read + Send + 'static) -> Receiver<Vec<u8>> {
    let (sender, units) = mpsc::channel();
    thread::spawn(move || {
        let (mut stream, mut piece) = (Vec::new(), vec![0; PIECE]);
        // Up to here, there is no beginning but the first.
        let mut searched = BEGIN.len();
        loop {
            let count = match output.read(&mut piece) {
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => continue,
                Ok(count) => count,
                Err(_) => 0,
            };
            stream.extend_from_slice(&piece[..count]);
            while let Some(at) = next_begin(&stream, searched) {
                let rest = stream.split_off(at);
                if sender.send(std::mem::replace(&mut stream, rest)).is_err() {
                    return;
                }
                searched = BEGIN.len() + 1;
            }
            searched = stream.len().saturating_sub(BEGIN.len()).max(searched);
            if count == 0 {
                if !stream.is_empty() {
                    // Nobody waits for the last picture of a video that was given up.
                    let _ = sender.send(stream);
                }
                return;
            }
        }
    });
    units
}

/// Where the next picture begins, at or after this place. A zero before a start code belongs to it.
fn next_begin(stream: &[u8], from: usize) -> Option<usize> {
    let after = stream.get(from..)?;
    let at = from + after.windows(BEGIN.len()).position(|window| window == BEGIN)?;
    Some(if stream[at - 1] == 0 { at - 1 } else { at })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A stream that comes in pieces of this length.
    struct ChunkedReader(Vec<u8>, usize);

    impl Read for ChunkedReader {
        fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
            let count = self.1.min(self.0.len()).min(buffer.len());
            buffer[..count].copy_from_slice(&self.0[..count]);
            self.0.drain(..count);
            Ok(count)
        }
    }

    #[test]
    fn a_stream_is_cut_where_pictures_begin() {
        let pictures: [&[u8]; 4] = [
            &[0, 0, 0, 1, 9, 16, 0, 0, 1, 103, 5, 0, 0, 1, 101, 9, 0, 0],
            &[0, 0, 0, 1, 9, 48, 0, 0, 1, 65, 1],
            &[0, 0, 1, 9, 48, 0, 0, 1, 65, 2],
            &[0, 0, 0, 1, 9, 48, 0, 0, 1, 65, 0, 3],
        ];
        for length in [1, 2, 3, 5, 7, 100] {
            let found: Vec<Vec<u8>> =
                split(ChunkedReader(pictures.concat(), length)).iter().collect();
            assert_eq!(found.concat(), pictures.concat());
            assert_eq!(found.len(), 4, "pieces of {length}: {found:?}");
        }
    }
}
