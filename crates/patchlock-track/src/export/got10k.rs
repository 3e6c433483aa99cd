//! GOT-10k: `<name>_<id>/groundtruth.txt` with `x,y,w,h` on each line, labels with one number per
//! line, `meta_info.ini`, and the frames as `00000001.jpg`; and `list.txt` with the names of the
//! sequences.

use std::collections::BTreeMap;
use std::path::Path;

use patchlock::BoundingBox;

use super::format::{Folder, ImageUse, Purpose};
use super::sequence::{BoxEntry, Sequence, items};
use super::track::Entry;
use super::{Format, Item, Job};

pub const FORMAT: Format = Format {
    name: "got10k",
    title: "GOT-10k",
    content: "a folder <name>_<id> for each target, with groundtruth.txt and labels; and list.txt",
    lost: Some("absence"),
    purpose: Purpose::Benchmark,
    images: ImageUse::Copied,
    folder: Some(Folder { clip: |job| items(job, sequence_items), common: lists }),
    ..Format::BASE
};

/// Number of visibility levels in `cover.label`, not counting 0.
const COVER_LEVELS: f64 = 8.0;

/// A list of the sequences of each folder.
fn lists(_: &str, jobs: &[Job<'_>]) -> Vec<Item> {
    let mut lists = BTreeMap::<&str, String>::new();
    for job in jobs {
        let list = lists.entry(job.folder).or_default();
        for (id, entries) in job.track.by_target() {
            if entries.iter().any(|entry| entry.found().is_some()) {
                *list += &(sequence_name(job, id) + "\n");
            }
        }
    }
    let lists = lists.into_iter();
    lists.map(|(folder, list)| Item::text(Path::new(folder).join("list.txt"), list)).collect()
}

fn sequence_name(job: &Job<'_>, id: u64) -> String {
    format!("{}_{id:06}", job.name)
}

fn sequence_items(job: &Job<'_>, sequence: &Sequence<'_>) -> Vec<Item> {
    let folder = &Path::new(job.folder).join(sequence_name(job, sequence.id));
    let (width, height) = job.frames.size;
    let meta = format!(
        "[METAINFO]\nurl: unknown\nobject_class: {}\nresolution: ({width}, {height})\n",
        job.label(sequence.id)
    );
    let label = |name: &str, value: &dyn Fn(Option<BoxEntry<'_>>) -> u8| {
        let values = sequence.frames.iter().map(|(_, found)| format!("{}\n", value(*found)));
        Item::text(folder.join(name), values.collect::<String>())
    };
    let mut items = vec![
        Item::text(folder.join("groundtruth.txt"), sequence.boxes(0.0)),
        Item::text(folder.join("meta_info.ini"), meta),
        label("absence.label", &|found| u8::from(found.is_none())),
        label("cover.label", &|found| found.map_or(0, |(entry, _)| cover(entry))),
        label("cut_by_image.label", &|found| {
            u8::from(found.is_some_and(|(_, bbox)| leaves(bbox, (width, height))))
        }),
    ];
    items.extend(sequence.images(job, folder));
    items
}

/// The visible share of the target in eighths; the full 8 if the score is unknown.
fn cover(entry: &Entry) -> u8 {
    (entry.score.unwrap_or(1.0) * COVER_LEVELS).round() as u8
}

/// Whether a part of the box lies outside the frame.
fn leaves(bbox: BoundingBox, (width, height): (usize, usize)) -> bool {
    let inside = bbox.x >= 0.0 && bbox.y >= 0.0;
    !inside || bbox.x + bbox.w > width as f64 || bbox.y + bbox.h > height as f64
}
