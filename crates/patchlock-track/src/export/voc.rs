//! Pascal VOC: `Annotations/<image>.xml` for each frame, `ImageSets/Main/trainval.txt` with their names, the
//! frames in `JPEGImages`, and `labelmap.txt`, which CVAT and datumaro need for labels of one's own. Pixels
//! count from 1, and the right and lower sides are those of the last pixel. Boxes are clipped to the frame
//! and rounded; boxes outside it are omitted. Frames in which a target is lost are left out, as in YOLO.

use std::fmt::Write;
use std::path::Path;

use super::xml::escaped;
use super::yolo::clipped;
use super::{Entry, Item, Job};

/// The files of the folder.
pub fn items(job: &Job<'_>) -> Vec<Item> {
    let (mut items, mut names) = (Vec::new(), String::new());
    for entries in job.track.entries().chunk_by(|a, b| a.frame == b.frame) {
        let Some(objects) = objects(job, entries) else { continue };
        let frame = entries[0].frame;
        let image = Path::new(&job.frames.name(frame)).with_extension("jpg");
        let text = annotation(job, &image, &objects);
        items.push(Item::text(Path::new("Annotations").join(image.with_extension("xml")), text));
        items.extend(job.frames.jpeg(frame, Path::new("JPEGImages").join(&image)));
        let _ = writeln!(names, "{}", image.with_extension("").display());
    }
    items.push(Item::text("ImageSets/Main/trainval.txt", names));
    items.push(Item::text("labelmap.txt", label_map(&job.labels)));
    items
}

/// The labels, without colours, parts and actions. One with a colon cannot be written there.
fn label_map(labels: &[&str]) -> String {
    let lines = labels.iter().filter(|label| !label.contains(':'));
    lines.fold("# label:color_rgb:parts:actions\n".to_owned(), |map, label| map + label + ":::\n")
}

fn annotation(job: &Job<'_>, image: &Path, objects: &str) -> String {
    let (width, height) = job.frames.size;
    format!(
        "<annotation>\n  <folder>JPEGImages</folder>\n  <filename>{}</filename>\n  <source>\n    \
         <database>{}</database>\n  </source>\n  <size>\n    <width>{width}</width>\n    \
         <height>{height}</height>\n    <depth>3</depth>\n  </size>\n  <segmented>0</segmented>\n\
         {objects}</annotation>\n",
        escaped(&image.to_string_lossy()),
        escaped(job.name),
    )
}

/// The objects of one frame; `None` if a target is lost in it.
fn objects(job: &Job<'_>, entries: &[Entry]) -> Option<String> {
    let (width, height) = (job.frames.size.0 as f64, job.frames.size.1 as f64);
    let mut out = String::new();
    for entry in entries.iter().filter(|entry| !entry.is_hidden()) {
        let bbox = entry.found()?;
        let Some(sides) = clipped(&bbox, width, height) else { continue };
        let whole = sides == [bbox.x, bbox.y, bbox.x + bbox.w, bbox.y + bbox.h];
        // Left and top of the first pixel, right and bottom of the last one, at least one pixel large.
        let [left, top, right, bottom] = sides.map(f64::round);
        let (left, top) = (left.min(width - 1.0) + 1.0, top.min(height - 1.0) + 1.0);
        let (right, bottom) = (right.max(left), bottom.max(top));
        let truncated = !whole || entry.said.is_some_and(|said| said.truncated);
        let _ = write!(
            out,
            "  <object>\n    <name>{}</name>\n    <pose>Unspecified</pose>\n    \
             <truncated>{}</truncated>\n    <occluded>{}</occluded>\n    <difficult>0</difficult>\n    \
             <bndbox>\n      <xmin>{left}</xmin>\n      <ymin>{top}</ymin>\n      \
             <xmax>{right}</xmax>\n      <ymax>{bottom}</ymax>\n    </bndbox>\n  </object>\n",
            escaped(job.label(entry.id)),
            u8::from(truncated),
            u8::from(entry.is_occluded()),
        );
    }
    Some(out)
}
