//! What a project may hold. Files and edits are checked by the same rules.

use std::collections::{BTreeMap, HashSet};

use patchlock::BoundingBox;
use patchlock_track::attributes::{Attribute, check as declared};

use super::{Changes, Frames, Key, Label, Project, Remark, Target, TrackedBox, Video, changes};

/// The limits of a project.
pub mod limits {
    /// Of names of labels and attributes, of values of attributes, and of attributes of a target or a
    /// label.
    pub use patchlock_track::attributes::{ATTRIBUTES, NAME, VALUE};

    /// Most changes of attributes of a target, in all frames together.
    pub const CHANGES: usize = 100_000;
    /// Longest text of a remark, in characters.
    pub const REMARK: usize = 2000;
    /// Most remarks.
    pub const REMARKS: usize = 10_000;
    /// Most labels.
    pub const LABELS: usize = 1000;
    /// Most targets.
    pub const TARGETS: usize = 10_000;
    /// Most frames of a video.
    pub const FRAMES: usize = patchlock_media::MOST_FRAMES;
    /// Longest side of a box or a frame, in pixels.
    pub const SIDE: f64 = 100_000.0;
    /// Largest id of a target. It is a whole number in every language, also where all numbers are
    /// `f64`.
    pub const ID: u64 = 1 << 53;
}

type Result<T = ()> = std::result::Result<T, String>;

/// Checks a whole project, as a file may hold it.
pub fn project(project: &Project) -> Result {
    let Project { video, labels, targets, next_id, done: _, remarks } = project;
    self::video(video)?;
    at_most("labels", labels.len(), limits::LABELS)?;
    at_most("targets", targets.len(), limits::TARGETS)?;
    let mut names = HashSet::new();
    for label in labels {
        self::label(label)?;
        ensure!(names.insert(&label.name), "the label {:?} appears twice", label.name);
    }
    let mut ids = HashSet::new();
    for target in targets {
        let in_target = |reason| format!("target {}: {reason}", target.id);
        ensure!(ids.insert(target.id), "there are two targets with the id {}", target.id);
        self::target(target, labels, video).map_err(in_target)?;
    }
    at_most("remarks", remarks.len(), limits::REMARKS)?;
    if !remarks.is_sorted_by(|a, b| a.id < b.id) {
        return Err("the ids of the remarks are not in order, or appear twice".to_owned());
    }
    for remark in remarks {
        let wrong = |reason| format!("remark {}: {reason}", remark.id);
        self::remark(remark, project).map_err(wrong)?;
    }
    let largest = ids.into_iter().max().unwrap_or(0);
    ensure!(
        *next_id > largest && *next_id <= limits::ID,
        "next_id is {next_id}; it must be above {largest}, the largest id in use, and at most {}",
        limits::ID
    );
    Ok(())
}

/// Checks a number of things.
pub fn at_most(what: &str, count: usize, most: usize) -> Result {
    ensure!(count <= most, "there are {count} {what}; at most {most} are allowed");
    Ok(())
}

/// Checks what is said of the video.
pub fn video(video: &Video) -> Result {
    let Video { frames, width, height, .. } = video;
    ensure!(
        (1..=limits::FRAMES).contains(frames),
        "the video has {frames} frames; allowed: 1 to {}",
        limits::FRAMES
    );
    let side = 1..=limits::SIDE as usize;
    ensure!(
        side.contains(width) && side.contains(height),
        "the frames are {width} x {height} pixels; allowed: 1 to {} for each side",
        limits::SIDE
    );
    if video.hash.len() != 64 || !video.hash.bytes().all(|digit| digit.is_ascii_hexdigit()) {
        return Err("the hash of the video is not 64 hexadecimal digits".to_owned());
    }
    Ok(())
}

/// Checks a remark by itself.
pub fn remark(remark: &Remark, project: &Project) -> Result {
    frame(remark.frame, &project.video)?;
    id(remark.id)?;
    if let Some(target) = remark.target {
        ensure!(project.target(target).is_some(), "there is no target {target}");
    }
    let length = remark.text.chars().count();
    let is_control = |c: char| c.is_control() && c != '\n';
    ensure!(
        length <= limits::REMARK && !remark.text.chars().any(is_control),
        "the text {:?} has {length} characters; allowed: at most {}, no control characters",
        shortened(&remark.text),
        limits::REMARK
    );
    Ok(())
}

