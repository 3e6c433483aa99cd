//! LaSOT: `<label>/<label>-<id>/groundtruth.txt` with `x,y,w,h` on each line, counted from 1, two
//! files with one line of flags each, and the frames as `img/00000001.jpg`.

use std::path::Path;

use super::format::{Folder, ImageUse, Purpose};
use super::sequence::{Sequence, items};
use super::{Format, Item, Job};

pub const FORMAT: Format = Format {
    name: "lasot",
    title: "LaSOT",
    content: "a folder <label>/<label>-<id> for each target, with groundtruth.txt and flags",
    lost: Some("full occlusion"),
    purpose: Purpose::Benchmark,
    images: ImageUse::Copied,
    needs_size: false,
    folder: Some(Folder { clip: |job| items(job, sequence_items), common: |_, _| Vec::new() }),
    ..Format::BASE
};

fn sequence_items(job: &Job<'_>, sequence: &Sequence<'_>) -> Vec<Item> {
    let label = job.label(sequence.id);
    let folder =
        Path::new(job.folder).join(label).join(format!("{label}-{}{}", job.prefix, sequence.id));
    let mut items = vec![
        Item::text(folder.join("groundtruth.txt"), sequence.boxes(1.0)),
        Item::text(folder.join("full_occlusion.txt"), flags(sequence, |hidden| hidden)),
        Item::text(folder.join("out_of_view.txt"), flags(sequence, |_| false)),
    ];
    items.extend(sequence.images(job, &folder.join("img")));
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
