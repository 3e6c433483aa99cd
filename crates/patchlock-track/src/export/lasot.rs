//! LaSOT: `<label>/<label>-<id>/groundtruth.txt` with `x,y,w,h` on each line, counted from 1, two
//! files with one line of flags each, and the frames as `img/00000001.jpg`.

use std::path::Path;

use super::sequence::{Sequence, sequences};
use super::{Item, Job};
use crate::Error;

/// The files of the folder.
pub fn items(job: &Job<'_>) -> Result<Vec<Item>, Error> {
    let sequences = sequences(job.track)?;
    Ok(sequences.iter().flat_map(|sequence| sequence_items(job, sequence)).collect())
}

fn sequence_items(job: &Job<'_>, sequence: &Sequence<'_>) -> Vec<Item> {
    let label = job.label(sequence.id);
    let folder = Path::new(label).join(format!("{label}-{}{}", job.prefix, sequence.id));
    let mut items = vec![
        Item::text(folder.join("groundtruth.txt"), sequence.boxes(1.0)),
        Item::text(folder.join("full_occlusion.txt"), flags(sequence, |hidden| hidden)),
        Item::text(folder.join("out_of_view.txt"), flags(sequence, |_| false)),
    ];
    for (k, (frame, _)) in sequence.frames.iter().enumerate() {
        let image = folder.join("img").join(format!("{:08}.jpg", k + 1));
        items.extend(job.frames.jpeg(*frame, image));
    }
    items
}

/// One line with a flag for each frame. `flag` receives whether the target is lost or has no box in
/// it.
fn flags(sequence: &Sequence<'_>, flag: impl Fn(bool) -> bool) -> String {
    let frames = sequence.frames.iter();
    let flags: Vec<&str> =
        frames.map(|(_, entry)| if flag(entry.is_none()) { "1" } else { "0" }).collect();
    flags.join(",") + "\n"
}
