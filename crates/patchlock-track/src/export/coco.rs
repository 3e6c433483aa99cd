//! COCO JSON for video: `images` and `annotations` as for images, so that image tools can read the
//! file, plus `videos` and `tracks`. An annotation refers to its target as `track_id` (TAO),
//! `instance_id` (CocoVID) and the attribute `track_id` (CVAT, Datumaro). The status, if known, is
//! the attribute `status`. A box that a person has drawn has the attributes `keyframe`, `occluded`
//! and `truncated`.

use patchlock::BoundingBox;
use serde_json::{Value, json};

use super::track::Entry;
use super::{Job, round};

/// The contents of the file.
pub fn text(job: &Job<'_>) -> String {
    let (width, height) = job.frames.size;
    let frames: Vec<usize> = job.track.frames().into_iter().collect();
    let images: Vec<Value> = frames
        .iter()
        .enumerate()
        .map(|(k, &frame)| {
            json!({
                "id": k + 1, "video_id": 1, "frame_id": frame, "file_name": job.frames.name(frame),
                "width": width, "height": height,
            })
        })
        .collect();
    let category = |id: u64| job.class(id) + 1;
    let annotations: Vec<Value> = job
        .track
        .entries()
        .iter()
        .filter_map(|entry| Some((entry, entry.bbox?)))
        .enumerate()
        .map(|(k, (entry, bbox))| {
            let image = frames.partition_point(|&frame| frame < entry.frame) + 1;
            annotation(k + 1, image, (entry, category(entry.id)), bbox)
        })
        .collect();
    let tracks: Vec<Value> = job
        .track
        .ids()
        .into_iter()
        .map(|id| json!({"id": id, "category_id": category(id), "video_id": 1}))
        .collect();
    let categories = job.labels.iter().enumerate();
    let categories: Vec<Value> = categories
        .map(|(k, label)| json!({"id": k + 1, "name": label, "supercategory": ""}))
        .collect();
    let all = json!({
        "info": {"description": format!("{}, tracked by Patchlock", job.name)},
        "licenses": [],
        "videos": [{"id": 1, "name": job.name, "width": width, "height": height}],
        "categories": categories,
        "tracks": tracks, "images": images, "annotations": annotations,
    });
    format!("{all:#}\n")
}

fn annotation(
    id: usize,
    image: usize,
    (entry, category): (&Entry, usize),
    bbox: BoundingBox,
) -> Value {
    // COCO's pixel k covers k to k + 1, so the centre of pixel k is at k + 0.5.
    let outline = entry.corners.map(|corners| corners.map(|[x, y]| [x + 0.5, y + 0.5]));
    let upright = [bbox.x, bbox.y, bbox.w, bbox.h].map(round);
    let mut all = json!({
        "id": id, "image_id": image, "video_id": 1, "category_id": category,
        "track_id": entry.id, "instance_id": entry.id, "attributes": {"track_id": entry.id},
        "bbox": upright,
        "area": round(outline.as_ref().map_or(bbox.w * bbox.h, area)),
        "iscrowd": 0,
    });
    if let Some(outline) = outline {
        let points: Vec<f64> = outline.as_flattened().iter().copied().map(round).collect();
        all["segmentation"] = json!([points]);
    }
    if let Some(status) = entry.status {
        all["attributes"]["status"] = json!(status);
    }
    if let Some(said) = entry.said {
        all["attributes"]["keyframe"] = json!(true);
        all["attributes"]["occluded"] = json!(said.occluded);
        all["attributes"]["truncated"] = json!(said.truncated);
    }
    if let Some(score) = entry.score {
        all["score"] = json!(round(score));
    }
    all
}

/// The area of a quadrilateral, by the shoelace formula.
fn area(corners: &[[f64; 2]; 4]) -> f64 {
    let next = |k: usize| corners[(k + 1) % corners.len()];
    let cross = |(k, [x, y]): (usize, &[f64; 2])| x * next(k)[1] - next(k)[0] * y;
    corners.iter().enumerate().map(cross).sum::<f64>().abs() / 2.0
}
