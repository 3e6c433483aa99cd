//! Label Studio: a JSON file with one task, to import into a project with a `Video`, a
//! `VideoRectangle` named `box` and its `Labels`. The tracks are its prediction. Positions are
//! percent of the frame, frames count from 1, and times are those of the frames. A key frame that
//! is not enabled ends a stretch; between the others the tool interpolates.

use serde_json::{Value, json};

use super::track::Entry;
use super::{Job, round};

/// The contents of the file.
pub fn text(job: &Job<'_>) -> String {
    let frames: Vec<usize> = job.track.frames().into_iter().collect();
    let last = frames[frames.len() - 1];
    let (count, end) = (last + 1, job.track.time(last));
    // As long as a mean frame, or that of a source without times.
    let step = if last > 0 { end / last as f64 } else { job.track.time(1) };
    let region = |(id, entries): (u64, Vec<&Entry>)| {
        let sequence = sequence(job, &frames, entries.into_iter());
        json!({
            "id": format!("target-{id}"), "type": "videorectangle", "from_name": "box", "to_name": "video",
            "origin": "prediction",
            "value": {
                "labels": [job.label(id)], "framesCount": count, "duration": round(end + step),
                "sequence": sequence,
            },
        })
    };
    let result: Vec<Value> = job.track.by_target().into_iter().map(region).collect();
    let version = concat!("patchlock ", env!("CARGO_PKG_VERSION"));
    let task = json!({
        "data": {"video": job.name}, "predictions": [{"model_version": version, "result": result}],
    });
    format!("{:#}\n", json!([task]))
}

/// The key frames of a target: the first and the last of each stretch, and every so many-th between
/// them.
fn sequence<'a>(
    job: &Job<'_>,
    frames: &[usize],
    entries: impl Iterator<Item = &'a Entry>,
) -> Vec<Value> {
    let (width, height) = (job.frames.size.0 as f64, job.frames.size.1 as f64);
    let mut found = entries.filter_map(|entry| Some((entry, entry.found()?))).peekable();
    let (mut keys, mut since) = (Vec::new(), 0);
    while let Some((entry, bbox)) = found.next() {
        let after = frames.get(frames.partition_point(|&frame| frame <= entry.frame));
        let next = found.peek().map(|(entry, _)| entry.frame);
        // The stretch ends if the target is not found in the next tracked frame, or there is none.
        let ends = match after {
            Some(&after) => next.is_none_or(|next| next > after),
            None => true,
        };
        if since % job.key_frames == 0 || ends {
            since = 0;
            keys.push(json!({
                "frame": entry.frame + 1, "time": round(job.track.time(entry.frame)), "enabled": !ends,
                "rotation": 0,
                "x": round(100.0 * bbox.x / width), "y": round(100.0 * bbox.y / height),
                "width": round(100.0 * bbox.w / width), "height": round(100.0 * bbox.h / height),
            }));
        }
        since = if ends { 0 } else { since + 1 };
    }
    keys
}
