//! "CVAT for video 1.1": tracks with boxes or polygons; and "CVAT for images 1.1": images with them.

use std::borrow::Cow;

use patchlock::BoundingBox;
use patchlock_track::attributes::RESERVED;

use super::xml::{Element, Xml};
use super::{ImportBuilder, Outcome, Outline, Row};
use crate::project::{Attribute, Kind, check, limits};

pub fn read(text: &str, found: &mut ImportBuilder<'_>) -> Outcome {
    let mut xml = Xml::new(text, "annotations")?;
    let mut size = None;
    while let Some(part) = xml.part()? {
        match part.name() {
            "track" => add_track(&part, found)?,
            "image" => add_image(&part, found)?,
            _ if size.is_none() => {
                size = read_meta(&part, found)?;
                found.check_size(size)?;
            }
            _ => {}
        }
    }
    // What comes after the outermost element has to be XML, too.
    xml.part().map(|_| ())
}

/// The size of the frames, and the attributes of labels, if the element has them.
fn read_meta(meta: &Element<'_>, found: &mut ImportBuilder<'_>) -> Outcome<Option<(usize, usize)>> {
    for label in meta.find("label") {
        read_label(label, found)?;
    }
    let sides = |size: &Element<'_>| {
        let [width, height] = size.texts(["width", "height"]);
        Some((width?.parse().ok()?, height?.parse().ok()?))
    };
    Ok(meta.find("original_size").into_iter().find_map(sides))
}

/// Reads a label with the definitions of its attributes.
fn read_label(label: &Element<'_>, found: &mut ImportBuilder<'_>) -> Outcome {
    let mut attributes = Vec::new();
    let lists = label.children.iter().filter(|child| child.name() == "attributes");
    for attribute in lists.flat_map(|list| &list.children) {
        let read = definition(attribute);
        check::at_most("attributes of a label", attributes.len(), limits::ATTRIBUTES)?;
        let is_other = |known: &Attribute| known.name != read.name;
        // Boxes have what is said under these names in other places.
        if attribute.name() == "attribute"
            && !RESERVED.contains(&read.name.as_str())
            && attributes.iter().all(is_other)
        {
            attributes.push(read);
        }
    }
    let [name] = label.texts(["name"]);
    if let Some(label) = name.filter(|_| !attributes.is_empty()) {
        patchlock_track::attributes::check(&attributes)
            .map_err(|reason| format!("the label {label:?}: {reason}"))?;
        found.declared.insert(label.to_owned(), attributes);
    }
    Ok(())
}

/// The definition of an attribute. One that a project cannot have, such as a choice without its
/// default, is that of a text, so that no value is lost.
fn definition(attribute: &Element<'_>) -> Attribute {
    let names = ["name", "mutable", "input_type", "default_value", "values"];
    let texts = attribute.texts(names).map(Option::unwrap_or_default);
    let [name, mutable, kind, default, values] = texts;
    let values: Vec<String> = values.lines().map(|value| value.trim().to_owned()).collect();
    let number = |k: usize| values.get(k).and_then(|text| text.parse::<f64>().ok());
    let kind = match kind {
        "checkbox" => Some(Kind::Checkbox),
        "select" | "radio" => Some(Kind::Select { values: values.clone() }),
        "number" => number(0).zip(number(1)).map(|(min, max)| Kind::Number {
            min,
            max,
            step: number(2).unwrap_or(1.0),
        }),
        _ => None,
    };
    let mutable = mutable.eq_ignore_ascii_case("true");
    let of = |kind: Kind, default| Attribute { name: name.to_owned(), kind, default, mutable };
    let read = kind.map(|kind| {
        let default = match kind {
            Kind::Checkbox => default.to_lowercase(),
            _ => default.to_owned(),
        };
        of(kind, default)
    });
    let text = || of(Kind::Text { length: limits::VALUE }, default.to_owned());
    read.filter(|read| read.check().is_ok()).unwrap_or_else(text)
}

