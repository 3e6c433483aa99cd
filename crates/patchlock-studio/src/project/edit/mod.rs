//! Everything that can be done to a project: [`Edit`] is the list. Each of the modules makes the
//! edits of one kind.

mod attributes;
mod keys;
mod labels;
mod remarks;
mod split_join;
mod targets;
mod tracks;

use std::collections::BTreeMap;

use patchlock::BoundingBox;
use serde::{Deserialize, Serialize};

use super::{
    Attribute, Changes, Error, Frames, Key, Label, Outline, Project, Remark, ReviewDecision,
    Target, TrackedBox, by_frame, changes, check, limits, stretches,
};
pub(super) use labels::after as labels_after;

/// A change to a project. In JSON, the member `edit` has its name: `{"edit": "hide", "target": 1,
/// "from": 5, "to": 9}`. Ranges of frames include both ends.
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
        /// A rotated box or a polygon, around which the box is.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        outline: Option<Outline>,
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
        /// A rotated box or a polygon, around which the box is.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        outline: Option<Outline>,
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
    /// Replaces the tracked boxes of a range. Key frames and hidden frames stay as they are:
    /// entries for them are left out. Boxes are rounded to 1/1000 pixel, all else to 1/10000.
    SetTracked {
        /// The target.
        target: u64,
        /// First frame.
        from: usize,
        /// Last frame.
        to: usize,
        /// The boxes, by frame; frames of the range without an entry get no box.
        #[serde(with = "by_frame")]
        tracked: BTreeMap<usize, TrackedBox>,
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
    /// Gives an attribute of the target's label a value, or takes it back.
    SetValue {
        /// The target.
        target: u64,
        /// Name of the attribute.
        name: String,
        /// The frame from which the value holds, until the next change; without one, the value is
        /// that of all frames up to the first change.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        frame: Option<usize>,
        /// The value; without one, that before the change, or the default, holds again.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        value: Option<String>,
    },
    /// Replaces all values of attributes. Those that the label does not allow do not count.
    SetValues {
        /// The target.
        target: u64,
        /// Those of all frames up to the first change.
        attributes: BTreeMap<String, String>,
        /// Those from a frame on.
        #[serde(default)]
        changes: BTreeMap<String, Changes>,
    },
    /// Deletes a target.
    DeleteTarget {
        /// The target.
        target: u64,
    },
    /// Makes a new target, with the same label and attributes, of all frames from `frame` on. Its
    /// id is [`Project::next_id`].
    Split {
        /// The target that keeps the frames before.
        target: u64,
        /// The first frame of the new target.
        frame: usize,
    },
    /// Adds the frames of the second target to the first and deletes the second. Label and
    /// attributes are those of the first. A frame must not have a box of both; boxes of lost
    /// targets and hidden frames give way to boxes.
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
    /// Replaces the attributes that a label declares. Values that they do not allow stay, and do not
    /// count.
    Declare {
        /// Name of the label.
        label: String,
        /// All its attributes.
        attributes: Vec<Attribute>,
    },
    /// Removes a label that no target has.
    RemoveLabel {
        /// Its name.
        name: String,
    },
    /// Says whether the video is annotated completely.
    SetDone {
        /// Whether it is.
        done: bool,
    },
    /// Adds what a reviewer says. An acceptance takes the place of what was said before of the
    /// target, and a rejection that of an acceptance.
    AddRemark {
        /// The frame that it is about.
        frame: usize,
        /// The target; without one, the frame.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        target: Option<u64>,
        /// What the reviewer decides.
        verdict: ReviewDecision,
        /// Why, in words.
        #[serde(default)]
        text: String,
    },
    /// Removes a remark, as one that was seen to.
    RemoveRemark {
        /// Its id.
        id: u64,
    },
    /// Replaces all remarks.
    SetRemarks {
        /// The remarks, in the order of their ids.
        remarks: Vec<Remark>,
    },
    /// Adds targets with new ids, in this order, the first with [`Project::next_id`]. Labels that
    /// do not exist are added.
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

/// What comes of an edit, or why it is not possible.
type Result<T> = std::result::Result<T, String>;

impl Edit {
    /// Changes the project, and returns the edits that undo it, to be applied in order. Only
    /// [`Project::next_id`] is not set back, so that no id is used twice.
    ///
    /// # Errors
    /// [`Error::Edit`] if the edit is not possible; the project is unchanged.
    pub fn apply(self, project: &mut Project) -> std::result::Result<Vec<Self>, Error> {
        self.try_apply(project).map_err(Error::Edit)
    }

    fn try_apply(self, project: &mut Project) -> Result<Vec<Self>> {
        match self {
            Self::AddTarget { label, frame, bbox, outline } => {
                targets::add_target(project, label, frame, Key { outline, ..Key::new(bbox) })
            }
            Self::SetKey { target, frame, bbox, outline, occluded, truncated } => {
                let key = Key { bbox, outline, occluded, truncated };
                keys::set_key(project, target, frame, key)
            }
            Self::RemoveKey { target, frame } => keys::remove_key(project, target, frame),
            Self::SetTracked { target, from, to, tracked } => {
                tracks::set_tracked(project, target, [from, to], tracked)
            }
            Self::Hide { target, from, to } => tracks::hide(project, target, [from, to]),
            Self::Show { target, from, to } => tracks::show(project, target, [from, to]),
            Self::SetTarget { target, label, attributes } => {
                targets::set_target(project, target, label, attributes)
            }
            Self::SetValue { target, name, frame, value } => {
                attributes::set_value(project, target, name, frame, value)
            }
            Self::SetValues { target, attributes, changes } => {
                attributes::set_values(project, target, attributes, changes)
            }
            Self::DeleteTarget { target } => targets::delete_target(project, target),
            Self::Split { target, frame } => split_join::split(project, target, frame),
            Self::Join { first, second } => split_join::join(project, first, second),
            Self::AddLabel { name, colour, at } => {
                labels::add(&mut project.labels, name, colour, at)
            }
            Self::SetLabel { name, new_name, colour } => {
                labels::set_label(project, name, new_name, colour)
            }
            Self::Declare { label, attributes } => {
                attributes::declare(&mut project.labels, &label, attributes)
            }
            Self::RemoveLabel { name } => labels::remove_label(project, &name),
            Self::SetDone { done } => {
                let before = std::mem::replace(&mut project.done, done);
                Ok(vec![Self::SetDone { done: before }])
            }
            Self::AddRemark { frame, target, verdict, text } => {
                remarks::add(project, Remark { id: 0, frame, target, verdict, text })
            }
            Self::RemoveRemark { id } => remarks::remove(project, id),
            Self::SetRemarks { remarks } => remarks::set(project, remarks),
            Self::Import { targets } => targets::import(project, targets),
            Self::Restore { target, at } => targets::restore(project, target, at),
            Self::SetFrames { target, from, to, frames } => {
                tracks::set_frames(project, target, [from, to], frames)
            }
        }
    }

    /// Whether it changes the list of labels and nothing else.
    pub fn is_of_labels(&self) -> bool {
        matches!(
            self,
            Self::AddLabel { .. }
                | Self::SetLabel { .. }
                | Self::Declare { .. }
                | Self::RemoveLabel { .. }
        )
    }

    /// The labels of targets that the edit needs.
    pub fn labels(&self) -> Vec<&str> {
        match self {
            Self::AddTarget { label, .. } | Self::SetTarget { label: Some(label), .. } => {
                vec![label.as_str()]
            }
            Self::Restore { target, .. } => vec![target.label.as_str()],
            Self::Import { targets } => targets.iter().map(|target| &*target.label).collect(),
            _ => Vec::new(),
        }
    }

    /// Gives a label another name, if the edit has it.
    pub(super) fn rename_label(&mut self, from: &str, to: &str) {
        let names: Vec<&mut String> = match self {
            Self::AddTarget { label, .. }
            | Self::Declare { label, .. }
            | Self::SetTarget { label: Some(label), .. } => vec![label],
            Self::Restore { target, .. } => vec![&mut target.label],
            Self::Import { targets } => {
                targets.iter_mut().map(|target| &mut target.label).collect()
            }
            Self::AddLabel { name, .. } | Self::RemoveLabel { name } => vec![name],
            Self::SetLabel { name, new_name, .. } => new_name.iter_mut().chain([name]).collect(),
            _ => Vec::new(),
        };
        names.into_iter().filter(|name| *name == from).for_each(|name| to.clone_into(name));
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
            Self::SetValue { target, name, frame, value } => {
                let from = frame.map(|frame| format!(" from frame {frame} on")).unwrap_or_default();
                match value {
                    Some(value) => format!("set {name} of target {target} to {value:?}{from}"),
                    None => format!("take back {name} of target {target}{from}"),
                }
            }
            Self::SetValues { target, .. } => format!("change the attributes of target {target}"),
            Self::DeleteTarget { target } => format!("delete target {target}"),
            Self::Split { target, frame } => format!("split target {target} at frame {frame}"),
            Self::Join { first, second } => format!("join targets {first} and {second}"),
            Self::AddLabel { name, .. } => format!("add the label {name}"),
            Self::SetLabel { name, .. } => format!("change the label {name}"),
            Self::Declare { label, .. } => format!("change the attributes of the label {label}"),
            Self::RemoveLabel { name } => format!("remove the label {name}"),
            Self::SetDone { done: true } => "mark the clip as done".to_owned(),
            Self::SetDone { done: false } => "mark the clip as not done".to_owned(),
            Self::AddRemark { frame, target, verdict, .. } => {
                let of = target.map(|target| format!(" target {target}")).unwrap_or_default();
                match verdict {
                    ReviewDecision::Accepted => format!("accept{of}"),
                    ReviewDecision::Rejected => format!("reject{of} in frame {frame}"),
                    ReviewDecision::Comment => format!("comment on{of} frame {frame}"),
                }
            }
            Self::RemoveRemark { id } => format!("remove remark {id}"),
            Self::SetRemarks { .. } => "change remarks".to_owned(),
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

    /// What the edit does to the frames of a target, and to which, if that is all that it does.
    pub(super) fn changes_frames(&self) -> Option<(&'static str, u64)> {
        match *self {
            Self::SetTracked { target, .. } => Some(("track", target)),
            Self::Hide { target, .. } => Some(("hide", target)),
            Self::Show { target, .. } => Some(("show", target)),
            Self::SetFrames { target, .. } => Some(("change", target)),
            _ => None,
        }
    }

    /// The targets whose frames the edit changes, so that tracking of them works on what no longer is.
    pub fn shapes(&self) -> Vec<u64> {
        match self {
            Self::SetKey { target, .. }
            | Self::RemoveKey { target, .. }
            | Self::SetTracked { target, .. }
            | Self::Hide { target, .. }
            | Self::Show { target, .. }
            | Self::DeleteTarget { target }
            | Self::Split { target, .. }
            | Self::SetFrames { target, .. } => vec![*target],
            Self::Restore { target, .. } => vec![target.id],
            Self::Join { first, second } => vec![*first, *second],
            _ => Vec::new(),
        }
    }

    /// The number of boxes and changes in the edit, which is what its memory grows with.
    pub(super) fn boxes(&self) -> usize {
        let of = |target: &Target| {
            let keys = target.keys.values().map(Key::size).sum::<usize>();
            keys + target.tracked.len() + changes::count(&target.changes)
        };
        match self {
            Self::SetValues { changes, .. } => changes::count(changes),
            Self::SetTracked { tracked, .. } => tracked.len(),
            Self::Import { targets } => targets.iter().map(of).sum(),
            Self::Restore { target, .. } => of(target),
            Self::SetFrames { frames, .. } => frames.boxes(),
            Self::AddTarget { outline: Some(outline), .. }
            | Self::SetKey { outline: Some(outline), .. } => outline.0.len() / 2,
            _ => 0,
        }
    }
}
