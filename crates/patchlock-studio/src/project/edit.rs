//! Everything that can be done to a project.

use std::collections::{BTreeMap, BTreeSet};

use patchlock::{BoundingBox, Status};
use serde::{Deserialize, Serialize};

use super::{
    Error, Frames, Key, Label, Project, Target, Tracked, by_frame, check, limits, stretches,
};

/// A change to a project. In JSON, the member `edit` has its name: `{"edit": "hide", "target": 1, "from": 5,
/// "to": 9}`. Ranges of frames include both ends.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "edit", rename_all = "snake_case", deny_unknown_fields)]
pub enum Edit {
    /// Adds a target with one key frame. Its id is [`Project::next_id`].
    AddTarget {
        /// Name of its label.
        label: String,
        /// The frame of the box.
        frame: usize,
        /// The box.
        #[serde(rename = "box")]
        bbox: BoundingBox,
    },
    /// Makes a frame a key frame, or changes its key. If it was hidden, it is so no more.
    SetKey {
        /// The target.
        target: u64,
        /// The frame.
        frame: usize,
        /// The box.
        #[serde(rename = "box")]
        bbox: BoundingBox,
        /// Part of the target is hidden by something else.
        #[serde(default)]
        occluded: bool,
        /// Part of the target is outside the frame.
        #[serde(default)]
        truncated: bool,
    },
    /// Removes a key; the frame then has no box.
    RemoveKey {
        /// The target.
        target: u64,
        /// The frame.
        frame: usize,
    },
    /// Replaces the tracked boxes of a range. Key frames and hidden frames stay as they are: entries for them
    /// are left out. Boxes are rounded to 1/1000 pixel, all else to 1/10000.
    SetTracked {
        /// The target.
        target: u64,
        /// First frame.
        from: usize,
        /// Last frame.
        to: usize,
        /// The boxes, by frame; frames of the range without an entry get no box.
        #[serde(with = "by_frame")]
        tracked: BTreeMap<usize, Tracked>,
    },
    /// Says that the target is not visible in a range; removes the keys and boxes there.
    Hide {
        /// The target.
        target: u64,
        /// First frame.
        from: usize,
        /// Last frame.
        to: usize,
    },
    /// Takes back that the target is not visible in a range.
    Show {
        /// The target.
        target: u64,
        /// First frame.
        from: usize,
        /// Last frame.
        to: usize,
    },
    /// Changes what is true of the whole target. What is not given stays as it is.
    SetTarget {
        /// The target.
        target: u64,
        /// Name of its label.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        label: Option<String>,
        /// All its attributes.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        attributes: Option<BTreeMap<String, String>>,
    },
    /// Deletes a target.
    DeleteTarget {
        /// The target.
        target: u64,
    },
    /// Makes a new target, with the same label and attributes, of all frames from `frame` on. Its id is
    /// [`Project::next_id`].
    Split {
        /// The target that keeps the frames before.
        target: u64,
        /// The first frame of the new target.
        frame: usize,
    },
    /// Adds the frames of the second target to the first and deletes the second. Label and attributes are
    /// those of the first. A frame must not have a box of both; boxes of lost targets and hidden frames give
    /// way to boxes.
    Join {
        /// The target that stays.
        first: u64,
        /// The target that becomes part of it.
        second: u64,
    },
    /// Adds a label.
    AddLabel {
        /// Its name.
        name: String,
        /// Its colour, `#rrggbb`; without one, the next of a palette.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        colour: Option<String>,
        /// Its place in the list, from 0; without one, the end.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        at: Option<usize>,
    },
    /// Changes a label, for all targets that have it. What is not given stays as it is.
    SetLabel {
        /// Its name so far.
        name: String,
        /// Its new name.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        new_name: Option<String>,
        /// Its new colour, `#rrggbb`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        colour: Option<String>,
    },
    /// Removes a label that no target has.
    RemoveLabel {
        /// Its name.
        name: String,
    },
    /// Adds targets with new ids, in this order, the first with [`Project::next_id`]. Labels that do not
    /// exist are added.
    Import {
        /// The targets; their ids are ignored.
        targets: Vec<Target>,
    },
    /// Puts a deleted target back.
    Restore {
        /// The target.
        target: Target,
        /// Its place in the list, from 0.
        at: usize,
    },
    /// Replaces everything that a target has in a range.
    SetFrames {
        /// The target.
        target: u64,
        /// First frame.
        from: usize,
        /// Last frame.
        to: usize,
        /// What it has there.
        frames: Frames,
    },
}

