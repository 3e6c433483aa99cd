//! A child process that exchanges lines of text, with a time limit for each line.

use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use patchlock_track::names;

/// The longest line that is kept, in bytes; the rest of a longer one is dropped.
const MAX_LINE_BYTES: u64 = 1 << 16;
/// Capacity of the queue of lines; a program that writes more has to wait.
const QUEUED_LINES: usize = 100;
/// Characters of other output that are kept for error messages.
const KEPT_OUTPUT: usize = 400;
/// Time limit for exiting.
const EXIT_TIMEOUT: Duration = Duration::from_secs(2);

/// A line that the program has written, or one for it.
struct Line {
    text: String,
    /// Whether it ended within [`MAX_LINE_BYTES`].
    whole: bool,
}

/// A running program.
pub struct Process {
    child: Child,
    /// Lines for the thread that writes them, since a program that does not read would never let us
    /// go on. `None` closes the program's input.
    input: Option<Sender<Line>>,
    lines: Receiver<Line>,
    output: Arc<Mutex<String>>,
    timeout: Duration,
}

impl Process {
    /// Starts a program with one additional environment variable. `timeout` is the time limit for
    /// each line.
    pub fn start(
        command: &[String],
        variable: (&str, &str),
        timeout: Duration,
    ) -> Result<Self, String> {
        let (program, arguments) = command.split_first().ok_or("the command is empty")?;
        let mut command = Command::new(program);
        command.args(arguments).env(variable.0, variable.1);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child =
            command.spawn().map_err(|error| format!("cannot start {program}: {error}"))?;
        let (sender, lines) = mpsc::sync_channel(QUEUED_LINES);
        let output = Arc::new(Mutex::new(String::new()));
        let on_thread = |work: Box<dyn FnOnce() + Send>| drop(thread::spawn(work));
        if let Some(mut stdout) = child.stdout.take() {
            on_thread(Box::new(move || each_line(&mut stdout, &|line| sender.send(line).is_ok())));
        }
        if let Some(mut stderr) = child.stderr.take() {
            let output = Arc::clone(&output);
            on_thread(Box::new(move || {
                each_line(&mut stderr, &|line| remember(&output, &line.text));
            }));
        }
        let (input, written) = mpsc::channel::<Line>();
        if let Some(mut stdin) = child.stdin.take() {
            on_thread(Box::new(move || {
                let mut lines = written.into_iter();
                let _ = lines.try_for_each(|line| stdin.write_all(line.text.as_bytes()));
            }));
        }
        Ok(Self { child, input: Some(input), lines, output, timeout })
    }

    /// Sends a line to the program's standard input.
    pub fn write(&mut self, line: &str) -> Result<(), String> {
        let line = Line { text: line.to_string(), whole: true };
        match self.input.as_ref().map(|input| input.send(line)) {
            Some(Ok(())) => Ok(()),
            _ => Err(format!("the tracker exited ({}){}", self.status(), self.recent_output())),
        }
    }

    /// The next line that is `wanted`; other lines are kept for error messages. `what` is what the
    /// program is expected to send.
    ///
    /// # Errors
    /// Why there is no such line.
    pub fn next(&mut self, what: &str, wanted: impl Fn(&str) -> bool) -> Result<String, String> {
        let end = Instant::now() + self.timeout;
        loop {
            // A program that never stops writing other lines has no more time than a silent one.
            let left = end.saturating_duration_since(Instant::now());
            let line = match left.is_zero() {
                true => Err(RecvTimeoutError::Timeout),
                false => self.lines.recv_timeout(left),
            };
            let reason = match line {
                Ok(line) if !wanted(&line.text) => {
                    remember(&self.output, &line.text);
                    continue;
                }
                Ok(line) if line.whole => return Ok(line.text),
                Ok(_) => {
                    let most =
                        format!("the tracker sent a message of more than {MAX_LINE_BYTES} bytes");
                    return Err(most);
                }
                Err(RecvTimeoutError::Timeout) => {
                    format!("did not send {what} within {} s", self.timeout.as_secs_f64())
                }
                Err(RecvTimeoutError::Disconnected) => {
                    format!("exited ({}) without sending {what}", self.status())
                }
            };
            return Err(format!("the tracker {reason}{}", self.recent_output()));
        }
    }

    /// The end of the program's other output, as a suffix of an error message.
    pub fn recent_output(&self) -> String {
        let output = self.output.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        let output = names::plain(&output.split_whitespace().collect::<Vec<_>>().join(" "));
        if output.is_empty() { String::new() } else { format!("; its output: {output}") }
    }

    /// The exit status in words. Called when the output is closed, so the program is expected to
    /// exit soon.
    fn status(&mut self) -> String {
        match wait(&mut self.child, EXIT_TIMEOUT) {
            Some(status) => status,
            None => "still running, but with its output closed".to_string(),
        }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.input = None; // end of input, for programs that do not handle quit
        if wait(&mut self.child, EXIT_TIMEOUT).is_none() {
            let _ = self.child.kill();
            let _ = self.child.wait();
        }
    }
}

/// The exit status in words; `None` after the timeout.
fn wait(child: &mut Child, timeout: Duration) -> Option<String> {
    let end = Instant::now() + timeout;
    loop {
        match child.try_wait() {
            Ok(Some(status)) => return Some(status.to_string()),
            Err(error) => return Some(error.to_string()),
            Ok(None) if Instant::now() >= end => return None,
            Ok(None) => thread::sleep(Duration::from_millis(5)),
        }
    }
}

/// Passes lines to `take` until the end of the stream or until `take` returns false. Invalid UTF-8
/// is replaced.
fn each_line(stream: &mut dyn Read, take: &dyn Fn(Line) -> bool) {
    let mut reader = BufReader::new(stream);
    let mut bytes = Vec::new();
    loop {
        bytes.clear();
        let read = reader.by_ref().take(MAX_LINE_BYTES).read_until(b'\n', &mut bytes);
        if !matches!(read, Ok(1..)) {
            return;
        }
        let whole = bytes.ends_with(b"\n") || (bytes.len() as u64) < MAX_LINE_BYTES;
        let text = String::from_utf8_lossy(&bytes).trim_end_matches(['\n', '\r']).to_string();
        if !take(Line { text, whole }) || !(whole || reader.skip_until(b'\n').is_ok()) {
            return;
        }
    }
}

/// Appends a line to the kept output and truncates it at the front. Always returns true.
fn remember(output: &Mutex<String>, line: &str) -> bool {
    let mut output = output.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    output.push_str(line);
    output.push('\n');
    let count = output.chars().count();
    if count > KEPT_OUTPUT {
        *output = output.chars().skip(count - KEPT_OUTPUT).collect();
    }
    true
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    /// Its input is soon full, since a pipe holds little.
    #[test]
    fn a_program_that_never_reads_is_not_waited_for() {
        let script = "echo hello; sleep 1000 & echo $!; wait";
        let command = ["sh", "-c", script].map(String::from);
        let mut process = Process::start(&command, ("X", "1"), Duration::from_millis(500)).unwrap();
        let line = "x".repeat(1 << 20) + "\n";
        for _ in 0..4 {
            process.write(&line).unwrap();
        }
        assert_eq!(process.next("a line", |_| true).unwrap(), "hello");
        let sleeper = process.next("a line", |_| true).unwrap();
        let error = process.next("a line", |_| true).unwrap_err();
        assert_eq!(error, "the tracker did not send a line within 0.5 s");
        drop(process);
        assert!(Command::new("kill").arg(sleeper).status().unwrap().success());
    }
}
