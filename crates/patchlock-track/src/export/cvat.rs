//! "CVAT for video 1.1": one track per target, and one box per key frame. CVAT interpolates between
//! the boxes of a track, and holds the last one to the end of the clip. A box with `outside="1"` ends
//! a run of frames with a box, and the next box starts a new one. CVAT refuses a track without boxes,
//! and a box in a frame that the clip does not have. A target of which less than half is visible, or
//! whose position is uncertain, is marked as occluded. A rotated box has the sides before it is
//! turned, and the attribute `rotation`.

use std::collections::{BTreeMap, BTreeSet};

use patchlock::{BoundingBox, Status};

use super::key_frames::{keys, upright};
use super::rotated::{self, rotation};
use super::track::Entry;
use super::xml::{Document, digit};
use super::{Format, Job, round};
use crate::Error;
use crate::attributes::{Attribute, Kind};

pub const FORMAT: Format = Format {
    name: "cvat",
    title: "CVAT for video 1.1",
    content: "an XML file, to go on in CVAT; targets with a score below 0.5 or of uncertain status \
              are marked as occluded",
    lost: Some("outside"),
    has_key_frames: true,
    file: Some(("xml", |job| text(job, false))),
    ..Format::BASE
};

pub const FORMAT_OBB: Format = Format {
    name: "cvat-obb",
    title: "CVAT, rotated boxes",
    content: "the same with the rotated outline: the box and its rotation; only for tables of \
              patchlock track",
    is_rotated: true,
    file: Some(("xml", |job| text(job, true))),
    ..FORMAT
};

/// Name of the attribute of a box of which a part is outside the frame.
const TRUNCATED: &str = "truncated";

/// The contents of the file. With `rotated`, boxes are those of the outlines.
fn text(job: &Job<'_>, rotated: bool) -> Result<String, Error> {
    if rotated {
        let mut found = job.track.entries().iter().filter(|entry| entry.found().is_some());
        found.try_for_each(|entry| job.outline(entry).map(drop))?;
    }
    let length = length(job);
    let mut xml = Document::new();
    xml.declare();
    xml.element("annotations", &[], |xml| {
        xml.leaf("version", &[], "1.1");
        xml.element("meta", &[], |xml| {
            xml.element("task", &[], |xml| write_task(xml, job, length));
        });
        for (id, entries) in job.track.by_target() {
            if entries.iter().all(|entry| entry.found().is_none()) {
                continue;
            }
            let (id_text, label) = (id.to_string(), job.label(id));
            let attributes = [("id", id_text.as_str()), ("label", label), ("source", "auto")];
            xml.element("track", &attributes, |xml| {
                write_boxes(xml, job, rotated, length, &entries);
            });
        }
    });
    Ok(xml.into_text())
}

/// The number of frames of the clip. If it is not known, the clip ends with the last row: CVAT refuses
/// a file with a frame that its clip does not have.
fn length(job: &Job<'_>) -> usize {
    let last = job.track.entries().iter().map(|entry| entry.frame).max();
    job.frames.count.unwrap_or_else(|| last.map_or(0, |last| last + 1))
}

/// Writes the name, the number of frames, the labels and the size of the frames.
fn write_task(xml: &mut Document, job: &Job<'_>, frames: usize) {
    let (width, height) = job.frames.size;
    xml.leaf("name", &[], job.name);
    xml.leaf("size", &[], &frames.to_string());
    xml.leaf("mode", &[], "interpolation");
    xml.element("labels", &[], |xml| write_labels(xml, job));
    xml.element("original_size", &[], |xml| {
        xml.leaf("width", &[], &width.to_string());
        xml.leaf("height", &[], &height.to_string());
    });
}

/// Writes the definitions of all labels, each with the attributes that it declares, and others that
/// its targets have.
fn write_labels(xml: &mut Document, job: &Job<'_>) {
    let mut others: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for id in job.track.ids() {
        let of_target =
            job.track.metadata(id).into_iter().flat_map(|metadata| metadata.attributes.keys());
        let is_declared =
            |name: &str| job.declared(id).iter().any(|attribute| attribute.name == name);
        let of_target = of_target.map(String::as_str).filter(|name| !is_declared(name));
        others.entry(job.label(id)).or_default().extend(of_target);
    }
    let truncated = job.track.entries().iter().any(|entry| entry.manual.is_some());
    for label in &job.labels {
        xml.element("label", &[], |xml| {
            xml.leaf("name", &[], label);
            xml.element("attributes", &[], |xml| {
                job.track.declared(label).iter().for_each(|it| write_declared(xml, it));
                // A label of the project may have no target in this clip.
                for name in others.get(label).into_iter().flatten() {
                    write_definition(xml, name, ["False", "text", "", ""]);
                }
                if truncated {
                    write_definition(xml, TRUNCATED, ["True", "checkbox", "false", "false"]);
                }
            });
        });
    }
}

