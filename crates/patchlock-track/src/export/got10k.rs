//! GOT-10k: `<name>_<id>/groundtruth.txt` with `x,y,w,h` on each line, labels with one number per
//! line, `meta_info.ini`, and the frames as `00000001.jpg`; and `list.txt` with the names of the
//! sequences.

use std::path::Path;

use patchlock::BoundingBox;

use super::format::{ImageUse, Purpose};
use super::sequence::{BoxEntry, Sequence, sequences};
use super::track::Entry;
use super::{Format, Item, Job};
use crate::Error;

pub const FORMAT: Format = Format {
    name: "got10k",
    title: "GOT-10k",
    content: "a folder <name>_<id> for each target, with groundtruth.txt and labels; and list.txt",
    lost: Some("absence"),
    purpose: Purpose::Benchmark,
    images: ImageUse::Copied,
    set: Some(set),
    ..Format::BASE
};

/// Number of visibility levels in `cover.label`, not counting 0.
const COVER_LEVELS: f64 = 8.0;

/// The files of the clips, and a list of the sequences of each folder.
fn set(_: &str, jobs: &[Job<'_>]) -> Result<Vec<Vec<Item>>, Error> {
    let mut lists: Vec<(&str, String)> = Vec::new();
    let mut clips = Vec::new();
    for job in jobs {
        let known = lists.iter().position(|(folder, _)| *folder == job.folder);
        let k = known.unwrap_or_else(|| {
            lists.push((job.folder, String::new()));
            lists.len() - 1
        });
        let list = &mut lists[k].1;
        let mut items = Vec::new();
        for sequence in sequences(job.track)? {
            let name = format!("{}_{:06}", job.name, sequence.id);
            items.extend(sequence_items(job, &sequence, &name));
            *list += &(name + "\n");
        }
        clips.push(items);
    }
    let lists = lists.into_iter();
    let lists = lists.map(|(folder, names)| Item::text(Path::new(folder).join("list.txt"), names));
    if let Some(first) = clips.first_mut() {
        first.extend(lists);
    }
    Ok(clips)
}

fn sequence_items(job: &Job<'_>, sequence: &Sequence<'_>, name: &str) -> Vec<Item> {
    let folder = &Path::new(job.folder).join(name);
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
    for (k, (frame, _)) in sequence.frames.iter().enumerate() {
        items.extend(job.frames.jpeg(*frame, folder.join(format!("{:08}.jpg", k + 1))));
    }
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
