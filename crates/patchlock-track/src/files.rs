//! Reads text files, writes files atomically, lists folders and takes file names apart.

use std::fs;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use patchlock_media::image_file::is_image;
use patchlock_media::natural_order;
use patchlock_media::plain_file::{self, is_endless};
use tempfile::NamedTempFile;

use crate::Error;

/// The longest text file that is read, in bytes.
pub const MAX_FILE_BYTES: u64 = 1 << 30;

/// The content of a text file.
///
/// # Errors
/// As [`fs::read`]; what is not a file (a pipe, a device, a folder) or is longer than
/// [`MAX_FILE_BYTES`] is refused before anything is read: it may never end.
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    let refused = |reason: &str| io::Error::new(io::ErrorKind::InvalidInput, reason);
    let mut plain = plain_file::open(path).map_err(|error| match is_endless(&error) {
        true => refused("it is a pipe or a device; save its content to a file and name that"),
        false => error,
    })?;
    let too_long = || refused("it is longer than 1 GiB");
    if plain.length > MAX_FILE_BYTES {
        return Err(too_long());
    }
    let bytes = plain.read(MAX_FILE_BYTES + 1)?;
    match bytes.len() as u64 <= MAX_FILE_BYTES {
        true => Ok(bytes),
        false => Err(too_long()),
    }
}

/// A temporary file in a folder, which is to be renamed when it is complete. It is not private: it has
/// the permissions of an ordinary new file.
///
/// # Errors
/// As [`tempfile::Builder::tempfile_in`].
pub fn temporary_in(folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".patchlock-").suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder)
}

/// Writes a file atomically: it is complete or does not exist.
///
/// # Errors
/// Those of the operating system; [`io::ErrorKind::AlreadyExists`] if there is such a file and it is
/// not to be replaced.
pub fn write(path: &Path, bytes: &[u8], replace: bool) -> io::Result<()> {
    let mut file = temporary_in(folder_of(path))?;
    file.write_all(bytes)?;
    file.as_file().sync_all()?;
    let placed = if replace { file.persist(path) } else { file.persist_noclobber(path) };
    placed.map(drop).map_err(|error| error.error)
}

/// The folder of a file.
pub fn folder_of(file: &Path) -> &Path {
    file.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// The entries of a folder in natural order, without hidden ones (leading dot).
pub fn entries(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let cannot = |error| Error::read(folder, error);
    let mut paths = Vec::new();
    for entry in fs::read_dir(folder).map_err(cannot)? {
        let path = entry.map_err(cannot)?.path();
        if !name_of(&path).starts_with('.') {
            paths.push(path);
        }
    }
    paths.sort_by(|a, b| natural_order::compare(&name_of(a), &name_of(b)));
    Ok(paths)
}

/// The file name of a path.
pub fn name_of(path: &Path) -> String {
    path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}

/// The file name without its extension.
pub fn stem_of(path: &Path) -> String {
    path.file_stem().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}

/// Whether the path has this extension, in any case.
pub fn ends_with(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|end| end.eq_ignore_ascii_case(extension))
}

/// The images of a folder in natural order; empty if there is no such folder.
pub fn images(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    if !folder.is_dir() {
        return Ok(Vec::new());
    }
    Ok(entries(folder)?.into_iter().filter(|path| is_image(path)).collect())
}

/// The number at the end of the stem: 12 of `img0012.jpg`.
pub fn number_of(path: &Path) -> Option<u64> {
    let stem = stem_of(path);
    let digits = stem.len() - stem.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    stem[stem.len() - digits..].parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_files_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.txt");
        fs::write(&file, "1,2,3,4").unwrap();
        assert_eq!(read(&file).unwrap(), b"1,2,3,4");
        assert_eq!(read(folder.path()).unwrap_err().kind(), io::ErrorKind::IsADirectory);
        assert_eq!(read(&folder.path().join("b")).unwrap_err().kind(), io::ErrorKind::NotFound);
    }

    #[cfg(unix)]
    #[test]
    fn pipes_and_devices_are_refused_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        assert!(made.unwrap().success());
        for path in [Path::new("/dev/zero"), Path::new("/dev/null"), &pipe] {
            let error = read(path).unwrap_err().to_string();
            assert!(error.contains("a pipe or a device; save its content to a file"), "{error}");
        }
    }

    #[test]
    fn a_file_that_is_too_long_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("long.txt");
        // No block of it is stored.
        fs::File::create(&path).unwrap().set_len(MAX_FILE_BYTES + 1).unwrap();
        let error = read(&path).unwrap_err().to_string();
        assert_eq!(error, "it is longer than 1 GiB");
    }
}
