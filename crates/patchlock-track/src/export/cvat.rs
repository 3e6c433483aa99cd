//! "CVAT for video 1.1": one track per target, and one box per key frame. CVAT interpolates between
//! the boxes of a track, and holds the last one to the end of the clip. A box with `outside="1"` ends
//! a run of frames with a box, and the next box starts a new one. CVAT refuses a track without boxes,
//! and a box in a frame that the clip does not have. A target of which less than half is visible, or
//! whose position is uncertain, is marked as occluded. A rotated box has the sides before it is
//! turned, and the attribute `rotation`. CVAT interpolates only between shapes of one kind, so that a
//! target with a polygon has polygons in all frames.

use patchlock::{BoundingBox, Status};

use super::key_frames::{Key, keys, upright};
use super::rotated::{self, RotatedBox, rotated_box};
use super::track::Entry;
use super::xml::{Document, digit};
use super::{Format, Job, round};
use crate::attributes::{Attribute, Kind};
use crate::names;
use crate::outline::Outline;

pub const FORMAT: Format = Format {
    name: "cvat",
    title: "CVAT for video 1.1",
    content: "an XML file, to go on in CVAT, with rotated boxes and polygons that a person has drawn; \
              targets with a score below 0.5 or of uncertain status are marked as occluded",
    lost: Some("outside"),
    has_key_frames: true,
    file: Some(("xml", |job| Ok(text(job, false)))),
    ..Format::BASE
};

pub const FORMAT_OBB: Format = Format {
    name: "cvat-obb",
    title: "CVAT, rotated boxes",
    content: "the same with the rotated outline of the tracker: the box and its rotation; only for \
              tables of patchlock track",
    is_rotated: true,
    is_of_tracker: true,
    file: Some(("xml", |job| Ok(text(job, true)))),
    ..FORMAT
};

/// Name of the attribute of a box of which a part is outside the frame.
const TRUNCATED: &str = "truncated";

/// The contents of the file. With `tracked`, boxes without a drawn outline have that of the tracker.
fn text(job: &Job<'_>, tracked: bool) -> String {
    // If the number of frames is not known, the clip ends with the last row: CVAT refuses a file with a
    // frame that its clip does not have.
    let last = job.track.entries().iter().map(|entry| entry.frame).max();
    let length = job.frames.count.unwrap_or_else(|| last.map_or(0, |last| last + 1));
    let (width, height) = job.frames.size;
    let mut xml = Document::new();
    xml.declare();
    xml.element("annotations", &[], |xml| {
        xml.leaf("version", &[], "1.1");
        xml.element("meta", &[], |xml| {
            xml.element("task", &[], |xml| {
                xml.leaf("name", &[], job.name);
                xml.leaf("size", &[], &length.to_string());
                xml.leaf("mode", &[], "interpolation");
                xml.element("labels", &[], |xml| write_labels(xml, job));
                xml.element("original_size", &[], |xml| {
                    xml.leaf("width", &[], &width.to_string());
                    xml.leaf("height", &[], &height.to_string());
                });
            });
        });
        for (id, entries) in job.track.by_target() {
            if entries.iter().all(|entry| entry.found().is_none()) {
                continue;
            }
            let (id_text, label) = (id.to_string(), job.label(id));
            let attributes = [("id", id_text.as_str()), ("label", label), ("source", "auto")];
            xml.element("track", &attributes, |xml| {
                write_shapes(xml, job, tracked, length, &entries);
            });
        }
    });
    xml.into_text()
}