type Result<T> = std::result::Result<T, Error>;

/// An edit that is refused, for this reason.
fn refused(reason: impl Into<String>) -> Error {
    Error::Edit(reason.into())
}

impl Edit {
    /// Changes the project, and returns the edits that undo it, to be applied in order. Only
    /// [`Project::next_id`] is not set back, so that no id is used twice.
    ///
    /// # Errors
    /// [`Error::Edit`] if the edit is not possible; the project is unchanged.
    pub fn apply(self, project: &mut Project) -> Result<Vec<Self>> {
        match self {
            Self::AddTarget { label, frame, bbox } => add_target(project, label, frame, bbox),
            Self::SetKey { target, frame, bbox, occluded, truncated } => {
                set_key(project, target, frame, Key { bbox, occluded, truncated })
            }
            Self::RemoveKey { target, frame } => remove_key(project, target, frame),
            Self::SetTracked { target, from, to, tracked } => {
                set_tracked(project, target, [from, to], tracked)
            }
            Self::Hide { target, from, to } => hide(project, target, [from, to]),
            Self::Show { target, from, to } => show(project, target, [from, to]),
            Self::SetTarget { target, label, attributes } => {
                set_target(project, target, label, attributes)
            }
            Self::DeleteTarget { target } => delete_target(project, target),
            Self::Split { target, frame } => split(project, target, frame),
            Self::Join { first, second } => join(project, first, second),
            Self::AddLabel { name, colour, at } => add_label(project, name, colour, at),
            Self::SetLabel { name, new_name, colour } => set_label(project, name, new_name, colour),
            Self::RemoveLabel { name } => remove_label(project, &name),
            Self::Import { targets } => import(project, targets),
            Self::Restore { target, at } => restore(project, target, at),
            Self::SetFrames { target, from, to, frames } => {
                set_frames(project, target, [from, to], frames)
            }
        }
    }

    /// What the edit does, in a few words for a person: `hide target 3 in frames 5 to 9`.
    pub fn text(&self) -> String {
        match self {
            Self::AddTarget { label, frame, .. } => format!("add {label} in frame {frame}"),
            Self::SetKey { target, frame, .. } => {
                format!("correct target {target} in frame {frame}")
            }
            Self::RemoveKey { target, frame } => {
                format!("remove the key of target {target} in frame {frame}")
            }
            Self::SetTracked { target, from, to, .. } => {
                format!("track target {target} in frames {from} to {to}")
            }
            Self::Hide { target, from, to } => {
                format!("hide target {target} in frames {from} to {to}")
            }
            Self::Show { target, from, to } => {
                format!("show target {target} in frames {from} to {to}")
            }
            Self::SetTarget { target, label: Some(label), .. } => {
                format!("label target {target} as {label}")
            }
            Self::SetTarget { target, .. } => format!("change the attributes of target {target}"),
            Self::DeleteTarget { target } => format!("delete target {target}"),
            Self::Split { target, frame } => format!("split target {target} at frame {frame}"),
            Self::Join { first, second } => format!("join targets {first} and {second}"),
            Self::AddLabel { name, .. } => format!("add the label {name}"),
            Self::SetLabel { name, .. } => format!("change the label {name}"),
            Self::RemoveLabel { name } => format!("remove the label {name}"),
            Self::Import { targets } => match targets.len() {
                1 => "import a target".to_owned(),
                count => format!("import {count} targets"),
            },
            Self::Restore { target, .. } => format!("restore target {}", target.id),
            Self::SetFrames { target, from, to, .. } => {
                format!("change target {target} in frames {from} to {to}")
            }
        }
    }

