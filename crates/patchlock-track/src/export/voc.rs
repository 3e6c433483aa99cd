//! Pascal VOC: `Annotations/<image>.xml` for each frame, `ImageSets/Main/trainval.txt` with their
//! names (and `train.txt` and `val.txt` of clips that are divided), the frames in `JPEGImages`, and `labelmap.txt`, which CVAT and datumaro need for labels
//! that VOC does not define. Pixels count from 1, and the right and lower sides are those of the
//! last pixel. Boxes are clipped to the frame and rounded; boxes outside it are omitted.

use std::fmt::Write;
use std::path::Path;

use super::format::{ImageUse, Purpose};
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
    set: Some(set),
    ..Format::BASE
};

/// The files of the clips.
fn set(_: &str, jobs: &[Job<'_>]) -> Result<Vec<Vec<Item>>, Error> {
    let mut names = Names::default();
    let mut clips: Vec<Vec<Item>> = jobs.iter().map(|job| of_clip(job, &mut names)).collect();
    if let Some(first) = clips.first_mut() {
        first.extend(metadata(&names, jobs));
    }
    Ok(clips)
}

/// The names of the images of each part, one a line.
#[derive(Default)]
struct Names {
    train: String,
    val: String,
}

/// The files of the folder that belong to no image of these clips, which have the same labels.
fn metadata(names: &Names, jobs: &[Job<'_>]) -> Vec<Item> {
    let set = |name: &str, names: &str| {
        Item::text(Path::new("ImageSets/Main").join(name).with_extension("txt"), names)
    };
    let Names { train, val } = names;
    let mut items = vec![set("trainval", &format!("{train}{val}"))];
    if jobs.iter().any(|job| job.part == Part::Val) {
        items.extend([set("train", train), set("val", val)]);
    }
    let labels = jobs.first().map_or(&[] as &[&str], |job| job.labels.as_slice());
    items.push(Item::text("labelmap.txt", label_map(labels)));
    items
}

/// The annotations and the images of a clip, whose names are added.
fn of_clip(job: &Job<'_>, names: &mut Names) -> Vec<Item> {
    let mut items = Vec::new();
    let names = match job.part {
        Part::Train => &mut names.train,
        Part::Val => &mut names.val,
    };
    for entries in job.track.entries().chunk_by(|a, b| a.frame == b.frame) {
        let objects = objects(job, entries);
        let frame = entries[0].frame;
        let image = Path::new(&job.image(frame)).with_extension("jpg");
        let text = annotation(job, &image, &objects);
        items.push(Item::text(Path::new("Annotations").join(image.with_extension("xml")), text));
        items.extend(job.frames.jpeg(frame, Path::new("JPEGImages").join(&image)));
        let _ = writeln!(names, "{}", image.with_extension("").display());
    }
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

/// The objects of one frame.
fn objects<'a>(job: &'a Job<'_>, entries: &[Entry]) -> Vec<Object<'a>> {
    let (width, height) = (job.frames.size.0 as f64, job.frames.size.1 as f64);
    let mut objects = Vec::new();
    for (entry, bbox) in entries.iter().filter_map(|entry| Some((entry, entry.found()?))) {
        let Some(sides) = clipped(&bbox, width, height) else { continue };
        let whole = sides == [bbox.x, bbox.y, bbox.x + bbox.w, bbox.y + bbox.h];
        // Left and top of the first pixel, right and bottom of the last one, at least one pixel
        // large.
        let [left, top, right, bottom] = sides.map(f64::round);
        let (left, top) = (left.min(width - 1.0) + 1.0, top.min(height - 1.0) + 1.0);
        objects.push(Object {
            label: job.label(entry.id),
            truncated: !whole || entry.manual.is_some_and(|manual| manual.truncated),
            occluded: entry.is_occluded(),
            sides: [left, top, right.max(left), bottom.max(top)],
        });
    }
    objects
}
