//! Decodes all other video formats with an `ffmpeg` process, whose Y4M output is read through a pipe.

use std::ffi::OsString;
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;
use std::process::{Child, ChildStderr, ChildStdout, Command, Stdio};
use std::thread::{self, JoinHandle};

use tempfile::TempDir;

use crate::colour::Matrix;
use crate::limits::Limits;
use crate::{Error, FrameRate, FrameSource, Picture, y4m};

/// The option for "every frame exactly once", as spelled by new and by old versions of ffmpeg.
const EVERY_FRAME_ONCE: [[&str; 2]; 2] = [["-fps_mode", "passthrough"], ["-vsync", "0"]];

/// Formats in which frames are taken as they are; others are converted to the nearest. All have 8 bits.
const FORMATS: &str = "format=yuv420p|yuv422p|yuv444p|yuv411p|gray";
/// Writes the time of each frame, in millionths of a second, to a file before the frame itself.
const TIMES: &str = "settb=AVTB,metadata=mode=add:key=n:value=0,metadata=mode=print:direct=1:file=";
const TIMES_FILE: &str = "times.txt";

/// Opens a video with ffmpeg. `reason` explains why ffmpeg is needed, for the message if it is missing: a
/// predicate of which the file is the subject, such as `holds VP9 video`.
pub fn open(
    path: &Path,
    reason: &str,
    reverse: bool,
    limits: Limits,
) -> Result<Box<dyn FrameSource>, Error> {
    let name = path.display().to_string();
    let folder = tempfile::tempdir().map_err(Error::because("cannot make a folder".to_string()))?;
    let about = About::of(path, reason, limits)?;
    let mut last_error = None;
    for sync in EVERY_FRAME_ONCE {
        let mut child =
            spawn(decoding(path, sync, limits)?.current_dir(folder.path()), path, reason)?;
        let (Some(output), Some(errors)) = (child.stdout.take(), child.stderr.take()) else {
            continue;
        };
        let messages = thread::spawn(move || messages(errors));
        let pipe = Pipe { child, output, messages: Some(messages) };
        match y4m::open_stream(pipe, &name, reverse, limits, about.matrix) {
            Ok(frames) => {
                let times = Times { folder, lines: None, read: Vec::new() };
                return Ok(Box::new(Video { frames, times, sound: about.sound }));
            }
            Err(error) if error.to_string().contains("max pixel count") => {
                let message = format!("{name}: its frames have too many pixels");
                let hint = format!("--max-pixels accepts more than {}", limits.pixels);
                return Err(Error::source(message, hint));
            }
            Err(error) => {
                let old_version = error.to_string().contains("fps_mode");
                last_error = Some(error);
                if !old_version {
                    break;
                }
            }
        }
    }
    Err(last_error.unwrap_or_else(|| Error::plain(format!("ffmpeg did not start for {name}"))))
}

/// The beginning of every command line.
fn ffmpeg(path: &Path, level: &str, limits: Limits) -> Result<Command, Error> {
    // A file may name others, on other machines too: ffmpeg must not follow that. The prefix keeps it from
    // taking a part of the name for a protocol.
    let mut input = OsString::from("file:");
    input.push(std::path::absolute(path).map_err(Error::because("no such path".to_string()))?);
    let mut command = Command::new("ffmpeg");
    command
        .args(["-hide_banner", "-v", level, "-nostdin", "-protocol_whitelist", "file"])
        .args(["-max_pixels", &limits.pixels.to_string(), "-i"])
        .arg(input)
        .args(["-map", "0:v:0"])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    Ok(command)
}

/// Decodes all frames. `-xerror` is not used: it also rejects intact videos with unevenly spaced frames.
fn decoding(path: &Path, sync: [&str; 2], limits: Limits) -> Result<Command, Error> {
    let mut command = ffmpeg(path, "error", limits)?;
    command.args(sync).args(["-vf", &format!("{TIMES}{TIMES_FILE},{FORMATS}")]).args([
        "-strict",
        "-1",
        "-f",
        "yuv4mpegpipe",
        "-",
    ]);
    Ok(command)
}

/// What the frames of Y4M do not tell of a video.
struct About {
    /// The matrix of the colours; `None` if the video does not say.
    matrix: Option<Matrix>,
    sound: bool,
}

impl About {
    /// Decodes one frame. Errors are left to the process that decodes all.
    fn of(path: &Path, reason: &str, limits: Limits) -> Result<Self, Error> {
        let mut command = ffmpeg(path, "info", limits)?;
        command
            .args(["-frames:v", "1", "-vf", "showinfo", "-f", "null", "-"])
            .stdout(Stdio::null());
        let mut child = spawn(&mut command, path, reason)?;
        let mut about = Self { matrix: None, sound: false };
        let Some(errors) = child.stderr.take() else { return Ok(about) };
        let mut errors = BufReader::new(errors);
        while let Some(line) = y4m::piece_of_line(&mut errors).ok().flatten() {
            about.sound |= line.contains("Stream #") && line.contains(": Audio:");
            let space = line.split(' ').find_map(|word| word.strip_prefix("color_space:"));
            about.matrix = about.matrix.or(space.and_then(matrix));
        }
        // What it printed is all that matters.
        let _ = child.wait();
        Ok(about)
    }
}

