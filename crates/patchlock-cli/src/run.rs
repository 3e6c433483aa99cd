//! One run over frames: passes each frame to the tracker and the results to the outputs. `track`
//! and `demo` use it.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use anyhow::Result;
use patchlock::{BoundingBox, MultiTracker, TargetId, TrackerConfig};
use patchlock_media::Picture;
use patchlock_studio::server::window::{RedrawnTarget, Window};
use patchlock_track::session::{self, timed_on};
use rayon::ThreadPool;

use crate::failure::{Failure, failed, usage};
use crate::interrupt;
use crate::output::measurements::Measurements;
use crate::output::{Sink, TargetResult, TrackedFrame};
use crate::progress::Progress;
use crate::targets::{Event, Names, Targets};

/// A tracker with its outputs and its measurements.
pub struct Run {
    tracker: MultiTracker,
    pool: Arc<ThreadPool>,
    /// The tracker's ids of the targets by those of the user.
    ids: BTreeMap<u64, TargetId>,
    sinks: Vec<Box<dyn Sink>>,
    /// Whether the rows contain the ids of the targets.
    with_ids: bool,
    names: Names,
    /// The page on which targets are drawn again while they are tracked.
    redrawn_on: Option<Arc<Window>>,
    size: Option<(usize, usize)>,
    measurements: Measurements,
}

impl Run {
    /// A run on `threads` threads; `None` means one per core.
    pub fn new(
        config: TrackerConfig,
        threads: Option<usize>,
        targets: &Targets,
        sinks: Vec<Box<dyn Sink>>,
    ) -> Result<Self> {
        let pool = session::pool(threads).map_err(Failure::from)?;
        Ok(Self {
            tracker: MultiTracker::new(config)?,
            pool,
            ids: BTreeMap::new(),
            sinks,
            with_ids: targets.many,
            names: targets.names.clone(),
            redrawn_on: None,
            size: None,
            measurements: Measurements::default(),
        })
    }

    /// The same with targets that start again where they are drawn on this page.
    #[must_use]
    pub fn redrawn_on(self, page: Option<Arc<Window>>) -> Self {
        Self { redrawn_on: page, ..self }
    }

    pub fn threads(&self) -> usize {
        self.pool.current_num_threads()
    }

    pub fn measurements(&self) -> &Measurements {
        &self.measurements
    }

    /// The outputs, for the caller to complete.
    pub fn into_sinks(self) -> Vec<Box<dyn Sink>> {
        self.sinks
    }

    /// Tracks all frames and passes each to the outputs, to `each` and to the progress bar. An
    /// error ends the run; the outputs then hold the frames tracked before it.
    pub fn track_all(
        &mut self,
        targets: &mut Targets,
        frames: impl Iterator<Item = Result<(usize, Picture)>>,
        progress: &Progress,
        mut each: impl FnMut(&TrackedFrame<'_>) -> Result<()>,
    ) -> Result<()> {
        for frame in frames {
            let (index, picture) = frame?;
            let picture = Arc::new(picture);
            targets.check_boxes(index, &picture)?;
            self.redraw(progress)?;
            let (found, ms) = self.track(index, &picture, &targets.due(index))?;
            let tracked = TrackedFrame { frame: index, ms, targets: &found, picture: &picture };
            self.write(&tracked)?;
            each(&tracked)?;
            progress.step(self.measurements.fps(), &found);
        }
        if interrupt::requested() {
            return Ok(());
        }
        Ok(targets.check_all_done()?)
    }

    /// Restarts targets that were drawn again since the last frame, on the frame where they were
    /// drawn. A box that the tracker refuses changes nothing.
    fn redraw(&mut self, progress: &Progress) -> Result<()> {
        for redrawn in self.redrawn_on.iter().flat_map(|page| page.redrawn()) {
            let RedrawnTarget { id, frame, picture, bbox: bbox @ BoundingBox { x, y, w, h } } =
                redrawn;
            let called = id.map_or_else(|| "the target".to_string(), |id| format!("target {id}"));
            let pixels = picture.frame()?;
            let Self { tracker, pool, ids, .. } = self;
            // A single target has the first id. One that has ended stays so.
            let restarted = ids.get(&id.unwrap_or(1)).map_or(Ok(()), |&known| {
                pool.install(|| tracker.restart(known, &pixels, bbox).map(|_| ()))
            });
            match restarted {
                Ok(()) => progress
                    .note(&format!("note: {called} restarts on frame {frame} at {x},{y},{w},{h}")),
                Err(error) => progress.note(&format!("note: {called} does not restart: {error}")),
            }
        }
        Ok(())
    }

    /// Processes the next frame: ends targets, tracks the others, starts new ones. Returns the
    /// targets in the order of their ids, and the time in milliseconds.
    fn track(
        &mut self,
        index: usize,
        picture: &Picture,
        events: &[Event],
    ) -> Result<(Vec<TargetResult>, f64)> {
        self.check_size(index, picture)?;
        let frame = picture.frame()?;
        for event in events.iter().filter(|event| event.bbox.is_none()) {
            let known = self.ids.remove(&event.id).ok_or_else(|| not_tracked(event.id, index))?;
            self.tracker.remove(known)?;
        }
        let begin: BTreeMap<u64, BoundingBox> =
            events.iter().filter_map(|event| Some((event.id, event.bbox?))).collect();
        let Self { tracker, pool, ids, .. } = self;
        let step = timed_on(pool, || {
            if !ids.is_empty() {
                tracker.update(&frame)?;
            }
            for (&id, &bbox) in &begin {
                if let Some(&known) = ids.get(&id) {
                    tracker.restart(known, &frame, bbox)?;
                } else {
                    ids.insert(id, tracker.add(&frame, bbox)?.id);
                }
            }
            Ok(())
        });
        let ((), seconds) = step.map_err(|error: patchlock::Error| {
            failed(format!("the tracker stopped in frame {index}: {error}"))
        })?;
        let estimates: HashMap<_, _> =
            tracker.tracked().iter().map(|target| (target.id, &target.estimate)).collect();
        let seen = ids.iter().map(|(id, known)| {
            let estimate = estimates[known].clone();
            // The given box in the frame where it starts.
            let bbox = begin.get(id).copied().unwrap_or(estimate.bbox);
            let name = self.names.get(id).cloned();
            TargetResult { id: self.with_ids.then_some(*id), name, bbox, estimate }
        });
        let (seen, ms) = (seen.collect::<Vec<_>>(), seconds * 1e3);
        self.measurements.add(index, &seen, ms);
        Ok((seen, ms))
    }

    /// Passes a tracked frame to the outputs. An output that fails is dropped; the others still get
    /// the frame.
    fn write(&mut self, tracked: &TrackedFrame<'_>) -> Result<()> {
        let mut result = Ok(());
        self.sinks.retain_mut(|sink| match sink.write(tracked) {
            Ok(()) => true,
            Err(error) => {
                result = Err(error);
                false
            }
        });
        result
    }

    fn check_size(&mut self, index: usize, picture: &Picture) -> Result<(), Failure> {
        let size = (picture.width, picture.height);
        let (width, height) = *self.size.get_or_insert(size);
        if size == (width, height) {
            return Ok(());
        }
        Err(failed(format!(
            "frame {index} is {} x {} pixels, but the frames before it are {width} x {height}",
            picture.width, picture.height
        ))
        .hint("all frames of a source must have the same size; --end stops before that frame"))
    }
}

fn not_tracked(id: u64, index: usize) -> Failure {
    usage(format!("--boxes: target {id} ends in frame {index}, but it is not tracked there"))
        .hint("a line without x, y, w and h ends a target that an earlier line has started")
}