fn add_track(track: &Element<'_>, found: &mut ImportBuilder<'_>) -> Outcome {
    let (id, label) = (required(track, "id")?, required(track, "label")?);
    let (id, label) = (&*id, &*label);
    let mut boxes = Vec::new();
    for element in &track.children {
        match element.name() {
            "box" | "polygon" => {
                let frame = required(element, "frame")?;
                let frame = frame
                    .parse()
                    .map_err(|_| element.in_line(format!("the frame is {frame:?}")))?;
                let row = read_shape(element, frame, label)?;
                if row.hidden && frame >= found.video.frames {
                    // CVAT ends a track so after the last frame of a job.
                    found.leave_out("box outside after the last frame");
                    continue;
                }
                boxes.push((Row { track: Some(id.to_owned()), ..row }, element));
            }
            "attribute" => {
                let (name, value) = (required(element, "name")?, element.text.clone());
                found.target(Some(id), Some(label)).attributes.insert(name.into_owned(), value);
            }
            shape => found.leave_out(shape),
        }
    }
    boxes.sort_by_key(|(row, _)| row.frame);
    let end = found.video.frames;
    for (k, (row, element)) in boxes.iter().enumerate() {
        let next = boxes.get(k + 1).map_or(end, |(next, _)| next.frame);
        found.add(row).map_err(|reason| element.in_line(reason))?;
        if row.hidden && next > row.frame {
            found.hide(Some(id), Some(label), [row.frame, next - 1]);
        }
    }
    Ok(())
}

/// Adds the boxes of an image, each of which is a target of its own.
fn add_image(image: &Element<'_>, found: &mut ImportBuilder<'_>) -> Outcome {
    let mut boxes = Vec::new();
    for element in &image.children {
        if matches!(element.name(), "box" | "polygon") {
            let label = required(element, "label")?;
            boxes.push(read_shape(element, 0, &label)?);
        } else {
            found.leave_out(element.name());
        }
    }
    if boxes.is_empty() {
        return Ok(());
    }
    let frame = || match found.images.have_names() {
        true => found.images.named(&attribute(image, "name")?),
        false => {
            let id = attribute(image, "id")?;
            id.parse().map_err(|_| format!("the id is {id:?}, not the number of a frame"))
        }
    };
    let wrong = |reason| image.in_line(reason);
    let frame = frame().map_err(wrong)?;
    for row in boxes {
        found.add(&Row { frame, ..row }).map_err(wrong)?;
    }
    Ok(())
}

/// Reads a box or a polygon. One that is outside is hidden.
fn read_shape(element: &Element<'_>, frame: usize, label: &str) -> Outcome<Row> {
    let row = shape(element, frame, label);
    let mut row = row.map_err(|reason| element.in_line(reason))?;
    for child in element.children.iter().filter(|child| child.name() == "attribute") {
        match child.attribute("name").as_deref() {
            Some(TRUNCATED) => row.truncated |= child.text == "true",
            Some(name) => row.values.push((name.to_owned(), child.text.clone())),
            None => {}
        }
    }
    Ok(row)
}

fn shape(element: &Element<'_>, frame: usize, label: &str) -> Outcome<Row> {
    let (bbox, outline) = match element.name() {
        "polygon" => polygon(&attribute(element, "points")?)?,
        _ => rotated_box(element)?,
    };
    let is = |name: &str| element.attribute(name).as_deref() == Some("1");
    let outside = is("outside");
    Ok(Row {
        frame,
        label: Some(label.to_owned()),
        bbox: Some(bbox).filter(|_| !outside),
        outline,
        hidden: outside,
        key: Some(element.attribute("keyframe").as_deref() != Some("0")),
        occluded: is("occluded"),
        ..Row::default()
    })
}

/// The upright box around a polygon, and the polygon.
fn polygon(points: &str) -> Outcome<(BoundingBox, Option<Outline>)> {
    let outline: Outline = points.parse()?;
    Ok((outline.bounds(), Some(outline)))
}

/// A box, or the upright one around a box that is turned clockwise around its centre, and that one.
fn rotated_box(element: &Element<'_>) -> Outcome<(BoundingBox, Option<Outline>)> {
    let number = |name: &str| {
        let text = attribute(element, name)?;
        text.parse::<f64>().map_err(|_| format!("{name} is {text:?}, not a number"))
    };
    let (x, y) = (number("xtl")?, number("ytl")?);
    let bbox = BoundingBox { x, y, w: number("xbr")? - x, h: number("ybr")? - y };
    let rotation = element.attribute("rotation").map_or(Ok(0.0), |_| number("rotation"))?;
    ensure!(rotation.is_finite(), "rotation is {rotation}; allowed: a number of degrees");
    let outline = (rotation != 0.0).then(|| Outline::of_box(bbox, rotation));
    Ok((outline.as_ref().map_or(bbox, Outline::bounds), outline))
}

/// The attribute of a box of which a part is outside the frame.
const TRUNCATED: &str = "truncated";

/// An attribute without which the file is wrong, in the line of the element.
fn required<'a>(element: &'a Element<'_>, name: &str) -> Outcome<Cow<'a, str>> {
    attribute(element, name).map_err(|reason| element.in_line(reason))
}

fn attribute<'a>(element: &'a Element<'_>, name: &str) -> Outcome<Cow<'a, str>> {
    element.attribute(name).ok_or_else(|| format!("<{}> has no {name}", element.name()))
}
