//! Undo and redo.

use std::borrow::Cow;
use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use super::{Edit, Error, Frames, Project, stretches};

/// The most steps that can be undone.
pub const MAX_STEPS: usize = 200;
/// The most boxes that the steps hold together. The oldest steps are forgotten first; the latest
/// step can always be undone.
pub const MAX_BOXES: usize = 1_000_000;

/// Edits that are undone together.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Step {
    /// The revision that made it.
    id: u64,
    /// What was done, for a person; `None` if the changed frames say it.
    said: Option<String>,
    /// The frames that were changed, by what was done to them.
    changed: Vec<FrameChange>,
    /// What takes it back (or, of an undone step, does it again), in order.
    edits: Vec<Edit>,
    /// All of it in words.
    text: String,
}

impl Step {
    fn new(id: u64, said: Option<String>, changed: Option<FrameChange>, edits: Vec<Edit>) -> Self {
        let changed = Vec::from_iter(changed);
        let mut step = Self { id, said, changed, edits, text: String::new() };
        step.name();
        step
    }

    fn name(&mut self) {
        let some = self.changed.iter().filter(|changed| !changed.frames.is_empty());
        let words = self.said.iter().cloned().chain(some.map(FrameChange::text));
        self.text = words.collect::<Vec<_>>().join(", and ");
        if self.text.is_empty() {
            self.text = self.changed.first().map(FrameChange::text).unwrap_or_default();
        }
    }

    /// Adds edits that were made later, which this takes back.
    fn add(&mut self, changed: FrameChange, undo: Vec<Edit>) {
        self.edits.splice(0..0, undo);
        let is_same =
            |it: &&mut FrameChange| it.verb == changed.verb && it.target == changed.target;
        match self.changed.iter_mut().find(is_same) {
            Some(before) => {
                changed.frames.iter().for_each(|&more| stretches::add(&mut before.frames, more));
            }
            None => self.changed.push(changed),
        }
        self.name();
    }

    fn boxes(&self) -> usize {
        self.edits.iter().map(Edit::boxes).sum()
    }

    /// Whether it changes the frames of a target.
    fn shapes(&self, target: u64) -> bool {
        self.edits.iter().any(|edit| edit.shapes().contains(&target))
    }
}

/// The frames of a target that a step has changed, as stretches.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FrameChange {
    /// What was done to them.
    verb: Cow<'static, str>,
    target: u64,
    frames: Vec<[usize; 2]>,
}

impl FrameChange {
    fn none(verb: &'static str, target: u64) -> Self {
        Self { verb: Cow::Borrowed(verb), target, frames: Vec::new() }
    }