/// Checks the id of a remark or a target.
fn id(id: u64) -> Result {
    let largest = limits::ID - 1;
    ensure!((1..=largest).contains(&id), "the id is {id}; allowed: 1 to {largest}");
    Ok(())
}

/// Checks a label by itself.
pub fn label(label: &Label) -> Result {
    name("name of the label", &label.name)?;
    let colour = label.colour.as_bytes();
    let digits = colour.strip_prefix(b"#").unwrap_or_default();
    ensure!(
        digits.len() == 6 && digits.iter().all(u8::is_ascii_hexdigit),
        "the colour {:?} is not #rrggbb, in hexadecimal digits",
        shortened(&label.colour)
    );
    let of_label = |reason| format!("the label {:?}: {reason}", shortened(&label.name));
    declared(&label.attributes).map_err(of_label)
}

/// Checks a target with all its frames.
pub fn target(target: &Target, labels: &[Label], video: &Video) -> Result {
    id(target.id)?;
    known_label(&target.label, labels)?;
    attributes(&target.attributes)?;
    changes(&target.changes, video)?;
    frames(&target.keys, &target.tracked, &target.hidden, [0, video.frames - 1], video)
}

/// Checks the frames of a part of a target.
pub fn part(part: &Frames, range: [usize; 2], video: &Video) -> Result {
    frames(&part.keys, &part.tracked, &part.hidden, range, video)
}

fn frames(
    keys: &BTreeMap<usize, Key>,
    tracked: &BTreeMap<usize, TrackedBox>,
    hidden: &[[usize; 2]],
    [from, to]: [usize; 2],
    video: &Video,
) -> Result {
    let inside = |frame: usize| {
        let range = from..=to;
        ensure!(range.contains(&frame), "frame {frame} is not one of the frames {from} to {to}");
        Ok(())
    };
    for (&frame, key) in keys {
        inside(frame)?;
        self::key(key, video).map_err(|reason| format!("frame {frame}: {reason}"))?;
    }
    for (&frame, tracked) in tracked {
        inside(frame)?;
        tracked_box(tracked).map_err(|reason| format!("frame {frame}: {reason}"))?;
        ensure!(!keys.contains_key(&frame), "frame {frame} has both a key and a tracked box");
    }
    let mut before = None;
    for &[first, last] in hidden {
        inside(first)?;
        inside(last)?;
        ensure!(
            first <= last && before.is_none_or(|before| first > before + 1),
            "the hidden frames {first} to {last} are not in order, or not apart from those before"
        );
        let key = keys.range(first..=last).next().map(|(frame, _)| frame);
        let box_inside = key.or(tracked.range(first..=last).next().map(|(frame, _)| frame));
        if let Some(frame) = box_inside {
            return Err(format!("frame {frame} is hidden and has a box"));
        }
        before = Some(last);
    }
    Ok(())
}

/// Checks a frame number.
pub fn frame(frame: usize, video: &Video) -> Result {
    let last = video.frames - 1;
    ensure!(frame <= last, "frame {frame} is not in the video; its frames are 0 to {last}");
    Ok(())
}

/// Checks a range of frames.
pub fn range([from, to]: [usize; 2], video: &Video) -> Result {
    frame(from, video)?;
    frame(to, video)?;
    ensure!(from <= to, "the range of frames begins with {from} and ends before it, with {to}");
    Ok(())
}

/// Checks what a person has drawn in a frame.
pub fn key(key: &Key, video: &Video) -> Result {
    drawn_box(key.bbox, video)?;
    let Some(outline) = &key.outline else { return Ok(()) };
    outline.check()?;
    let (own, around) = (key.bbox, outline.bounds());
    let off = [own.x - around.x, own.y - around.y, own.w - around.w, own.h - around.h];
    ensure!(
        off.iter().all(|off| off.abs() <= ROUNDING),
        "the box is {}; the upright box around the outline is {}",
        shown(own),
        shown(around)
    );
    Ok(())
}

/// By how many pixels a box may differ from that around its outline, as both are rounded.
const ROUNDING: f64 = 0.02;

/// Checks a box that a person has drawn. Its centre must be within the frame, enlarged by the size
/// of the box on all sides.
pub fn drawn_box(bbox: BoundingBox, video: &Video) -> Result {
    sides(bbox, 1.0)?;
    let [x, y] = bbox.centre();
    let (width, height) = (video.width as f64, video.height as f64);
    if x < -bbox.w || y < -bbox.h || x > width + bbox.w || y > height + bbox.h {
        return Err(format!(
            "the box {} is too far outside the frame of {width} x {height} pixels; its centre may be at most \
             its own size away",
            shown(bbox)
        ));
    }
    Ok(())
}

