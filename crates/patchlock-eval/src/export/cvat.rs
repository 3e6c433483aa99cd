//! "CVAT for video 1.1": one track per target, and one box per key frame. A box with `outside="1"` ends a
//! stretch where the target leaves or is lost; the next box starts a new one. A target of which less than
//! half is visible, or whose position is uncertain, is marked as occluded.

use std::fmt::Write;

use patchlock::{BoundingBox, Status};

use super::track::Entry;
use super::xml::escaped;
use super::{Job, round};

/// A target with a score below this is marked as occluded.
const OCCLUDED: f64 = 0.5;

/// The contents of the file.
pub fn text(job: &Job<'_>) -> String {
    let frames: Vec<usize> = job.track.frames().into_iter().collect();
    let (width, height) = job.frames.size;
    let label = escaped(job.label);
    let mut out = format!(
        "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<annotations>\n  <version>1.1</version>\n  <meta>\n    \
         <task>\n      <name>{}</name>\n      <size>{}</size>\n      <mode>interpolation</mode>\n      \
         <labels>\n        <label>\n          <name>{label}</name>\n          \
         <attributes></attributes>\n        </label>\n      </labels>\n      <original_size>\n        \
         <width>{width}</width>\n        <height>{height}</height>\n      </original_size>\n    \
         </task>\n  </meta>\n",
        escaped(job.name),
        frames[frames.len() - 1] + 1,
    );
    for id in job.track.ids() {
        let _ = writeln!(out, "  <track id=\"{id}\" label=\"{label}\" source=\"auto\">");
        let entries = job.track.entries().iter().filter(|entry| entry.id == id);
        add_boxes(&mut out, (&frames, job.key_frames), entries);
        out += "  </track>\n";
    }
    out += "</annotations>\n";
    out
}

/// Writes the boxes of a target: the first and the last of each stretch, every `step`-th between them, and
/// those where it begins or ceases to be occluded. If it is not found in the next tracked frame, the last box
/// is repeated there as outside.
fn add_boxes<'a>(
    out: &mut String,
    (frames, step): (&[usize], usize),
    entries: impl Iterator<Item = &'a Entry>,
) {
    let mut found = entries.filter_map(|entry| Some((entry, entry.found()?))).peekable();
    let (mut since, mut before) = (0, None);
    while let Some((entry, bbox)) = found.next() {
        let occluded = entry.status == Some(Status::Uncertain)
            || entry.score.is_some_and(|score| score < OCCLUDED);
        let after = frames.get(frames.partition_point(|&frame| frame <= entry.frame));
        let next = found.peek().map(|(entry, _)| entry.frame);
        let outside = after.filter(|after| next.is_none_or(|next| next > **after));
        if since % step == 0 || before != Some(occluded) || outside.is_some() || next.is_none() {
            add_box(out, entry.frame, bbox, (false, occluded));
            since = 0;
        }
        (since, before) = (since + 1, Some(occluded));
        if let Some(&after) = outside {
            add_box(out, after, bbox, (true, occluded));
            (since, before) = (0, None);
        }
    }
}

fn add_box(out: &mut String, frame: usize, bbox: BoundingBox, (outside, occluded): (bool, bool)) {
    let _ = writeln!(
        out,
        "    <box frame=\"{frame}\" keyframe=\"1\" outside=\"{}\" occluded=\"{}\" xtl=\"{}\" ytl=\"{}\" \
         xbr=\"{}\" ybr=\"{}\" z_order=\"0\"></box>",
        u8::from(outside),
        u8::from(occluded),
        round(bbox.x),
        round(bbox.y),
        round(bbox.x + bbox.w),
        round(bbox.y + bbox.h),
    );
}
