//! "CVAT for video 1.1": tracks with boxes or polygons; and "CVAT for images 1.1": images with them.

use patchlock::BoundingBox;
use patchlock_track::attributes::RESERVED;

use super::xml::{Element, Xml};
use super::{ImportBuilder, Outcome, Outline, Row};
use crate::project::{Attribute, Kind, check, limits};

pub fn read(text: &str, found: &mut ImportBuilder<'_>) -> Outcome {
    let mut xml = Xml::new(text);
    let root = xml.root()?;
    ensure!(root.name == "annotations", "the file begins with <{}>, not <annotations>", root.name);
    let mut size = None;
    while let Some(child) = xml.child()? {
        match child.name.as_str() {
            "track" => add_track(&mut xml, &child, found)?,
            "image" => add_image(&mut xml, &child, found)?,
            _ if size.is_none() => {
                size = read_meta(&mut xml, found)?;
                found.check_size(size)?;
            }
            _ => xml.close_to(1)?,
        }
    }
    // What comes after the outermost element has to be XML, too.
    xml.child().map(|_| ())
}

/// The size of the frames, and the attributes of labels, if the open element, which is read to its
/// end, has them.
fn read_meta(xml: &mut Xml<'_>, found: &mut ImportBuilder<'_>) -> Outcome<Option<(usize, usize)>> {
    let (depth, mut sides) = (xml.depth(), [None; 2]);
    while let Some(name) = xml.find(depth, &["original_size", "label"])? {
        if name == "label" {
            read_label(xml, found)?;
            continue;
        }
        xml.texts(&["width", "height"], |side, text| {
            sides[side] = sides[side].or(text.parse().ok());
            Ok(())
        })?;
    }
    Ok(sides[0].zip(sides[1]))
}

/// Reads a label with the definitions of its attributes.
fn read_label(xml: &mut Xml<'_>, found: &mut ImportBuilder<'_>) -> Outcome {
    let (mut label, mut attributes) = (None, Vec::new());
    while let Some(child) = xml.child()? {
        match child.name.as_str() {
            "name" => label = Some(xml.text()?),
            "attributes" => {
                while let Some(attribute) = xml.child()? {
                    let read = definition(xml)?;
                    check::at_most("attributes of a label", attributes.len(), limits::ATTRIBUTES)?;
                    let is_other = |known: &Attribute| known.name != read.name;
                    // Boxes have what is said under these names in other places.
                    if attribute.name == "attribute"
                        && !RESERVED.contains(&read.name.as_str())
                        && attributes.iter().all(is_other)
                    {
                        attributes.push(read);
                    }
                }
            }
            _ => drop(xml.text()?),
        }
    }
    if let Some(label) = label.filter(|_| !attributes.is_empty()) {
        patchlock_track::attributes::check(&attributes)
            .map_err(|reason| format!("the label {label:?}: {reason}"))?;
        found.declared.insert(label, attributes);
    }
    Ok(())
}

