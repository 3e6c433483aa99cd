//! YOLO, as read by Ultralytics: `data.yaml`, `labels/train/<image>.txt` with `class centre-x
//! centre-y width height` relative to the frame, and the frames in `images/train`; clips that are
//! kept for judging are in `labels/val` and `images/val`. Boxes are clipped to the frame, as the
//! format requires, and stay in it when they are rounded; boxes outside it are omitted. With
//! rotated boxes, a line has the corners of the outline, each clipped to the frame, in place of the
//! box; of a polygon, those of the smallest rectangle around it.

use std::fmt::Write;
use std::path::Path;

use patchlock::BoundingBox;

use super::format::{Folder, ImageUse, Purpose};
use super::{Entry, Format, Item, Job, Part};
use crate::Error;
use crate::outline::{Outline, Point};

pub const FORMAT: Format = Format {
    name: "yolo",
    title: "YOLO",
    content: "a folder to train a detector: data.yaml, labels and images; boxes are clipped to the \
              frame, ids are lost",
    purpose: Purpose::Training,
    images: ImageUse::Copied,
    folder: Some(Folder { clip: |job| items(job, Shape::Box), common: metadata }),
    ..Format::BASE
};

pub const FORMAT_OBB: Format = Format {
    name: "yolo-obb",
    title: "YOLO, rotated boxes",
    content: "the same with the corners of the rotated outline in place of the box, of a polygon those \
              of the smallest rectangle around it",
    is_rotated: true,
    folder: Some(Folder { clip: |job| items(job, Shape::Outline), common: metadata }),
    ..FORMAT
};

/// What a line says of a target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Shape {
    /// Its upright box.
    Box,
    /// The corners of its outline.
    Outline,
}

/// What the folder of these clips holds, which have the same labels. Without `path`, Ultralytics
/// takes the folder of this file, wherever it is and from wherever it is read.
fn metadata(name: &str, jobs: &[Job<'_>]) -> Vec<Item> {
    let has_val = jobs.iter().any(|job| job.part == Part::Val);
    let val = if has_val { Part::Val } else { Part::Train };
    let labels = jobs.first().map_or(&[] as &[&str], |job| job.labels.as_slice());
    let mut yaml = format!(
        "# {name}\ntrain: images/{}\nval: images/{}\nnc: {}\nnames:\n",
        Part::Train.name(),
        val.name(),
        labels.len()
    );
    for (k, class) in labels.iter().enumerate() {
        let _ = writeln!(yaml, "  {k}: {}", serde_json::Value::from(*class)); // a JSON string is valid YAML
    }
    vec![Item::text("data.yaml", yaml)]
}

/// The labels and the images of a clip.
fn items(job: &Job<'_>, shape: Shape) -> Result<Vec<Item>, Error> {
    let (mut items, part) = (Vec::new(), job.part.name());
    let entries = job.track.entries();
    for frames in entries.chunk_by(|a, b| a.frame == b.frame) {
        let labels = labels(job, frames, shape)?;
        let frame = frames[0].frame;
        let name = job.image(frame);
        let label = Path::new("labels").join(part).join(&name).with_extension("txt");
        items.push(Item::text(label, labels));
        let image = Path::new("images").join(part).join(name);
        items.extend(job.frames.copy(frame, image));
    }
    Ok(items)
}

/// The lines of one frame.
fn labels(job: &Job<'_>, entries: &[Entry], shape: Shape) -> Result<String, Error> {
    let (width, height) = (job.frames.size.0 as f64, job.frames.size.1 as f64);
    let mut lines = String::new();
    for (entry, bbox) in entries.iter().filter_map(|entry| Some((entry, entry.found()?))) {
        let Some([left, top, right, bottom]) = clipped(&bbox, width, height) else { continue };
        let numbers: Vec<f64> = match shape {
            Shape::Box => {
                let ([x, w], [y, h]) =
                    (relative(left, right, width), relative(top, bottom, height));
                if w == 0.0 || h == 0.0 {
                    continue;
                }
                vec![x, y, w, h]
            }
            Shape::Outline => {
                let inside = |at: f64, side: f64| (at / side).clamp(0.0, 1.0);
                let corners = corners(job, entry, bbox).into_iter();
                let corners = corners.map(|[x, y]| [inside(x, width), inside(y, height)]);
                corners.collect::<Vec<_>>().into_flattened()
            }
        };
        let numbers: Vec<String> = numbers.iter().map(|number| format!("{number:.6}")).collect();
        let _ = writeln!(lines, "{} {}", job.class(entry.id), numbers.join(" "));
    }
    Ok(lines)
}

/// The corners of a rotated box; of an upright one if there is no outline.
fn corners(job: &Job<'_>, entry: &Entry, bbox: BoundingBox) -> Vec<Point> {
    let outline = job.outline(entry).unwrap_or_else(|| Outline::of_box(bbox, 0.0));
    match outline.0.len() {
        4 if job.track.outline(entry).is_none() || outline.is_rectangle() => outline.0,
        _ => {
            let (bbox, degrees) = outline.rotated_box();
            Outline::of_box(bbox, degrees).0
        }
    }
}

/// Centre and length of the part of a side of the frame from `from` to `to`, relative to that side.
/// Both have the six decimal places of the file, with which both ends are still in the frame.
fn relative(from: f64, to: f64, side: f64) -> [f64; 2] {
    let millionths = |value: f64| (value / side * MILLION).round();
    let centre = millionths((from + to) / 2.0);
    let most = 2.0 * centre.min(MILLION - centre);
    [centre / MILLION, millionths(to - from).min(most) / MILLION]
}

/// What a number with six decimal places is multiplied with to make it a whole one.
const MILLION: f64 = 1e6;

/// Left, top, right and bottom of the part inside the frame; `None` if nothing is inside.
pub fn clipped(bbox: &BoundingBox, width: f64, height: f64) -> Option<[f64; 4]> {
    let (left, right) = (bbox.x.max(0.0), (bbox.x + bbox.w).min(width));
    let (top, bottom) = (bbox.y.max(0.0), (bbox.y + bbox.h).min(height));
    (left < right && top < bottom).then_some([left, top, right, bottom])
}
