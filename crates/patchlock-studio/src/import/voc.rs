//! Pascal VOC: an XML file for each image. Pixels count from 1, and the right and lower sides are those
//! of the last pixel.

use patchlock::BoundingBox;

use super::xml::{Element, Xml};
use super::{File, ImportBuilder, Outcome, Row, text_of};

/// What a file says.
#[derive(Default)]
struct Annotation {
    image: String,
    size: [Option<usize>; 2],
    rows: Vec<Row>,
}

pub fn read(files: &[File], found: &mut ImportBuilder<'_>) -> Outcome {
    let mut all = Vec::new();
    // A file that is read by itself has no name.
    let is_xml = |file: &&File| file.name.is_empty() || file.name.to_lowercase().ends_with(".xml");
    for file in files.iter().filter(is_xml) {
        let wrong = |reason: String| format!("{}: {reason}", file.name);
        let text = text_of(&file.content).map_err(wrong)?;
        let read = annotation(text).map_err(wrong)?;
        found.check_size(read.size[0].zip(read.size[1])).map_err(wrong)?;
        let image = if read.image.is_empty() { file.name.clone() } else { read.image };
        all.push(Annotation { image, ..read });
    }
    found.number_images(all.iter().map(|it| it.image.as_str()))?;
    for Annotation { image, rows, .. } in all.iter().filter(|it| !it.rows.is_empty()) {
        let frame = found.images.frame(image)?;
        for row in rows {
            let row = Row { frame, ..row.clone() };
            found.add(&row).map_err(|reason| format!("{image}: {reason}"))?;
        }
    }
    Ok(())
}

fn annotation(text: &str) -> Outcome<Annotation> {
    let mut xml = Xml::new(text, "annotation")?;
    let mut read = Annotation::default();
    while let Some(part) = xml.part()? {
        match part.name() {
            "filename" => read.image = part.text,
            "size" => {
                read.size = part.texts(["width", "height"]).map(|side| side?.parse().ok());
            }
            "object" => read.rows.push(object(&part)?),
            _ => {}
        }
    }
    Ok(read)
}

fn object(object: &Element<'_>) -> Outcome<Row> {
    let [label, truncated, occluded] = object.texts(["name", "truncated", "occluded"]);
    let names = ["xmin", "ymin", "xmax", "ymax"];
    let bounds = object.children.iter().rfind(|child| child.name() == "bndbox");
    let sides = bounds.map_or([None; 4], |bounds| bounds.texts(names));
    let [Some(left), Some(top), Some(right), Some(bottom)] = sides else {
        return Err("an object has no bndbox with xmin, ymin, xmax and ymax".to_owned());
    };
    let number = |name: &str, text: &str| {
        text.parse::<f64>().map_err(|_| format!("{name} is {text:?}, not a number"))
    };
    let (left, top) = (number("xmin", left)?, number("ymin", top)?);
    let (right, bottom) = (number("xmax", right)?, number("ymax", bottom)?);
    let (w, h) = (right - left + 1.0, bottom - top + 1.0);
    Ok(Row {
        label: label.map(ToOwned::to_owned),
        bbox: Some(BoundingBox { x: left - 1.0, y: top - 1.0, w, h }),
        truncated: truncated == Some("1"),
        occluded: occluded == Some("1"),
        ..Row::default()
    })
}
