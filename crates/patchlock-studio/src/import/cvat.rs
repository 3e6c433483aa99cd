//! "CVAT for video 1.1": tracks with boxes.

use patchlock::BoundingBox;
use roxmltree::{Document, Node};

use super::{Found, Outcome, Row};
use crate::project::stretches;

/// Reads all tracks.
pub fn read(text: &str, found: &mut Found<'_>) -> Outcome {
    let document =
        Document::parse(text).map_err(|error| format!("the file is not XML: {error}"))?;
    let root = document.root_element();
    if root.tag_name().name() != "annotations" {
        return Err(format!(
            "the file begins with <{}>, not <annotations>",
            root.tag_name().name()
        ));
    }
    if root.children().any(|child| child.has_tag_name("image")) {
        return Err(
            "it is \"CVAT for images\"; export the task as \"CVAT for video 1.1\"".to_owned()
        );
    }
    found.check_size(original_size(root))?;
    let tracks = root.children().filter(|child| child.has_tag_name("track"));
    for track in tracks {
        add_track(track, found)?;
    }
    Ok(())
}

/// The size of the frames, if the file has it.
fn original_size(root: Node<'_, '_>) -> Option<(usize, usize)> {
    let size = root.descendants().find(|node| node.has_tag_name("original_size"))?;
    let side = |name: &str| {
        let node = size.children().find(|child| child.has_tag_name(name))?;
        node.text()?.trim().parse().ok()
    };
    Some((side("width")?, side("height")?))
}

fn add_track(track: Node<'_, '_>, found: &mut Found<'_>) -> Outcome {
    let id = attribute(track, "id")?.to_owned();
    let label = attribute(track, "label")?.to_owned();
    let mut boxes = Vec::new();
    for node in track.children().filter(Node::is_element) {
        match node.tag_name().name() {
            "box" => {
                let wrong = |reason| format!("line {}: {reason}", line_of(node));
                boxes.push((Outlined::read(node, &id, &label).map_err(wrong)?, node));
                let target = found.target(Some(&id), Some(&label));
                for (name, value) in attributes(node).filter(|(name, _)| *name != TRUNCATED) {
                    target.attributes.entry(name.to_owned()).or_insert(value.to_owned());
                }
            }
            "attribute" => {
                let name = attribute(node, "name")?.to_owned();
                let value = node.text().unwrap_or_default().trim().to_owned();
                found.target(Some(&id), Some(&label)).attributes.insert(name, value);
            }
            shape => {
                let line = line_of(node);
                return Err(format!(
                    "line {line}: the track {id} has a {shape}; only boxes are read"
                ));
            }
        }
    }
    boxes.sort_by_key(|(shape, _)| shape.row.frame);
    let end = found.video.frames;
    for (k, (shape, node)) in boxes.iter().enumerate() {
        let next = boxes.get(k + 1).map_or(end, |(next, _)| next.row.frame);
        let wrong = |reason| format!("line {}: {reason}", line_of(*node));
        found.add(&shape.row).map_err(wrong)?;
        if shape.outside && next > shape.row.frame {
            let hidden = [shape.row.frame, next - 1];
            stretches::add(&mut found.target(Some(&id), Some(&label)).hidden, hidden);
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
    fn read(node: Node<'_, '_>, id: &str, label: &str) -> Outcome<Self> {
        let frame = attribute(node, "frame")?;
        let frame = frame.parse().map_err(|_| format!("the frame is {frame:?}"))?;
        let number = |name: &str| {
            let text = attribute(node, name)?;
            text.parse::<f64>().map_err(|_| format!("{name} is {text:?}, not a number"))
        };
        let (x, y) = (number("xtl")?, number("ytl")?);
        let bbox = BoundingBox { x, y, w: number("xbr")? - x, h: number("ybr")? - y };
        let is = |name: &str| node.attribute(name) == Some("1");
        let outside = is("outside");
        if !outside && node.attribute("rotation").is_some_and(|turn| turn.parse() != Ok(0.0)) {
            return Err("the box is rotated; only upright boxes are read".to_owned());
        }
        let row = Row {
            frame,
            track: Some(id.to_owned()),
            label: Some(label.to_owned()),
            bbox: Some(bbox).filter(|_| !outside),
            hidden: outside,
            key: Some(node.attribute("keyframe") != Some("0")),
            occluded: is("occluded"),
            truncated: attributes(node).any(|found| found == (TRUNCATED, "true")),
            ..Row::default()
        };
        Ok(Self { row, outside })
    }
}

/// The attribute of a box of which a part is outside the frame.
const TRUNCATED: &str = "truncated";

/// Names and values of the attributes of a box.
fn attributes<'a>(node: Node<'a, 'a>) -> impl Iterator<Item = (&'a str, &'a str)> {
    let found = node.children().filter(|child| child.has_tag_name("attribute"));
    found.filter_map(|child| {
        Some((child.attribute("name")?, child.text().unwrap_or_default().trim()))
    })
}

fn attribute<'a>(node: Node<'a, '_>, name: &str) -> Outcome<&'a str> {
    node.attribute(name).ok_or_else(|| {
        format!("line {}: <{}> has no {name}", line_of(node), node.tag_name().name())
    })
}

/// The line of an element. It counts the lines before it, so it is asked only for errors.
fn line_of(node: Node<'_, '_>) -> usize {
    node.document().text_pos_at(node.range().start).row as usize
}