    /// What an edit has changed that is undone like this.
    fn new((verb, target): (&'static str, u64), project: &Project, undo: &[Edit]) -> Self {
        let mut changed = Self::none(verb, target);
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

/// A change of the history, from which it can be made again.
#[derive(Debug, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum Event {
    /// All that there is.
    Whole { done: VecDeque<Step>, undone: Vec<Step> },
    /// A step was made.
    Made { step: Step },
    /// Something was added to a step.
    Added { id: u64, changed: FrameChange, undo: Vec<Edit> },
    /// A step that has changed nothing was dropped.
    Dropped { id: u64 },
    /// The last step was undone; these edits do it again.
    Undone { edits: Vec<Edit> },
    /// The step that was undone last was done again; these edits undo it.
    Redone { edits: Vec<Edit> },
    /// A label got another name.
    Renamed { from: String, to: String },
}

/// The steps that can be undone and redone.
#[derive(Debug, Default)]
pub struct History {
    done: VecDeque<Step>,
    undone: Vec<Step>,
    /// What has happened since it was written, as JSON; `None` if it is not kept in a file.
    events: Option<Vec<String>>,
}

impl History {
    /// A history that keeps what happens, after the events of earlier runs.
    pub(super) fn kept(events: Vec<Event>) -> Self {
        let mut history = Self::default();
        events.into_iter().for_each(|event| history.happen(event));
        // Of tracking that a crash has ended before it found anything.
        history.done.retain(|step| !step.edits.is_empty());
        Self { events: Some(Vec::new()), ..history }
    }

    /// What has happened since the last call, as JSON.
    pub(super) fn take_events(&mut self) -> Vec<String> {
        self.events.as_mut().map(std::mem::take).unwrap_or_default()
    }

    /// All that there is, as JSON.
    pub(super) fn whole(&self) -> serde_json::Result<String> {
        let (done, undone) = (self.done.clone(), self.undone.clone());
        serde_json::to_string(&Event::Whole { done, undone })
    }

    /// Lets an event happen, and keeps it.
    fn happen(&mut self, event: Event) {
        if let Some(events) = &mut self.events {
            // Whoever reads a line that lacks an event does not take the line.
            events.push(serde_json::to_string(&event).unwrap_or_default());
        }
        match event {
            Event::Whole { done, undone } => (self.done, self.undone) = (done, undone),
            Event::Made { step } => {
                self.undone.clear();
                self.done.push_back(step);
            }
            Event::Added { id, changed, undo } => {
                if let Some(step) = self.done.iter_mut().rev().find(|step| step.id == id) {
                    step.add(changed, undo);
                }
            }
            Event::Dropped { id } => self.done.retain(|step| step.id != id),
            Event::Undone { edits } => {
                self.undone.extend(self.done.pop_back().map(|step| Step { edits, ..step }));
            }
            Event::Redone { edits } => {
                self.done.extend(self.undone.pop().map(|step| Step { edits, ..step }));
            }
            Event::Renamed { from, to } => {
                let steps = self.done.iter_mut().chain(&mut self.undone);
                let edits = steps.flat_map(|step| &mut step.edits);
                edits.for_each(|edit| edit.rename_label(&from, &to));
            }
        }
        self.forget();
    }

    /// Applies edits as one step, all or none, which makes this revision.
    pub(super) fn apply(
        &mut self,
        project: &mut Project,
        edits: Vec<Edit>,
        revision: u64,
    ) -> Result<(), Error> {
        let text = match edits.as_slice() {
            [] => return Ok(()),
            [edit] => edit.text(),
            [first, rest @ ..] => format!("{}, and {} more", first.text(), rest.len()),
        };
        let kind = edits[0].changes_frames();
        let kind = kind.filter(|_| edits.iter().all(|edit| edit.changes_frames() == kind));
        let undo = apply_all(project, edits)?;
        let changed = kind.map(|kind| FrameChange::new(kind, project, &undo));
        let said = changed.is_none().then_some(text);
        self.happen(Event::Made { step: Step::new(revision, said, changed, undo) });
        Ok(())
    }

    /// The step that tracking of a target adds to: the one with the id `since`, if it can, or else a
    /// new one, which makes this revision.
    pub(super) fn begin(&mut self, target: u64, since: Option<u64>, revision: u64) -> u64 {
        if let Some(since) = since.filter(|&since| self.takes(since, target)) {
            return since;
        }
        let changed = Some(FrameChange::none("track", target));
        self.happen(Event::Made { step: Step::new(revision, None, changed, Vec::new()) });
        revision
    }

    /// Adds tracked boxes of a target to a step, so that they are undone with it. `false` if that is
    /// not possible: it was undone or forgotten, or a later step has changed frames of the target.
    pub(super) fn add(
        &mut self,
        project: &mut Project,
        id: u64,
        target: u64,
        edits: Vec<Edit>,
    ) -> Result<bool, Error> {
        if !self.takes(id, target) {
            return Ok(false);
        }
        let undo = apply_all(project, edits)?;
        let changed = FrameChange::new(("track", target), project, &undo);
        self.happen(Event::Added { id, changed, undo });
        Ok(true)
    }

    /// Drops a step if it has changed nothing.
    pub(super) fn end(&mut self, id: u64) {
        if self.done.iter().any(|step| step.id == id && step.edits.is_empty()) {
            self.happen(Event::Dropped { id });
        }
    }

    /// Whether frames of a target can be added to a step: no other one that comes after it, done or
    /// undone, has anything to do with them.
    fn takes(&self, id: u64, target: u64) -> bool {
        let Some(at) = self.done.iter().rposition(|step| step.id == id) else { return false };
        let mut later = self.done.iter().skip(at + 1).chain(&self.undone);
        !later.any(|step| step.shapes(target))
    }

    /// Takes back the last step, or with `redo` does the one again that was undone last; `false` if
    /// there is none.
    pub(super) fn step(&mut self, project: &mut Project, redo: bool) -> Result<bool, Error> {
        let Some(step) = self.next(redo) else { return Ok(false) };
        let edits = apply_all(project, step.edits.clone())?;
        self.happen(if redo { Event::Redone { edits } } else { Event::Undone { edits } });
        Ok(true)
    }

    /// Whether a step has been undone, and not done again.
    pub fn is_undone(&self, id: u64) -> bool {
        self.undone.iter().any(|step| step.id == id)
    }

    /// The step that the next undo takes back, or the next redo does again.
    fn next(&self, redo: bool) -> Option<&Step> {
        if redo { self.undone.last() } else { self.done.back() }
    }

    /// The id of the step that the next undo takes back, or the next redo does again.
    pub fn id(&self, redo: bool) -> Option<u64> {
        self.next(redo).map(|step| step.id)
    }

    /// What the next undo takes back, or the next redo does again.
    pub fn text(&self, redo: bool) -> Option<&str> {
        self.next(redo).map(|step| step.text.as_str())
    }

    /// Gives a label another name in all steps.
    pub(super) fn rename_label(&mut self, from: &str, to: &str) {
        self.happen(Event::Renamed { from: from.to_owned(), to: to.to_owned() });
    }

    /// The labels of targets that the next undo, or the next redo, needs.
    pub fn labels(&self, redo: bool) -> Vec<String> {
        let edits = self.next(redo).into_iter().flat_map(|step| &step.edits);
        edits.flat_map(Edit::labels).map(ToOwned::to_owned).collect()
    }

    /// The targets whose frames the next undo, or the next redo, changes.
    pub fn targets(&self, redo: bool) -> Vec<u64> {
        let edits = self.next(redo).into_iter().flat_map(|step| &step.edits);
        edits.flat_map(Edit::shapes).collect()
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
