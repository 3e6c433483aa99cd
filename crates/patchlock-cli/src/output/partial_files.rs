//! A global list of the files that are being written, so that an immediate exit leaves none of them
//! behind.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// All open files.
static OPEN: Mutex<Vec<Entry>> = Mutex::new(Vec::new());

struct Entry {
    part: PathBuf,
    target: PathBuf,
    overwrite: bool,
    /// Whether to keep the file if it is incomplete.
    keep_partial: bool,
}

/// The registration of a file that is being written; dropping it removes the file from the list.
pub struct PartialFileGuard {
    part: PathBuf,
}

fn open() -> MutexGuard<'static, Vec<Entry>> {
    // A panic can't leave the list in an inconsistent state.
    OPEN.lock().unwrap_or_else(PoisonError::into_inner)
}

impl PartialFileGuard {
    /// Registers the temporary file `part`, which will become `target`.
    pub fn new(part: &Path, target: &Path, overwrite: bool) -> Self {
        let (part, target) = (part.to_path_buf(), target.to_path_buf());
        open().push(Entry { part: part.clone(), target, overwrite, keep_partial: false });
        Self { part }
    }

    /// Keeps the file on an immediate exit even if it is incomplete.
    pub fn keep_partial(&self) {
        let mut open = open();
        let entries = open.iter_mut().filter(|entry| entry.part == self.part);
        entries.for_each(|entry| entry.keep_partial = true);
    }

    /// Moves the file into place with `place`; an immediate exit can't interrupt this.
    pub fn settle<T>(&self, place: impl FnOnce() -> T) -> T {
        let mut open = open();
        let placed = place();
        open.retain(|entry| entry.part != self.part);
        placed
    }
}

/// Delays an immediate exit while it lives, for writes that must not be split.
pub struct ExitDelay {
    _open: MutexGuard<'static, Vec<Entry>>,
}

/// Delays an immediate exit until the guard is dropped.
pub fn delay_exit() -> ExitDelay {
    ExitDelay { _open: open() }
}

impl Drop for PartialFileGuard {
    fn drop(&mut self) {
        open().retain(|entry| entry.part != self.part);
    }
}

/// What became of the files at an immediate exit.
#[derive(Debug, Default, PartialEq)]
pub struct ExitCleanup {
    /// Files moved into place, as far as they were written.
    pub kept: Vec<PathBuf>,
    /// Files that were removed.
    pub removed: Vec<PathBuf>,
}

/// Moves partial files that should be kept into place and removes the others. The process must exit
/// after this: no file can be completed any more.
pub fn clean_up() -> ExitCleanup {
    let mut open = open();
    let mut result = ExitCleanup::default();
    for entry in open.drain(..) {
        let list = if entry.keep() { &mut result.kept } else { &mut result.removed };
        list.push(entry.target);
    }
    // Never unlock: a waiting thread would continue to write.
    std::mem::forget(open);
    result
}

impl Entry {
    /// Moves the file into place or removes it; returns whether it was kept.
    fn keep(&self) -> bool {
        let has_content = fs::metadata(&self.part).is_ok_and(|part| part.len() > 0);
        if self.keep_partial && has_content && self.place().is_ok() {
            return true;
        }
        // The program exits now, so an error can't be handled.
        let _ = fs::remove_file(&self.part);
        false
    }

    fn place(&self) -> io::Result<()> {
        if !self.overwrite && self.target.exists() {
            return Err(io::ErrorKind::AlreadyExists.into());
        }
        fs::rename(&self.part, &self.target)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn existing_files_are_replaced_only_with_overwrite() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let entry = |overwrite, keep_partial| {
            fs::write(path("a.part"), "new").unwrap();
            Entry { part: path("a.part"), target: path("a.csv"), overwrite, keep_partial }
        };
        let read = || fs::read_to_string(path("a.csv")).unwrap_or_default();
        assert!(!entry(false, false).keep() && read().is_empty());
        assert!(entry(false, true).keep() && read() == "new");
        fs::write(path("a.csv"), "other").unwrap();
        assert!(!entry(false, true).keep() && read() == "other");
        assert!(entry(true, true).keep() && read() == "new");
        assert!(!path("a.part").exists());
    }
}
