//! Label Studio: a JSON file with one task, to import into a project with a `Video`, a
//! `VideoRectangle` named `box` and its `Labels`. The tracks are its prediction. Positions are
//! percent of the frame, frames count from 1, and times are those of the frames. The tool
//! interpolates between key frames, and holds the last one to the end of the clip. A key frame that
//! is not enabled is the last one of a run of frames with a box: the target is shown in it, and then
//! not before the next one.

use serde_json::{Value, json};

use super::key_frames::{Key, keys};
use super::track::Entry;
use super::{Job, round};

/// The contents of the file.
pub fn text(job: &Job<'_>) -> String {
    let last = job.track.frames().last().copied().unwrap_or(0);
    let (count, end) = (job.frames.count.unwrap_or(last + 1), job.track.time(last));
    // As long as a mean frame, or that of a source without times.
    let step = if last > 0 { end / last as f64 } else { job.track.time(1) };
    let duration = round(end + step * (count - last) as f64);
    let region = |(id, entries): (u64, Vec<&Entry>)| {
        let sequence = sequence(job, &entries);
        let value = json!({
            "labels": [job.label(id)], "framesCount": count, "duration": duration,
            "sequence": sequence,
        });
        // The tool looks at the first key frame of each region.
        (!sequence.is_empty()).then(|| {
            json!({
                "id": format!("target-{id}"), "type": "videorectangle", "from_name": "box",
                "to_name": "video", "origin": "prediction", "value": value,
            })
        })
    };
    let result: Vec<Value> = job.track.by_target().into_iter().filter_map(region).collect();
    let version = concat!("patchlock ", env!("CARGO_PKG_VERSION"));
    let task = json!({
        "data": {"video": job.name}, "predictions": [{"model_version": version, "result": result}],
    });
    format!("{:#}\n", json!([task]))
}

/// The key frames of a target.
fn sequence(job: &Job<'_>, entries: &[&Entry]) -> Vec<Value> {
    let (width, height) = (job.frames.size.0 as f64, job.frames.size.1 as f64);
    let keys = keys(entries, job.key_frames, |_| ()).into_iter();
    let value = |key: Key<'_>| {
        let (frame, bbox) = (key.entry.frame, key.bbox);
        json!({
            "frame": frame + 1, "time": round(job.track.time(frame)), "enabled": !key.ends,
            "rotation": 0,
            "x": round(100.0 * bbox.x / width), "y": round(100.0 * bbox.y / height),
            "width": round(100.0 * bbox.w / width), "height": round(100.0 * bbox.h / height),
        })
    };
    keys.map(value).collect()
}
