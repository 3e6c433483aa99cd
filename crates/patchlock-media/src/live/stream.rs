//! One run of ffmpeg on a live source: raw frames from its output, times and facts from its
//! messages.

use std::io::{self, BufReader, Read};
use std::process::{Command, Stdio};
use std::sync::mpsc::{self, Receiver};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use super::address::{Address, System, listed_camera, without_password};
use crate::child::{ChildGuard, TimeoutReader, locked, own_process_group};
use crate::colour::Matrix;
use crate::ffmpeg::{EVERY_FRAME_ONCE, FORMATS, Program, matrix, without_address};
use crate::y4m::{Header, Y4mStream, piece_of_line};
use crate::{Error, Limits, Picture};

/// Prints the time of each frame, in millionths of a second, before the frame is written.
const TIMES: &str = "settb=AVTB,metadata=mode=add:key=n:value=0,metadata=mode=print";
/// How long a message, as the time of a frame, may come after the frame itself.
const MESSAGE_COMES: Duration = Duration::from_secs(1);
/// What ffmpeg may read ahead to find out what the stream holds, in millionths of a second.
const ANALYSIS: &str = "500000";

/// A frame as it came.
pub struct RawFrame {
    header: Header,
    samples: Vec<u8>,
    /// In millionths of a second: since 1970 if the source is live, else as the file says.
    pub time: Option<i64>,
}

impl RawFrame {
    /// The frame of this number in colours.
    pub fn picture(&self, index: usize) -> Picture {
        self.header.picture(&self.samples, index)
    }
}

/// Frames of one run of ffmpeg, in the order in which they come.
pub struct Stream {
    frames: Y4mStream<TimeoutReader>,
    messages: Messages,
    process: Arc<ChildGuard>,
    address: Address,
    timeout: Duration,
    /// Whether ffmpeg prints times.
    is_timed: bool,
    /// Whether it is a file that somebody serves, which has an end.
    pub has_length: bool,
}

/// What ffmpeg prints.
#[derive(Debug, PartialEq)]
enum LogEvent {
    /// Whether the input has an end.
    HasLength(bool),
    /// What the input says of the colours of its video.
    Video(Option<Matrix>),
    /// When the next frame is shown.
    Time(Option<i64>),
    /// All of the input was described.
    Opened,
}

/// How to open a live source.
pub struct Task {
    pub address: Address,
    pub program: Program,
    pub limits: Limits,
}

impl Task {
    /// Starts ffmpeg and waits for the first frame. `began` gets the process as soon as it runs. With
    /// `as_told`, the times are those of the stream, not those at which its parts came.
    pub fn open(&self, as_told: bool, began: &dyn Fn(&Arc<ChildGuard>)) -> Result<Stream, Error> {
        let address = self.camera_by_name()?;
        let mut old_version = None;
        for sync in EVERY_FRAME_ONCE {
            match self.run(&address, sync, as_told, began) {
                Err(Error::NotLive { reason, .. }) if reason.contains("fps_mode") => {
                    old_version = Some(reason);
                }
                opened => return opened,
            }
        }
        Err(self.cannot_open(old_version.unwrap_or_default()))
    }

    /// The address, with the name of a camera that ffmpeg does not know by its number.
    fn camera_by_name(&self) -> Result<Address, Error> {
        let Some(number) = self.address.needs_name(System::HERE) else {
            return Ok(self.address.clone());
        };
        let mut list = Command::new(&self.program.name);
        list.args(["-hide_banner", "-list_devices", "true", "-f", "dshow", "-i", "dummy"]);
        let listed =
            list.stdin(Stdio::null()).output().map_err(|error| self.cannot_start(error))?;
        let text = String::from_utf8_lossy(&listed.stderr);
        match listed_camera(&text, number) {
            Some(name) => Ok(self.address.named(name)),
            None => Err(self.cannot_open(format!("there is no camera of the number {number}"))),
        }
    }

