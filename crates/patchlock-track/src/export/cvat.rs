//! "CVAT for video 1.1": one track per target, and one box per key frame. A box with `outside="1"` ends a
//! stretch where the target leaves or is lost; the next box starts a new one. A target of which less than
//! half is visible, or whose position is uncertain, is marked as occluded.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use patchlock::{BoundingBox, Status};

use super::track::Entry;
use super::xml::escaped;
use super::{Job, round};

/// The contents of the file.
pub fn text(job: &Job<'_>) -> String {
    let frames: Vec<usize> = job.track.frames().into_iter().collect();
    let (width, height) = job.frames.size;
    let mut out = format!(
        "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<annotations>\n  <version>1.1</version>\n  <meta>\n    \
         <task>\n      <name>{}</name>\n      <size>{}</size>\n      <mode>interpolation</mode>\n      \
         <labels>\n{}      </labels>\n      <original_size>\n        \
         <width>{width}</width>\n        <height>{height}</height>\n      </original_size>\n    \
         </task>\n  </meta>\n",
        escaped(job.name),
        frames[frames.len() - 1] + 1,
        labels(job),
    );
    for (id, entries) in job.track.by_target() {
        let label = escaped(job.label(id));
        let _ = writeln!(out, "  <track id=\"{id}\" label=\"{label}\" source=\"auto\">");
        add_boxes(&mut out, job, &frames, entries.into_iter());
        out += "  </track>\n";
    }
    out += "</annotations>\n";
    out
}

/// The definitions of all labels.
fn labels(job: &Job<'_>) -> String {
    let mut attributes: BTreeMap<&str, BTreeSet<&String>> = BTreeMap::new();
    for id in job.track.ids() {
        let of_target = job.attributes(id).map(|(name, _)| name);
        attributes.entry(job.label(id)).or_default().extend(of_target);
    }
    let truncated = job.track.entries().iter().any(|entry| entry.said.is_some());
    let labels = job.labels.iter();
    labels.map(|label| label_meta(label, &attributes[label], truncated)).collect()
}

/// The definition of a label, with the attributes that its targets have.
fn label_meta(label: &str, names: &BTreeSet<&String>, truncated: bool) -> String {
    let define = |name: &str, mutable: &str, kind: &str, default: &str| {
        format!(
            "<attribute><name>{name}</name><mutable>{mutable}</mutable><input_type>{kind}</input_type>\
             <default_value>{default}</default_value><values>{default}</values></attribute>"
        )
    };
    let mut attributes: String =
        names.iter().map(|name| define(&escaped(name), "False", "text", "")).collect();
    if truncated {
        attributes += &define(TRUNCATED, "True", "checkbox", "false");
    }
    format!(
        "        <label>\n          <name>{}</name>\n          \
             <attributes>{attributes}</attributes>\n        \
         </label>\n",
        escaped(label)
    )
}

/// Name of the attribute of a box of which a part is outside the frame.
const TRUNCATED: &str = "truncated";

/// The attributes of a target in a frame.
fn attributes(job: &Job<'_>, entry: &Entry) -> String {
    let line = |name: &str, value: &str| {
        format!("      <attribute name=\"{}\">{}</attribute>\n", escaped(name), escaped(value))
    };
    let own = job.attributes(entry.id).map(|(name, value)| line(name, value));
    let said =
        entry.said.map(|said| line(TRUNCATED, if said.truncated { "true" } else { "false" }));
    own.chain(said).collect()
}

/// Writes the boxes of a target: the first and the last of each stretch, every `step`-th between them, and
/// those where it begins or ceases to be occluded. If it is not found in the next tracked frame, the last box
/// is repeated there as outside.
fn add_boxes<'a>(
    out: &mut String,
    job: &Job<'_>,
    frames: &[usize],
    entries: impl Iterator<Item = &'a Entry>,
) {
    let mut found = entries.filter_map(|entry| Some((entry, entry.found()?))).peekable();
    let (mut since, mut before) = (0, None);
    while let Some((entry, bbox)) = found.next() {
        let occluded = entry.status == Some(Status::Uncertain) || entry.is_occluded();
        let after = frames.get(frames.partition_point(|&frame| frame <= entry.frame));
        let next = found.peek().map(|(entry, _)| entry.frame);
        let outside = after.filter(|after| next.is_none_or(|next| next > **after));
        let attributes = attributes(job, entry);
        if since % job.key_frames == 0
            || entry.said.is_some()
            || before != Some(occluded)
            || outside.is_some()
            || next.is_none()
        {
            add_box(out, entry.frame, bbox, (false, occluded), &attributes);
            since = 0;
        }
        (since, before) = (since + 1, Some(occluded));
        if let Some(&after) = outside {
            add_box(out, after, bbox, (true, occluded), &attributes);
            (since, before) = (0, None);
        }
    }
}

fn add_box(
    out: &mut String,
    frame: usize,
    bbox: BoundingBox,
    (outside, occluded): (bool, bool),
    attributes: &str,
) {
    let inside = if attributes.is_empty() { "" } else { "\n" };
    let indent = if attributes.is_empty() { "" } else { "    " };
    let _ = writeln!(
        out,
        "    <box frame=\"{frame}\" keyframe=\"1\" outside=\"{}\" occluded=\"{}\" xtl=\"{}\" ytl=\"{}\" \
         xbr=\"{}\" ybr=\"{}\" z_order=\"0\">{inside}{attributes}{indent}</box>",
        u8::from(outside),
        u8::from(occluded),
        round(bbox.x),
        round(bbox.y),
        round(bbox.x + bbox.w),
        round(bbox.y + bbox.h),
    );
}
