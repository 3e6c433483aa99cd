//! Decodes all other video formats with an `ffmpeg` process, whose Y4M output is read through a pipe.

use std::ffi::OsString;
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};
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
/// predicate of which the file is the subject, such as `holds VP9 video`. `times` are those of all frames, in
/// millionths of a second, if the file tells them.
pub fn open(
    path: &Path,
    reason: &str,
    reverse: bool,
    limits: Limits,
    times: Option<Vec<i64>>,
) -> Result<Box<dyn FrameSource>, Error> {
    let about = About::of(path, reason, limits)?;
    let task = Task {
        path: path.to_path_buf(),
        reason: reason.to_string(),
        limits,
        reverse,
        matrix: about.matrix,
    };
    let part = task.start(None)?;
    let times = times.filter(|_| !reverse);
    Ok(Box::new(Video { task, part, times, waiting: None, sound: about.sound }))
}

/// How to decode a video.
struct Task {
    path: PathBuf,
    reason: String,
    limits: Limits,
    reverse: bool,
    matrix: Option<Matrix>,
}

impl Task {
    /// Starts ffmpeg: at the beginning, or with the frame of this number, which is the first one shown at
    /// this time, in millionths of a second, or later.
    fn start(&self, from: Option<(usize, i64)>) -> Result<Part, Error> {
        let (first, from) = (from.map_or(0, |(first, _)| first), from.map(|(_, time)| time));
        let name = self.path.display().to_string();
        let folder =
            tempfile::tempdir().map_err(Error::because("cannot make a folder".to_string()))?;
        let mut last_error = None;
        for sync in EVERY_FRAME_ONCE {
            let mut command = decoding(&self.path, from, sync, self.limits)?;
            let mut child = spawn(command.current_dir(folder.path()), &self.path, &self.reason)?;
            let (Some(output), Some(errors)) = (child.stdout.take(), child.stderr.take()) else {
                continue;
            };
            let messages = thread::spawn(move || messages(errors));
            let pipe = Pipe { child, output, messages: Some(messages) };
            match y4m::open_stream(pipe, &name, self.reverse, self.limits, self.matrix, first) {
                Ok(frames) => {
                    let times = Times { folder, lines: None, first, read: Vec::new(), start: None };
                    return Ok(Part { frames, times });
                }
                Err(error) if error.to_string().contains("max pixel count") => {
                    let message = format!("{name}: its frames have too many pixels");
                    let hint = format!("--max-pixels accepts more than {}", self.limits.pixels);
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
}

/// Frames from one run of ffmpeg, with their times.
struct Part {
    frames: Box<dyn FrameSource>,
    times: Times,
}

/// A command line up to the input. With `from`, decoding starts there and times are those of the file.
fn ffmpeg(path: &Path, level: &str, from: Option<i64>, limits: Limits) -> Result<Command, Error> {
    // A file may name others, on other machines too: ffmpeg must not follow that. The prefix keeps it from
    // taking a part of the name for a protocol.
    let mut input = OsString::from("file:");
    input.push(std::path::absolute(path).map_err(Error::because("no such path".to_string()))?);
    let mut command = Command::new("ffmpeg");
    command
        .args(["-hide_banner", "-v", level, "-nostdin", "-protocol_whitelist", "file"])
        .args(["-max_pixels", &limits.pixels.to_string()]);
    if let Some(from) = from {
        command.args(["-copyts", "-seek_timestamp", "1", "-ss", &format!("{from}us")]);
    }
    command
        .arg("-i")
        .arg(input)
        .args(["-map", "0:v:0"])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    Ok(command)
}

/// Decodes all frames. `-xerror` is not used: it also rejects intact videos with unevenly spaced frames.
/// Dithering would make the pixels of a frame depend on how many were decoded before it.
fn decoding(
    path: &Path,
    from: Option<i64>,
    sync: [&str; 2],
    limits: Limits,
) -> Result<Command, Error> {
    let mut command = ffmpeg(path, "error", from, limits)?;
    let filters = format!("{TIMES}{TIMES_FILE},{FORMATS}");
    command.args(sync).args(["-sws_dither", "none", "-vf", &filters]);
    command.args(["-strict", "-1", "-f", "yuv4mpegpipe", "-"]);
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
        let mut command = ffmpeg(path, "info", None, limits)?;
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

/// A video that ffmpeg decodes.
struct Video {
    task: Task,
    part: Part,
    /// When each frame is shown, in millionths of a second; to start at a later frame.
    times: Option<Vec<i64>>,
    /// The frame with this number, read in advance.
    waiting: Option<(usize, Picture)>,
    sound: bool,
}

impl Video {
    /// Starts at a later frame, if it is certain that ffmpeg then begins with that one: otherwise all frames
    /// are decoded.
    fn skip_to(&mut self, index: usize) -> Option<()> {
        let times = self.times.take()?;
        let (before, wanted) = (*times.get(index.checked_sub(1)?)?, *times.get(index)?);
        // Frames that are shown twice have no certain place.
        if !times.is_sorted_by(|a, b| a < b) {
            return None;
        }
        let from = before + (wanted - before) / 2;
        let mut part = self.task.start(Some((index, from))).ok()?;
        let picture = part.frames.frame(index).ok()??;
        if (part.times.absolute(index)? - wanted).abs() > 1 {
            return None;
        }
        part.times.start = times.first().copied();
        self.part = part;
        self.waiting = Some((index, picture));
        Some(())
    }
}

impl FrameSource for Video {
    fn length(&self) -> Option<usize> {
        self.part.frames.length()
    }

    fn rate(&self) -> Option<FrameRate> {
        self.part.frames.rate()
    }

    fn has_sound(&self) -> bool {
        self.sound
    }

    fn frame(&mut self, index: usize) -> Result<Option<Picture>, Error> {
        if self.times.is_some() {
            self.skip_to(index);
        }
        let waiting = self.waiting.take().filter(|(number, _)| *number == index);
        let picture = match waiting {
            Some((_, picture)) => Some(picture),
            None => self.part.frames.frame(index)?,
        };
        // A frame without a time has that of an even rate.
        Ok(picture.map(|picture| {
            let time = self.part.times.of(index).or(picture.time);
            picture.at(time)
        }))
    }
}

/// The times of the frames, in a file that ffmpeg writes ahead of them.
struct Times {
    folder: TempDir,
    lines: Option<BufReader<File>>,
    /// The number of the first frame in the file.
    first: usize,
    /// In millionths of a second; `None` for a frame without a time.
    read: Vec<Option<i64>>,
    /// The time of frame 0, if that is not in the file.
    start: Option<i64>,
}

impl Times {
    /// The time of a frame in the video; `None` if ffmpeg has not told.
    fn absolute(&mut self, index: usize) -> Option<i64> {
        let at = index.checked_sub(self.first)?;
        if self.lines.is_none() {
            let file = File::open(self.folder.path().join(TIMES_FILE)).ok()?;
            self.lines = Some(BufReader::new(file));
        }
        while self.read.len() <= at {
            let line = y4m::piece_of_line(self.lines.as_mut()?).ok()??;
            if let Some((_, after)) = line.split_once(" pts:") {
                let time = after.split_whitespace().next().and_then(|text| text.parse().ok());
                self.read.push(time);
            }
        }
        self.read[at]
    }

    /// When a frame is shown, in seconds from the first frame of the video.
    fn of(&mut self, index: usize) -> Option<f64> {
        let time = self.absolute(index)?;
        let start = self.start.or(*self.read.first()?)?;
        Some((time - start) as f64 / 1e6)
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
