//! A program with its lines, and patience with it.

use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

/// The longest line that is read whole.
const LONGEST_LINE: u64 = 1 << 20;
/// Lines that wait to be read: a program that chatters more has to wait itself.
const WAITING_LINES: usize = 1000;
/// How much of what the program says on its standard error is kept.
const LAST_WORDS: usize = 400;
/// How long a program that was told to quit may take.
const FAREWELL: Duration = Duration::from_secs(2);

/// Why no line came.
#[derive(Debug)]
pub enum Silence {
    /// Patience ran out after so many seconds.
    TooLong(f64),
    /// The program ended; its exit status in words.
    Ended(String),
}

/// A running program.
pub struct Process {
    child: Child,
    stdin: Option<ChildStdin>,
    lines: Receiver<String>,
    said: Arc<Mutex<String>>,
    patience: Duration,
}

impl Process {
    /// Starts a program with one variable more in its environment. It is waited for so long at most, each time.
    pub fn start(
        command: &[String],
        variable: (&str, &str),
        patience: Duration,
    ) -> Result<Self, String> {
        let (program, arguments) = command.split_first().ok_or("the command is empty")?;
        let mut command = Command::new(program);
        command.args(arguments).env(variable.0, variable.1);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child =
            command.spawn().map_err(|error| format!("cannot start {program}: {error}"))?;
        let (sender, lines) = mpsc::sync_channel(WAITING_LINES);
        let said = Arc::new(Mutex::new(String::new()));
        if let Some(stdout) = child.stdout.take() {
            thread::spawn(move || each_line(stdout, |line| sender.send(line).is_ok()));
        }
        if let Some(stderr) = child.stderr.take() {
            let said = Arc::clone(&said);
            thread::spawn(move || each_line(stderr, |line| remember(&said, &line)));
        }
        let stdin = child.stdin.take();
        Ok(Self { child, stdin, lines, said, patience })
    }

    /// Sends a line.
    pub fn write(&mut self, line: &str) -> Result<(), String> {
        let sent = self
            .stdin
            .as_mut()
            .map(|stdin| stdin.write_all(line.as_bytes()).and_then(|()| stdin.flush()));
        match sent {
            Some(Ok(())) => Ok(()),
            _ => Err(format!("the tracker ended ({}){}", self.status(), self.last_words())),
        }
    }

    /// The next line that is wanted; others are kept as last words.
    pub fn next(&mut self, wanted: impl Fn(&str) -> bool) -> Result<String, Silence> {
        let end = Instant::now() + self.patience;
        loop {
            let left = end.saturating_duration_since(Instant::now());
            match self.lines.recv_timeout(left) {
                Ok(line) if wanted(&line) => return Ok(line),
                Ok(line) => drop(remember(&self.said, &line)),
                Err(RecvTimeoutError::Timeout) => {
                    return Err(Silence::TooLong(self.patience.as_secs_f64()));
                }
                Err(RecvTimeoutError::Disconnected) => return Err(Silence::Ended(self.status())),
            }
        }
    }

    /// The last of what it said beside the protocol, for a message.
    pub fn last_words(&self) -> String {
        let said = self.said.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
        if said.is_empty() { String::new() } else { format!("; it said: {said}") }
    }

    /// The exit status in words. A program that has closed its output is about to end.
    fn status(&mut self) -> String {
        match wait(&mut self.child, FAREWELL) {
            Some(status) => status,
            None => "it still runs, but its output is closed".to_string(),
        }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.stdin = None; // the end of its input, for those that do not know quit
        if wait(&mut self.child, FAREWELL).is_none() {
            let _ = self.child.kill();
            let _ = self.child.wait();
        }
    }
}

/// The exit status in words, if it comes in time.
fn wait(child: &mut Child, patience: Duration) -> Option<String> {
    let end = Instant::now() + patience;
    loop {
        match child.try_wait() {
            Ok(Some(status)) => return Some(status.to_string()),
            Err(error) => return Some(error.to_string()),
            Ok(None) if Instant::now() >= end => return None,
            Ok(None) => thread::sleep(Duration::from_millis(5)),
        }
    }
}

/// Gives away line after line, in whatever encoding, until the end or until nobody wants more.
fn each_line(stream: impl Read, mut take: impl FnMut(String) -> bool) {
    let mut reader = BufReader::new(stream);
    loop {
        let mut line = Vec::new();
        match reader.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut line) {
            Ok(1..) => {
                let text = String::from_utf8_lossy(&line);
                if !take(text.trim_end_matches(['\n', '\r']).to_string()) {
                    return;
                }
            }
            Ok(0) | Err(_) => return,
        }
    }
}

/// Keeps the end of what is said.
fn remember(said: &Mutex<String>, line: &str) -> bool {
    let mut said = said.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    said.push_str(line);
    said.push('\n');
    let count = said.chars().count();
    if count > LAST_WORDS {
        *said = said.chars().skip(count - LAST_WORDS).collect();
    }
    true
}
