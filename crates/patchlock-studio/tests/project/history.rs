//! Undo and redo against a plain model, with tracking that goes on meanwhile, and over restarts.

use std::collections::BTreeMap;

use patchlock::{BoundingBox, Status};
use patchlock_media::Limits;
use patchlock_studio::project::{Edit, Project, Store, TrackedBox};
use proptest::prelude::*;

use crate::support::{FRAMES, TestFolder};

const BOX: BoundingBox = BoundingBox { x: 1.0, y: 1.0, w: 5.0, h: 5.0 };
const TARGETS: u64 = 3;

/// What a person does, or a piece of what a job has found.
#[derive(Debug, Clone, Copy)]
enum Action {
    Key {
        target: u64,
        frame: usize,
        x: u8,
    },
    Hide {
        target: u64,
        from: usize,
        to: usize,
    },
    Attribute {
        target: u64,
        value: u8,
    },
    Done,
    Delete {
        target: u64,
    },
    /// Tracking begins, with the last change or as a step of its own.
    Track {
        target: u64,
        follows: bool,
    },
    Piece {
        target: u64,
        from: usize,
        to: usize,
        x: u8,
    },
    End {
        target: u64,
    },
    Undo,
    Redo,
    Restart,
}

fn acts() -> impl Strategy<Value = Vec<Action>> {
    let target = || 1..=TARGETS;
    let frame = || 0..FRAMES;
    let x = 0u8..20;
    let act = prop_oneof![
        4 => (target(), frame(), x.clone())
            .prop_map(|(target, frame, x)| Action::Key { target, frame, x }),
        1 => (target(), frame(), frame())
            .prop_map(|(target, a, b)| Action::Hide { target, from: a.min(b), to: a.max(b) }),
        2 => (target(), x.clone()).prop_map(|(target, value)| Action::Attribute { target, value }),
        1 => Just(Action::Done),
        1 => target().prop_map(|target| Action::Delete { target }),
        4 => (target(), any::<bool>()).prop_map(|(target, follows)| Action::Track { target, follows }),
        8 => (target(), frame(), frame(), x).prop_map(|(target, a, b, x)| Action::Piece {
            target,
            from: a.min(b),
            to: a.max(b),
            x
        }),
        2 => target().prop_map(|target| Action::End { target }),
        5 => Just(Action::Undo),
        3 => Just(Action::Redo),
        1 => Just(Action::Restart),
    ];
    prop::collection::vec(act, 1..60)
}

/// A step of the model: its edits, in order.
#[derive(Debug, Clone)]
struct Step {
    id: u64,
    edits: Vec<Edit>,
    /// The targets whose frames it has to do with.
    shapes: Vec<u64>,
}

/// The project as it was at first, and the steps that were done and undone since then. The project
/// now is what the steps make of the first one.
struct Model {
    first: Project,
    done: Vec<Step>,
    undone: Vec<Step>,
    /// The step of the running job of each target.
    jobs: BTreeMap<u64, u64>,
}

impl Model {
    fn project(&self) -> Project {
        let mut project = self.first.clone();
        for edit in self.done.iter().flat_map(|step| &step.edits) {
            edit.clone().apply(&mut project).unwrap();
        }
        project
    }

    fn push(&mut self, id: u64, edits: Vec<Edit>, shapes: Vec<u64>) {
        self.undone.clear();
        self.done.push(Step { id, edits, shapes });
    }

    fn has(&self, target: u64) -> bool {
        self.project().target(target).is_some()
    }
}

/// What is compared: ids are never used again.
fn content(project: &Project) -> Project {
    Project { next_id: 0, ..project.clone() }
}

fn set_key(target: u64, frame: usize, x: u8) -> Edit {
    let bbox = BoundingBox { x: f64::from(x), ..BOX };
    Edit::SetKey { target, frame, bbox, outline: None, occluded: false, truncated: false }
}

fn tracked(target: u64, from: usize, to: usize, x: u8) -> Edit {
    let bbox = BoundingBox { x: f64::from(x), ..BOX };
    let status = Status::Uncertain;
    let tracked = TrackedBox { bbox, score: 0.75, status, visible: Some(0.5), agreement: None };
    let tracked = (from..=to).map(|frame| (frame, tracked)).collect();
    Edit::SetTracked { target, from, to, tracked }
}

/// The store and the model, driven by the same acts as the server drives the store: a change of a
/// target's frames ends its job, and so does taking back the step of the job.
struct HistoryTest<'a> {
    place: &'a TestFolder,
    store: Store,
    model: Model,
}

