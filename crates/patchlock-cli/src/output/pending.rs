//! A file that appears only when it is complete: written under a temporary name in the same folder, then
//! renamed.

use std::fmt::Display;
use std::fs::{self, File};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use anyhow::Result;
use patchlock_media::without_path;
use tempfile::NamedTempFile;

use super::printed::quoted;
use super::unfinished::{self, Unfinished};
use crate::complaint::{Complaint, failed, usage};

/// A file in the making. Dropped without [`PendingFile::commit`], it leaves nothing behind.
pub struct PendingFile {
    target: PathBuf,
    overwrite: bool,
    writer: Writer,
}

enum Writer {
    Temporary(BufWriter<NamedTempFile>, Unfinished),
    /// Devices and pipes can't be replaced by a renamed file: they are written directly.
    Direct(BufWriter<File>),
}

/// Complains early about a target that could not be written in the end.
pub fn check(target: &Path, overwrite: bool) -> Result<(), Complaint> {
    if target.is_dir() {
        return Err(usage(format!("cannot write {}: it is a folder", target.display()))
            .hint("name a file in it"));
    }
    if target.is_file() && !overwrite {
        return Err(
            usage(format!("{} exists already", target.display())).hint("--overwrite replaces it")
        );
    }
    let folder = folder_of(target);
    if !folder.is_dir() {
        return Err(failed(format!(
            "cannot write {}: there is no folder {}",
            target.display(),
            folder.display()
        ))
        .hint(format!("mkdir -p {} makes it", quoted(&folder))));
    }
    Ok(())
}

fn folder_of(target: &Path) -> PathBuf {
    let parent = target.parent().filter(|parent| !parent.as_os_str().is_empty());
    parent.unwrap_or(Path::new(".")).to_path_buf()
}

impl PendingFile {
    /// Opens the temporary file, so that a folder without write permission is noticed before the work begins.
    pub fn create(target: &Path, overwrite: bool) -> Result<Self, Complaint> {
        check(target, overwrite)?;
        // A link is followed: its target gets the new content, the link stays.
        let target = fs::canonicalize(target).unwrap_or_else(|_| target.to_path_buf());
        let writer = if target.exists() && !target.is_file() {
            fs::OpenOptions::new()
                .write(true)
                .open(&target)
                .map(|file| Writer::Direct(BufWriter::new(file)))
        } else {
            temporary_in(&folder_of(&target)).map(|file| {
                let known = Unfinished::new(file.path(), &target, overwrite);
                Writer::Temporary(BufWriter::new(file), known)
            })
        };
        let writer = writer.map_err(|error| cannot_write(target.display(), &error))?;
        Ok(Self { target, overwrite, writer })
    }

    /// Where the file will be.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Says that what is in it is of use also where the program is ended at once, before all of it is there.
    pub fn useful(self) -> Self {
        if let Writer::Temporary(_, known) = &self.writer {
            known.useful();
        }
        self
    }

    /// Makes an end at once wait for what is written meanwhile. Not for devices and pipes, where writing may
    /// take for ever.
    pub fn hold(&self) -> Option<unfinished::Hold> {
        matches!(self.writer, Writer::Temporary(..)).then(unfinished::hold)
    }

    /// The file with this in it.
    pub fn filled(mut self, content: &[u8]) -> Result<Self, Complaint> {
        match self.write_all(content).and_then(|()| self.flush()) {
            Ok(()) => Ok(self),
            Err(error) => Err(self.complain(&error)),
        }
    }

    /// Puts the complete file in its place and says where that is.
    pub fn commit(self) -> Result<PathBuf, Complaint> {
        let complain = |error: io::Error| cannot_write(self.target.display(), &error);
        let (file, known) = match self.writer {
            Writer::Direct(mut writer) => {
                return writer.flush().map(|()| self.target.clone()).map_err(complain);
            }
            Writer::Temporary(writer, known) => {
                (writer.into_inner().map_err(|error| complain(error.into_error()))?, known)
            }
        };
        // Before it gets its name: a power failure must not leave a name without the content.
        file.as_file().sync_all().map_err(complain)?;
        let placed = known.settle(|| match self.overwrite {
            true => file.persist(&self.target),
            false => file.persist_noclobber(&self.target),
        });
        placed.map(|_| self.target.clone()).map_err(|error| complain(error.error))
    }

    /// Turns an error of writing into one that names the file.
    pub fn complain(&self, error: &io::Error) -> Complaint {
        cannot_write(self.target.display(), error)
    }

    /// The same for a caller that has given the file away: a way to complain later.
    pub fn complainer(&self) -> impl Fn(patchlock_media::Error) -> Complaint + 'static {
        let target = self.target.clone();
        move |error| match error {
            patchlock_media::Error::Write(cause) => cannot_write(target.display(), &cause),
            other => other.into(),
        }
    }
}

/// Temporary files are private by default; a result should have the permissions of any other new file.
fn temporary_in(folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".patchlock-").suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
        builder.tempfile_in(folder)
    }
    #[cfg(not(unix))]
    builder.tempfile_in(folder)
}

/// The complaint about what can't be written, with what to do. `target` is a file, or `to standard output`.
pub(super) fn cannot_write(target: impl Display, error: &io::Error) -> Complaint {
    // A temporary file puts its own name into its errors, which would tell the user nothing.
    let plain = without_path(error);
    let error = plain.as_ref().unwrap_or(error);
    let hint = match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            "the disk is full: make room or write elsewhere"
        }
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "choose a folder you may write in"
        }
        io::ErrorKind::AlreadyExists => {
            "it appeared while the tracker ran; --overwrite replaces it"
        }
        _ => "check the folder and the disk",
    };
    failed(format!("cannot write {target}: {error}")).hint(hint)
}

impl Write for PendingFile {
    fn write(&mut self, data: &[u8]) -> io::Result<usize> {
        match &mut self.writer {
            Writer::Temporary(writer, _) => writer.write(data),
            Writer::Direct(writer) => writer.write(data),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.writer {
            Writer::Temporary(writer, _) => writer.flush(),
            Writer::Direct(writer) => writer.flush(),
        }
    }
}

impl Seek for PendingFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match &mut self.writer {
            Writer::Temporary(writer, _) => writer.seek(to),
            Writer::Direct(writer) => writer.seek(to),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_there_before_the_commit_and_all_of_it_after() {
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
