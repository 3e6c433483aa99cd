//! What ffmpeg writes to standard error while it decodes: when each frame is shown, before it
//! writes that frame, and error messages.

use std::io::{self, BufReader, Read};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use crate::child::{locked, silent};
use crate::y4m;

/// A message may come so many frames before the frame that it is about: a decoder has several
/// threads, and holds frames back to reorder them.
const EARLY: usize = 64;
/// How long the time of a frame may come after the frame itself.
const COMES: Duration = Duration::from_secs(5);
/// Most messages that are kept.
const MOST: usize = 10_000;

/// What one run of ffmpeg says.
#[derive(Clone)]
pub(crate) struct DecoderLog {
    shared: Arc<(Mutex<Lines>, Condvar)>,
    timeout: Duration,
}

#[derive(Default)]
struct Lines {
    /// In millionths of a second; `None` for a frame without a time.
    times: Vec<Option<i64>>,
    /// The first frame that differs from the first of all in size or format.
    change: Option<usize>,
    /// The first one at each frame that has some.
    messages: Vec<LogMessage>,
    /// The text of the last one.
    last: String,
    /// Nothing more comes.
    is_over: bool,
    /// The time of a frame did not come, so nobody waits for those of others.
    is_mute: bool,
}

/// A line that is no time of a frame.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LogMessage {
    /// How many times of frames had come before it.
    pub at: usize,
    pub text: String,
}

impl DecoderLog {
    /// Reads what is said on a thread.
    pub(crate) fn listen(errors: impl Read + Send + 'static, timeout: Duration) -> Self {
        let log = Self { shared: Arc::default(), timeout };
        let shared = Arc::clone(&log.shared);
        thread::spawn(move || {
            let mut errors = BufReader::new(errors);
            while let Some(line) = y4m::piece_of_line(&mut errors).ok().flatten() {
                locked(&shared.0).hear(&line);
                shared.1.notify_all();
            }
            locked(&shared.0).is_over = true;
            shared.1.notify_all();
        });
        log
    }

    /// When a frame of this run is shown, in millionths of a second; `None` if ffmpeg does not say.
    pub(crate) fn time(&self, at: usize) -> Option<i64> {
        let mut lines = locked(&self.shared.0);
        loop {
            if let Some(time) = lines.times.get(at) {
                return *time;
            }
            if lines.is_over || lines.is_mute {
                return None;
            }
            let waited = self.shared.1.wait_timeout(lines, self.timeout.min(COMES));
            let (now, time) = waited.unwrap_or_else(PoisonError::into_inner);
            lines = now;
            lines.is_mute |= time.timed_out() && lines.times.len() <= at;
        }
    }

    /// Waits until ffmpeg has said everything. Returns its first message, which usually names the
    /// cause, and the last one; empty if there is none.
    pub(crate) fn whole(&self) -> io::Result<String> {
        let mut lines = locked(&self.shared.0);
        while !lines.is_over {
            let waited = self.shared.1.wait_timeout(lines, self.timeout);
            let (now, time) = waited.unwrap_or_else(PoisonError::into_inner);
            lines = now;
            if time.timed_out() && !lines.is_over {
                return Err(silent(self.timeout));
            }
        }
        let first = lines.messages.first().map(|first| first.text.as_str()).unwrap_or_default();
        Ok(if first == lines.last {
            first.to_string()
        } else {
            format!("{first} ... {}", lines.last)
        })
    }

    /// The first message so far.
    pub(crate) fn first(&self) -> Option<LogMessage> {
        locked(&self.shared.0).messages.first().cloned()
    }

    /// What may be about this frame: the first message there or not far before it.
    pub(crate) fn near(&self, at: usize) -> Option<LogMessage> {
        let lines = locked(&self.shared.0);
        let first = lines.messages.partition_point(|message| message.at + EARLY < at);
        lines.messages.get(first).filter(|message| message.at <= at).cloned()
    }

    /// The first frame that has another size or format than the first of all.
    pub(crate) fn change(&self) -> Option<usize> {
        locked(&self.shared.0).change
    }
}

impl Lines {
    fn hear(&mut self, line: &str) {
        // A time may come within a message, which ffmpeg writes in pieces.
        let message = match time_in(line) {
            Some((before, number, time)) => {
                // ffmpeg counts anew for frames of another kind.
                if number == 0 && !self.times.is_empty() {
                    self.change.get_or_insert(self.times.len());
                }
                self.times.push(time);
                before
            }
            None => line.strip_suffix("n=0").unwrap_or(line),
        };
        let text = without_address(message);
        if text.is_empty() {
            return;
        }
        self.last.clone_from(&text);
        let at = self.times.len();
        let is_new = self.messages.last().is_none_or(|last| last.at < at);
        if is_new && self.messages.len() < MOST {
            self.messages.push(LogMessage { at, text });
        }
    }
}

/// The text before the time of a frame, its number, and the time.
fn time_in(line: &str) -> Option<(&str, u64, Option<i64>)> {
    let (before, rest) = line.split_once("frame:")?;
    let (number, after) = rest.split_once(" pts:")?;
    let time = after.split_whitespace().next().and_then(|text| text.parse().ok());
    Some((before, number.trim().parse().ok()?, time))
}

/// Removes a leading memory address such as `[hevc @ 0x55e5cc57e4c0] `. Returns an empty string for
/// a line that says nothing else, or only counts repetitions.
pub(crate) fn without_address(line: &str) -> String {
    let line = line.trim();
    let text = match line.strip_prefix('[').and_then(|line| line.split_once(']')) {
        Some((address, text)) if address.contains(" @ ") => text.trim_start(),
        _ => line,
    };
    if text.starts_with("Last message repeated") { String::new() } else { text.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_and_messages_are_separated() {
        let text = "frame:0    pts:0       pts_time:0\nn=0\n\
                    [mjpeg @ 0x55] frame:1    pts:40000   pts_time:0.04\nn=0\n\
                    overread 8\n    Last message repeated 3 times\n\
                    [h264 @ 0x7f] n=0\nframe:2    pts:NOPTS   pts_time:NOPTS\nn=0\n\
                    error while decoding MB 9 7\n\
                    frame:0    pts:120000  pts_time:0.12\nn=0\n";
        let log = DecoderLog::listen(text.as_bytes(), Duration::from_secs(20));
        assert_eq!(log.whole().unwrap(), "overread 8 ... error while decoding MB 9 7");
        let times: Vec<_> = (0..5).map(|at| log.time(at)).collect();
        assert_eq!(times, [Some(0), Some(40_000), None, Some(120_000), None]);
        assert_eq!(log.first(), Some(LogMessage { at: 2, text: "overread 8".to_string() }));
        assert_eq!(log.change(), Some(3));
        let near = |at| log.near(at).map(|message| message.text);
        assert_eq!(near(1), None);
        assert_eq!(near(2 + EARLY).as_deref(), Some("overread 8"));
        assert_eq!(near(3 + EARLY).as_deref(), Some("error while decoding MB 9 7"));
        assert_eq!(near(4 + EARLY), None);
    }
}
