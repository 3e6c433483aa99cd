//! COCO JSON for video: `images` and `annotations` as for images, so that image tools can read the
//! file, plus `videos` and `tracks`. An annotation refers to its target as `track_id` (TAO),
//! `instance_id` (CocoVID) and the attribute `track_id` (CVAT, Datumaro). The status, if known, is
//! the attribute `status`. A box that a person has drawn has the attributes `keyframe`, `occluded`
//! and `truncated`. The attributes of the target have the values of the frame; those of a checkbox
//! are truth values, and numbers are numbers.

use std::path::Path;

use serde_json::{Value, json};

use super::format::{Folder, ImageUse, Purpose};
use super::track::Entry;
use super::{Format, Item, Job, Part, round};
use crate::Error;
use crate::attributes::RESERVED;
use crate::outline::Outline;

pub const FORMAT: Format = Format {
    name: "coco",
    title: "COCO with tracks",
    content: "a JSON file with videos, tracks and track_id, to train a detector or for pycocotools; \
              the outline is the segmentation",
    lost: Some("the attribute status, which all frames have"),
    purpose: Purpose::Training,
    images: ImageUse::Named,
    file: Some(("json", |job| Ok(text(job.name, &[job])))),
    folder: Some(Folder { clip: images, common: annotations }),
    ..Format::BASE
};

/// The images of a clip, where readers look for them.
fn images(job: &Job<'_>) -> Result<Vec<Item>, Error> {
    let folder = Path::new("images").join(job.part.name());
    let frames = job.track.frames().into_iter();
    Ok(frames.filter_map(|frame| job.frames.copy(frame, folder.join(job.image(frame)))).collect())
}

/// The annotations of each part that has a clip.
fn annotations(name: &str, jobs: &[Job<'_>]) -> Vec<Item> {
    let of_part = |part: Part| {
        let jobs: Vec<&Job<'_>> = jobs.iter().filter(|job| job.part == part).collect();
        let path = format!("annotations/instances_{}.json", part.name());
        (!jobs.is_empty()).then(|| Item::text(path, text(name, &jobs)))
    };
    [Part::Train, Part::Val].into_iter().filter_map(of_part).collect()
}

/// The contents of the file, for these clips, which have the same labels. Ids are unique in the file.
fn text(name: &str, jobs: &[&Job<'_>]) -> String {
    let [mut videos, mut images, mut annotations, mut tracks] = [const { Vec::new() }; 4];
    let mut last_track = 0;
    for job in jobs {
        let (width, height) = job.frames.size;
        let video = videos.len() + 1;
        videos.push(json!({"id": video, "name": job.name, "width": width, "height": height}));
        let (images_before, tracks_before) = (images.len(), last_track);
        let frames = job.track.frames();
        images.extend(frames.iter().enumerate().map(|(k, &frame)| {
            json!({
                "id": images_before + k + 1, "video_id": video, "frame_id": frame,
                "file_name": job.image(frame), "width": width, "height": height,
            })
        }));
        for (entry, bbox) in job.track.entries().iter().filter_map(|it| Some((it, it.bbox?))) {
            let image = images_before + frames.partition_point(|&frame| frame < entry.frame) + 1;
            let track = tracks_before + entry.id;
            let upright = [bbox.x, bbox.y, bbox.w, bbox.h].map(round);
            let outline = job.outline(entry);
            let mut one = json!({
                "id": annotations.len() + 1, "image_id": image, "video_id": video,
                "category_id": job.class(entry.id) + 1,
                "track_id": track, "instance_id": track, "attributes": {"track_id": track},
                "bbox": upright,
                "area": round(outline.as_ref().map_or(bbox.w * bbox.h, Outline::area)),
                "iscrowd": 0,
            });
            if let Some(Outline(points)) = outline {
                let points: Vec<f64> = points.as_flattened().iter().copied().map(round).collect();
                one["segmentation"] = json!([points]);
            }
            if let Some(score) = entry.score {
                one["score"] = json!(round(score));
            }
            add_attributes(&mut one["attributes"], job, entry);
            annotations.push(one);
        }
        for id in job.track.ids() {
            let (track, category) = (tracks_before + id, job.class(id) + 1);
            tracks.push(json!({"id": track, "category_id": category, "video_id": video}));
            last_track = track;
        }
    }
    let labels = jobs.first().map_or(&[] as &[&str], |job| job.labels.as_slice());
    let category = |(k, label)| json!({"id": k + 1, "name": label, "supercategory": ""});
    let categories: Vec<Value> = labels.iter().enumerate().map(category).collect();
    let all = json!({
        "info": {"description": format!("{name}, tracked by Patchlock")}, "licenses": [],
        "videos": videos, "categories": categories,
        "tracks": tracks, "images": images, "annotations": annotations,
    });
    format!("{all:#}\n")
}

/// Adds what is known of a box, and the attributes of the target, except those with names that say
/// something else here.
fn add_attributes(attributes: &mut Value, job: &Job<'_>, entry: &Entry) {
    if let Some(status) = entry.status {
        attributes["status"] = json!(status);
    }
    if let Some(manual) = entry.manual {
        attributes["keyframe"] = json!(true);
        attributes["occluded"] = json!(manual.occluded);
        attributes["truncated"] = json!(manual.truncated);
    }
    let declared = job.declared(entry.id);
    for (name, value) in job.values(entry.id, entry.frame) {
        if !RESERVED.contains(&name) {
            let known = declared.iter().find(|attribute| attribute.name == name);
            attributes[name] = known.map_or_else(|| json!(value), |known| known.json(value));
        }
    }
}
