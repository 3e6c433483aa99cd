//! A shell script in place of ffmpeg, for tests.

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::PathBuf;
use std::time::Duration;

use tempfile::TempDir;

use crate::ffmpeg::Program;

/// A script that may write nothing for half a second.
pub struct FakeFfmpeg {
    folder: TempDir,
    /// The script.
    pub program: Program,
}

impl FakeFfmpeg {
    /// `script` runs in the folder of the test.
    pub fn new(script: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let name = folder.path().join("ffmpeg");
        let here = folder.path().display();
        fs::write(&name, format!("#!/bin/sh\ncd '{here}'\n{script}\n")).unwrap();
        fs::set_permissions(&name, fs::Permissions::from_mode(0o755)).unwrap();
        let (timeout, own) = (Duration::from_millis(500), Some(folder.path().to_path_buf()));
        Self { folder, program: Program { name, timeout, folder: own, is_of_group: false } }
    }

    /// A file in the folder of the test.
    pub fn file(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Whether the process whose id the script has written has ended.
    pub fn has_ended(&self) -> bool {
        let id = fs::read_to_string(self.file("id")).unwrap();
        fs::read_to_string(format!("/proc/{}/stat", id.trim())).is_err()
    }
}
