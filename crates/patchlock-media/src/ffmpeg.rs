//! Everything else: an `ffmpeg` binary decodes, a pipe brings the frames here as Y4M.

use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, ChildStderr, ChildStdout, Command, Stdio};
use std::thread::{self, JoinHandle};

use crate::{Error, FrameSource, y4m};

/// "Every frame once, none doubled", in the spelling of new and of old versions.
const EVERY_FRAME_ONCE: [[&str; 2]; 2] = [["-fps_mode", "passthrough"], ["-vsync", "0"]];

/// Opens a file by way of ffmpeg. `reason` says why it is needed, for the message when there is none.
pub fn open(path: &Path, reason: &str, reverse: bool) -> Result<Box<dyn FrameSource>, Error> {
    let mut last_error = None;
    for sync in EVERY_FRAME_ONCE {
        let Some(mut child) = spawn(path, sync, reason)? else { continue };
        let (Some(output), Some(errors)) = (child.stdout.take(), child.stderr.take()) else {
            continue;
        };
        let words = thread::spawn(move || words(errors));
        let pipe = Pipe { child, output, words: Some(words) };
        match y4m::open_stream(pipe, &path.display().to_string(), reverse) {
            Ok(frames) => return Ok(frames),
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

/// Starts ffmpeg. Not with `-xerror`, which also ends healthy videos whose frames are not evenly spaced in
/// time.
fn spawn(path: &Path, sync: [&str; 2], reason: &str) -> Result<Option<Child>, Error> {
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
        Err(error) if error.kind() == io::ErrorKind::NotFound => Err(Error::source(
            format!(
                "{} {reason}, which needs the program ffmpeg, and there is none in the PATH",
                path.display()
            ),
            "install ffmpeg, or convert the video elsewhere to an MP4 with H.264 of 8 bits and 4:2:0 \
             (yuv420p)",
        )),
        Err(error) => Err(Error::because("cannot start ffmpeg".to_string())(error)),
    }
}

/// What ffmpeg wrote about its troubles: the first line, which is mostly the cause, and the last one. Empty
/// where all went well.
fn words(errors: ChildStderr) -> String {
    let (mut first, mut last) = (None, None);
    for line in BufReader::new(errors).split(b'\n').map_while(Result::ok) {
        let line = plain(&String::from_utf8_lossy(&line));
        if !line.is_empty() {
            *if first.is_none() { &mut first } else { &mut last } = Some(line);
        }
    }
    first.into_iter().chain(last).collect::<Vec<_>>().join(" ... ")
}

/// A line without the address in memory before it, as in `[hevc @ 0x55e5cc57e4c0] `; nothing for one that
/// only counts others.
fn plain(line: &str) -> String {
    let line = line.trim();
    let said =
        line.split_once("] ").filter(|_| line.starts_with('[')).map_or(line, |(_, said)| said);
    if said.starts_with("Last message repeated") { String::new() } else { said.to_string() }
}

/// The output of ffmpeg, which at its end turns a failed exit, and words about damage, into an error.
struct Pipe {
    child: Child,
    output: ChildStdout,
    words: Option<JoinHandle<String>>,
}

impl Pipe {
    /// Whether the end of the output is that of the video. ffmpeg leaves out what it can't decode and yet
    /// calls that a success: only its words tell.
    fn check_end(&mut self) -> io::Result<()> {
        let status = self.child.wait()?;
        let words = self.words.take().and_then(|words| words.join().ok()).unwrap_or_default();
        if !status.success() {
            let words = if words.is_empty() { "no reason given" } else { &words };
            return Err(io::Error::other(format!("ffmpeg failed: {words}")));
        }
        if !words.is_empty() {
            return Err(io::Error::other(format!(
                "ffmpeg gave no more frames and found damage, perhaps in earlier frames too: {words}"
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
        // It may have ended by itself already, and then neither call has anything to do.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
