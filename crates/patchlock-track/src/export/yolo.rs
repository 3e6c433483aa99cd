//! YOLO, as read by Ultralytics: `data.yaml`, `labels/train/<image>.txt` with `class centre-x
//! centre-y width height` relative to the frame, and the frames in `images/train`; clips that are
//! kept for judging are in `labels/val` and `images/val`. Boxes are clipped to the frame, as the
//! format requires, and stay in it when they are rounded; boxes outside it are omitted. Frames in
//! which a target is lost are left out: it may be in the picture, and a detector would learn that it
//! is background. With rotated boxes, a line has the corners of the outline, each clipped to the
//! frame, in place of the box.

use std::fmt::Write;
use std::path::Path;

use patchlock::BoundingBox;

use super::{Entry, Format, Item, Job, Part};
use crate::Error;

/// What a line says of a target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// Its upright box.
    Box,
    /// The corners of its outline.
    Outline,
}

impl Shape {
    /// That of a format.
    pub fn of(format: Format) -> Self {
        if format == Format::YoloObb { Self::Outline } else { Self::Box }
    }
}

/// What the folder of these clips holds, which have the same labels. Without `path`, Ultralytics
/// takes the folder of this file, wherever it is and from wherever it is read.
pub fn about(name: &str, jobs: &[&Job<'_>]) -> Item {
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
    Item::text("data.yaml", yaml)
}

/// The labels and the images of a clip.
pub fn of_clip(job: &Job<'_>, shape: Shape) -> Result<Vec<Item>, Error> {
    let (mut items, part) = (Vec::new(), job.part.name());
    let entries = job.track.entries();
    for frames in entries.chunk_by(|a, b| a.frame == b.frame) {
        let Some(labels) = labels(job, frames, shape)? else { continue };
        let frame = frames[0].frame;
        let name = job.image(frame);
        let label = Path::new("labels").join(part).join(&name).with_extension("txt");
        items.push(Item::text(label, labels));
        let image = Path::new("images").join(part).join(name);
        items.extend(job.frames.copy(frame, image));
    }
    Ok(items)
}

/// The lines of one frame; `None` if a target is lost in it.
fn labels(job: &Job<'_>, entries: &[Entry], shape: Shape) -> Result<Option<String>, Error> {
    let (width, height) = (job.frames.size.0 as f64, job.frames.size.1 as f64);
    let mut lines = String::new();
    for entry in entries.iter().filter(|entry| !entry.is_hidden()) {
        let Some(bbox) = entry.found() else { return Ok(None) };
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
                let corners = job.outline(entry)?;
                // A corner is a point, and the centres of pixels are at whole numbers.
                let inside = |at: f64, side: f64| ((at + 0.5) / side).clamp(0.0, 1.0);
                corners.iter().flat_map(|[x, y]| [inside(*x, width), inside(*y, height)]).collect()
            }
        };
        let numbers: Vec<String> = numbers.iter().map(|number| format!("{number:.6}")).collect();
        let _ = writeln!(lines, "{} {}", job.class(entry.id), numbers.join(" "));
    }
    Ok(Some(lines))
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