    /// The number of boxes in the edit, which is what its memory grows with.
    pub(super) fn boxes(&self) -> usize {
        let of = |target: &Target| target.keys.len() + target.tracked.len();
        match self {
            Self::SetTracked { tracked, .. } => tracked.len(),
            Self::Import { targets } => targets.iter().map(of).sum(),
            Self::Restore { target, .. } => of(target),
            Self::SetFrames { frames, .. } => frames.boxes(),
            _ => 0,
        }
    }
}

fn index_of(project: &Project, id: u64) -> Result<usize> {
    let index = project.targets.iter().position(|target| target.id == id);
    index.ok_or_else(|| refused(format!("there is no target {id}")))
}

fn target_mut(project: &mut Project, id: u64) -> Result<&mut Target> {
    let index = index_of(project, id)?;
    Ok(&mut project.targets[index])
}

/// Takes the next id. The ids may only run out if a file claims so.
fn new_id(project: &mut Project) -> Result<u64> {
    if project.targets.len() >= limits::TARGETS {
        let reason = format!("the project has {} targets, and may not have more", limits::TARGETS);
        return Err(refused(reason));
    }
    let id = project.next_id;
    if id >= limits::ID {
        return Err(refused("all ids of targets are used up"));
    }
    project.next_id += 1;
    Ok(id)
}

fn add_target(
    project: &mut Project,
    label: String,
    frame: usize,
    bbox: BoundingBox,
) -> Result<Vec<Edit>> {
    check::known_label(&label, &project.labels).map_err(refused)?;
    check::frame(frame, &project.video).map_err(refused)?;
    check::drawn_box(bbox, &project.video).map_err(refused)?;
    let id = new_id(project)?;
    let key = Key { bbox, occluded: false, truncated: false };
    project.targets.push(Target { keys: BTreeMap::from([(frame, key)]), ..empty(id, label) });
    Ok(vec![Edit::DeleteTarget { target: id }])
}

fn empty(id: u64, label: String) -> Target {
    Target {
        id,
        label,
        attributes: BTreeMap::new(),
        keys: BTreeMap::new(),
        tracked: BTreeMap::new(),
        hidden: Vec::new(),
    }
}

/// Changes the frames of a range, and returns what brings the old ones back.
fn change_frames(
    target: &mut Target,
    [from, to]: [usize; 2],
    change: impl FnOnce(&Frames) -> Frames,
) -> Vec<Edit> {
    let old = target.cut([from, to]);
    target.put(change(&old));
    vec![Edit::SetFrames { target: target.id, from, to, frames: old }]
}

fn set_key(project: &mut Project, id: u64, frame: usize, key: Key) -> Result<Vec<Edit>> {
    check::frame(frame, &project.video).map_err(refused)?;
    check::drawn_box(key.bbox, &project.video).map_err(refused)?;
    let new = Frames { keys: BTreeMap::from([(frame, key)]), ..Frames::default() };
    Ok(change_frames(target_mut(project, id)?, [frame; 2], |_| new))
}

fn remove_key(project: &mut Project, id: u64, frame: usize) -> Result<Vec<Edit>> {
    let target = target_mut(project, id)?;
    if !target.keys.contains_key(&frame) {
        return Err(refused(format!("target {id} has no key in frame {frame}")));
    }
    Ok(change_frames(target, [frame; 2], |_| Frames::default()))
}

