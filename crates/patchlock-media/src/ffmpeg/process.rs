//! Runs of ffmpeg on one file.

use std::io::{self, BufReader, Read};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use super::decoder_log::DecoderLog;
use super::{EVERY_FRAME_ONCE, FORMATS, Program, TIMES};
use crate::child::{ChildGuard, TimeoutReader};
use crate::colour::Matrix;
use crate::limits::{self, Limits};
use crate::y4m::{Header, Y4mFile, Y4mStream};
use crate::{Container, Error, FrameSource as _, y4m};

/// How to decode a video.
pub(super) struct Task {
    pub program: Program,
    pub path: PathBuf,
    pub reason: String,
    pub limits: Limits,
    pub matrix: Option<Matrix>,
}

/// Frames from one run of ffmpeg, and what it says of them.
pub(super) struct DecodeRun {
    pub frames: Frames,
    pub log: DecoderLog,
}

/// When the frames of packets are shown, in millionths of a second.
pub(super) struct Packets {
    /// Of all, in the order in which they are shown.
    pub times: Vec<i64>,
    /// Of the first one that is a key frame.
    pub key: Option<i64>,
}

pub(super) enum Frames {
    Stream(Y4mStream<Pipe>),
    /// All frames, in a temporary file.
    Whole(Y4mFile),
}

impl DecodeRun {
    pub fn header(&self) -> Header {
        match &self.frames {
            Frames::Stream(stream) => stream.header(),
            Frames::Whole(file) => file.header(),
        }
    }

    /// The number of frames, if all of them are there.
    pub fn length(&self) -> Option<usize> {
        match &self.frames {
            Frames::Stream(_) => None,
            Frames::Whole(file) => file.length(),
        }
    }
}

impl Task {
    pub fn name(&self) -> String {
        self.path.display().to_string()
    }

    /// A command line up to the input. With `from`, decoding starts there.
    pub fn command(&self, level: &str, from: Option<i64>) -> Result<Command, Error> {
        let mut command = self.program.empty(level, self.limits);
        Program::add_input(&mut command, &self.path, from)?;
        Ok(command)
    }

    /// Starts a command that reads the file.
    pub fn spawn(&self, command: &mut Command) -> Result<Child, Error> {
        let started = self.program.spawn(command, &self.path, self.limits);
        started.map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => Error::FfmpegMissing {
                path: self.path.display().to_string(),
                reason: self.reason.clone(),
            },
            _ => Error::unreadable(self.name(), format!("ffmpeg does not start: {error}")),
        })
    }

    /// Starts ffmpeg: at the beginning, or with the first frame that is shown at this time, in
    /// millionths of a second, or later. With `whole`, the frames are copied to a temporary file, in
    /// which they can be read in any order.
    pub fn start(&self, from: Option<i64>, whole: bool) -> Result<DecodeRun, Error> {
        let name = self.name();
        let mut last_error = None;
        for sync in EVERY_FRAME_ONCE {
            let pipe = Pipe::start(&mut self.decoding(from, sync)?, self)?;
            let log = pipe.log.clone();
            let frames = match whole {
                true => y4m::spooled(pipe, &name, self.limits, self.matrix).map(Frames::Whole),
                false => {
                    Y4mStream::begin(pipe, &name, self.limits, self.matrix).map(Frames::Stream)
                }
            };
            match frames {
                Ok(frames) => return Ok(DecodeRun { frames, log }),
                Err(error) if reason_of(&error).contains("max pixel count") => {
                    return Err(Error::TooManyPixels { name, limit: self.limits.pixels });
                }
                Err(error) if reason_of(&error).contains("not on whitelist") => {
                    let reason = "it is in none of the formats that ffmpeg may read here";
                    return Err(Error::unreadable_in(Container::Other, &name, reason));
                }
                // An old version, which knows the other spelling.
                Err(error) if reason_of(&error).contains("fps_mode") => last_error = Some(error),
                Err(error) => return Err(of_ffmpeg(error)),
            }
        }
        Err(last_error.map_or_else(|| Error::unreadable(&name, "ffmpeg did not start"), of_ffmpeg))
    }

    /// The times of all frames that ffmpeg shows before this time.
    pub fn shown_until(&self, end: i64) -> Vec<i64> {
        let mut shown = Vec::new();
        let Ok(DecodeRun { frames: Frames::Stream(mut stream), log }) = self.start(None, false)
        else {
            return shown;
        };
        while let Ok(Some(_)) = stream.read_next()
            && let Some(time) = log.time(shown.len())
            && time < end
        {
            shown.push(time);
        }
        shown
    }

    /// Decodes all frames. `-xerror` is not used: it also rejects intact videos with unevenly
    /// spaced frames. Dithering would make the pixels of a frame depend on how many were decoded
    /// before it.
    fn decoding(&self, from: Option<i64>, sync: [&str; 2]) -> Result<Command, Error> {
        let mut command = self.command("error", from)?;
        let filters = format!("{TIMES},{FORMATS}");
        command.args(sync).args(["-sws_dither", "none", "-vf", &filters]);
        command.args(["-strict", "-1", "-f", "yuv4mpegpipe", "-"]);
        Ok(command)
    }

    /// When the frames are shown, from the packets of the file, which are read but not decoded;
    /// `None` if they do not tell.
    pub fn packet_times(&self) -> Option<Packets> {
        let most = limits::frames(self.path.metadata().ok()?.len()) as usize;
        let mut command = self.command("error", None).ok()?;
        // Also those before the first key frame, of which a decoder may show some.
        command.args(["-c", "copy", "-copyinkf", "-f", "framecrc", "-"]);
        let mut lines = BufReader::new(Pipe::start(&mut command, self).ok()?);
        let (mut unit, mut times, mut key) = (None, Vec::new(), None);
        while let Some(line) = y4m::piece_of_line(&mut lines).ok()? {
            if let Some(text) = line.strip_prefix("#tb 0: ") {
                let (over, under) = text.trim().split_once('/')?;
                unit = Some((over.parse::<i128>().ok()?, under.parse::<i128>().ok()?));
            } else if !line.starts_with('#') {
                // Stream, two times, duration, size.
                let mut columns = line.split(',').map(str::trim).skip(2);
                let ticks: i64 = columns.next()?.parse().ok()?;
                // A packet without data repeats the frame before it.
                if columns.nth(1) == Some("0") {
                    continue;
                }
                let (over, under) = unit.filter(|&(over, under)| over > 0 && under > 0)?;
                let micros = 1_000_000 * over * i128::from(ticks);
                let time = i64::try_from((micros + under / 2).div_euclid(under)).ok()?;
                // Only packets of other kinds have flags.
                let is_key = !line.contains(", F=0x0");
                key = key.or(Some(time).filter(|_| is_key));
                times.push(time);
            }
            if times.len() > most {
                return None;
            }
        }
        // Packets are in the order of decoding.
        times.sort_unstable();
        Some(Packets { times, key })
    }
}

