//! One target becomes two, or two become one.

use std::collections::{BTreeMap, BTreeSet};

use patchlock::Status;

use super::attributes::without_boxes;
use super::targets::{index_of, new_id, target_mut};
use super::tracks::change_frames;
use super::{
    Changes, Edit, Frames, Project, Result, Target, TrackedBox, check, remarks, stretches,
};

pub fn split(project: &mut Project, id: u64, frame: usize) -> Result<Vec<Edit>> {
    check::frame(frame, &project.video)?;
    let range = [frame, project.video.frames - 1];
    let target = &project.targets[index_of(project, id)?];
    let boxes = || target.keys.keys().chain(target.tracked.keys());
    ensure!(
        boxes().any(|&other| other < frame) && boxes().any(|&other| other >= frame),
        "target {id} cannot be split at frame {frame}: it must have a box before it, and one from it on"
    );
    let mut new = without_boxes(target);
    for (name, changes) in &mut new.changes {
        // What holds in the first frame of the new target holds from its beginning.
        let value = changes.at(frame).map(ToOwned::to_owned);
        *changes = changes.split_off(frame);
        changes.0.remove(&frame);
        new.attributes.extend(value.map(|value| (name.clone(), value)));
    }
    new.changes.retain(|_, changes| !changes.0.is_empty());
    new.id = new_id(project)?;
    let new_id = new.id;
    let target = target_mut(project, id)?;
    let before = without_boxes(target);
    let rest = target.cut(range);
    target.changes.values_mut().for_each(|changes| drop(changes.split_off(frame)));
    target.changes.retain(|_, changes| !changes.0.is_empty());
    new.put(rest.clone());
    project.targets.push(new);
    Ok(vec![
        Edit::DeleteTarget { target: new_id },
        Edit::SetFrames { target: id, from: range[0], to: range[1], frames: rest },
        Edit::SetValues { target: id, attributes: before.attributes, changes: before.changes },
    ])
}

pub fn join(project: &mut Project, first: u64, second: u64) -> Result<Vec<Edit>> {
    ensure!(first != second, "target {first} cannot be joined with itself");
    let (one, at) = (index_of(project, first)?, index_of(project, second)?);
    if let Some((frame, count)) = clash(&project.targets[one], &project.targets[at]) {
        let others = if count > 1 { format!(", and {} more", count - 1) } else { String::new() };
        return Err(format!(
            "targets {first} and {second} both have a box in frame {frame}{others}; remove one of them first"
        ));
    }
    let changes = joined(project, one, at);
    let mut removed = project.targets.remove(at);
    let restore = Edit::Restore { target: removed.clone(), at };
    let remarks = remarks::without(project, second);
    let added = removed.cut([0, usize::MAX]);
    let range = added.span().unwrap_or([0, 0]);
    let target = target_mut(project, first)?;
    let mut undo = change_frames(target, range, |old| merged(old, added));
    if changes != target.changes {
        let before = std::mem::replace(&mut target.changes, changes);
        let attributes = target.attributes.clone();
        undo.push(Edit::SetValues { target: first, attributes, changes: before });
    }
    undo.push(restore);
    undo.extend(remarks);
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

/// The changes of attributes of two targets that become one: in each frame the value of the target
/// that has a box there, so that the frames of the second keep theirs.
fn joined(project: &Project, first: usize, second: usize) -> BTreeMap<String, Changes> {
    let (first, second) = (&project.targets[first], &project.targets[second]);
    let mut changes = first.changes.clone();
    let of_first = sure_frames(first);
    let of_second = sure_frames(second);
    for attribute in project.declared(&first.label).iter().filter(|it| it.mutable) {
        let starts = |target: &Target| {
            let changes = target.changes.get(&attribute.name);
            changes.map(|changes| changes.0.clone()).unwrap_or_default().into_keys()
        };
        // The value can only change where one of them changes, or the other one begins.
        let mut now = first.value(attribute, 0);
        let mut all = Changes::default();
        let boxes = of_first.iter().chain(&of_second).copied();
        let frames: BTreeSet<usize> = boxes.chain(starts(first)).chain(starts(second)).collect();
        let mut owner = first;
        for frame in frames {
            if of_second.contains(&frame) {
                owner = second;
            } else if of_first.contains(&frame) {
                owner = first;
            }
            let value = owner.value(attribute, frame);
            if value != now {
                all.0.insert(frame, value.to_owned());
                now = value;
            }
        }
        match all.0.is_empty() {
            true => drop(changes.remove(&attribute.name)),
            false => drop(changes.insert(attribute.name.clone(), all)),
        }
    }
    changes
}

/// The frames of both, which have no sure boxes in common.
fn merged(old: &Frames, added: Frames) -> Frames {
    let (mut keys, mut tracked) = (old.keys.clone(), old.tracked.clone());
    keys.extend(added.keys);
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
    let lost = |(&frame, tracked): (&usize, &TrackedBox)| {
        (tracked.status == Status::Lost).then_some(frame)
    };
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