fn set_tracked(
    project: &mut Project,
    id: u64,
    range: [usize; 2],
    mut tracked: BTreeMap<usize, Tracked>,
) -> Result<Vec<Edit>> {
    check::range(range, &project.video).map_err(refused)?;
    tracked.values_mut().for_each(round);
    let new = Frames { tracked, ..Frames::default() };
    check::part(&new, range, &project.video).map_err(refused)?;
    Ok(change_frames(target_mut(project, id)?, range, |old| {
        let is_free = |frame: &usize| {
            !old.keys.contains_key(frame)
                && !old.hidden.iter().any(|&[from, to]| (from..=to).contains(frame))
        };
        let mut tracked = new.tracked;
        tracked.retain(|frame, _| is_free(frame));
        Frames { keys: old.keys.clone(), tracked, hidden: old.hidden.clone() }
    }))
}

/// Rounds to what a tracker can know, so that files are short.
fn round(tracked: &mut Tracked) {
    let to = |value: f64, parts: f64| (value * parts).round() / parts;
    let BoundingBox { x, y, w, h } = &mut tracked.bbox;
    for value in [x, y, w, h] {
        *value = to(*value, 1e3);
    }
    tracked.score = to(tracked.score, 1e4);
    for value in [&mut tracked.visible, &mut tracked.agreement] {
        *value = value.map(|value| to(value, 1e4));
    }
}

fn hide(project: &mut Project, id: u64, range: [usize; 2]) -> Result<Vec<Edit>> {
    check::range(range, &project.video).map_err(refused)?;
    let new = Frames { hidden: vec![range], ..Frames::default() };
    Ok(change_frames(target_mut(project, id)?, range, |_| new))
}

fn show(project: &mut Project, id: u64, range: [usize; 2]) -> Result<Vec<Edit>> {
    check::range(range, &project.video).map_err(refused)?;
    let target = target_mut(project, id)?;
    Ok(change_frames(target, range, |old| Frames { hidden: Vec::new(), ..old.clone() }))
}

fn set_target(
    project: &mut Project,
    id: u64,
    label: Option<String>,
    attributes: Option<BTreeMap<String, String>>,
) -> Result<Vec<Edit>> {
    if let Some(label) = &label {
        check::known_label(label, &project.labels).map_err(refused)?;
    }
    if let Some(attributes) = &attributes {
        check::attributes(attributes).map_err(refused)?;
    }
    let target = target_mut(project, id)?;
    let label = label.map(|label| std::mem::replace(&mut target.label, label));
    let attributes = attributes.map(|new| std::mem::replace(&mut target.attributes, new));
    Ok(vec![Edit::SetTarget { target: id, label, attributes }])
}

fn delete_target(project: &mut Project, id: u64) -> Result<Vec<Edit>> {
    let at = index_of(project, id)?;
    let target = project.targets.remove(at);
    Ok(vec![Edit::Restore { target, at }])
}

fn restore(project: &mut Project, target: Target, at: usize) -> Result<Vec<Edit>> {
    let (id, count) = (target.id, project.targets.len());
    if project.target(id).is_some() {
        return Err(refused(format!("there is a target {id} already")));
    }
    if at > count {
        return Err(refused(format!("the place is {at}; allowed: 0 to {count}")));
    }
    if count >= limits::TARGETS {
        return Err(refused(format!("there are {count} targets, and may not be more")));
    }
    check::target(&target, &project.labels, &project.video).map_err(refused)?;
    project.next_id = project.next_id.max(id + 1);
    project.targets.insert(at, target);
    Ok(vec![Edit::DeleteTarget { target: id }])
}

fn set_frames(
    project: &mut Project,
    id: u64,
    range: [usize; 2],
    frames: Frames,
) -> Result<Vec<Edit>> {
    check::range(range, &project.video).map_err(refused)?;
    check::part(&frames, range, &project.video).map_err(refused)?;
    Ok(change_frames(target_mut(project, id)?, range, |_| frames))
}