/// The definition of an attribute. One that a project cannot have, such as a choice without its
/// default, is that of a text, so that no value is lost.
fn definition(xml: &mut Xml<'_>) -> Outcome<Attribute> {
    let mut parts: [String; 5] = Default::default();
    xml.texts(&["name", "mutable", "input_type", "default_value", "values"], |part, text| {
        parts[part] = text;
        Ok(())
    })?;
    let [name, mutable, kind, default, values] = parts;
    let values: Vec<String> = values.lines().map(|value| value.trim().to_owned()).collect();
    let number = |k: usize| values.get(k).and_then(|text| text.parse::<f64>().ok());
    let kind = match kind.as_str() {
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
    let of = |kind: Kind, default| Attribute { name: name.clone(), kind, default, mutable };
    let read = kind.map(|kind| {
        let default = match kind {
            Kind::Checkbox => default.to_lowercase(),
            _ => default.clone(),
        };
        of(kind, default)
    });
    let text = || of(Kind::Text { length: limits::VALUE }, default.clone());
    Ok(read.filter(|read| read.check().is_ok()).unwrap_or_else(text))
}

fn add_track(xml: &mut Xml<'_>, track: &Element, found: &mut ImportBuilder<'_>) -> Outcome {
    let (id, label) = (required(xml, track, "id")?, required(xml, track, "label")?);
    let mut boxes = Vec::new();
    while let Some(element) = xml.child()? {
        match element.name.as_str() {
            "box" | "polygon" => {
                let frame = required(xml, &element, "frame")?;
                let frame = frame
                    .parse()
                    .map_err(|_| xml.in_line(&element, format!("the frame is {frame:?}")))?;
                let row = read_shape(xml, &element, frame, label)?;
                if row.hidden && frame >= found.video.frames {
                    // CVAT ends a track so after the last frame of a job.
                    found.leave_out("box outside after the last frame");
                    continue;
                }
                boxes.push((Row { track: Some(id.to_owned()), ..row }, element));
            }
            "attribute" => {
                let name = required(xml, &element, "name")?.to_owned();
                let value = xml.text()?;
                found.target(Some(id), Some(label)).attributes.insert(name, value);
            }
            shape => {
                found.leave_out(shape);
                xml.text()?;
            }
        }
    }
    boxes.sort_by_key(|(row, _)| row.frame);
    let end = found.video.frames;
    for (k, (row, element)) in boxes.iter().enumerate() {
        let next = boxes.get(k + 1).map_or(end, |(next, _)| next.frame);
        found.add(row).map_err(|reason| xml.in_line(element, reason))?;
        if row.hidden && next > row.frame {
            found.hide(Some(id), Some(label), [row.frame, next - 1]);
        }
    }
    Ok(())
}

/// Adds the boxes of an image, each of which is a target of its own.
fn add_image(xml: &mut Xml<'_>, image: &Element, found: &mut ImportBuilder<'_>) -> Outcome {
    let mut boxes = Vec::new();
    while let Some(element) = xml.child()? {
        if matches!(element.name.as_str(), "box" | "polygon") {
            let label = required(xml, &element, "label")?;
            boxes.push(read_shape(xml, &element, 0, label)?);
        } else {
            found.leave_out(&element.name);
            xml.text()?;
        }
    }
    if boxes.is_empty() {
        return Ok(());
    }
    let frame = || match found.images.have_names() {
        true => found.images.named(attribute(image, "name")?),
        false => {
            let id = attribute(image, "id")?;
            id.parse().map_err(|_| format!("the id is {id:?}, not the number of a frame"))
        }
    };
    // The line is looked for only if it is needed.
    let wrong = |reason| xml.in_line(image, reason);
    let frame = frame().map_err(wrong)?;
    for row in boxes {
        found.add(&Row { frame, ..row }).map_err(wrong)?;
    }
    Ok(())
}

/// Reads an open box or polygon to its end. One that is outside is hidden.
fn read_shape(xml: &mut Xml<'_>, element: &Element, frame: usize, label: &str) -> Outcome<Row> {
    let row = shape(element, frame, label);
    let mut row = row.map_err(|reason| xml.in_line(element, reason))?;
    while let Some(child) = xml.child()? {
        let value = xml.text()?;
        match child.attribute("name").filter(|_| child.name == "attribute") {
            Some(TRUNCATED) => row.truncated |= value == "true",
            Some(name) => row.values.push((name.to_owned(), value)),
            None => {}
        }
    }
    Ok(row)
}

fn shape(element: &Element, frame: usize, label: &str) -> Outcome<Row> {
    let (bbox, outline) = match element.name.as_str() {
        "polygon" => polygon(attribute(element, "points")?)?,
        _ => rotated_box(element)?,
    };
    let is = |name: &str| element.attribute(name) == Some("1");
    let outside = is("outside");
    Ok(Row {
        frame,
        label: Some(label.to_owned()),
        bbox: Some(bbox).filter(|_| !outside),
        outline,
        hidden: outside,
        key: Some(element.attribute("keyframe") != Some("0")),
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
fn rotated_box(element: &Element) -> Outcome<(BoundingBox, Option<Outline>)> {
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
fn required<'a>(xml: &Xml<'_>, element: &'a Element, name: &str) -> Outcome<&'a str> {
    attribute(element, name).map_err(|reason| xml.in_line(element, reason))
}

fn attribute<'a>(element: &'a Element, name: &str) -> Outcome<&'a str> {
    element.attribute(name).ok_or_else(|| format!("<{}> has no {name}", element.name))
}