    fn command(&self, address: &Address, sync: [&str; 2], as_told: bool) -> Command {
        let mut command = Command::new(&self.program.name);
        command
            .args(["-hide_banner", "-nostats", "-loglevel", "level+info"])
            .args(["-max_pixels", &self.limits.pixels.to_string()])
            // Threads for frames would keep as many frames back as there are threads.
            .args(["-thread_type", "slice", "-analyzeduration", ANALYSIS])
            .arg("-copyts");
        if !as_told {
            command.args(["-use_wallclock_as_timestamps", "1"]);
        }
        command.args(address.input(System::HERE)).args(["-map", "0:v:0"]).args(sync);
        command.args(["-sws_dither", "none", "-vf", &format!("{TIMES},{FORMATS}")]);
        command.args(["-strict", "-1", "-flush_packets", "1", "-f", "yuv4mpegpipe", "-"]);
        match address.is_pipe() {
            true => command.stdin(Stdio::inherit()),
            false => own_process_group(command.arg("-nostdin").stdin(Stdio::null())),
        };
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    fn run(
        &self,
        address: &Address,
        sync: [&str; 2],
        as_told: bool,
        began: &dyn Fn(&Arc<ChildGuard>),
    ) -> Result<Stream, Error> {
        let mut child = self
            .command(address, sync, as_told)
            .spawn()
            .map_err(|error| self.cannot_start(error))?;
        let (output, messages) = (child.stdout.take(), child.stderr.take());
        let process = Arc::new(ChildGuard::new(child));
        began(&process);
        let (Some(output), Some(messages)) = (output, messages) else {
            return Err(self.cannot_open("ffmpeg started without its output".to_string()));
        };
        let (messages, timeout) = (Messages::listen(messages), self.program.timeout);
        let (mut has_length, mut matrix) = (false, None);
        let opened = loop {
            match messages.events.recv_timeout(timeout) {
                // What the user has called live is.
                Ok(LogEvent::HasLength(known)) => has_length = known && !address.is_pipe(),
                Ok(LogEvent::Video(said)) => matrix = matrix.or(said),
                Ok(LogEvent::Opened) => break true,
                Ok(LogEvent::Time(_)) => {}
                Err(mpsc::RecvTimeoutError::Timeout) => {
                    process.kill();
                    return Err(self.cannot_open(silence(timeout)));
                }
                Err(mpsc::RecvTimeoutError::Disconnected) => break false,
            }
        };
        let output = TimeoutReader::new(output, timeout);
        let name = self.address.shown();
        let frames = match Y4mStream::begin(output, &name, self.limits, matrix) {
            Ok(frames) if opened => frames,
            Err(error @ Error::TooLarge { .. }) => return Err(error),
            Ok(_) | Err(_) => return Err(self.why_not(&process, &messages)),
        };
        let address = self.address.clone();
        Ok(Stream { frames, messages, process, address, timeout, is_timed: true, has_length })
    }

    /// Why ffmpeg has opened nothing.
    fn why_not(&self, process: &ChildGuard, messages: &Messages) -> Error {
        let ended = process.end(self.program.timeout);
        let reason = messages.reason(&self.address);
        let name = self.address.shown();
        if reason.contains("max pixel count") {
            return Error::TooManyPixels { name, limit: self.limits.pixels };
        }
        if reason.contains(NOT_ALLOWED) {
            return match list_format(&reason) {
                Some(format) => Error::AddressList { name, format: format.to_string() },
                None => self.cannot_open("it is no video".to_string()),
            };
        }
        self.cannot_open(match ended {
            Err(_) => silence(self.program.timeout),
            Ok(_) if reason.is_empty() => "ffmpeg gives no reason".to_string(),
            Ok(_) => reason,
        })
    }

    fn cannot_open(&self, reason: String) -> Error {
        let is_camera = !self.address.is_network() && !self.address.is_pipe();
        Error::NotLive { name: self.address.shown(), is_camera, reason }
    }

    fn cannot_start(&self, error: io::Error) -> Error {
        match error.kind() {
            io::ErrorKind::NotFound => {
                Error::FfmpegMissing { path: self.address.shown(), reason: Error::LIVE.to_string() }
            }
            _ => self.cannot_open(format!("ffmpeg does not start: {error}")),
        }
    }
}

fn silence(timeout: Duration) -> String {
    format!("no frame came for {} s", timeout.as_secs_f64())
}

impl Stream {
    /// The next frame; `None` at the end.
    ///
    /// # Errors
    /// [`Error::Gone`] if the source has failed.
    pub fn next(&mut self) -> Result<Option<RawFrame>, Error> {
        match self.frames.read_next() {
            Ok(Some(samples)) => {
                Ok(Some(RawFrame { header: self.frames.header(), samples, time: self.time() }))
            }
            Ok(None) => match self.process.end(self.timeout) {
                Ok(status) if status.success() => Ok(None),
                _ => Err(self.gone("the connection ended")),
            },
            Err(_) => {
                self.process.kill();
                Err(self.gone(&silence(self.timeout)))
            }
        }
    }