fn split(project: &mut Project, id: u64, frame: usize) -> Result<Vec<Edit>> {
    check::frame(frame, &project.video).map_err(refused)?;
    let range = [frame, project.video.frames - 1];
    let target = &project.targets[index_of(project, id)?];
    let boxes = || target.keys.keys().chain(target.tracked.keys());
    if !boxes().any(|&other| other < frame) || !boxes().any(|&other| other >= frame) {
        return Err(refused(format!(
            "target {id} cannot be split at frame {frame}: it must have a box before it, and one from it on"
        )));
    }
    let (label, attributes) = (target.label.clone(), target.attributes.clone());
    let new_id = new_id(project)?;
    let rest = target_mut(project, id)?.cut(range);
    let mut new = Target { attributes, ..empty(new_id, label) };
    new.put(rest.clone());
    project.targets.push(new);
    Ok(vec![
        Edit::DeleteTarget { target: new_id },
        Edit::SetFrames { target: id, from: range[0], to: range[1], frames: rest },
    ])
}

fn join(project: &mut Project, first: u64, second: u64) -> Result<Vec<Edit>> {
    if first == second {
        return Err(refused(format!("target {first} cannot be joined with itself")));
    }
    let (one, at) = (index_of(project, first)?, index_of(project, second)?);
    let clash = clash(&project.targets[one], &project.targets[at]);
    if let Some((frame, count)) = clash {
        let others = if count > 1 { format!(", and {} more", count - 1) } else { String::new() };
        return Err(refused(format!(
            "targets {first} and {second} both have a box in frame {frame}{others}; remove one of them first"
        )));
    }
    let mut removed = project.targets.remove(at);
    let restore = Edit::Restore { target: removed.clone(), at };
    let added = removed.cut_all();
    let range = added.span().unwrap_or([0, 0]);
    let target = target_mut(project, first)?;
    let mut undo = change_frames(target, range, |old| merged(old, added));
    undo.push(restore);
    Ok(undo)
}

/// The boxes of a target that count: those of lost frames only say where it was seen last.
fn sure_frames(target: &Target) -> BTreeSet<usize> {
    let found = target.tracked.iter().filter(|(_, tracked)| tracked.status != Status::Lost);
    target.keys.keys().chain(found.map(|(frame, _)| frame)).copied().collect()
}

/// The first frame in which both targets have a box that counts, and the number of such frames.
fn clash(first: &Target, second: &Target) -> Option<(usize, usize)> {
    let (first, second) = (sure_frames(first), sure_frames(second));
    let mut both = first.intersection(&second);
    let frame = *both.next()?;
    Some((frame, both.count() + 1))
}

/// The frames of both, which have no sure boxes in common.
fn merged(old: &Frames, added: Frames) -> Frames {
    let keys: BTreeMap<usize, Key> = old.keys.clone().into_iter().chain(added.keys).collect();
    let mut tracked = old.tracked.clone();
    for (frame, new) in added.tracked {
        let place = tracked.entry(frame).or_insert(new);
        if place.status == Status::Lost {
            *place = new;
        }
    }
    tracked.retain(|frame, _| !keys.contains_key(frame));
    let mut hidden = old.hidden.clone();
    for stretch in added.hidden {
        stretches::add(&mut hidden, stretch);
    }
    let lost =
        |(&frame, tracked): (&usize, &Tracked)| (tracked.status == Status::Lost).then_some(frame);
    let lost: BTreeSet<usize> = tracked.iter().filter_map(lost).collect();
    let sure = keys.keys().chain(tracked.keys().filter(|frame| !lost.contains(frame)));
    for &frame in sure {
        stretches::remove(&mut hidden, [frame; 2]);
    }
    // Boxes of lost frames give way to what a person said.
    for &[from, to] in &hidden {
        for frame in lost.range(from..=to) {
            tracked.remove(frame);
        }
    }
    Frames { keys, tracked, hidden }
}

fn label_index(project: &Project, name: &str) -> Result<usize> {
    check::known_label(name, &project.labels).map_err(refused)?;
    let index = project.labels.iter().position(|label| label.name == name);
    index.ok_or_else(|| refused("there is no such label"))
}

