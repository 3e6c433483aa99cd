//! Only one process writes a project: it holds a lock on a file beside it.

use std::fs::{self, File, TryLockError};
use std::io::{self, Read as _, Seek as _, Write as _};
use std::path::{Path, PathBuf};

#[cfg(unix)]
use rustix::fs::OFlags;

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
    /// [`Error::Track`], also if something else has the name of the lock's file.
    pub fn take(project: &Path) -> Result<Self, Error> {
        let path = lock_file(project);
        let cannot = |error| Error::write(&path, error);
        loop {
            // What is there already is never written to: it may be anything.
            let (file, is_new) = match create(&path) {
                Ok(file) => (file, true),
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => match existing(&path)
                {
                    Ok(file) => (file, false),
                    // It has just been removed.
                    Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                    Err(error) => return Err(cannot(error)),
                },
                Err(error) => return Err(cannot(error)),
            };
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => {
                    return Err(Error::InUse { path: project.to_path_buf(), by: holder(&file) });
                }
                // Some network file systems have no locks.
                Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => {}
                Err(TryLockError::Error(error)) => return Err(cannot(error)),
            }
            // The one who had it may have removed the file after it was opened here.
            if !is_at(&file, &path) {
                continue;
            }
            if is_new {
                // From here on, an error removes the file.
                let mut lock = Self { path: path.clone(), file };
                write!(lock.file, "{OURS}{}", std::process::id()).map_err(cannot)?;
                return Ok(lock);
            }
            if !cfg!(unix) {
                return Ok(Self { path, file });
            }
            // A process that was killed has left it. Nobody else removes it while it is locked.
            fs::remove_file(&path).map_err(cannot)?;
        }
    }
}

/// How the text of a lock's file begins; the number of a process follows.
const OURS: &str = "process ";
/// Bytes of the longest such text.
const LONGEST: u64 = 20;

/// Makes the file, unless something has its name, and be it a link that leads nowhere.
fn create(path: &Path) -> io::Result<File> {
    File::options().create_new(true).read(true).write(true).open(path)
}

/// Opens the file that a lock has left, and nothing else.
fn existing(path: &Path) -> io::Result<File> {
    let refused = |what: &str| {
        let reason = format!("{what}, not a lock of Patchlock: look at it, then remove it");
        Err(io::Error::new(io::ErrorKind::AlreadyExists, reason))
    };
    let about = fs::symlink_metadata(path)?;
    if about.is_symlink() {
        return refused("it is a link");
    }
    if !about.is_file() {
        return refused("it is not a file");
    }
    let mut options = File::options();
    // Some network file systems lock only what may be written to.
    options.read(true).write(true);
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt as _;
        // A link or a pipe may have taken its place.
        let flags = OFlags::NOFOLLOW | OFlags::NONBLOCK;
        options.custom_flags(flags.bits().cast_signed());
    }
    let file = options.open(path)?;
    // Windows lets nobody else read a locked file.
    if cfg!(unix) && (!file.metadata()?.is_file() || !is_ours(&file)?) {
        return refused("it is a file of its own");
    }
    Ok(file)
}

/// Whether a file holds what [`Lock::take`] writes, or nothing yet.
fn is_ours(file: &File) -> io::Result<bool> {
    let text = beginning(file)?;
    let number = text.strip_prefix(OURS);
    let is_number = |digits: &str| !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit());
    Ok(text.is_empty() || number.is_some_and(is_number))
}

/// The text at the beginning of a file, somewhat longer than that of a lock. The file is at its
/// beginning afterwards.
fn beginning(mut file: &File) -> io::Result<String> {
    let mut bytes = Vec::new();
    file.take(LONGEST).read_to_end(&mut bytes)?;
    file.rewind()?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
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
fn holder(file: &File) -> String {
    // Windows lets nobody else read a locked file.
    let text = beginning(file).unwrap_or_default();
    match text.strip_prefix(OURS).map(str::parse::<u32>) {
        Some(Ok(id)) if id == std::process::id() => "this process".to_owned(),
        Some(Ok(id)) => format!("another process, number {id}"),
        _ => "another process".to_owned(),
    }
}

/// Whether the path still leads to this file.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt as _;
    let id = |about: io::Result<fs::Metadata>| about.ok().map(|about| (about.dev(), about.ino()));
    id(file.metadata()) == id(fs::symlink_metadata(path))
}

/// Whether the path still leads to this file: it is never removed.
#[cfg(not(unix))]
fn is_at(_: &File, _: &Path) -> bool {
    true
}
