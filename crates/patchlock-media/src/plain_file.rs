//! Opens files for reading, and nothing but files.
//!
//! A pipe waits for somebody to write to it, a device may never end, and a file that the system
//! makes up, such as `/proc/kmsg`, is a file of no bytes whose reader waits for ever.

use std::fs::{self, File};
use std::io::{self, Read as _};
use std::path::Path;

/// A file that was opened for reading.
#[derive(Debug)]
pub struct PlainFile {
    /// The file, at its beginning.
    pub file: File,
    /// Its length in bytes when it was opened. Nothing is to be read of a file without length.
    pub length: u64,
}

#[derive(Debug, thiserror::Error)]
#[error("it is a pipe or a device, not a file")]
struct EndlessError;

/// Whether an error of [`open`] is that the path leads to a pipe or a device, which may never end.
pub fn is_endless(error: &io::Error) -> bool {
    error.get_ref().is_some_and(|error| error.is::<EndlessError>())
}

/// Opens a file. Links are followed.
///
/// # Errors
/// Of a pipe or a device, [`is_endless`]; of a folder, one of the kind [`io::ErrorKind::IsADirectory`].
pub fn open(path: &Path) -> io::Result<PlainFile> {
    // Opening alone can change a device, so this is asked before.
    check(&fs::metadata(path)?)?;
    let mut options = File::options();
    options.read(true);
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt as _;
        // A pipe may have taken the place of the file since.
        options.custom_flags(rustix::fs::OFlags::NONBLOCK.bits().cast_signed());
    }
    let file = options.open(path)?;
    let about = file.metadata()?;
    check(&about)?;
    Ok(PlainFile { file, length: about.len() })
}

fn check(about: &fs::Metadata) -> io::Result<()> {
    match about {
        about if about.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
        about if about.is_file() => Ok(()),
        _ => Err(io::Error::new(io::ErrorKind::InvalidInput, EndlessError)),
    }
}

impl PlainFile {
    /// The bytes from here to the end, at most `most`; none of a file without length.
    ///
    /// # Errors
    /// As [`io::Read::read`].
    pub fn read(&mut self, most: u64) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        if self.length > 0 {
            (&self.file).take(most).read_to_end(&mut bytes)?;
        }
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_files_are_opened() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.txt");
        fs::write(&file, "12345").unwrap();
        let mut opened = open(&file).unwrap();
        assert_eq!((opened.length, opened.read(3).unwrap()), (5, b"123".to_vec()));
        let kind = |path: &Path| open(path).unwrap_err().kind();
        assert_eq!(kind(folder.path()), io::ErrorKind::IsADirectory);
        assert_eq!(kind(&folder.path().join("b")), io::ErrorKind::NotFound);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn what_may_never_end_is_not_read() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        assert!(made.unwrap().success());
        for path in [Path::new("/dev/zero"), &pipe] {
            assert!(is_endless(&open(path).unwrap_err()), "{}", path.display());
        }
        // As /proc/kmsg, which only the administrator may open: a file without length, with bytes.
        let made_up = Path::new("/proc/self/environ");
        assert!(!fs::read(made_up).unwrap().is_empty());
        assert!(open(made_up).unwrap().read(9).unwrap().is_empty());
    }
}
