//! A folder of text files with boxes, a file a target.

use std::fs;
use std::path::Path;

use super::{Builder, Dataset, Layout, truth};
use crate::{Error, files, text};

/// `None` where there is no text file of boxes.
pub fn read(root: &Path) -> Result<Option<Dataset>, Error> {
    let texts: Vec<_> = files::entries(root)?
        .into_iter()
        .filter(|path| path.is_file() && files::ends_with(path, "txt"))
        .collect();
    let mut builder = Builder::new(Layout::TruthOnly, root);
    for file in texts {
        if !begins_with_numbers(&file)? {
            builder.remark_all(format!("{} is no list of boxes: left out", file.display()));
            continue;
        }
        let truth = truth::read(&file, Layout::TruthOnly.origin());
        builder.add(&files::stem_of(&file), truth, None, Vec::new());
    }
    // A folder where no text is a list of boxes is something else.
    Ok((!builder.dataset.sequences.is_empty()).then_some(builder.dataset))
}

/// Beside the truth there may be a text to read.
fn begins_with_numbers(file: &Path) -> Result<bool, Error> {
    let bytes = fs::read(file).map_err(|error| Error::read(file, error))?;
    let (text, _) = text::decode(&bytes);
    Ok(text.lines().next().is_some_and(|line| text::numbers(line).is_ok()))
}
