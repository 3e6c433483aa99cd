//! A global list of the files that are being written, so that an immediate exit leaves none of them
//! behind.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::TempPath;

/// All open files.
static OPEN: Mutex<Vec<Entry>> = Mutex::new(Vec::new());

/// A file that is being written under a temporary name. Dropping it removes the file.
struct Entry {
    part: TempPath,
    target: PathBuf,
    overwrite: bool,
    /// Whether to keep the file if it is incomplete.
    keep_partial: bool,
}

/// The registration of a file that is being written, by its temporary name; dropping it removes the
/// file.
pub struct PartialFileGuard(PathBuf);

fn open() -> MutexGuard<'static, Vec<Entry>> {
    // A panic can't leave the list in an inconsistent state.
    OPEN.lock().unwrap_or_else(PoisonError::into_inner)
}

impl PartialFileGuard {
    /// Registers the temporary file `part`, which will become `target`.
    pub fn new(part: TempPath, target: &Path, overwrite: bool) -> Self {
        let guard = Self(part.to_path_buf());
        open().push(Entry { part, target: target.to_path_buf(), overwrite, keep_partial: false });
        guard
    }

    /// Keeps the file on an immediate exit even if it is incomplete.
    pub fn keep_partial(&self) {
        let mut open = open();
        let entries = open.iter_mut().filter(|entry| *entry.part == *self.0);
        entries.for_each(|entry| entry.keep_partial = true);
    }

    /// Moves the file into place; an immediate exit can't interrupt this.
    pub fn settle(&self) -> io::Result<()> {
        let mut open = open();
        open.extract_if(.., |entry| *entry.part == *self.0).try_for_each(Entry::place)
    }
}

/// Delays an immediate exit until the guard is dropped, for writes that must not be split.
pub fn delay_exit() -> impl Drop {
    open()
}

impl Drop for PartialFileGuard {
    fn drop(&mut self) {
        open().retain(|entry| *entry.part != *self.0);
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
        let target = entry.target.clone();
        let list = if entry.keep() { &mut result.kept } else { &mut result.removed };
        list.push(target);
    }
    // Never unlock: a waiting thread would continue to write.
    std::mem::forget(open);
    result
}

impl Entry {
    /// Moves the file into place or removes it; returns whether it was kept.
    fn keep(self) -> bool {
        let has_content = fs::metadata(&self.part).is_ok_and(|part| part.len() > 0);
        self.keep_partial && has_content && self.place().is_ok()
    }

    fn place(self) -> io::Result<()> {
        let placed = match self.overwrite {
            true => self.part.persist(&self.target),
            false => self.part.persist_noclobber(&self.target),
        };
        placed.map_err(|error| error.error)
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
            let part = TempPath::try_from_path(path("a.part")).unwrap();
            Entry { part, target: path("a.csv"), overwrite, keep_partial }
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
