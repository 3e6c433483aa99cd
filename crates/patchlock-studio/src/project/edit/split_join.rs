//! One target becomes two, or two become one.

use std::collections::{BTreeMap, BTreeSet};

use patchlock::Status;

use super::targets::{empty, index_of, new_id, target_mut};
use super::tracks::change_frames;
use super::{
    Edit, Frames, Key, Project, Result, Target, Tracked, check, refused, remarks, stretches,
};

pub fn split(project: &mut Project, id: u64, frame: usize) -> Result<Vec<Edit>> {
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

pub fn join(project: &mut Project, first: u64, second: u64) -> Result<Vec<Edit>> {
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
    let remarks = remarks::without(project, second);
    let added = removed.cut_all();
    let range = added.span().unwrap_or([0, 0]);
    let target = target_mut(project, first)?;
    let mut undo = change_frames(target, range, |old| merged(old, added));
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
