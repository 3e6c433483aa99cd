//! Label Studio: a JSON file with one task, to import into a project with a `Video`, a
//! `VideoRectangle` named `box` and its `Labels`. The tracks are its prediction. Positions are
//! percent of the frame, frames count from 1, and times are those of the frames. A rotated box is
//! turned around its first corner, which is its position; a polygon is the smallest one around it.
//! The tool takes frames to be as long as the `framerate` of its `Video` says. In a clip whose frames
//! differ in length, a box is in the frame that the tool shows at its time. The tool interpolates
//! between key frames, and holds the last one to the end of the clip. A key frame that is not enabled
//! is the last one of a run of frames with a box: the target is shown in it, and then not before the
//! next one.

use serde_json::{Value, json};

use super::key_frames::{Key, keys, upright};
use super::rotated::rotated_box;
use super::track::{Entry, Track};
use super::{Error, Format, Job, round};
use crate::outline::Outline;

pub const FORMAT: Format = Format {
    name: "label-studio",
    title: "Label Studio",
    content: "a JSON file: a task with a prediction, for VideoRectangle",
    lost: Some("the end of a stretch"),
    has_key_frames: true,
    file: Some(("json", text)),
    note: Some(note),
    ..Format::BASE
};

/// How the tool is to be told the lengths of the frames, if they are known.
fn note(track: &Track) -> Option<String> {
    let (rate, is_even) = timing(track)?;
    let uneven = "the frames of this clip differ in length, so a box is in the frame that is shown at \
                  its time; ";
    Some(format!(
        "{}give the Video of the project framerate=\"{}\"",
        if is_even { "" } else { uneven },
        (rate * 1e3).round() / 1e3
    ))
}

/// The mean number of frames per second, and whether each frame is shown at the time of its number at
/// this rate; `None` if not all frames have times.
fn timing(track: &Track) -> Option<(f64, bool)> {
    let frames = track.frames();
    let times = frames.iter().map(|&frame| Some((frame as f64, track.known_time(frame)?)));
    let times = times.collect::<Option<Vec<(f64, f64)>>>()?;
    let (last, end) = *times.last()?;
    let rate = if last > 0.0 && end > 0.0 { last / end } else { return None };
    Some((rate, times.iter().all(|(frame, time)| (time * rate - frame).abs() < 0.5)))
}

/// The contents of the file.
fn text(job: &Job<'_>) -> Result<String, Error> {
    let last = job.track.frames().last().copied().unwrap_or(0);
    let (count, end) = (job.frames.count.unwrap_or(last + 1), job.track.time(last));
    // As long as a mean frame, or that of a source without times.
    let step = if last > 0 { end / last as f64 } else { job.track.time(1) };
    let duration = round(end + step * (count - last) as f64);
    let uneven = timing(job.track).filter(|(_, is_even)| !is_even).map(|(rate, _)| rate);
    let region = |(id, entries): (u64, Vec<&Entry>)| {
        let sequence = sequence(job, uneven, &entries);
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
    Ok(format!("{:#}\n", json!([task])))
}

/// The key frames of a target. With a rate, frames are those at the times of the boxes.
fn sequence(job: &Job<'_>, rate: Option<f64>, entries: &[&Entry]) -> Vec<Value> {
    let (width, height) = (job.frames.size.0 as f64, job.frames.size.1 as f64);
    let keys = keys(entries, job.key_frames, |_| (), upright).into_iter().rev();
    let value = |key: Key<'_>| {
        let frame = key.entry.frame;
        let (bbox, rotation) = rotated_box(job.track, key.entry, false).unwrap_or((key.bbox, 0.0));
        let [x, y] = Outline::of_box(bbox, rotation).0[0];
        let shown = rate.map_or(frame, |rate| (job.track.time(frame) * rate).round() as usize);
        json!({
            "frame": shown + 1, "time": round(job.track.time(frame)), "enabled": !key.ends,
            "rotation": if rotation == 0.0 { json!(0) } else { json!(rotation) },
            "x": round(100.0 * x / width), "y": round(100.0 * y / height),
            "width": round(100.0 * bbox.w / width), "height": round(100.0 * bbox.h / height),
        })
    };
    let mut values: Vec<Value> = keys.map(value).collect();
    // Of short frames that the tool does not tell apart, the last one counts: here the first one.
    values.dedup_by_key(|value| value["frame"].clone());
    values.reverse();
    values
}
