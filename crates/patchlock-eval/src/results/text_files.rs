//! `<target>.txt` with `x,y,w,h` a line, as the tracker benchmark has it.

use std::path::Path;

use patchlock::BoundingBox;

use super::{Layout, Results, Run};
use crate::files::{ends_with, entries, name_of, stem_of};
use crate::{Error, text};

/// `None` where the folder has no text file.
pub fn read(folder: &Path, origin: f64) -> Result<Option<Results>, Error> {
    let mut results = Results {
        name: name_of(folder),
        layout: Layout::Otb,
        runs: Vec::new(),
        faults: Vec::new(),
    };
    for file in entries(folder)?.into_iter().filter(|path| ends_with(path, "txt")) {
        match boxes(&file, origin) {
            Ok(boxes) => results.runs.push(Run {
                target: stem_of(&file),
                seed: 0,
                variant: 0,
                first: 0,
                boxes,
                seconds: None,
                file,
            }),
            Err(error) => results.faults.push(error.to_string()),
        }
    }
    Ok((!results.runs.is_empty() || !results.faults.is_empty()).then_some(results))
}

/// The boxes of a file. A row with NaN is a box that was not given.
pub fn boxes(file: &Path, origin: f64) -> Result<Vec<Option<BoundingBox>>, Error> {
    let table = text::read(file)?;
    let row = |(k, row): (usize, &Vec<f64>)| {
        text::region(row, origin).map_err(|reason| Error::Line {
            path: file.to_path_buf(),
            line: k + 1,
            reason,
        })
    };
    table.rows.iter().enumerate().map(row).collect()
}
