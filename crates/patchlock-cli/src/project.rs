//! Tracks into a project: where its targets start, and an output that adds the boxes to it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::Result;
use patchlock_media::{Limits, Order};
use patchlock_studio::project::{self, Edit, Project, Store, Target};

use crate::failure::{Failure, failed, usage};
use crate::output::{Sink, TrackedFrame};
use crate::targets::{Event, Targets};

/// Opens the project of a source, or begins it.
pub fn open(file: &Path, video: &Path, limits: Limits) -> Result<Store, Failure> {
    if !video.exists() {
        return Err(usage(format!(
            "--project needs a video file or a folder of images, not {}",
            video.display()
        ))
        .hint(
            "a project belongs to one file or folder, so that it can tell whether that has changed",
        ));
    }
    let store = Store::open(file, Some(video), limits)?;
    match store.changed() {
        None => Ok(store),
        Some(change) => Err(failed(format!("{}: {change}", file.display()))
            .hint("the boxes may not fit it; patchlock studio shows them and can go on with it")),
    }
}

/// The starts of all targets of a project, restarts and ends, as its key frames and hidden frames
/// say.
///
/// # Errors
/// If there is no key frame among the frames that are tracked.
pub fn starts(store: &Store, order: &Order) -> Result<Targets, Failure> {
    let frames = store.project().video.frames;
    let events: Vec<Event> = store
        .project()
        .targets
        .iter()
        .flat_map(|target| events_of(target, order, frames))
        .collect();
    match events.is_empty() {
        true => Err(usage(format!("{} has no key frame to start from", store.path().display()))
            .hint("give --box, or choose other frames with --start, --end and --stride")),
        false => Ok(Targets::at_frames(events)),
    }
}

/// The events of one target in the frames that are visited.
fn events_of(target: &Target, order: &Order, frames: usize) -> Vec<Event> {
    let visited = |frame: &usize| order.holds(*frame, Some(frames));
    let first_of = |&[from, to]: &[usize; 2]| match order.reverse {
        true => (from..=to).rev().find(visited),
        false => (from..=to).find(visited),
    };
    let keys = target.keys.iter().filter(|(frame, _)| visited(frame));
    let keys = keys.map(|(&frame, key)| (frame, Some(key.bbox)));
    let hidden = target.hidden.iter().filter_map(first_of).map(|frame| (frame, None));
    let mut all: Vec<_> = keys.chain(hidden).collect();
    all.sort_unstable_by_key(|(frame, bbox)| (*frame, bbox.is_none()));
    if order.reverse {
        all.reverse();
    }
    // Only a target that is being tracked can end.
    let mut tracked = false;
    all.retain(|(_, bbox)| std::mem::replace(&mut tracked, bbox.is_some()) || bbox.is_some());
    all.into_iter().map(|(frame, bbox)| Event { frame: Some(frame), id: target.id, bbox }).collect()
}

/// What a run knows of one target.
#[derive(Default)]
struct Boxes {
    keys: BTreeMap<usize, project::Key>,
    tracked: BTreeMap<usize, project::TrackedBox>,
}

/// Adds the boxes of a run to a project, when it is complete.
pub struct Output {
    store: Store,
    /// Whether the targets of the run are those of the project, and not new ones.
    known: bool,
    /// Starts of targets: frame (`None` for the first) and id.
    starts: Vec<(Option<usize>, u64)>,
    /// What is known of each target, by its id.
    boxes: BTreeMap<u64, Boxes>,
    begun: bool,
}

impl Output {
    /// An output for these targets: those of the project if they are `known`, or new ones.
    pub fn new(store: Store, targets: &Targets, known: bool) -> Self {
        let starts = targets.starts().collect();
        Self { store, known, starts, boxes: BTreeMap::new(), begun: false }
    }

    fn edits(&mut self) -> Vec<Edit> {
        let mut edits = Vec::new();
        let Project { labels, next_id, .. } = self.store.project();
        let (label, mut next_id) = (labels.first().map(|label| label.name.clone()), *next_id);
        if label.is_none() && !self.known {
            edits.push(Edit::AddLabel { name: LABEL.to_owned(), colour: None, at: None });
        }
        let label = label.unwrap_or_else(|| LABEL.to_owned());
        for (id, Boxes { keys, tracked }) in std::mem::take(&mut self.boxes) {
            let mut target = id;
            if !self.known {
                target = next_id;
                next_id += 1;
                for (k, (&frame, key)) in keys.iter().enumerate() {
                    let (label, bbox) = (label.clone(), key.bbox);
                    let (occluded, truncated) = (false, false);
                    edits.push(match k {
                        0 => Edit::AddTarget { label, frame, bbox, outline: None },
                        _ => {
                            Edit::SetKey { target, frame, bbox, outline: None, occluded, truncated }
                        }
                    });
                }
            }
            if let (Some(&from), Some(&to)) = (tracked.keys().next(), tracked.keys().next_back()) {
                edits.push(Edit::SetTracked { target, from, to, tracked });
            }
        }
        edits
    }
}

/// The label of new targets in a project that has none.
const LABEL: &str = "target";

impl Sink for Output {
    fn write(&mut self, frame: &TrackedFrame<'_>) -> Result<()> {
        for target in frame.targets {
            let id = target.id.unwrap_or(1);
            let is_start = self
                .starts
                .iter()
                .any(|&(at, other)| other == id && at.map_or(!self.begun, |at| at == frame.frame));
            let boxes = self.boxes.entry(id).or_default();
            if is_start {
                boxes.keys.insert(frame.frame, project::Key::new(target.bbox));
            } else {
                boxes.tracked.insert(frame.frame, (&target.estimate).into());
            }
        }
        self.begun = true;
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<Option<PathBuf>> {
        let edits = self.edits();
        self.store.apply(edits).map_err(Failure::from)?;
        self.store.save().map_err(Failure::from)?;
        Ok(Some(self.store.path().to_path_buf()))
    }
}
