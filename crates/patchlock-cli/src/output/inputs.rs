//! The files that a command reads, which it must not replace.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use patchlock_track::files::folder_of;

use crate::failure::{Failure, usage};

/// The files that a command reads.
#[derive(Debug, Default)]
pub struct Inputs {
    files: Vec<PathBuf>,
}

impl Inputs {
    /// These files, which need not exist yet.
    pub fn new<'a>(files: impl IntoIterator<Item = &'a Path>) -> Self {
        Self { files: files.into_iter().map(Path::to_path_buf).collect() }
    }

    /// The files and those of a source of frames.
    pub fn with_source(mut self, source: impl AsRef<OsStr>) -> Self {
        self.files.extend(patchlock_media::files_of(source));
        self
    }

    /// Refuses a file that is one of them, under any name.
    pub fn check(&self, out: &Path) -> Result<(), Failure> {
        let (place, file) = (resolved(out), identity(out));
        let is_same = |input: &PathBuf| match &file {
            Some(file) => identity(input).as_ref() == Some(file),
            None => resolved(input) == place,
        };
        match self.files.iter().any(is_same) {
            true => Err(usage(format!("{} is an input and would be replaced", out.display()))
                .hint("choose another name")),
            false => Ok(()),
        }
    }
}

/// What two names of one file have in common; `None` if there is no file.
#[cfg(unix)]
fn identity(path: &Path) -> Option<(u64, u64)> {
    use std::os::unix::fs::MetadataExt as _;
    path.metadata().ok().map(|about| (about.dev(), about.ino()))
}

/// What two names of one file have in common, unless they are hard links; `None` if there is no
/// file.
#[cfg(not(unix))]
fn identity(path: &Path) -> Option<PathBuf> {
    path.canonicalize().ok()
}

/// The canonical form of a path, whose last component may not exist yet.
pub fn resolved(path: &Path) -> PathBuf {
    if let Ok(canonical) = path.canonicalize() {
        return canonical;
    }
    let parent = folder_of(path);
    let parent = parent.canonicalize().unwrap_or_else(|_| parent.to_path_buf());
    path.file_name().map_or_else(|| parent.clone(), |name| parent.join(name))
}
