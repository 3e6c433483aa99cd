//! Undo and redo.

use std::collections::VecDeque;

use super::{Edit, Error, Frames, Project, stretches};

/// The most steps that can be undone.
pub const MAX_STEPS: usize = 200;
/// The most boxes that the steps hold together. The oldest steps are forgotten first; the latest
/// step can always be undone.
pub const MAX_BOXES: usize = 1_000_000;

/// Edits that are undone together.
#[derive(Debug)]
struct Step {
    /// What was done, for a person.
    text: String,
    /// The frames that were changed, if the step is of one kind and of one target.
    changed: Option<Changed>,
    /// What takes it back (or, of an undone step, does it again), in order.
    edits: Vec<Edit>,
}

impl Step {
    fn boxes(&self) -> usize {
        self.edits.iter().map(Edit::boxes).sum()
    }
}

/// The frames of a target that a step has changed, as stretches.
#[derive(Debug)]
struct Changed {
    /// What was done to them.
    verb: &'static str,
    target: u64,
    frames: Vec<[usize; 2]>,
}

impl Changed {
    /// What an edit has changed that is undone like this.
    fn new((verb, target): (&'static str, u64), project: &Project, undo: &[Edit]) -> Self {
        let mut changed = Self { verb, target, frames: Vec::new() };
        for edit in undo {
            if let Edit::SetFrames { target, from, to, frames } = edit {
                changed.add(project, *target, [*from, *to], frames);
            }
        }
        changed
    }

    /// Adds the frames of a range that are now other than they were.
    fn add(&mut self, project: &Project, target: u64, [from, to]: [usize; 2], before: &Frames) {
        let Some(now) = project.target(target) else { return };
        let keys = before.keys.keys().chain(now.keys.range(from..=to).map(|(frame, _)| frame));
        let keys = keys.filter(|frame| before.keys.get(frame) != now.keys.get(frame));
        let tracked = before.tracked.keys();
        let tracked = tracked.chain(now.tracked.range(from..=to).map(|(frame, _)| frame));
        let tracked = tracked.filter(|frame| before.tracked.get(frame) != now.tracked.get(frame));
        for &frame in keys.chain(tracked) {
            stretches::add(&mut self.frames, [frame; 2]);
        }
        let hidden = stretches::common(&now.hidden, [from, to]);
        for (some, others) in [(&before.hidden, &hidden), (&hidden, &before.hidden)] {
            let mut only = some.clone();
            others.iter().for_each(|&stretch| stretches::remove(&mut only, stretch));
            only.into_iter().for_each(|stretch| stretches::add(&mut self.frames, stretch));
        }
    }

    fn text(&self) -> String {
        let Self { verb, target, frames } = self;
        let count: usize = frames.iter().map(|[from, to]| to - from + 1).sum();
        match (frames.first(), frames.last()) {
            (Some([only, _]), _) if count == 1 => format!("{verb} target {target} in frame {only}"),
            (Some([first, _]), Some([_, last])) => {
                format!("{verb} target {target} in {count} frames, {first} to {last}")
            }
            _ => format!("{verb} target {target} in no frame"),
        }
    }
}

/// The steps that can be undone and redone.
#[derive(Debug, Default)]
pub struct History {
    done: VecDeque<Step>,
    undone: Vec<Step>,
}

impl History {
    /// Applies edits as one step, all or none. With `join`, they become part of the last step.
    pub fn apply(
        &mut self,
        project: &mut Project,
        edits: Vec<Edit>,
        join: bool,
    ) -> Result<(), Error> {
        let text = match edits.as_slice() {
            [] => return Ok(()),
            [edit] => edit.text(),
            [first, rest @ ..] => format!("{}, and {} more", first.text(), rest.len()),
        };
        let kind = edits[0].changes_frames();
        let kind = kind.filter(|_| edits.iter().all(|edit| edit.changes_frames() == kind));
        let undo = apply_all(project, edits)?;
        self.undone.clear();
        let changed = kind.map(|kind| Changed::new(kind, project, &undo));
        match self.done.back_mut().filter(|_| join) {
            Some(last) => {
                if let (Some(before), Some(more)) = (&mut last.changed, &changed) {
                    more.frames.iter().for_each(|&more| stretches::add(&mut before.frames, more));
                    last.text = before.text();
                }
                last.edits.splice(0..0, undo);
            }
            None => {
                let text = changed.as_ref().map_or(text, Changed::text);
                self.done.push_back(Step { text, changed, edits: undo });
            }
        }
        self.forget();
        Ok(())
    }

    /// Takes back the last step; `false` if there is none.
    pub fn undo(&mut self, project: &mut Project) -> Result<bool, Error> {
        let Some(mut step) = self.done.pop_back() else { return Ok(false) };
        let edits = apply_all(project, std::mem::take(&mut step.edits))?;
        self.undone.push(Step { edits, ..step });
        Ok(true)
    }

    /// Does the step again that was undone last; `false` if there is none.
    pub fn redo(&mut self, project: &mut Project) -> Result<bool, Error> {
        let Some(mut step) = self.undone.pop() else { return Ok(false) };
        let edits = apply_all(project, std::mem::take(&mut step.edits))?;
        self.done.push_back(Step { edits, ..step });
        Ok(true)
    }

    /// What the next undo takes back.
    pub fn undo_text(&self) -> Option<&str> {
        self.done.back().map(|step| step.text.as_str())
    }

    /// What the next redo does again.
    pub fn redo_text(&self) -> Option<&str> {
        self.undone.last().map(|step| step.text.as_str())
    }

    /// Gives a label another name in all steps.
    pub fn rename_label(&mut self, from: &str, to: &str) {
        let steps = self.done.iter_mut().chain(&mut self.undone);
        steps.flat_map(|step| &mut step.edits).for_each(|edit| edit.rename_label(from, to));
    }

    /// The labels of targets that the next undo, or the next redo, needs.
    pub fn labels_of_step(&self, redo: bool) -> Vec<String> {
        let step = if redo { self.undone.last() } else { self.done.back() };
        let edits = step.into_iter().flat_map(|step| &step.edits);
        edits.flat_map(Edit::labels).map(ToOwned::to_owned).collect()
    }

    /// Drops the oldest steps beyond the limits.
    fn forget(&mut self) {
        let mut boxes: usize = self.done.iter().map(Step::boxes).sum();
        while self.done.len() > 1 && (self.done.len() > MAX_STEPS || boxes > MAX_BOXES) {
            boxes -= self.done.pop_front().map_or(0, |step| step.boxes());
        }
    }
}

/// Applies edits in order, all or none. Returns the edits that take them back.
fn apply_all(project: &mut Project, edits: Vec<Edit>) -> Result<Vec<Edit>, Error> {
    let next_id = project.next_id;
    let mut steps: Vec<Vec<Edit>> = Vec::new();
    for edit in edits {
        match edit.apply(project) {
            Ok(undo) => steps.push(undo),
            Err(error) => {
                for edit in steps.into_iter().rev().flatten() {
                    // What was changed a moment ago can be changed back.
                    edit.apply(project)?;
                }
                // Nobody has seen the new ids.
                project.next_id = next_id;
                return Err(error);
            }
        }
    }
    Ok(steps.into_iter().rev().flatten().collect())
}
