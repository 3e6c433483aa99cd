//! Files for surfaces that read by path.

use std::fs;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

/// A folder that is removed with its content.
pub struct Scratch {
    folder: TempDir,
}

impl Scratch {
    /// An empty folder below the system's folder for temporary files.
    pub fn new() -> Self {
        Self { folder: tempfile::tempdir().expect("a folder for temporary files") }
    }

    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// Writes a file at this path below the folder, and the folders above it.
    pub fn file(&self, path: &str, content: &[u8]) -> PathBuf {
        let file = self.folder.path().join(path);
        fs::create_dir_all(file.parent().expect("is below a folder")).expect("makes a folder");
        fs::write(&file, content).expect("writes a file");
        file
    }
}
