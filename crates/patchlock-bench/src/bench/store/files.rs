//! Reads and identifies the files of a store.

use std::path::Path;

use serde::Deserialize;
use sha2::{Digest, Sha256};

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
