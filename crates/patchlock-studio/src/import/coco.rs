//! COCO, with or without tracks.

use std::collections::HashMap;

use patchlock::{BoundingBox, Status};
use serde::Deserialize;
use serde_json::Value;

use super::{Found, Outcome, Row};

#[derive(Deserialize)]
struct Document {
    #[serde(default)]
    videos: Vec<Value>,
    images: Vec<Image>,
    annotations: Vec<Annotation>,
    #[serde(default)]
    categories: Vec<Category>,
}

#[derive(Deserialize)]
struct Image {
    id: u64,
    #[serde(default)]
    file_name: String,
    frame_id: Option<usize>,
    width: Option<usize>,
    height: Option<usize>,
}

#[derive(Deserialize)]
struct Category {
    id: u64,
    name: String,
}

#[derive(Deserialize)]
struct Annotation {
    image_id: u64,
    category_id: Option<u64>,
    bbox: [f64; 4],
    track_id: Option<Value>,
    instance_id: Option<Value>,
    score: Option<f64>,
    #[serde(default)]
    attributes: Attributes,
}

/// Those that CVAT and we write; others are ignored.
#[derive(Deserialize, Default)]
struct Attributes {
    track_id: Option<Value>,
    status: Option<Status>,
    keyframe: Option<bool>,
    #[serde(default)]
    occluded: bool,
    #[serde(default)]
    truncated: bool,
    visible: Option<f64>,
}

/// Reads all annotations.
pub fn read(text: &str, found: &mut Found<'_>) -> Outcome {
    let document: Document = serde_json::from_str(text).map_err(|error| error.to_string())?;
    if document.videos.len() > 1 {
        let count = document.videos.len();
        return Err(format!("the file has {count} videos; a project has one"));
    }
    let mut frames = HashMap::new();
    for image in &document.images {
        let frame = frame_of(image)?;
        let wrong = |reason| format!("image {}: {reason}", image.id);
        found.check_size(image.width.zip(image.height)).map_err(wrong)?;
        if frames.insert(image.id, frame).is_some() {
            return Err(format!("there are two images with the id {}", image.id));
        }
    }
    let names: HashMap<u64, &str> =
        document.categories.iter().map(|category| (category.id, category.name.as_str())).collect();
    for (k, annotation) in document.annotations.iter().enumerate() {
        annotation
            .row(&frames, &names)
            .and_then(|row| found.add(&row))
            .map_err(|reason| format!("annotation {}: {reason}", k + 1))?;
    }
    Ok(())
}

fn frame_of(image: &Image) -> Outcome<usize> {
    let stem = image.file_name.rsplit_once('.').map_or(image.file_name.as_str(), |(stem, _)| stem);
    let number = &stem[stem.trim_end_matches(|c: char| c.is_ascii_digit()).len()..];
    image.frame_id.or_else(|| number.parse().ok()).ok_or_else(|| {
        format!(
            "the image {:?} has no frame_id, and no number at the end of its name",
            image.file_name
        )
    })
}

impl Annotation {
    fn row(&self, frames: &HashMap<u64, usize>, names: &HashMap<u64, &str>) -> Outcome<Row> {
        let image = self.image_id;
        let frame = frames.get(&image).copied();
        let frame = frame.ok_or_else(|| format!("there is no image with the id {image}"))?;
        let [x, y, w, h] = self.bbox;
        let track = [&self.track_id, &self.instance_id, &self.attributes.track_id];
        let track = track.into_iter().flatten().find(|value| !value.is_null());
        let label = self.category_id.map(|category| {
            let name = names.get(&category).map(|name| (*name).to_owned());
            name.ok_or_else(|| format!("there is no category with the id {category}"))
        });
        Ok(Row {
            frame,
            track: track.map(|value| value.to_string()),
            label: label.transpose()?,
            bbox: Some(BoundingBox { x, y, w, h }),
            key: self.attributes.keyframe,
            occluded: self.attributes.occluded,
            truncated: self.attributes.truncated,
            score: self.score,
            status: self.attributes.status,
            visible: self.attributes.visible,
            ..Row::default()
        })
    }
}
