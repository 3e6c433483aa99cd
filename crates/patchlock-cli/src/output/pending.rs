//! Atomic files: written under a temporary name in the same folder and renamed when they are
//! complete.

use std::fmt::Display;
use std::fs::{self, File};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use anyhow::Result;
use patchlock_media::without_path;
use patchlock_track::files::{folder_of, temporary_in};

use super::partial_files::{self, PartialFileGuard};
use super::printed::quoted;
use crate::failure::{Failure, failed, usage};

/// A file that is being written. It is removed if it is dropped without [`PendingFile::commit`].
pub struct PendingFile {
    target: PathBuf,
    writer: BufWriter<File>,
    /// The temporary file. Devices and pipes can't be replaced by renaming, so they are written
    /// directly.
    temporary: Option<PartialFileGuard>,
}

/// Fails early if the target could not be written in the end.
pub fn check(target: &Path, overwrite: bool) -> Result<(), Failure> {
    if target.is_dir() {
        return Err(usage(format!("cannot write {}: it is a folder", target.display()))
            .hint("name a file inside it"));
    }
    if target.is_file() && !overwrite {
        return Err(
            usage(format!("{} already exists", target.display())).hint("--overwrite replaces it")
        );
    }
    if target.is_symlink() && !target.exists() {
        let message = format!("cannot write {}: it is a link that leads nowhere", target.display());
        return Err(usage(message).hint("remove it, or name another file"));
    }
    let folder = folder_of(target);
    if !folder.is_dir() {
        return Err(failed(format!(
            "cannot write {}: there is no folder {}",
            target.display(),
            folder.display()
        ))
        .hint(format!("mkdir -p {} creates it", quoted(folder))));
    }
    Ok(())
}

impl PendingFile {
    /// Opens the temporary file, so that a missing write permission is noticed before the work
    /// starts.
    pub fn create(target: &Path, overwrite: bool) -> Result<Self, Failure> {
        check(target, overwrite)?;
        // Follow links: the target gets the new content, the link stays.
        let target = dunce::canonicalize(target).unwrap_or_else(|_| target.to_path_buf());
        let opened = match target.exists() && !target.is_file() {
            true => fs::OpenOptions::new().write(true).open(&target).map(|file| (file, None)),
            false => temporary_in(folder_of(&target)).map(|file| {
                let (file, part) = file.into_parts();
                (file, Some(PartialFileGuard::new(part, &target, overwrite)))
            }),
        };
        let (file, temporary) = opened.map_err(|error| cannot_write(target.display(), &error))?;
        Ok(Self { target, writer: BufWriter::new(file), temporary })
    }

    /// The final path of the file.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Keeps the file even if the program exits immediately, before the file is complete.
    pub fn keep_partial(self) -> Self {
        self.temporary.iter().for_each(PartialFileGuard::keep_partial);
        self
    }

    /// Delays an immediate exit while the guard lives. Not for devices and pipes, where writing may
    /// block forever.
    pub fn delay_exit(&self) -> Option<impl Drop + use<>> {
        self.temporary.as_ref().map(|_| partial_files::delay_exit())
    }

    /// Writes the whole content and returns the file.
    pub fn filled(mut self, content: &[u8]) -> Result<Self, Failure> {
        match self.write_all(content).and_then(|()| self.flush()) {
            Ok(()) => Ok(self),
            Err(error) => Err(self.write_error(&error)),
        }
    }

    /// Moves the complete file into place and returns its path.
    pub fn commit(mut self) -> Result<PathBuf, Failure> {
        let mut placed = self.writer.flush();
        if let Some(temporary) = &self.temporary {
            // Sync before renaming: a power failure must not leave a name without the content.
            placed = placed.and_then(|()| self.writer.get_ref().sync_all());
            placed = placed.and_then(|()| temporary.settle());
        }
        placed.map_err(|error| self.write_error(&error))?;
        Ok(self.target)
    }

    /// Adds the name of the file to an error.
    pub fn write_error(&self, error: &io::Error) -> Failure {
        cannot_write(self.target.display(), error)
    }

    /// A function that does the same after the file has been moved elsewhere.
    pub fn error_handler(&self) -> impl Fn(patchlock_media::Error) -> Failure + 'static {
        let target = self.target.clone();
        move |error| match error {
            patchlock_media::Error::Write(cause) => cannot_write(target.display(), &cause),
            other => other.into(),
        }
    }
}

/// The error for a failed write, with advice. `target` is a file, or `to standard output`.
pub(super) fn cannot_write(target: impl Display, error: &io::Error) -> Failure {
    // Errors of temporary files contain the temporary name, which means nothing to the user.
    let plain = without_path(error);
    let error = plain.as_ref().unwrap_or(error);
    let hint = match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            "the disk is full: free some space or write elsewhere"
        }
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "choose a folder in which you may write"
        }
        io::ErrorKind::AlreadyExists => {
            "it was created while the tracker ran; --overwrite replaces it"
        }
        _ => "check the folder and the disk",
    };
    failed(format!("cannot write {target}: {error}")).hint(hint)
}

impl Write for PendingFile {
    fn write(&mut self, data: &[u8]) -> io::Result<usize> {
        self.writer.write(data)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

impl Seek for PendingFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.writer.seek(to)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_appears_with_the_commit() {
        let folder = tempfile::tempdir().expect("a folder");
        let target = folder.path().join("a.csv");
        let mut file = PendingFile::create(&target, false).expect("creates");
        file.write_all(b"data").expect("writes");
        assert!(!target.exists());
        file.commit().expect("commits");
        assert_eq!(fs::read(&target).expect("reads"), b"data");

        assert!(PendingFile::create(&target, false).is_err(), "it exists");
        drop(PendingFile::create(&target, true).expect("may overwrite"));
        assert_eq!(fs::read(&target).expect("reads"), b"data", "a dropped file changes nothing");
        assert_eq!(
            fs::read_dir(folder.path()).expect("lists").count(),
            1,
            "no temporary files are left"
        );
    }
}
