//! Lists folders and takes file names apart.

use std::fs;
use std::path::{Path, PathBuf};

use patchlock_media::image_file::is_image;
use patchlock_media::natural_order;

use crate::Error;

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
