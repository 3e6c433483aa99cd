//! Reads MOT files: `frame,id,x,y,w,h,confidence,..` on each line, frames counted from 1, with a
//! single object.

use std::collections::BTreeMap;
use std::path::Path;

use patchlock::BoundingBox;
use patchlock_media::MOST_FRAMES;

use crate::Error;
use patchlock_track::text;
use patchlock_track::text::Table;

/// Whether the rows look like MOT: 7, 9 or 10 numbers, the first two of which are integers.
pub fn is_mot(table: &Table) -> bool {
    let whole = |value: f64| value.fract() == 0.0;
    let row = |row: &Vec<f64>| matches!(row.len(), 7 | 9 | 10) && whole(row[0]) && whole(row[1]);
    !table.rows.is_empty() && table.rows.iter().all(row)
}

/// One box per frame up to the last frame in the file; `None` for frames that are not listed. No
/// frame may be after the last of the truth, which has so many `frames`: a short line cannot claim
/// memory by its number. A target without truth is not scored; it has the listed frames only.
pub fn boxes(
    file: &Path,
    table: &Table,
    origin: f64,
    frames: Option<usize>,
) -> Result<Vec<Option<BoundingBox>>, Error> {
    let error = |line: usize, reason: String| Error::line(file, line, reason);
    let mut boxes = BTreeMap::new();
    let first_id = table.rows.first().map_or(0.0, |row| row[1]);
    for (k, row) in table.rows.iter().enumerate() {
        let line = k + 1;
        let (frame, id) = (row[0], row[1]);
        let most = frames.unwrap_or(MOST_FRAMES);
        if !(1.0..=most as f64).contains(&frame) {
            let of = if frames.is_some() { ", the number of frames in the truth" } else { "" };
            return Err(error(line, format!("frame {frame}: frames count from 1 to {most}{of}")));
        }
        if first_id != id {
            return Err(error(
                line,
                format!("object {id} after object {first_id}: a file holds one target"),
            ));
        }
        let bbox = text::region(&row[2..6], origin).map_err(|reason| error(line, reason))?;
        if boxes.insert(frame as usize - 1, bbox).is_some() {
            return Err(error(line, format!("frame {frame} appears twice")));
        }
    }
    let last = boxes.last_key_value().map_or(0, |(frame, _)| frame + 1);
    Ok(match frames {
        Some(_) => (0..last).map(|frame| boxes.get(&frame).copied().flatten()).collect(),
        None => boxes.into_values().collect(),
    })
}