/// Checks what a tracker said.
pub fn tracked_box(tracked: &TrackedBox) -> Result {
    let TrackedBox { bbox, score, visible, agreement, .. } = *tracked;
    sides(bbox, 0.001)?;
    let shares = [("score", Some(score)), ("visible", visible), ("agreement", agreement)];
    for (name, value) in shares {
        let value = value.unwrap_or(1.0);
        ensure!((0.0..=1.0).contains(&value), "{name} is {value}; allowed: 0 to 1");
    }
    Ok(())
}

fn sides(bbox: BoundingBox, least: f64) -> Result {
    let BoundingBox { x, y, w, h } = bbox;
    let side = least..=limits::SIDE;
    // NaN is in no range.
    let place = -10.0 * limits::SIDE..=10.0 * limits::SIDE;
    ensure!(
        [w, h].iter().all(|w| side.contains(w)) && [x, y].iter().all(|x| place.contains(x)),
        "the box is {}; width and height must be {least} to {} pixels, x and y at most {} from 0",
        shown(bbox),
        limits::SIDE,
        10.0 * limits::SIDE
    );
    Ok(())
}

fn shown(bbox: BoundingBox) -> String {
    format!("{},{},{},{}", bbox.x, bbox.y, bbox.w, bbox.h)
}

/// Checks that there is such a label.
pub fn known_label(name: &str, labels: &[Label]) -> Result {
    if labels.iter().any(|label| label.name == name) {
        return Ok(());
    }
    let known = labels.iter().take(20).map(|label| format!("{:?}", label.name));
    let (name, known) = (shortened(name), known.collect::<Vec<_>>().join(", "));
    Err(format!("there is no label {name:?}; the labels are {known}"))
}

/// Checks the attributes of a target.
pub fn attributes(attributes: &BTreeMap<String, String>) -> Result {
    at_most("attributes", attributes.len(), limits::ATTRIBUTES)?;
    for (attribute, value) in attributes {
        name("name of the attribute", attribute)?;
        self::value(attribute, value)?;
    }
    Ok(())
}

/// Checks the values of attributes by frame. Those that the label does not allow are no error: it
/// may have been changed while the project was closed.
pub fn changes(changes: &BTreeMap<String, Changes>, video: &Video) -> Result {
    at_most("attributes that change", changes.len(), limits::ATTRIBUTES)?;
    at_most("changes of attributes", changes::count(changes), limits::CHANGES)?;
    for (attribute, Changes(values)) in changes {
        name("name of the attribute", attribute)?;
        for (&at, value) in values {
            frame(at, video).map_err(|reason| format!("the attribute {attribute:?}: {reason}"))?;
            self::value(attribute, value)?;
        }
    }
    Ok(())
}

fn value(attribute: &str, value: &str) -> Result {
    let length = value.chars().count();
    ensure!(
        length <= limits::VALUE && !value.chars().any(char::is_control),
        "the value {:?} of the attribute {attribute:?} has {length} characters; allowed: at most {}, \
         no control characters",
        shortened(value),
        limits::VALUE
    );
    Ok(())
}

/// Checks that all values of a target's attributes are such as its label declares.
pub fn fits(target: &Target, declared: &[Attribute]) -> Result {
    for attribute in declared {
        let name = &attribute.name;
        let changes = target.changes.get(name).into_iter().flat_map(|Changes(values)| values);
        if let Some(value) = target.attributes.get(name) {
            attribute.allows(value)?;
        }
        for (frame, value) in changes {
            attribute.allows(value).map_err(|reason| format!("frame {frame}: {reason}"))?;
        }
    }
    Ok(())
}

fn name(what: &str, name: &str) -> Result {
    let length = name.chars().count();
    ensure!(
        (1..=limits::NAME).contains(&length)
            && name.trim() == name
            && !name.chars().any(char::is_control),
        "the {what} is {:?}, of {length} characters; allowed: 1 to {}, no control characters, no space \
         at the ends",
        shortened(name),
        limits::NAME
    );
    Ok(())
}

/// The first characters of a text that may be very long.
fn shortened(text: &str) -> String {
    match text.char_indices().nth(50) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.to_owned(),
    }
}
