//! Reads `<target>.txt` in the tracker's folder: `x,y,w,h` on each line as in OTB, or lines of MOT.

use std::path::Path;

use super::{Results, boxes, mot};
use crate::Error;
use crate::dataset::Dataset;
use patchlock_track::files::{ends_with, entries, name_of, stem_of};
use patchlock_track::text;

/// `None` if the folder has no text file.
pub fn read(folder: &Path, truth: &Dataset) -> Result<Option<Results>, Error> {
    let mut results = Results::new(name_of(folder));
    for file in entries(folder)?.into_iter().filter(|path| ends_with(path, "txt")) {
        let target = stem_of(&file);
        match text::read(&file) {
            Err(error) => results.faults.push(error.to_string()),
            Ok(table) if mot::is_mot(&table) => {
                let frames = truth.find(&target).map(|sequence| sequence.truth.len());
                let boxes = mot::boxes(&file, &table, truth.origin(), frames);
                results.add(target, 0, &file, boxes, None);
            }
            Ok(table) => {
                // The got10k toolkit writes times to the folder `times` beside the boxes.
                let times = folder.join("times").join(format!("{target}_time.txt"));
                let boxes = boxes(&file, &table, truth.origin());
                results.add(target, 0, &file, boxes, Some(&times));
            }
        }
    }
    Ok((!results.is_empty()).then_some(results))
}
