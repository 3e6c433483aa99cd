//! COCO: a data set, with or without tracks, or the list of a detector's results. Such a list has
//! neither images nor categories: they are those that its boxes name.

use std::collections::{HashMap, HashSet};
use std::fmt::{self, Display};

use patchlock::{BoundingBox, Status};
use serde::Deserialize;
use serde_json::Value;

use super::images::Images;
use super::{ImportBuilder, Outcome, Outline, Row};

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
    id: ImageId,
    #[serde(default)]
    file_name: String,
    frame_id: Option<usize>,
    width: Option<usize>,
    height: Option<usize>,
}

/// A number. Detectors also take the name of the image, without ending.
#[derive(Deserialize, Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[serde(try_from = "Value")]
enum ImageId {
    Number(u64),
    Name(String),
}

impl TryFrom<Value> for ImageId {
    type Error = String;

    fn try_from(value: Value) -> Outcome<Self> {
        let number = value.as_u64().map(Self::Number);
        let id = number.or_else(|| value.as_str().map(|name| Self::Name(name.to_owned())));
        id.ok_or_else(|| {
            format!("the id of an image is {value}; allowed: a whole number from 0, or a name")
        })
    }
}

impl Display for ImageId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => number.fmt(f),
            Self::Name(name) => name.fmt(f),
        }
    }
}

#[derive(Deserialize)]
struct Category {
    id: u64,
    name: String,
}

#[derive(Deserialize)]
struct Annotation {
    image_id: ImageId,
    category_id: Option<u64>,
    bbox: Option<[f64; 4]>,
    segmentation: Option<Value>,
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

pub fn read(text: &str, found: &mut ImportBuilder<'_>) -> Outcome {
    let document = match text.trim_start().starts_with('[') {
        true => serde_json::from_slice(text.as_bytes()).map(|results| Document::of(results, found)),
        false => serde_json::from_slice(text.as_bytes()),
    };
    add(&document.map_err(|error| error.to_string())?, found)
}

impl Document {
    /// The data set of a list of results.
    fn of(results: Vec<Annotation>, found: &mut ImportBuilder<'_>) -> Self {
        let mut ids: Vec<&ImageId> = results.iter().map(|it| &it.image_id).collect();
        ids.sort_unstable();
        ids.dedup();
        let images = ids.into_iter().map(|id| Image {
            id: id.clone(),
            file_name: id.to_string(),
            frame_id: match id {
                ImageId::Number(number) => found.images.numbered(*number),
                ImageId::Name(_) => None,
            },
            width: None,
            height: None,
        });
        let images = images.collect();
        let mut ids: Vec<u64> = results.iter().filter_map(|it| it.category_id).collect();
        ids.sort_unstable();
        ids.dedup();
        let first = ids.first();
        found.notes.extend(first.map(|id| {
            format!("The file has no names of categories: the label of category {id} is class {id}")
        }));
        let categories = ids.iter().map(|&id| Category { id, name: format!("class {id}") });
        let categories = categories.collect();
        Self { videos: Vec::new(), images, annotations: results, categories }
    }
}

fn add(document: &Document, found: &mut ImportBuilder<'_>) -> Outcome {
    let videos = document.videos.len();
    ensure!(videos <= 1, "the file has {videos} videos; a project has one");
    let annotated: HashSet<&ImageId> = document.annotations.iter().map(|it| &it.image_id).collect();
    let without_frame = document.images.iter().filter(|image| image.frame_id.is_none());
    found.number_images(without_frame.map(|image| image.file_name.as_str()))?;
    let mut frames = HashMap::new();
    for image in &document.images {
        let wrong = |reason| format!("image {}: {reason}", image.id);
        found.check_size(image.width.zip(image.height)).map_err(wrong)?;
        let is_needed = annotated.contains(&image.id);
        let frame = is_needed.then(|| frame_of(image, &found.images)).transpose();
        let before = frames.insert(&image.id, frame.map_err(wrong)?);
        ensure!(before.is_none(), "there are two images with the id {}", image.id);
    }
    let names: HashMap<u64, &str> =
        document.categories.iter().map(|category| (category.id, category.name.as_str())).collect();
    for (k, annotation) in document.annotations.iter().enumerate() {
        let wrong = |reason| format!("annotation {}: {reason}", k + 1);
        let Some([x, y, w, h]) = annotation.bbox else {
            found.leave_out("annotation without a box");
            continue;
        };
        annotation
            .row(BoundingBox { x, y, w, h }, &frames, &names)
            .and_then(|row| found.add(&row))
            .map_err(wrong)?;
    }
    Ok(())
}

/// The frame of an image: by its name in a folder, which says more than a number.
fn frame_of(image: &Image, images: &Images) -> Outcome<usize> {
    match image.frame_id {
        Some(frame) => Ok(images.named(&image.file_name).unwrap_or(frame)),
        None => images.frame(&image.file_name),
    }
}

impl Annotation {
    /// The outline, if the segmentation is one polygon that a project can have. Other targets are
    /// known by their boxes.
    fn outline(&self) -> Option<Outline> {
        let [polygon] = &self.segmentation.as_ref()?.as_array()?[..] else { return None };
        let numbers = polygon.as_array()?.iter().map(Value::as_f64).collect::<Option<Vec<_>>>()?;
        let (points, rest) = numbers.as_chunks::<2>();
        let outline = Outline(points.to_vec());
        (rest.is_empty() && outline.check().is_ok()).then_some(outline)
    }

    fn row(
        &self,
        bbox: BoundingBox,
        frames: &HashMap<&ImageId, Option<usize>>,
        names: &HashMap<u64, &str>,
    ) -> Outcome<Row> {
        let image = &self.image_id;
        let frame = frames.get(image).copied().flatten();
        let frame = frame.ok_or_else(|| format!("there is no image with the id {image}"))?;
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
            bbox: Some(bbox),
            outline: self.outline(),
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