fn write_declared(xml: &mut Document, attribute: &Attribute) {
    let Attribute { name, kind, default, mutable } = attribute;
    let values = match kind {
        Kind::Select { values } => values.join("\n"),
        Kind::Number { min, max, step } => format!("{min}\n{max}\n{step}"),
        Kind::Checkbox | Kind::Text { .. } => default.clone(),
    };
    let mutable = if *mutable { "True" } else { "False" };
    write_definition(xml, name, [mutable, kind.name(), default, &values]);
}

/// Writes the definition of an attribute: its name, whether it may change from frame to frame, how
/// it is entered, its first value, and all values.
fn write_definition(xml: &mut Document, name: &str, [mutable, kind, default, values]: [&str; 4]) {
    xml.element("attribute", &[], |xml| {
        xml.leaf("name", &[], name);
        xml.leaf("mutable", &[], mutable);
        xml.leaf("input_type", &[], kind);
        xml.leaf("default_value", &[], default);
        xml.leaf("values", &[], values);
    });
}

/// Writes the key frames of a target; occlusion and attributes change only at key frames. If the
/// target has no box in the frame after one, the box is repeated there as outside, unless the clip of
/// `length` frames ends before it.
fn write_boxes(
    xml: &mut Document,
    job: &Job<'_>,
    rotated: bool,
    length: usize,
    entries: &[&Entry],
) {
    let occluded = |entry: &Entry| entry.status == Some(Status::Uncertain) || entry.is_occluded();
    let state = |entry: &Entry| (occluded(entry), job.values(entry.id, entry.frame));
    let overlap = if rotated { rotated::overlap } else { upright };
    for key in keys(entries, job.key_frames, state, overlap) {
        let entry = key.entry;
        let rotation = if rotated { rotation(entry) } else { 0.0 };
        let (frame, bbox, occluded) = (entry.frame, key.bbox, occluded(entry));
        let shape = Shape { frame, bbox, rotation, outside: false, occluded };
        shape.write(xml, job, entry);
        if key.ends && frame + 1 < length {
            Shape { frame: frame + 1, outside: true, ..shape }.write(xml, job, entry);
        }
    }
}

/// A box of a track.
struct Shape {
    frame: usize,
    bbox: BoundingBox,
    /// Degrees by which the box is turned clockwise around its centre.
    rotation: f64,
    outside: bool,
    occluded: bool,
}

impl Shape {
    /// Writes the box, with the attributes of an entry.
    fn write(&self, xml: &mut Document, job: &Job<'_>, entry: &Entry) {
        let BoundingBox { x, y, w, h } = self.bbox;
        let sides = [x, y, x + w, y + h].map(|side| round(side).to_string());
        let frame = self.frame.to_string();
        let rotation = self.rotation.to_string();
        let mut of_box = vec![
            ("frame", frame.as_str()),
            ("keyframe", "1"),
            ("outside", digit(self.outside)),
            ("occluded", digit(self.occluded)),
            ("xtl", &sides[0]),
            ("ytl", &sides[1]),
            ("xbr", &sides[2]),
            ("ybr", &sides[3]),
            ("z_order", "0"),
        ];
        if rotation != "0" {
            of_box.push(("rotation", &rotation));
        }
        let truncated = entry.manual.map(|manual| if manual.truncated { "true" } else { "false" });
        let own = job.values(entry.id, self.frame).into_iter();
        let inside: Vec<_> = own.chain(truncated.map(|value| (TRUNCATED, value))).collect();
        if inside.is_empty() {
            return xml.leaf("box", &of_box, "");
        }
        xml.element("box", &of_box, |xml| {
            for (name, value) in inside {
                xml.leaf("attribute", &[("name", name)], value);
            }
        });
    }
}