impl HistoryTest<'_> {
    fn change(&mut self, edit: Edit) {
        let shapes = edit.shapes();
        for target in &shapes {
            self.end(*target);
        }
        let id = self.store.apply(vec![edit.clone()]).unwrap();
        self.model.push(id, vec![edit], shapes);
    }

    fn begin(&mut self, target: u64, follows: bool) {
        self.end(target);
        // What was undone since cannot be done again after tracking of the same frames.
        let follows = follows && !self.model.undone.iter().any(|it| it.shapes.contains(&target));
        let last = self.model.done.last();
        let since = last.filter(|last| follows && last.shapes == [target]).map(|last| last.id);
        let id = self.store.begin_tracking(target, since);
        match since {
            Some(since) => assert_eq!(id, since),
            None => self.model.push(id, Vec::new(), vec![target]),
        }
        self.model.jobs.insert(target, id);
    }

    fn piece(&mut self, target: u64, edit: Edit) {
        let Some(&id) = self.model.jobs.get(&target) else { return };
        assert_eq!(self.store.track(target, id, vec![edit.clone()]).unwrap(), id);
        let step = self.model.done.iter_mut().find(|step| step.id == id).unwrap();
        step.edits.push(edit);
    }

    fn end(&mut self, target: u64) {
        let Some(id) = self.model.jobs.remove(&target) else { return };
        self.store.end_tracking(id);
        self.model.done.retain(|step| step.id != id || !step.edits.is_empty());
    }

    fn undo(&mut self) {
        let Some(meant) = self.model.done.last().cloned() else {
            assert!(self.store.step(false).unwrap().is_none());
            return;
        };
        self.end_all(&meant);
        if self.model.done.last().is_some_and(|last| last.id == meant.id) {
            assert_eq!(self.store.history().id(false), Some(meant.id));
            self.store.step(false).unwrap();
            self.model.undone.extend(self.model.done.pop());
        }
    }

    fn redo(&mut self) {
        let Some(meant) = self.model.undone.last().cloned() else {
            assert!(self.store.step(true).unwrap().is_none());
            return;
        };
        self.end_all(&meant);
        assert_eq!(self.store.history().id(true), Some(meant.id));
        self.store.step(true).unwrap();
        self.model.done.extend(self.model.undone.pop());
    }

    fn end_all(&mut self, step: &Step) {
        let targets: Vec<u64> = self.model.jobs.keys().copied().collect();
        for target in targets {
            if self.model.jobs[&target] == step.id || step.shapes.contains(&target) {
                self.end(target);
            }
        }
    }

    /// The program ends and starts again: no job is left.
    fn restart(mut self) -> Self {
        for target in 1..=TARGETS {
            self.end(target);
        }
        self.store.save().unwrap();
        let Self { place, store, model } = self;
        drop(store);
        Self { place, store: open(place), model }
    }

    fn act(mut self, act: Action) -> Self {
        let has = |target| self.model.has(target);
        match act {
            Action::Key { target, frame, x } if has(target) => {
                self.change(set_key(target, frame, x))
            }
            Action::Hide { target, from, to } if has(target) => {
                self.change(Edit::Hide { target, from, to });
            }
            Action::Attribute { target, value } if has(target) => {
                let attributes = Some([("a".to_owned(), value.to_string())].into());
                self.change(Edit::SetTarget { target, label: None, attributes });
            }
            Action::Done => self.change(Edit::SetDone { done: !self.model.project().done }),
            Action::Delete { target } if has(target) => self.change(Edit::DeleteTarget { target }),
            Action::Track { target, follows } if has(target) => self.begin(target, follows),
            Action::Piece { target, from, to, x } if has(target) => {
                self.piece(target, tracked(target, from, to, x));
            }
            Action::End { target } => self.end(target),
            Action::Undo => self.undo(),
            Action::Redo => self.redo(),
            Action::Restart => return self.restart(),
            _ => {}
        }
        self
    }
}

fn open(place: &TestFolder) -> Store {
    let mut store = Store::open(&place.file(), Some(&place.video()), Limits::default()).unwrap();
    store.keep_history().unwrap();
    store
}

fn begin(place: &TestFolder) -> Store {
    let mut store = place.store();
    for frame in 0..TARGETS as usize {
        store
            .apply(vec![Edit::AddTarget {
                label: "target".into(),
                frame,
                bbox: BOX,
                outline: None,
            }])
            .unwrap();
    }
    store.save().unwrap();
    drop(store);
    open(place)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// One step for what a person did, with the tracking that follows from it, whatever happens
    /// meanwhile: other changes, undo and redo at any moment, the end of the program.
    #[test]
    fn undo_and_redo_are_those_of_a_plain_model(acts in acts()) {
        let place = TestFolder::new();
        let store = begin(&place);
        let model = Model {
            first: store.project().clone(),
            done: Vec::new(),
            undone: Vec::new(),
            jobs: BTreeMap::new(),
        };
        let mut course = HistoryTest { place: &place, store, model };
        for act in acts {
            course = course.act(act);
            let HistoryTest { store, model, .. } = &course;
            prop_assert_eq!(content(store.project()), content(&model.project()), "after {:?}", act);
            prop_assert_eq!(store.history().id(false), model.done.last().map(|step| step.id));
            prop_assert_eq!(store.history().id(true), model.undone.last().map(|step| step.id));
        }
        while course.store.history().id(false).is_some() {
            course.undo();
        }
        prop_assert_eq!(content(course.store.project()), content(&course.model.first));
    }
}

