//! Helpers shared by the tests: tiny datasets in a temporary folder.

use std::fs;
use std::path::{Path, PathBuf};

use image::GrayImage;
use patchlock_bench::dataset::{Dataset, Severity};
use tempfile::TempDir;

pub const WIDTH: u32 = 16;
pub const HEIGHT: u32 = 12;

pub struct Folder(TempDir);

impl Folder {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub fn path(&self) -> &Path {
        self.0.path()
    }

    pub fn file(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, content).unwrap();
        path
    }

    /// Writes images with these numbers, padded to `digits` digits.
    pub fn images(&self, folder: &str, numbers: impl IntoIterator<Item = usize>, digits: usize) {
        for number in numbers {
            let path = self.path().join(folder).join(format!("{number:0digits$}.png"));
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            GrayImage::new(WIDTH, HEIGHT).save(path).unwrap();
        }
    }

    pub fn dataset(&self) -> Dataset {
        Dataset::open(self.path()).unwrap()
    }
}

/// `count` rows with the same box.
pub fn rows(count: usize) -> String {
    "3,4,5,6\n".repeat(count)
}

/// The texts of the remarks on a target with this severity.
pub fn remarks(dataset: &Dataset, target: &str, severity: Severity) -> Vec<String> {
    let about = dataset.remarks.iter().filter(|r| r.target.as_deref() == Some(target));
    about.filter(|r| r.severity == severity).map(|r| r.text.clone()).collect()
}
