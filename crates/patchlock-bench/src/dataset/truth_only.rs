//! Reads a folder of text files of boxes, one file per target.

use std::path::Path;

use super::{Builder, Dataset, Layout, truth};
use crate::Error;
use patchlock_track::{files, text};

/// `None` if there is no text file of boxes.
pub fn read(root: &Path) -> Result<Option<Dataset>, Error> {
    let texts: Vec<_> = files::entries(root)?
        .into_iter()
        .filter(|path| path.is_file() && files::ends_with(path, "txt"))
        .collect();
    let mut builder = Builder::new(Layout::TruthOnly, root);
    for file in texts {
        if !starts_with_numbers(&file)? {
            builder.remark_all(format!("{} is left out: not a list of boxes", file.display()));
            continue;
        }
        let truth = truth::read(&file, Layout::TruthOnly.origin());
        builder.add(&files::stem_of(&file), truth, None, Vec::new());
    }
    // A folder whose text files hold no boxes is not a dataset of this layout.
    Ok((!builder.dataset.sequences.is_empty()).then_some(builder.dataset))
}

/// Whether a file starts like a list of boxes, unlike a readme.
fn starts_with_numbers(file: &Path) -> Result<bool, Error> {
    let bytes = files::read(file).map_err(|error| Error::read(file, error))?;
    let (text, _) = text::decode(&bytes);
    Ok(text.lines().next().is_some_and(|line| text::numbers(line).is_ok()))
}
