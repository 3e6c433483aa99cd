//! Label Studio: a JSON list of tasks. Of a video, key frames of targets, counted from 1; of images,
//! rectangles. Positions are percent of the frame; a rotated box is turned clockwise around its position,
//! the first corner. Between two key frames the tool interpolates, and
//! after one that is not enabled the target is not shown.

use std::collections::BTreeMap;

use patchlock::BoundingBox;
use serde::Deserialize;
use serde_json::Value;

use super::{ImportBuilder, Outcome, Outline, Row};

#[derive(Deserialize)]
struct Task {
    #[serde(default)]
    data: BTreeMap<String, Value>,
    #[serde(default)]
    annotations: Vec<Results>,
    #[serde(default)]
    predictions: Vec<Results>,
}

#[derive(Deserialize)]
struct Results {
    #[serde(default)]
    result: Vec<Region>,
    #[serde(default)]
    was_cancelled: bool,
}

#[derive(Deserialize)]
struct Region {
    id: Option<String>,
    #[serde(rename = "type", default)]
    kind: String,
    #[serde(default)]
    value: RegionValue,
}

#[derive(Deserialize, Default)]
struct RegionValue {
    #[serde(default)]
    sequence: Vec<Key>,
    #[serde(default)]
    labels: Vec<String>,
    #[serde(default)]
    rectanglelabels: Vec<String>,
    x: Option<f64>,
    y: Option<f64>,
    width: Option<f64>,
    height: Option<f64>,
    #[serde(default)]
    rotation: f64,
}

#[derive(Deserialize)]
struct Key {
    frame: usize,
    #[serde(default = "yes")]
    enabled: bool,
    x: f64,
    y: f64,
    width: f64,
    height: f64,
    #[serde(default)]
    rotation: f64,
}

fn yes() -> bool {
    true
}

impl Task {
    /// What people have annotated; if nobody has, what was predicted.
    fn regions(&self) -> impl Iterator<Item = &Region> {
        let drawn = self.annotations.iter().find(|results| !results.was_cancelled);
        drawn.or(self.predictions.first()).into_iter().flat_map(|results| &results.result)
    }

    /// The address of its image.
    fn image(&self) -> &str {
        self.data.values().find_map(Value::as_str).unwrap_or_default()
    }
}

pub fn read(text: &str, found: &mut ImportBuilder<'_>) -> Outcome {
    let tasks: Vec<Task> =
        serde_json::from_slice(text.as_bytes()).map_err(|error| error.to_string())?;
    let is_video = |task: &Task| task.regions().any(|region| region.kind == "videorectangle");
    let videos = tasks.iter().filter(|task| is_video(task)).count();
    ensure!(videos <= 1, "the file has {videos} videos; a project has one");
    let is_image = |task: &&Task| task.regions().any(|region| region.kind == "rectanglelabels");
    found.number_images(tasks.iter().filter(is_image).map(Task::image))?;
    for task in &tasks {
        for (k, region) in task.regions().enumerate() {
            let wrong = |reason: String| format!("region {}: {reason}", k + 1);
            match region.kind.as_str() {
                "videorectangle" => add_sequence(region, found).map_err(wrong)?,
                "rectanglelabels" => {
                    let frame = found.images.frame(task.image())?;
                    add_rectangle(region, frame, found).map_err(wrong)?;
                }
                kind => found.leave_out(if kind.is_empty() { "region" } else { kind }),
            }
        }
    }
    Ok(())
}

/// A box of percents in pixels, or the upright one around a rotated box, and that one.
fn in_pixels(
    [x, y, w, h]: [f64; 4],
    degrees: f64,
    found: &ImportBuilder<'_>,
) -> (BoundingBox, Option<Outline>) {
    let (width, height) = (found.video.width as f64 / 100.0, found.video.height as f64 / 100.0);
    let bbox = BoundingBox { x: x * width, y: y * height, w: w * width, h: h * height };
    if degrees == 0.0 {
        return (bbox, None);
    }
    let around_centre = Outline::of_box(bbox, degrees);
    let [u, v] = around_centre.0[0];
    let moved = around_centre.0.iter().map(|[a, b]| [a + bbox.x - u, b + bbox.y - v]);
    let outline = Outline(moved.collect());
    (outline.bounds(), Some(outline))
}

fn add_rectangle(region: &Region, frame: usize, found: &mut ImportBuilder<'_>) -> Outcome {
    let value = &region.value;
    let (Some(x), Some(y), Some(w), Some(h)) = (value.x, value.y, value.width, value.height) else {
        return Err("it has no x, y, width and height".to_owned());
    };
    let (bbox, outline) = in_pixels([x, y, w, h], value.rotation, found);
    let label = value.rectanglelabels.first().cloned();
    found.add(&Row { frame, label, bbox: Some(bbox), outline, ..Row::default() })
}

fn add_sequence(region: &Region, found: &mut ImportBuilder<'_>) -> Outcome {
    let id = region.id.as_deref().ok_or("it has no id")?;
    let label = region.value.labels.first().cloned();
    let mut keys: Vec<&Key> = region.value.sequence.iter().collect();
    keys.sort_by_key(|key| key.frame);
    let end = found.video.frames;
    for (k, key) in keys.iter().enumerate() {
        let frame = key.frame.checked_sub(1).ok_or("a frame is 0; frames count from 1")?;
        let (bbox, outline) = in_pixels([key.x, key.y, key.width, key.height], key.rotation, found);
        let (bbox, track) = (Some(bbox), Some(id.to_owned()));
        found.add(&Row { frame, track, label: label.clone(), bbox, outline, ..Row::default() })?;
        let next = keys.get(k + 1).map_or(end, |next| next.frame - 1);
        if !key.enabled && next > frame + 1 {
            found.hide(Some(id), label.as_deref(), [frame + 1, next - 1]);
        }
    }
    Ok(())
}