    /// The time of the frame that was just read. ffmpeg prints it before it writes the frame.
    fn time(&mut self) -> Option<i64> {
        while self.is_timed {
            match self.messages.events.recv_timeout(MESSAGE_COMES) {
                Ok(LogEvent::Time(time)) => return time,
                Ok(LogEvent::HasLength(_) | LogEvent::Video(_) | LogEvent::Opened) => {}
                Err(_) => self.is_timed = false,
            }
        }
        None
    }

    fn gone(&self, otherwise: &str) -> Error {
        let reason = self.messages.reason(&self.address);
        let reason = if reason.is_empty() { otherwise.to_string() } else { reason };
        Error::Gone { name: self.address.shown(), reason }
    }

    /// Frames per second, as far as the source says.
    pub fn rate(&self) -> Option<crate::FrameRate> {
        self.frames.header().rate
    }
}

/// What one run of ffmpeg prints, read on a thread.
struct Messages {
    events: Receiver<LogEvent>,
    /// The last errors.
    errors: Arc<Mutex<Vec<String>>>,
}

impl Messages {
    fn listen(messages: impl Read + Send + 'static) -> Self {
        let (sender, events) = mpsc::channel();
        let errors = Arc::new(Mutex::new(Vec::new()));
        let heard = Arc::clone(&errors);
        thread::spawn(move || {
            let mut messages = BufReader::new(messages);
            // The description of the input comes before that of the output, which has the same form.
            let mut opened = false;
            while let Ok(Some(line)) = piece_of_line(&mut messages) {
                if let Some(error) = error_in(&line) {
                    let mut errors = locked(&heard);
                    errors.push(error);
                    let surplus = errors.len().saturating_sub(ERRORS);
                    errors.drain(..surplus);
                } else if let Some(found) = log_event_in(&line) {
                    let is_time = matches!(found, LogEvent::Time(_));
                    // The time of the first frame may come before the description of the output.
                    if (is_time || !opened) && sender.send(found).is_err() {
                        return;
                    }
                    opened |= line.contains("Stream mapping:");
                }
            }
        });
        Self { events, errors }
    }

    /// The last errors, without the password of the address. ffmpeg has ended, but its messages may
    /// not all have been read.
    fn reason(&self, address: &Address) -> String {
        while self.events.recv_timeout(MESSAGE_COMES).is_ok() {}
        let name = address.shown();
        let said = locked(&self.errors).join("; ");
        let words = said.split(' ').map(without_password);
        // The address is named before the reason already.
        let words = words.filter(|word| word.trim_end_matches(':') != name && !word.is_empty());
        words.collect::<Vec<_>>().join(" ")
    }
}

/// What ffmpeg says of a format that is not allowed.
const NOT_ALLOWED: &str = "Format not on whitelist";

/// Formats that list addresses.
const LISTS: [&str; 3] = ["hls", "dash", "concat"];

/// The format of the list that a message refuses. ffmpeg may give it several names, `hls,applehttp`.
fn list_format(message: &str) -> Option<&'static str> {
    let (before, _) = message.split_once(NOT_ALLOWED)?;
    let names = before.trim_end_matches(": ").rsplit(' ').next()?;
    LISTS.into_iter().find(|list| names.split(',').any(|name| name == *list))
}

/// Errors that are kept.
const ERRORS: usize = 2;

