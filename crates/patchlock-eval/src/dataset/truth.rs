//! The boxes of a target, from a text file.

use std::path::Path;

use patchlock::BoundingBox;

use crate::{Error, text};

/// Where the target is in each frame.
pub struct Truth {
    /// Counted from 0; `None` where the frame has no truth.
    pub boxes: Vec<Option<BoundingBox>>,
    /// What is odd but does not stand in the way.
    pub oddities: Vec<String>,
}

impl Truth {
    /// Takes away the truth of the frames that a file flags: the target is not to be seen there.
    ///
    /// # Errors
    /// [`Error::Line`] where there is not one flag for each frame.
    pub fn without(&mut self, flags: &Path) -> Result<(), Error> {
        let rows: Vec<f64> = text::read(flags)?.rows.into_iter().flatten().collect();
        if rows.len() != self.boxes.len() {
            let reason = format!("{} flags, but {} rows of truth", rows.len(), self.boxes.len());
            return Err(Error::Line { path: flags.to_path_buf(), line: 1, reason });
        }
        let mut gone = 0;
        for (bbox, _) in self.boxes.iter_mut().zip(rows).filter(|(_, flag)| *flag > 0.0) {
            gone += usize::from(bbox.take().is_some());
        }
        if gone > 0 {
            let file = flags.file_name().unwrap_or_default().display();
            self.oddities
                .push(format!("in {gone} frames it is not to be seen ({file}): they do not count"));
        }
        Ok(())
    }
}

/// Reads the truth of a target. A row with NaN or without a positive width and height is a frame without truth.
pub fn read(path: &Path, origin: f64) -> Result<Truth, Error> {
    let table = text::read(path)?;
    let error =
        |line: usize, reason: String| Error::Line { path: path.to_path_buf(), line, reason };
    if table.rows.is_empty() {
        return Err(error(1, "the file is empty".to_string()));
    }
    let mut oddities = table.oddities;
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
            oddities.push(format!(
                "the truth of {count} of {} frames is {what}: they do not count",
                boxes.len()
            ));
        }
    }
    Ok(Truth { boxes, oddities })
}
