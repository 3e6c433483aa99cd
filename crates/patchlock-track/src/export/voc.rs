//! Pascal VOC: `Annotations/<image>.xml` for each frame, `ImageSets/Main/trainval.txt` with their
//! names, the frames in `JPEGImages`, and `labelmap.txt`, which CVAT and datumaro need for labels
//! that VOC does not define. Pixels count from 1, and the right and lower sides are those of the
//! last pixel. Boxes are clipped to the frame and rounded; boxes outside it are omitted. Frames in
//! which a target is lost are left out, as in YOLO.

use std::fmt::Write;
use std::path::Path;

use super::xml::{Document, digit};
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

fn annotation(job: &Job<'_>, image: &Path, objects: &[Object<'_>]) -> String {
    let (width, height) = job.frames.size;
    let mut xml = Document::new();
    xml.element("annotation", &[], |xml| {
        xml.leaf("folder", &[], "JPEGImages");
        xml.leaf("filename", &[], &image.to_string_lossy());
        xml.element("source", &[], |xml| xml.leaf("database", &[], job.name));
        xml.element("size", &[], |xml| {
            xml.leaf("width", &[], &width.to_string());
            xml.leaf("height", &[], &height.to_string());
            xml.leaf("depth", &[], "3");
        });
        xml.leaf("segmented", &[], "0");
        for object in objects {
            xml.element("object", &[], |xml| object.write(xml));
        }
    });
    xml.into_text()
}

/// A target in a frame.
struct Object<'a> {
    label: &'a str,
    truncated: bool,
    occluded: bool,
    /// Left, top, right and bottom: the first and the last pixel, which count from 1.
    sides: [f64; 4],
}

impl Object<'_> {
    fn write(&self, xml: &mut Document) {
        xml.leaf("name", &[], self.label);
        xml.leaf("pose", &[], "Unspecified");
        xml.leaf("truncated", &[], digit(self.truncated));
        xml.leaf("occluded", &[], digit(self.occluded));
        xml.leaf("difficult", &[], "0");
        xml.element("bndbox", &[], |xml| {
            for (name, side) in ["xmin", "ymin", "xmax", "ymax"].iter().zip(self.sides) {
                xml.leaf(name, &[], &side.to_string());
            }
        });
    }
}

/// The objects of one frame; `None` if a target is lost in it.
fn objects<'a>(job: &'a Job<'_>, entries: &[Entry]) -> Option<Vec<Object<'a>>> {
    let (width, height) = (job.frames.size.0 as f64, job.frames.size.1 as f64);
    let mut objects = Vec::new();
    for entry in entries.iter().filter(|entry| !entry.is_hidden()) {
        let bbox = entry.found()?;
        let Some(sides) = clipped(&bbox, width, height) else { continue };
        let whole = sides == [bbox.x, bbox.y, bbox.x + bbox.w, bbox.y + bbox.h];
        // Left and top of the first pixel, right and bottom of the last one, at least one pixel
        // large.
        let [left, top, right, bottom] = sides.map(f64::round);
        let (left, top) = (left.min(width - 1.0) + 1.0, top.min(height - 1.0) + 1.0);
        objects.push(Object {
            label: job.label(entry.id),
            truncated: !whole || entry.said.is_some_and(|said| said.truncated),
            occluded: entry.is_occluded(),
            sides: [left, top, right.max(left), bottom.max(top)],
        });
    }
    Some(objects)
}