#[test]
fn a_step_says_what_was_done_and_what_was_tracked_since() {
    let place = TestFolder::new();
    let mut store = begin(&place);
    let key = store.apply(vec![set_key(1, 4, 9)]).unwrap();
    assert_eq!(store.begin_tracking(1, Some(key)), key);
    assert_eq!(store.history().text(false), Some("correct target 1 in frame 4"));
    store.track(1, key, vec![tracked(1, 5, 8, 3)]).unwrap();
    let said = "correct target 1 in frame 4, and track target 1 in 4 frames, 5 to 8";
    assert_eq!(store.history().text(false), Some(said));
    // The label of another target is a step of its own; the tracking goes on with its own step.
    store.apply(vec![Edit::SetDone { done: true }]).unwrap();
    assert_eq!(store.track(1, key, vec![tracked(1, 9, 9, 3)]).unwrap(), key);
    assert_eq!(store.history().text(false), Some("mark the clip as done"));
    store.step(false).unwrap();
    assert_eq!(
        store.history().text(false),
        Some("correct target 1 in frame 4, and track target 1 in 5 frames, 5 to 9")
    );
    store.step(false).unwrap();
    assert!(store.history().is_undone(key) && store.history().text(false).is_none());
    let target = store.project().target(1).unwrap();
    assert!(target.tracked.is_empty() && target.keys.len() == 1);
    // Tracking that has found nothing is no step.
    let job = store.begin_tracking(1, None);
    store.end_tracking(job);
    assert_eq!(store.history().id(false), None);
}

#[test]
fn the_history_survives_a_restart_but_not_a_change_by_others() {
    let place = TestFolder::new();
    let mut store = begin(&place);
    let before = content(store.project());
    store.apply(vec![set_key(1, 4, 9)]).unwrap();
    store.save().unwrap();
    store.apply(vec![set_key(2, 5, 9)]).unwrap();
    store.save().unwrap();
    store.step(false).unwrap();
    store.save().unwrap();
    drop(store);
    let mut store = open(&place);
    assert_eq!(store.history().text(false), Some("correct target 1 in frame 4"));
    assert_eq!(store.history().text(true), Some("correct target 2 in frame 5"));
    // Killed before it was saved: the history is that of the file.
    store.step(true).unwrap();
    drop(store);
    let mut store = open(&place);
    store.step(false).unwrap();
    assert_eq!(content(store.project()), before);
    store.save().unwrap();
    drop(store);
    // Another program has written the project.
    let mut other = Store::open(&place.file(), None, Limits::default()).unwrap();
    other.apply(vec![set_key(3, 6, 9)]).unwrap();
    other.save().unwrap();
    drop(other);
    let store = open(&place);
    assert_eq!((store.history().text(false), store.history().text(true)), (None, None));
}

#[test]
fn a_history_that_is_none_is_not_used() {
    let place = TestFolder::new();
    let mut store = begin(&place);
    store.apply(vec![set_key(1, 4, 9)]).unwrap();
    store.save().unwrap();
    drop(store);
    let file = place.file().with_file_name("frames.patchlock.json.history");
    let good = std::fs::read(&file).unwrap();
    // A line that was cut by a crash, after those that lead to the project.
    let cut = [good.as_slice(), &good[..good.len() / 2]].concat();
    std::fs::write(&file, cut).unwrap();
    assert!(open(&place).history().text(false).is_some());
    for bad in [&b""[..], b"{}", b"[1]\n", &good[..good.len() / 2], &[0xff; 99]] {
        std::fs::write(&file, bad).unwrap();
        let mut store = open(&place);
        assert_eq!(store.history().text(false), None);
        store.apply(vec![set_key(1, 4, 9)]).unwrap();
        store.save().unwrap();
        drop(store);
        assert!(open(&place).history().text(false).is_some());
    }
    // A link is replaced, and what it leads to stays as it is.
    #[cfg(unix)]
    {
        let secret = place.folder().join("secret");
        std::fs::write(&secret, "secret").unwrap();
        std::fs::remove_file(&file).unwrap();
        std::os::unix::fs::symlink(&secret, &file).unwrap();
        let mut store = open(&place);
        store.apply(vec![set_key(1, 4, 9)]).unwrap();
        store.save().unwrap();
        assert_eq!(std::fs::read_to_string(&secret).unwrap(), "secret");
        assert!(!file.is_symlink());
    }
}
