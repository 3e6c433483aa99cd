//! Undo and redo.

use std::collections::VecDeque;

use super::{Edit, Error, Project};

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
    /// What takes it back (or, of an undone step, does it again), in order.
    edits: Vec<Edit>,
}

impl Step {
    fn boxes(&self) -> usize {
        self.edits.iter().map(Edit::boxes).sum()
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
        let undo = apply_all(project, edits)?;
        self.undone.clear();
        match self.done.back_mut().filter(|_| join) {
            Some(last) => drop(last.edits.splice(0..0, undo)),
            None => self.done.push_back(Step { text, edits: undo }),
        }
        self.forget();
        Ok(())
    }

    /// Takes back the last step; `false` if there is none.
    pub fn undo(&mut self, project: &mut Project) -> Result<bool, Error> {
        let Some(step) = self.done.pop_back() else { return Ok(false) };
        let edits = apply_all(project, step.edits)?;
        self.undone.push(Step { text: step.text, edits });
        Ok(true)
    }

    /// Does the step again that was undone last; `false` if there is none.
    pub fn redo(&mut self, project: &mut Project) -> Result<bool, Error> {
        let Some(step) = self.undone.pop() else { return Ok(false) };
        let edits = apply_all(project, step.edits)?;
        self.done.push_back(Step { text: step.text, edits });
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
