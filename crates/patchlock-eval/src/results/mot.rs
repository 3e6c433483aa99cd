//! Reads MOT files: `frame,id,x,y,w,h,confidence,..` on each line, frames counted from 1, with a single
//! object.

use std::path::Path;

use patchlock::BoundingBox;

use crate::text::Table;
use crate::{Error, text};

/// Largest number of a frame: nine hours at 30 frames per second. All frames before the last one take memory,
/// also those that are not listed.
const LAST_FRAME: f64 = 1e6;

/// Whether the rows look like MOT: 7, 9 or 10 numbers, the first two of which are integers.
pub fn is_mot(table: &Table) -> bool {
    let whole = |value: f64| value.fract() == 0.0;
    let row = |row: &Vec<f64>| matches!(row.len(), 7 | 9 | 10) && whole(row[0]) && whole(row[1]);
    !table.rows.is_empty() && table.rows.iter().all(row)
}

/// One box per frame up to the last frame in the file; `None` for frames that are not listed.
pub fn boxes(file: &Path, table: &Table, origin: f64) -> Result<Vec<Option<BoundingBox>>, Error> {
    let error =
        |line: usize, reason: String| Error::Line { path: file.to_path_buf(), line, reason };
    let mut boxes: Vec<Option<BoundingBox>> = Vec::new();
    let mut object = None;
    for (k, row) in table.rows.iter().enumerate() {
        let line = k + 1;
        let (frame, id) = (row[0], row[1]);
        if !(1.0..=LAST_FRAME).contains(&frame) {
            return Err(error(
                line,
                format!("frame {frame}: frames count from 1, and end at {LAST_FRAME}"),
            ));
        }
        if *object.get_or_insert(id) != id {
            let first = object.unwrap_or(id);
            return Err(error(
                line,
                format!("object {id} after object {first}: a file holds one target"),
            ));
        }
        let frame = frame as usize;
        if boxes.len() < frame {
            boxes.resize(frame, None);
        }
        if boxes[frame - 1].is_some() {
            return Err(error(line, format!("frame {frame} appears twice")));
        }
        boxes[frame - 1] =
            text::region(&row[2..6], origin).map_err(|reason| error(line, reason))?;
    }
    Ok(boxes)
}
