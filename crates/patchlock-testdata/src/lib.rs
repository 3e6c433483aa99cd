//! Finds the real sequences and networks that tests use. They belong to others and are not part of
//! the repository.
//!
//! The environment variable `PATCHLOCK_DATA` names the folder with the sets: `otb-dev`, `mixed-dev`
//! and `otb2013-published`. Without it the folder is `../shared/data` beside the checkout. With the
//! value `required` it is the same folder, and a set that is missing fails the test.
//!
//! `PATCHLOCK_MODELS` does the same for the folders of the networks: `nanotrack-v3`,
//! `nanotrack-v2` and `vittrack`. Without it the folder is `../shared/models` beside the checkout.
//!
//! [`slow`] tells a test that takes long whether to run whole.

use std::env;
use std::ffi::OsStr;
use std::io::Write;
use std::path::{Path, PathBuf};

/// The folder of a set, such as `otb-dev`, or of a part of it. Without it, prints that the test is
/// skipped, and returns `None`.
///
/// # Panics
/// If the folder is missing and `PATCHLOCK_DATA` is `required`.
pub fn real(test: &str, name: &str) -> Option<PathBuf> {
    find(test, name, "PATCHLOCK_DATA", "data")
}

/// The folder of a network, such as `nanotrack-v3`. Without it, prints that the test is skipped,
/// and returns `None`.
///
/// # Panics
/// If the folder is missing and `PATCHLOCK_MODELS` is `required`.
pub fn model(test: &str, name: &str) -> Option<PathBuf> {
    find(test, name, "PATCHLOCK_MODELS", "models")
}

/// Whether a test that takes about so many seconds runs whole, as with `PATCHLOCK_SLOW=1`. Otherwise prints that the
/// short form runs, and returns `false`.
pub fn slow(test: &str, seconds: u32) -> bool {
    let whole = env::var_os("PATCHLOCK_SLOW").is_some_and(|value| value == "1");
    if !whole {
        let _ = writeln!(
            std::io::stderr(),
            "{test}: in short form (PATCHLOCK_SLOW=1 runs the whole test, which takes {seconds} s)"
        );
    }
    whole
}

/// The folder `name` in the folder that a variable names, or in `../shared/BESIDE`.
fn find(test: &str, name: &str, variable: &str, beside: &str) -> Option<PathBuf> {
    let place = DataFolder::new(env::var_os(variable).as_deref(), beside);
    let folder = place.folder.join(name);
    if folder.is_dir() {
        return Some(folder);
    }
    let folder = folder.display();
    assert!(!place.required, "{test}: {variable} is required, but there is no {folder}");
    // The test harness does not capture what is written directly.
    let _ = writeln!(
        std::io::stderr(),
        "{test}: SKIPPED, there is no {folder} ({variable} names the folder around it)"
    );
    None
}

/// Where the folders are.
#[derive(Debug, PartialEq)]
struct DataFolder {
    folder: PathBuf,
    /// Whether a missing folder is a failure.
    required: bool,
}

impl DataFolder {
    /// The place for a value of the variable.
    fn new(value: Option<&OsStr>, beside: &str) -> Self {
        let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared").join(beside);
        match value {
            None => Self { folder: beside(), required: false },
            Some(value) if value == "required" => Self { folder: beside(), required: true },
            Some(value) => Self { folder: PathBuf::from(value), required: false },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_variable_names_the_folder_or_requires_the_default() {
        let place = |value: Option<&str>| DataFolder::new(value.map(OsStr::new), "data");
        let default = place(None);
        assert!(default.folder.ends_with("shared/data") && !default.required);
        assert_eq!(place(Some("required")), DataFolder { folder: default.folder, required: true });
        let named = DataFolder { folder: "/sequences".into(), required: false };
        assert_eq!(place(Some("/sequences")), named);
    }
}