/// The matrix with this name in ffmpeg; `None` if the video does not say.
fn matrix(name: &str) -> Option<Matrix> {
    match name {
        "bt709" => Some(Matrix::Bt709),
        // What has no luma (`gbr`) is converted by ffmpeg, which then uses BT.601.
        "bt470bg" | "smpte170m" | "fcc" | "gbr" => Some(Matrix::Bt601),
        "bt2020nc" | "bt2020c" => Some(Matrix::Bt2020),
        _ => None,
    }
}

/// The frames of a video, with their times.
struct Video {
    frames: Box<dyn FrameSource>,
    times: Times,
    sound: bool,
}

impl FrameSource for Video {
    fn length(&self) -> Option<usize> {
        self.frames.length()
    }

    fn rate(&self) -> Option<FrameRate> {
        self.frames.rate()
    }

    fn has_sound(&self) -> bool {
        self.sound
    }

    fn frame(&mut self, index: usize) -> Result<Option<Picture>, Error> {
        let picture = self.frames.frame(index)?;
        // A frame without a time has that of an even rate.
        Ok(picture.map(|picture| {
            let time = self.times.of(index).or(picture.time);
            picture.at(time)
        }))
    }
}

/// The times of the frames, in a file that ffmpeg writes ahead of them.
struct Times {
    folder: TempDir,
    lines: Option<BufReader<File>>,
    /// In millionths of a second; `None` for a frame without a time.
    read: Vec<Option<i64>>,
}

impl Times {
    /// When a frame is shown, in seconds from the first; `None` if ffmpeg has not told.
    fn of(&mut self, index: usize) -> Option<f64> {
        if self.lines.is_none() {
            let file = File::open(self.folder.path().join(TIMES_FILE)).ok()?;
            self.lines = Some(BufReader::new(file));
        }
        while self.read.len() <= index {
            let line = y4m::piece_of_line(self.lines.as_mut()?).ok()??;
            if let Some((_, after)) = line.split_once(" pts:") {
                let time = after.split_whitespace().next().and_then(|text| text.parse().ok());
                self.read.push(time);
            }
        }
        Some((self.read[index]? - self.read[0]?) as f64 / 1e6)
    }
}

fn spawn(command: &mut Command, path: &Path, reason: &str) -> Result<Child, Error> {
    let started = command.spawn();
    match started {
        Ok(child) => Ok(child),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Err(Error::source(
            format!(
                "{} {reason}; reading it needs ffmpeg, which is not on the PATH",
                path.display()
            ),
            "install ffmpeg, or convert the video elsewhere to an MP4 with 8-bit 4:2:0 H.264 (yuv420p)",
        )),
        Err(error) => Err(Error::because("cannot start ffmpeg".to_string())(error)),
    }
}

/// Summarises what ffmpeg wrote to standard error: the first line, which usually names the cause, and the
/// last line. Empty if ffmpeg wrote nothing.
fn messages(errors: ChildStderr) -> String {
    let (mut first, mut last) = (None, None);
    let mut errors = BufReader::new(errors);
    while let Some(line) = y4m::piece_of_line(&mut errors).ok().flatten() {
        let line = without_address(&line);
        if !line.is_empty() {
            *if first.is_none() { &mut first } else { &mut last } = Some(line);
        }
    }
    first.into_iter().chain(last).collect::<Vec<_>>().join(" ... ")
}

/// Removes a leading memory address such as `[hevc @ 0x55e5cc57e4c0] `. Returns an empty string for a line
/// that only counts repetitions.
fn without_address(line: &str) -> String {
    let line = line.trim();
    let text =
        line.split_once("] ").filter(|_| line.starts_with('[')).map_or(line, |(_, text)| text);
    if text.starts_with("Last message repeated") { String::new() } else { text.to_string() }
}

/// The output of ffmpeg. At the end of the output, a failed exit or a message on standard error becomes a
/// read error.
struct Pipe {
    child: Child,
    output: ChildStdout,
    messages: Option<JoinHandle<String>>,
}

impl Pipe {
    /// Checks that the output ended where the video ends. ffmpeg skips what it cannot decode and still exits
    /// with success, so standard error has to be checked as well.
    fn check_end(&mut self) -> io::Result<()> {
        let status = self.child.wait()?;
        let messages = self.messages.take().and_then(|thread| thread.join().ok());
        let messages = messages.unwrap_or_default();
        if !status.success() {
            let reason = if messages.is_empty() { "no reason given" } else { &messages };
            return Err(io::Error::other(format!("ffmpeg failed: {reason}")));
        }
        if !messages.is_empty() {
            return Err(io::Error::other(format!(
                "ffmpeg stopped and reported damage, possibly in earlier frames too: {messages}"
            )));
        }
        Ok(())
    }
}

impl Read for Pipe {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.output.read(buffer)?;
        if count == 0 && !buffer.is_empty() {
            self.check_end()?;
        }
        Ok(count)
    }
}

impl Drop for Pipe {
    fn drop(&mut self) {
        // If it has exited already, both calls do nothing.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