/// Writes the definitions of all labels, each with the attributes that it declares, and others that
/// its targets have.
fn write_labels(xml: &mut Document, job: &Job<'_>) {
    let mut others = Vec::new();
    for id in job.track.ids() {
        let Some(metadata) = job.track.metadata(id) else { continue };
        let is_declared =
            |name: &str| job.declared(id).iter().any(|attribute| attribute.name == name);
        let names = metadata.attributes.keys().map(String::as_str);
        let of_target = names.filter(|name| !is_declared(name));
        others.extend(of_target.map(|name| (job.label(id), name)));
    }
    others.sort_by_key(|(of, _)| *of);
    let truncated = job.track.entries().iter().any(|entry| entry.manual.is_some());
    for label in &job.labels {
        xml.element("label", &[], |xml| {
            xml.leaf("name", &[], label);
            xml.element("attributes", &[], |xml| {
                job.track.declared(label).iter().for_each(|it| write_declared(xml, it));
                // A label of the project may have no target in this clip.
                let first = others.partition_point(|(of, _)| of < label);
                let own = others[first..].iter().take_while(|(of, _)| of == label);
                for name in names::distinct(own.map(|(_, name)| *name).collect()) {
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
/// target has no box in the frame after one, the shape is repeated there as outside, unless the clip of
/// `length` frames ends before it.
fn write_shapes(
    xml: &mut Document,
    job: &Job<'_>,
    tracked: bool,
    length: usize,
    entries: &[&Entry],
) {
    let occluded = |entry: &Entry| entry.status == Some(Status::Uncertain) || entry.is_occluded();
    let state = |entry: &Entry| (occluded(entry), job.values(entry.id, entry.frame));
    let rotated = |entry: &Entry| rotated_box(job.track, entry, tracked);
    let mut outlines = entries.iter().filter_map(|entry| job.track.outline(entry));
    let has_polygons = outlines.any(|outline| !outline.is_rectangle());
    let overlap = |ends: [&Entry; 2], share: f64, entry: &Entry| {
        let boxes = || Some(([rotated(ends[0])?, rotated(ends[1])?], rotated(entry)?));
        match boxes().filter(|(ends, own)| ends.iter().chain([own]).any(|(_, turn)| *turn != 0.0)) {
            Some((ends, own)) if !has_polygons => rotated::overlap(ends, share, own),
            _ => upright(ends, share, entry),
        }
    };
    for Key { entry, bbox, ends } in keys(entries, job.key_frames, state, overlap) {
        let (name, position) = match (has_polygons, job.track.outline(entry)) {
            (true, Some(outline)) => polygon(outline),
            (true, None) => polygon(&Outline::of_box(bbox, 0.0)),
            (false, _) => rectangle(rotated(entry).unwrap_or((bbox, 0.0))),
        };
        let truncated = entry.manual.map(|manual| if manual.truncated { "true" } else { "false" });
        let mut write = |frame: usize, outside: bool| {
            let number = frame.to_string();
            let mut all = vec![
                ("frame", number.as_str()),
                ("keyframe", "1"),
                ("outside", digit(outside)),
                ("occluded", digit(occluded(entry))),
            ];
            all.extend(position.iter().map(|(name, value)| (*name, value.as_str())));
            let values = job.values(entry.id, frame).into_iter();
            let inside: Vec<_> = values.chain(truncated.map(|value| (TRUNCATED, value))).collect();
            if inside.is_empty() {
                return xml.leaf(name, &all, "");
            }
            xml.element(name, &all, |xml| {
                for (name, value) in inside {
                    xml.leaf("attribute", &[("name", name)], value);
                }
            });
        };
        write(entry.frame, false);
        if ends && entry.frame + 1 < length {
            write(entry.frame + 1, true);
        }
    }
}

/// The name of an XML element, and its attributes that say where the target is.
type Element = (&'static str, Vec<(&'static str, String)>);

fn polygon(Outline(points): &Outline) -> Element {
    let points = Outline(points.iter().map(|point| point.map(round)).collect());
    ("polygon", vec![("points", points.to_string()), ("z_order", "0".into())])
}

fn rectangle((BoundingBox { x, y, w, h }, rotation): RotatedBox) -> Element {
    let number = |value: f64| round(value).to_string();
    let names = ["xtl", "ytl", "xbr", "ybr"].into_iter();
    let mut all: Vec<_> = names.zip([x, y, x + w, y + h].map(number)).collect();
    all.push(("z_order", "0".into()));
    if rotation != 0.0 {
        all.push(("rotation", number(rotation)));
    }
    ("box", all)
}