fn add_label(
    project: &mut Project,
    name: String,
    colour: Option<String>,
    at: Option<usize>,
) -> Result<Vec<Edit>> {
    let count = project.labels.len();
    let mut label = Label::new(name, count);
    label.colour = colour.unwrap_or(label.colour);
    check::label(&label).map_err(refused)?;
    unused_label(project, &label.name)?;
    if count >= limits::LABELS {
        return Err(refused(format!("there are {count} labels, and may not be more")));
    }
    let at = at.unwrap_or(count);
    if at > count {
        return Err(refused(format!("the place is {at}; allowed: 0 to {count}")));
    }
    let name = label.name.clone();
    project.labels.insert(at, label);
    Ok(vec![Edit::RemoveLabel { name }])
}

fn unused_label(project: &Project, name: &str) -> Result<()> {
    match project.labels.iter().any(|label| label.name == name) {
        true => Err(refused(format!("there is a label {name:?} already"))),
        false => Ok(()),
    }
}

fn set_label(
    project: &mut Project,
    name: String,
    new_name: Option<String>,
    colour: Option<String>,
) -> Result<Vec<Edit>> {
    let index = label_index(project, &name)?;
    let old = &project.labels[index];
    let new = Label {
        name: new_name.clone().unwrap_or_else(|| name.clone()),
        colour: colour.clone().unwrap_or_else(|| old.colour.clone()),
    };
    check::label(&new).map_err(refused)?;
    if new.name != name {
        unused_label(project, &new.name)?;
    }
    for target in project.targets.iter_mut().filter(|target| target.label == name) {
        target.label.clone_from(&new.name);
    }
    let now = new.name.clone();
    let old = std::mem::replace(&mut project.labels[index], new);
    Ok(vec![Edit::SetLabel {
        name: now,
        new_name: new_name.map(|_| name),
        colour: colour.map(|_| old.colour),
    }])
}

fn remove_label(project: &mut Project, name: &str) -> Result<Vec<Edit>> {
    let index = label_index(project, name)?;
    let users = project.targets.iter().filter(|target| target.label == name).count();
    if users > 0 {
        return Err(refused(format!(
            "the label {name:?} cannot be removed: {users} targets have it"
        )));
    }
    let Label { name, colour } = project.labels.remove(index);
    Ok(vec![Edit::AddLabel { name, colour: Some(colour), at: Some(index) }])
}

fn import(project: &mut Project, targets: Vec<Target>) -> Result<Vec<Edit>> {
    let mut labels = project.labels.clone();
    for target in &targets {
        if !labels.iter().any(|label| label.name == target.label) {
            labels.push(Label::new(target.label.clone(), labels.len()));
        }
    }
    for (k, target) in targets.iter().enumerate() {
        // The id is a new one, so that of the file may be any.
        let target = Target { id: 1, ..target.clone() };
        check::target(&target, &labels, &project.video)
            .map_err(|reason| refused(format!("target {} of those to import: {reason}", k + 1)))?;
    }
    labels[project.labels.len()..].iter().try_for_each(check::label).map_err(refused)?;
    let count = targets.len();
    if labels.len() > limits::LABELS || project.targets.len() + count > limits::TARGETS {
        return Err(refused(format!(
            "the project may have {} labels and {} targets; this would be more",
            limits::LABELS,
            limits::TARGETS
        )));
    }
    if project.next_id + count as u64 > limits::ID {
        return Err(refused("all ids of targets are used up"));
    }
    let mut undo = Vec::new();
    for label in labels.split_off(project.labels.len()) {
        undo.push(Edit::RemoveLabel { name: label.name.clone() });
        project.labels.push(label);
    }
    for target in targets {
        let id = new_id(project)?;
        project.targets.push(Target { id, ..target });
        undo.push(Edit::DeleteTarget { target: id });
    }
    undo.reverse();
    Ok(undo)
}
