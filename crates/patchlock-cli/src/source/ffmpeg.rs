//! Everything else: an `ffmpeg` binary decodes, a pipe brings the frames here as Y4M.

use std::io::Read;
use std::path::Path;
use std::process::{Child, ChildStderr, ChildStdout, Command, Stdio};
use std::thread::{self, JoinHandle};

use anyhow::{Context, Result};

use super::{FrameSource, y4m};
use crate::complaint::failed;

/// "Every frame once, none doubled", in the spelling of new and of old versions.
const EVERY_FRAME_ONCE: [[&str; 2]; 2] = [["-fps_mode", "passthrough"], ["-vsync", "0"]];

/// Opens a file by way of ffmpeg. `reason` says why it is needed, for the message when there is none.
pub fn open(path: &Path, reason: &str, reverse: bool) -> Result<Box<dyn FrameSource>> {
    let mut last_error = None;
    for sync in EVERY_FRAME_ONCE {
        let Some(mut child) = spawn(path, sync, reason)? else { continue };
        let (Some(output), Some(errors)) = (child.stdout.take(), child.stderr.take()) else {
            continue;
        };
        let words = thread::spawn(move || last_words(errors));
        let pipe = Pipe { child, output, words: Some(words), name: path.display().to_string() };
        match y4m::open_stream(pipe, &path.display().to_string(), reverse) {
            Ok(frames) => return Ok(frames),
            Err(error) => {
                let old_version = format!("{error:#}").contains("fps_mode");
                last_error = Some(error);
                if !old_version {
                    break;
                }
            }
        }
    }
    Err(last_error
        .unwrap_or_else(|| failed(format!("ffmpeg did not start for {}", path.display())).into()))
}

fn spawn(path: &Path, sync: [&str; 2], reason: &str) -> Result<Option<Child>> {
    let started = Command::new("ffmpeg")
        .args(["-v", "error", "-nostdin", "-i"])
        .arg(path)
        .args(["-map", "0:v:0"])
        .args(sync)
        .args(["-pix_fmt", "yuv444p", "-strict", "-1", "-f", "yuv4mpegpipe", "-"])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn();
    match started {
        Ok(child) => Ok(Some(child)),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Err(failed(format!(
            "{} {reason}, which needs the program ffmpeg, and there is none in the PATH",
            path.display()
        ))
        .hint("install ffmpeg, or convert the video elsewhere to an MP4 with H.264")
        .into()),
        Err(error) => Err(error).context("cannot start ffmpeg"),
    }
}

/// The last line that ffmpeg wrote about its troubles.
fn last_words(mut errors: ChildStderr) -> String {
    let mut text = Vec::new();
    // What can't be read can't be reported; the exit status still tells of the failure.
    let _ = errors.read_to_end(&mut text);
    let text = String::from_utf8_lossy(&text);
    text.lines()
        .rev()
        .find(|line| !line.trim().is_empty())
        .unwrap_or("no reason given")
        .trim()
        .to_string()
}

/// The output of ffmpeg, which at its end turns a failed exit into an error.
struct Pipe {
    child: Child,
    output: ChildStdout,
    words: Option<JoinHandle<String>>,
    name: String,
}

impl Read for Pipe {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.output.read(buffer)?;
        if count == 0 && !buffer.is_empty() && !self.child.wait()?.success() {
            let words = self.words.take().and_then(|words| words.join().ok()).unwrap_or_default();
            return Err(std::io::Error::other(format!("ffmpeg failed on {}: {words}", self.name)));
        }
        Ok(count)
    }
}

impl Drop for Pipe {
    fn drop(&mut self) {
        // It may have ended by itself already, and then neither call has anything to do.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
