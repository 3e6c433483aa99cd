//! The history in a file beside the project, so that the next run of the program can undo, too. Each
//! line has what has happened up to a text of the project, and the hash of that text. Where no line
//! leads to the project as it is, another program has changed it, and the history is not used.

use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use patchlock_track::files;
use serde::Deserialize;
use sha2::{Digest as _, Sha256};

use super::file;
use super::history::{Event, History};

/// A file that has grown to twice its length and by this many bytes is written anew.
const SLACK: u64 = 8 << 20;

/// A line of the file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Line {
    /// SHA-256 of the project file, in hexadecimal digits.
    project: String,
    /// What has happened since the line before.
    events: Vec<Event>,
}

/// The file of a history.
#[derive(Debug)]
pub struct Log {
    path: PathBuf,
    /// The file as this run has begun it. It is never opened by its name to be written to: that may
    /// be the name of a link.
    file: Option<File>,
    /// Its length, and that when it was last written as a whole.
    length: [u64; 2],
}

impl Log {
    /// The file of a project, and the history in it that leads to this text of the project.
    pub fn open(project: &Path, text: Option<&[u8]>) -> (Self, History) {
        let mut name = project.file_name().unwrap_or_default().to_owned();
        name.push(".history");
        let path = project.with_file_name(name);
        let events = text.and_then(|text| read(&path, &hash(text)));
        let history = History::kept(events.unwrap_or_default());
        (Self { path, file: None, length: [0; 2] }, history)
    }

    /// Writes what has happened, before the project is written as this text. A history that cannot
    /// be written does not keep the project from being written: there is none then.
    pub fn write(&mut self, history: &mut History, text: &[u8]) {
        if self.try_write(history, text).is_err() {
            self.file = None;
            let _ = fs::remove_file(&self.path);
        }
    }

    fn try_write(&mut self, history: &mut History, text: &[u8]) -> io::Result<()> {
        let new = history.take_events();
        let [length, whole] = self.length;
        if let Some(file) = self.file.as_mut().filter(|_| length < 2 * whole + SLACK) {
            let line = line(&new, text);
            file.write_all(&line)?;
            file.sync_all()?;
            self.length[0] += line.len() as u64;
            return Ok(());
        }
        let line = line(&[history.whole()?], text);
        self.file = Some(file::replace(&self.path, &line)?);
        self.length = [line.len() as u64; 2];
        Ok(())
    }
}

/// The events that lead to the project with this hash; `None` if there are none, or the file is not
/// one of histories.
fn read(path: &Path, hash: &str) -> Option<Vec<Event>> {
    let text = files::read(path).ok()?;
    // The last line is cut where a process was killed.
    let lines = text.split(|&byte| byte == b'\n');
    let lines = lines.map_while(|line| serde_json::from_slice::<Line>(line).ok());
    let mut lines: Vec<Line> = lines.collect();
    let last = lines.iter().rposition(|line| line.project == hash)?;
    lines.truncate(last + 1);
    Some(lines.into_iter().flat_map(|line| line.events).collect())
}

fn line(events: &[String], text: &[u8]) -> Vec<u8> {
    let (project, events) = (hash(text), events.join(","));
    format!("{{\"project\":\"{project}\",\"events\":[{events}]}}\n").into_bytes()
}

/// SHA-256 in hexadecimal digits.
fn hash(text: &[u8]) -> String {
    Sha256::digest(text).iter().map(|byte| format!("{byte:02x}")).collect()
}
