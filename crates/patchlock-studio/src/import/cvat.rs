//! "CVAT for video 1.1": tracks with boxes.

use patchlock::BoundingBox;

use super::xml::{Element, Xml};
use super::{Found, Outcome, Row};

/// Reads all tracks.
pub fn read(text: &str, found: &mut Found<'_>) -> Outcome {
    let mut xml = Xml::new(text);
    let root = xml.root()?;
    if root.name != "annotations" {
        return Err(format!("the file begins with <{}>, not <annotations>", root.name));
    }
    let mut size = None;
    while let Some(child) = xml.child()? {
        match child.name.as_str() {
            "track" => add_track(&mut xml, &child, found)?,
            "image" => {
                return Err("it is \"CVAT for images\"; export the task as \"CVAT for video 1.1\""
                    .to_owned());
            }
            _ if size.is_none() => {
                size = original_size(&mut xml)?;
                found.check_size(size)?;
            }
            _ => xml.close_to(1)?,
        }
    }
    // What comes after the outermost element has to be XML, too.
    xml.child().map(|_| ())
}

/// The size of the frames, if the open element, which is read to its end, has it.
fn original_size(xml: &mut Xml<'_>) -> Outcome<Option<(usize, usize)>> {
    let (outer, mut sides) = (xml.depth() - 1, [None; 2]);
    if xml.skip_to("original_size")? {
        while let Some(child) = xml.child()? {
            let side = ["width", "height"].iter().position(|name| *name == child.name);
            let text = xml.text()?;
            if let Some(side) = side {
                sides[side] = sides[side].or(text.parse().ok());
            }
        }
    }
    xml.close_to(outer)?;
    Ok(sides[0].zip(sides[1]))
}

fn add_track(xml: &mut Xml<'_>, track: &Element, found: &mut Found<'_>) -> Outcome {
    let required = |xml: &Xml<'_>, element: &Element, name: &str| {
        let value = attribute(element, name).map(str::to_owned);
        value.map_err(|reason| format!("line {}: {reason}", xml.line_of(element)))
    };
    let (id, label) = (required(xml, track, "id")?, required(xml, track, "label")?);
    let (id, label) = (id.as_str(), label.as_str());
    let mut boxes = Vec::new();
    while let Some(element) = xml.child()? {
        match element.name.as_str() {
            "box" => {
                let read = Outlined::read(&element, id, label);
                let mut shape =
                    read.map_err(|reason| format!("line {}: {reason}", xml.line_of(&element)))?;
                let target = found.target(Some(id), Some(label));
                while let Some(child) = xml.child()? {
                    let value = xml.text()?;
                    match child.attribute("name").filter(|_| child.name == "attribute") {
                        Some(TRUNCATED) => shape.row.truncated |= value == "true",
                        Some(name) => {
                            target.attributes.entry(name.to_owned()).or_insert(value);
                        }
                        None => {}
                    }
                }
                boxes.push((shape, element));
            }
            "attribute" => {
                let name = required(xml, &element, "name")?;
                let value = xml.text()?;
                found.target(Some(id), Some(label)).attributes.insert(name, value);
            }
            shape => {
                let line = xml.line_of(&element);
                return Err(format!(
                    "line {line}: the track {id} has a {shape}; only boxes are read"
                ));
            }
        }
    }
    boxes.sort_by_key(|(shape, _)| shape.row.frame);
    let end = found.video.frames;
    for (k, (shape, element)) in boxes.iter().enumerate() {
        let next = boxes.get(k + 1).map_or(end, |(next, _)| next.row.frame);
        let wrong = |reason| format!("line {}: {reason}", xml.line_of(element));
        found.add(&shape.row).map_err(wrong)?;
        if shape.outside && next > shape.row.frame {
            found.hide(Some(id), Some(label), [shape.row.frame, next - 1]);
        }
    }
    Ok(())
}

/// A box of a track.
struct Outlined {
    row: Row,
    outside: bool,
}

impl Outlined {
    fn read(element: &Element, id: &str, label: &str) -> Outcome<Self> {
        let frame = attribute(element, "frame")?;
        let frame = frame.parse().map_err(|_| format!("the frame is {frame:?}"))?;
        let number = |name: &str| {
            let text = attribute(element, name)?;
            text.parse::<f64>().map_err(|_| format!("{name} is {text:?}, not a number"))
        };
        let (x, y) = (number("xtl")?, number("ytl")?);
        let bbox = BoundingBox { x, y, w: number("xbr")? - x, h: number("ybr")? - y };
        let is = |name: &str| element.attribute(name) == Some("1");
        let outside = is("outside");
        if !outside && element.attribute("rotation").is_some_and(|turn| turn.parse() != Ok(0.0)) {
            return Err("the box is rotated; only upright boxes are read".to_owned());
        }
        let row = Row {
            frame,
            track: Some(id.to_owned()),
            label: Some(label.to_owned()),
            bbox: Some(bbox).filter(|_| !outside),
            hidden: outside,
            key: Some(element.attribute("keyframe") != Some("0")),
            occluded: is("occluded"),
            ..Row::default()
        };
        Ok(Self { row, outside })
    }
}

/// The attribute of a box of which a part is outside the frame.
const TRUNCATED: &str = "truncated";

fn attribute<'a>(element: &'a Element, name: &str) -> Outcome<&'a str> {
    element.attribute(name).ok_or_else(|| format!("<{}> has no {name}", element.name))
}
