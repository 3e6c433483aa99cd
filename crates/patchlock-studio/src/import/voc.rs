//! Pascal VOC: an XML file for each image. Pixels count from 1, and the right and lower sides are those
//! of the last pixel.

use patchlock::BoundingBox;

use super::xml::Xml;
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
        let read = annotation(&mut Xml::new(text)).map_err(wrong)?;
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

fn annotation(xml: &mut Xml<'_>) -> Outcome<Annotation> {
    let root = xml.root()?;
    ensure!(root.name == "annotation", "the file begins with <{}>, not <annotation>", root.name);
    let mut read = Annotation::default();
    while let Some(child) = xml.child()? {
        match child.name.as_str() {
            "filename" => read.image = xml.text()?,
            "size" => xml.texts(&["width", "height"], |side, text| {
                read.size[side] = text.parse().ok();
                Ok(())
            })?,
            "object" => read.rows.push(object(xml)?),
            _ => drop(xml.text()?),
        }
    }
    Ok(read)
}

fn object(xml: &mut Xml<'_>) -> Outcome<Row> {
    let (mut row, mut sides) = (Row::default(), [None; 4]);
    while let Some(child) = xml.child()? {
        match child.name.as_str() {
            "name" => row.label = Some(xml.text()?),
            "truncated" => row.truncated = xml.text()? == "1",
            "occluded" => row.occluded = xml.text()? == "1",
            "bndbox" => {
                let names = ["xmin", "ymin", "xmax", "ymax"];
                xml.texts(&names, |side, text| {
                    let wrong = |_| format!("{} is {text:?}, not a number", names[side]);
                    sides[side] = Some(text.parse::<f64>().map_err(wrong)?);
                    Ok(())
                })?;
            }
            _ => drop(xml.text()?),
        }
    }
    let [Some(left), Some(top), Some(right), Some(bottom)] = sides else {
        return Err("an object has no bndbox with xmin, ymin, xmax and ymax".to_owned());
    };
    let (w, h) = (right - left + 1.0, bottom - top + 1.0);
    Ok(Row { bbox: Some(BoundingBox { x: left - 1.0, y: top - 1.0, w, h }), ..row })
}
