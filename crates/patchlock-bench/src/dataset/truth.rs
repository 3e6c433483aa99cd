//! Reads the ground truth of a target from a text file.

use std::path::Path;

use patchlock::BoundingBox;

use crate::Error;
use patchlock_track::text;

pub struct Truth {
    /// The box in each frame, in pixels counted from 0; `None` for frames without ground truth.
    pub boxes: Vec<Option<BoundingBox>>,
    /// Unusual properties of the file that do not affect its use.
    pub notes: Vec<String>,
}

impl Truth {
    /// Removes the ground truth of the frames that are flagged in a file: the target is not visible
    /// there.
    ///
    /// # Errors
    /// [`Error::Track`] unless there is one flag for each frame.
    pub fn without(&mut self, flags: &Path) -> Result<(), Error> {
        let rows: Vec<f64> = text::read(flags)?.rows.into_iter().flatten().collect();
        if rows.len() != self.boxes.len() {
            let reason = format!("{} flags, but {} rows of truth", rows.len(), self.boxes.len());
            return Err(Error::line(flags, 1, reason));
        }
        let mut removed = 0;
        for (bbox, _) in self.boxes.iter_mut().zip(rows).filter(|(_, flag)| *flag > 0.0) {
            removed += usize::from(bbox.take().is_some());
        }
        if removed > 0 {
            let file = flags.file_name().unwrap_or_default().display();
            self.notes.push(format!(
                "the target is not visible in {removed} frames ({file}), which do not count"
            ));
        }
        Ok(())
    }
}

/// Reads the ground truth of a target. A row with NaN or without a positive width and height is a
/// frame without ground truth.
pub fn read(path: &Path, origin: f64) -> Result<Truth, Error> {
    let table = text::read(path)?;
    let error = |line: usize, reason: String| Error::line(path, line, reason);
    if table.rows.is_empty() {
        return Err(error(1, "the file is empty".to_string()));
    }
    let mut notes = table.notes;
    let (mut boxes, mut unknown, mut flat) = (Vec::new(), 0, 0);
    for (k, row) in table.rows.iter().enumerate() {
        let given = text::region(row, origin).map_err(|reason| error(k + 1, reason))?;
        let kept = given.filter(|bbox| bbox.w > 0.0 && bbox.h > 0.0);
        unknown += usize::from(given.is_none());
        flat += usize::from(given.is_some() && kept.is_none());
        boxes.push(kept);
    }
    if boxes.iter().all(Option::is_none) {
        return Err(error(1, "no frame has a box of positive width and height".to_string()));
    }
    for (count, what) in [(unknown, "NaN"), (flat, "a box without width or height")] {
        if count > 0 {
            notes.push(format!(
                "the truth of {count} of {} frames is {what}: these frames do not count",
                boxes.len()
            ));
        }
    }
    Ok(Truth { boxes, notes })
}
