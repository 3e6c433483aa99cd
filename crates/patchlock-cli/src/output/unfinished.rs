//! The files in the making, known to the whole program, so that one that is ended at once leaves none of them behind.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// All that are open.
static OPEN: Mutex<Vec<Entry>> = Mutex::new(Vec::new());

struct Entry {
    part: PathBuf,
    target: PathBuf,
    overwrite: bool,
    /// Whether what is in it is of use before all of it is.
    useful: bool,
}

/// A file in the making; while this lives, it is known.
pub struct Unfinished {
    part: PathBuf,
}

fn open() -> MutexGuard<'static, Vec<Entry>> {
    // Nothing that holds it can leave the list half changed.
    OPEN.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Unfinished {
    /// Registers the temporary file `part` that is to become `target`.
    pub fn new(part: &Path, target: &Path, overwrite: bool) -> Self {
        let (part, target) = (part.to_path_buf(), target.to_path_buf());
        open().push(Entry { part: part.clone(), target, overwrite, useful: false });
        Self { part }
    }

    /// Says that it is worth keeping also as it is.
    pub fn useful(&self) {
        open().iter_mut().filter(|entry| entry.part == self.part).for_each(|e| e.useful = true);
    }

    /// Puts the file in its place; an end at once comes before or after it.
    pub fn settle<T>(&self, place: impl FnOnce() -> T) -> T {
        let mut open = open();
        let placed = place();
        open.retain(|entry| entry.part != self.part);
        placed
    }
}

/// While it lives, nothing is abandoned: for a part that only makes sense as a whole.
pub struct Hold {
    _open: MutexGuard<'static, Vec<Entry>>,
}

/// Makes an end at once wait.
pub fn hold() -> Hold {
    Hold { _open: open() }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        open().retain(|entry| entry.part != self.part);
    }
}

/// What became of the files.
#[derive(Debug, Default, PartialEq)]
pub struct Abandoned {
    /// Those in their place, as far as they were written.
    pub kept: Vec<PathBuf>,
    /// Those that are not there.
    pub lost: Vec<PathBuf>,
}

/// Puts useful files in their place and removes the others. The process must end now: nothing can be put in its place after this.
pub fn abandon() -> Abandoned {
    let mut open = open();
    let mut result = Abandoned::default();
    for entry in open.drain(..) {
        let list = if entry.keep() { &mut result.kept } else { &mut result.lost };
        list.push(entry.target);
    }
    // Never given back: who waits for it would go on to write.
    std::mem::forget(open);
    result
}

impl Entry {
    /// Whether it is in its place now; else it is removed.
    fn keep(&self) -> bool {
        let has_content = fs::metadata(&self.part).is_ok_and(|part| part.len() > 0);
        if self.useful && has_content && self.place().is_ok() {
            return true;
        }
        // Nothing more can be done for it on the way out.
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
    fn what_appeared_meanwhile_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let entry = |overwrite, useful| {
            fs::write(path("a.part"), "new").unwrap();
            Entry { part: path("a.part"), target: path("a.csv"), overwrite, useful }
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
