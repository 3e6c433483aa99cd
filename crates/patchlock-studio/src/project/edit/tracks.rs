//! Edits of stretches: tracked boxes, and where the target is not visible.

use std::collections::BTreeMap;

use patchlock::BoundingBox;

use super::targets::target_mut;
use super::{Edit, Frames, Project, Result, Target, TrackedBox, check};

pub fn set_tracked(
    project: &mut Project,
    id: u64,
    range: [usize; 2],
    mut tracked: BTreeMap<usize, TrackedBox>,
) -> Result<Vec<Edit>> {
    check::range(range, &project.video)?;
    tracked.values_mut().for_each(round);
    let new = Frames { tracked, ..Frames::default() };
    check::part(&new, range, &project.video)?;
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
fn round(tracked: &mut TrackedBox) {
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

pub fn hide(project: &mut Project, id: u64, range: [usize; 2]) -> Result<Vec<Edit>> {
    check::range(range, &project.video)?;
    let new = Frames { hidden: vec![range], ..Frames::default() };
    Ok(change_frames(target_mut(project, id)?, range, |_| new))
}

pub fn show(project: &mut Project, id: u64, range: [usize; 2]) -> Result<Vec<Edit>> {
    check::range(range, &project.video)?;
    let target = target_mut(project, id)?;
    Ok(change_frames(target, range, |old| Frames { hidden: Vec::new(), ..old.clone() }))
}

pub fn set_frames(
    project: &mut Project,
    id: u64,
    range: [usize; 2],
    frames: Frames,
) -> Result<Vec<Edit>> {
    check::range(range, &project.video)?;
    check::part(&frames, range, &project.video)?;
    Ok(change_frames(target_mut(project, id)?, range, |_| frames))
}

/// Changes the frames of a range, and returns what brings the old ones back.
pub fn change_frames(
    target: &mut Target,
    [from, to]: [usize; 2],
    change: impl FnOnce(&Frames) -> Frames,
) -> Vec<Edit> {
    let old = target.cut([from, to]);
    target.put(change(&old));
    vec![Edit::SetFrames { target: target.id, from, to, frames: old }]
}
