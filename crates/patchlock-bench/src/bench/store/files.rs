//! Writes files atomically: they are complete or do not exist.

use std::io::{self, Write};
use std::path::Path;

use serde::Deserialize;
use sha2::{Digest, Sha256};
use tempfile::NamedTempFile;

use crate::Error;
use patchlock_track::files;

/// The SHA-256 of some bytes, in hexadecimal.
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Reads and parses a JSON file.
pub(crate) fn read_json<T: for<'de> Deserialize<'de>>(path: &Path) -> Result<T, Error> {
    let text = files::read(path).map_err(|error| Error::read(path, error))?;
    serde_json::from_slice(&text)
        .map_err(|error| Error::Manifest { path: path.to_path_buf(), reason: error.to_string() })
}

/// A temporary file in a folder, which becomes a result. It is not private: a result has the
/// permissions of an ordinary new file.
///
/// # Errors
/// As [`tempfile::Builder::tempfile_in`].
pub fn temporary_in(folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".patchlock-").suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder)
}

/// Writes a file atomically. Without `replace`, an existing file is kept and the result is `false`.
pub(super) fn write_atomically(path: &Path, bytes: &[u8], replace: bool) -> Result<bool, Error> {
    let cannot = |error| Error::write(path, error);
    let mut file = temporary_in(path.parent().unwrap_or(Path::new("."))).map_err(cannot)?;
    file.write_all(bytes).and_then(|()| file.as_file().sync_all()).map_err(cannot)?;
    if replace {
        file.persist(path).map_err(|error| cannot(error.error))?;
        return Ok(true);
    }
    match file.persist_noclobber(path) {
        Ok(_) => Ok(true),
        Err(error) if error.error.kind() == io::ErrorKind::AlreadyExists => Ok(false),
        Err(error) => Err(cannot(error.error)),
    }
}
