//! Only one process writes a project: it holds a lock on a file beside it.

use std::fs::{self, File, TryLockError};
use std::io::{Read as _, Write as _};
use std::path::{Path, PathBuf};

use super::Error;

/// A lock, held until it is dropped or the process ends.
#[derive(Debug)]
pub struct Lock {
    path: PathBuf,
    file: File,
}

impl Lock {
    /// Takes the lock of a project file.
    ///
    /// # Errors
    /// [`Error::InUse`] if another process has it, or another store of this process;
    /// [`Error::Write`].
    pub fn take(project: &Path) -> Result<Self, Error> {
        let path = lock_file(project);
        let cannot = |error| Error::write(&path, error);
        loop {
            let mut options = File::options();
            let file = options.create(true).truncate(false).read(true).write(true).open(&path);
            let file = file.map_err(cannot)?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => {
                    return Err(Error::InUse { path: project.to_path_buf(), by: holder(&file) });
                }
                // Some network file systems have no locks.
                Err(TryLockError::Error(error))
                    if error.kind() == std::io::ErrorKind::Unsupported => {}
                Err(TryLockError::Error(error)) => return Err(cannot(error)),
            }
            // The one who had it may have removed the file after it was opened here.
            if is_at(&file, &path) {
                // From here on, an error removes the file.
                let mut lock = Self { path: path.clone(), file };
                lock.file.set_len(0).map_err(cannot)?;
                write!(lock.file, "process {}", std::process::id()).map_err(cannot)?;
                return Ok(lock);
            }
        }
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // The lock is still held, so nobody else's file is removed. If it cannot be removed, it
        // does no harm.
        if cfg!(unix) {
            let _ = fs::remove_file(&self.path);
        }
    }
}

fn lock_file(project: &Path) -> PathBuf {
    let mut name = project.as_os_str().to_owned();
    name.push(".lock");
    PathBuf::from(name)
}

/// Who has the lock, as its file says.
fn holder(mut file: &File) -> String {
    let mut text = String::new();
    // Windows lets nobody else read a locked file.
    let _ = (&mut file).take(100).read_to_string(&mut text);
    match text.strip_prefix("process ").map(str::parse::<u32>) {
        Some(Ok(id)) if id == std::process::id() => "this process".to_owned(),
        Some(Ok(id)) => format!("another process, number {id}"),
        _ => "another process".to_owned(),
    }
}

/// Whether the path still leads to this file.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt as _;
    let id =
        |about: std::io::Result<fs::Metadata>| about.ok().map(|about| (about.dev(), about.ino()));
    id(file.metadata()) == id(fs::metadata(path))
}

/// Whether the path still leads to this file: it is never removed.
#[cfg(not(unix))]
fn is_at(_: &File, _: &Path) -> bool {
    true
}
