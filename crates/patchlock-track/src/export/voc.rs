//! Pascal VOC: `Annotations/<image>.xml` for each frame, `ImageSets/Main/trainval.txt` with their
//! names (and `train.txt` and `val.txt` of clips that are divided), the frames in `JPEGImages`, and `labelmap.txt`, which CVAT and datumaro need for labels
//! that VOC does not define. Pixels count from 1, and the right and lower sides are those of the
//! last pixel. Boxes are clipped to the frame and rounded; boxes outside it are omitted.

use std::path::{Path, PathBuf};

use patchlock::BoundingBox;

use super::format::{Folder, ImageUse, Purpose};
use super::xml::{Document, digit};
use super::yolo::clipped;
use super::{Entry, Error, Format, Item, Job, Part};

pub const FORMAT: Format = Format {
    name: "voc",
    title: "Pascal VOC",
    content: "a folder to train a detector: Annotations, ImageSets, labelmap.txt and JPEGImages; \
              boxes are clipped to the frame, ids are lost",
    purpose: Purpose::Training,
    images: ImageUse::Copied,
    folder: Some(Folder { clip: items, common: metadata }),
    ..Format::BASE
};

/// The files of the folder that belong to no image of these clips, which have the same labels.
fn metadata(_: &str, jobs: &[Job<'_>]) -> Vec<Item> {
    // The names of the images of a part, one a line.
    let names = |part: Part| -> String {
        let jobs = jobs.iter().filter(|job| job.part == part);
        let frames = jobs.flat_map(|job| job.track.frames().into_iter().map(|k| image(job, k)));
        frames.map(|image| format!("{}\n", image.with_extension("").display())).collect()
    };
    let [train, val] = [Part::Train, Part::Val].map(names);
    let set = |name: &str, names: &str| {
        Item::text(Path::new("ImageSets/Main").join(name).with_extension("txt"), names)
    };
    let mut items = vec![set("trainval", &format!("{train}{val}"))];
    if jobs.iter().any(|job| job.part == Part::Val) {
        items.extend([set("train", &train), set("val", &val)]);
    }
    let labels = jobs.first().map_or(&[] as &[&str], |job| job.labels.as_slice());
    items.push(Item::text("labelmap.txt", label_map(labels)));
    items
}

/// The name of the image of a frame.
fn image(job: &Job<'_>, frame: usize) -> PathBuf {
    Path::new(&job.image(frame)).with_extension("jpg")
}

/// The annotations and the images of a clip.
fn items(job: &Job<'_>) -> Result<Vec<Item>, Error> {
    let mut items = Vec::new();
    for entries in job.track.entries().chunk_by(|a, b| a.frame == b.frame) {
        let frame = entries[0].frame;
        let image = image(job, frame);
        let text = annotation(job, &image, entries);
        items.push(Item::text(Path::new("Annotations").join(image.with_extension("xml")), text));
        items.extend(job.frames.jpeg(frame, Path::new("JPEGImages").join(image)));
    }
    Ok(items)
}

/// The labels, without colours, parts and actions. One with a colon cannot be written there.
fn label_map(labels: &[&str]) -> String {
    let lines = labels.iter().filter(|label| !label.contains(':'));
    lines.fold("# label:color_rgb:parts:actions\n".to_owned(), |map, label| map + label + ":::\n")
}

fn annotation(job: &Job<'_>, image: &Path, entries: &[Entry]) -> String {
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
        for (entry, bbox) in entries.iter().filter_map(|entry| Some((entry, entry.found()?))) {
            write_object(xml, job, entry, bbox);
        }
    });
    xml.into_text()
}

/// Writes the target of an entry, unless its box is outside the frame.
fn write_object(xml: &mut Document, job: &Job<'_>, entry: &Entry, bbox: BoundingBox) {
    let (width, height) = (job.frames.size.0 as f64, job.frames.size.1 as f64);
    let Some(sides) = clipped(&bbox, width, height) else { return };
    let is_whole = sides == [bbox.x, bbox.y, bbox.x + bbox.w, bbox.y + bbox.h];
    let truncated = !is_whole || entry.manual.is_some_and(|manual| manual.truncated);
    // Left and top of the first pixel, right and bottom of the last one, at least one pixel
    // large; they count from 1.
    let [left, top, right, bottom] = sides.map(f64::round);
    let (left, top) = (left.min(width - 1.0) + 1.0, top.min(height - 1.0) + 1.0);
    let sides = [left, top, right.max(left), bottom.max(top)];
    xml.element("object", &[], |xml| {
        xml.leaf("name", &[], job.label(entry.id));
        xml.leaf("pose", &[], "Unspecified");
        xml.leaf("truncated", &[], digit(truncated));
        xml.leaf("occluded", &[], digit(entry.is_occluded()));
        xml.leaf("difficult", &[], "0");
        xml.element("bndbox", &[], |xml| {
            for (name, side) in ["xmin", "ymin", "xmax", "ymax"].iter().zip(sides) {
                xml.leaf(name, &[], &side.to_string());
            }
        });
    });
}