/// An error in a line, without its level; of a format that is not allowed, with its name.
fn error_in(line: &str) -> Option<String> {
    let (before, text) = line.split_once("[error] ").or_else(|| line.split_once("[fatal] "))?;
    let is_level = before.is_empty() || before.ends_with("] ");
    let format = before.strip_prefix('[').and_then(|part| part.split_once(" @"));
    let of_format = |text: String| match format {
        Some((format, _)) if text.starts_with(NOT_ALLOWED) => format!("{format}: {text}"),
        _ => text,
    };
    is_level.then(|| of_format(without_address(text)))
}

fn log_event_in(line: &str) -> Option<LogEvent> {
    let text = line.split_once("[info] ").map(|(_, text)| text.trim_start())?;
    if text.starts_with("frame:") {
        let (_, after) = text.split_once(" pts:")?;
        let time = after.split_whitespace().next().and_then(|text| text.parse().ok());
        return Some(LogEvent::Time(time));
    }
    if let Some(length) = text.strip_prefix("Duration: ") {
        return Some(LogEvent::HasLength(!length.starts_with("N/A")));
    }
    if text.starts_with("Stream mapping:") {
        return Some(LogEvent::Opened);
    }
    let (_, video) = text.strip_prefix("Stream #")?.split_once(": Video: ")?;
    // As in `yuv420p(tv, bt709/unknown/unknown, progressive)`.
    let words = video.split(['(', ')', ',', ' ']).filter_map(|word| word.split('/').next());
    Some(LogEvent::Video({ words }.find_map(matrix)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_of_ffmpeg_are_understood() {
        let said = log_event_in;
        assert_eq!(said("[info]   Duration: N/A, start: 1.0"), Some(LogEvent::HasLength(false)));
        assert_eq!(said("[info]   Duration: 00:00:05.00, "), Some(LogEvent::HasLength(true)));
        let video = "[info]   Stream #0:0: Video: mjpeg (Baseline), yuvj420p(pc, bt470bg/unknown/unknown), 2x2";
        assert_eq!(said(video), Some(LogEvent::Video(Some(Matrix::Bt601))));
        let video =
            "[info]   Stream #0:1[0x100]: Video: h264 (High), yuv420p(tv, bt709, progressive), 2x2";
        assert_eq!(said(video), Some(LogEvent::Video(Some(Matrix::Bt709))));
        let video = "[info]   Stream #0:0: Video: h264 (High), yuv420p(progressive), 2x2";
        assert_eq!(said(video), Some(LogEvent::Video(None)));
        let time =
            "[Parsed_metadata_2 @ 0x5f] [info] frame:2    pts:1795610163103000 pts_time:1.79e+09";
        assert_eq!(said(time), Some(LogEvent::Time(Some(1_795_610_163_103_000))));
        assert_eq!(said("[x @ 0x1] [info] frame:2    pts:NOPTS"), Some(LogEvent::Time(None)));
        assert_eq!(said("[info] Stream mapping:"), Some(LogEvent::Opened));
        assert_eq!(said("[info]   Stream #0:1: Audio: aac"), None);
        let error = error_in("[rtsp @ 0x55] [error] method DESCRIBE failed: 404 Not Found");
        assert_eq!(error.as_deref(), Some("method DESCRIBE failed: 404 Not Found"));
        assert_eq!(error_in("[info] title: [error] x"), None);
        for (line, list) in [
            ("[hls @ 0x55] [error] Format not on whitelist 'mov,mp4'", Some("hls")),
            ("[hls,applehttp @ 0x55] [error] Format not on whitelist 'mov,mp4'", Some("hls")),
            ("[dash @ 0x55] [error] Format not on whitelist 'mov,mp4'", Some("dash")),
            ("[png_pipe @ 0x55] [error] Format not on whitelist 'mov,mp4'", None),
            ("[error] Format not on whitelist 'mov,mp4'", None),
        ] {
            let error = error_in(line).unwrap();
            assert!(error.contains(NOT_ALLOWED));
            assert_eq!(list_format(&error), list, "{line}");
            assert_eq!(list_format(&format!("a: b; {error}; c")), list, "{line}");
        }
    }
}
