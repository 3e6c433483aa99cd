//! Decodes all other video formats with an `ffmpeg` process, whose Y4M output is read through a pipe.

use std::ffi::OsString;
use std::io::{self, BufReader, Read};
use std::path::Path;
use std::process::{Child, ChildStderr, ChildStdout, Command, Stdio};
use std::thread::{self, JoinHandle};

use crate::limits::Limits;
use crate::{Error, FrameSource, y4m};

/// The option for "every frame exactly once", as spelled by new and by old versions of ffmpeg.
const EVERY_FRAME_ONCE: [[&str; 2]; 2] = [["-fps_mode", "passthrough"], ["-vsync", "0"]];

/// Opens a video with ffmpeg. `reason` explains why ffmpeg is needed, for the message if it is missing: a
/// predicate of which the file is the subject, such as `holds VP9 video`.
pub fn open(
    path: &Path,
    reason: &str,
    reverse: bool,
    limits: Limits,
) -> Result<Box<dyn FrameSource>, Error> {
    let mut last_error = None;
    for sync in EVERY_FRAME_ONCE {
        let Some(mut child) = spawn(path, sync, reason, limits)? else { continue };
        let (Some(output), Some(errors)) = (child.stdout.take(), child.stderr.take()) else {
            continue;
        };
        let messages = thread::spawn(move || messages(errors));
        let pipe = Pipe { child, output, messages: Some(messages) };
        match y4m::open_stream(pipe, &path.display().to_string(), reverse, limits) {
            Ok(frames) => return Ok(frames),
            Err(error) if error.to_string().contains("max pixel count") => {
                let message = format!("{}: its frames have too many pixels", path.display());
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
    Err(last_error
        .unwrap_or_else(|| Error::plain(format!("ffmpeg did not start for {}", path.display()))))
}

/// Starts ffmpeg. `-xerror` is not used: it also rejects intact videos with unevenly spaced frames.
fn spawn(
    path: &Path,
    sync: [&str; 2],
    reason: &str,
    limits: Limits,
) -> Result<Option<Child>, Error> {
    // A file may name others, on other machines too: ffmpeg must not follow that. The prefix keeps it from
    // taking a part of the name for a protocol.
    let mut input = OsString::from("file:");
    input.push(path);
    let started = Command::new("ffmpeg")
        .args(["-v", "error", "-nostdin", "-protocol_whitelist", "file", "-max_pixels"])
        .arg(limits.pixels.to_string())
        .arg("-i")
        .arg(input)
        .args(["-map", "0:v:0"])
        .args(sync)
        .args(["-pix_fmt", "yuv444p", "-strict", "-1", "-f", "yuv4mpegpipe", "-"])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn();
    match started {
        Ok(child) => Ok(Some(child)),
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