/// The reason why ffmpeg has written no header. Its exit codes do not tell.
fn reason_of(error: &Error) -> &str {
    match error {
        Error::Unreadable { reason, .. } | Error::StreamEnd { reason, .. } => reason,
        _ => "",
    }
}

/// The error of the video, as opposed to one of the Y4M stream that ffmpeg makes of it.
fn of_ffmpeg(error: Error) -> Error {
    match error {
        Error::Unreadable { name, reason, .. } => {
            Error::unreadable_in(Container::Other, name, reason)
        }
        error => error,
    }
}

/// The exit status of ffmpeg if it could not decode the greater part of the frames.
const MOSTLY_DAMAGED: i32 = 69;

/// The output of ffmpeg. If it has failed, the end of the output is a read error.
pub(super) struct Pipe {
    child: ChildGuard,
    output: TimeoutReader,
    log: DecoderLog,
    timeout: Duration,
    has_written: bool,
}

impl Pipe {
    fn start(command: &mut Command, task: &Task) -> Result<Self, Error> {
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = task.spawn(command)?;
        let (Some(output), Some(errors)) = (child.stdout.take(), child.stderr.take()) else {
            return Err(Error::unreadable(task.name(), "ffmpeg started without its output"));
        };
        let timeout = task.program.timeout;
        let log = DecoderLog::listen(errors, timeout);
        let (child, output) = (ChildGuard::new(child), TimeoutReader::new(output, timeout));
        Ok(Self { child, output, log, timeout, has_written: false })
    }

    /// Checks that ffmpeg has come to the end of the file. What it cannot decode is no failure: it
    /// goes on with the next frame that it can. Which frames are missing is told by their times.
    fn check_end(&self) -> io::Result<()> {
        let status = self.child.end(self.timeout)?;
        let messages = self.log.whole()?;
        let reason = if messages.is_empty() { "it gives no reason" } else { &messages };
        match status.code() {
            Some(0 | MOSTLY_DAMAGED) if self.has_written => Ok(()),
            Some(0 | MOSTLY_DAMAGED) => {
                Err(io::Error::other(format!("ffmpeg cannot decode any frame of it: {reason}")))
            }
            _ => Err(io::Error::other(format!("ffmpeg failed: {reason}"))),
        }
    }
}

impl Read for Pipe {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.output.read(buffer).inspect_err(|_| self.child.kill())?;
        self.has_written |= count > 0;
        if count == 0 && !buffer.is_empty() {
            self.check_end()?;
        }
        Ok(count)
    }
}
