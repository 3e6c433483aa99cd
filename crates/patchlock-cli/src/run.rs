//! One run over frames: passes each frame to the tracker and the results to the outputs. Used by `track` and
//! `demo`.

use std::collections::BTreeSet;

use anyhow::Result;
use patchlock::TrackerConfig;
use patchlock_eval::many_targets::{ManyTargets, TrackedTarget};
use patchlock_eval::session;
use patchlock_media::Picture;

use crate::failure::{Failure, failed, usage};
use crate::output::row::Row;
use crate::output::{Seen, Sink, Tracked};
use crate::targets::Event;

/// A tracker with its outputs and its timings.
pub struct Run {
    tracker: ManyTargets,
    sinks: Vec<Box<dyn Sink>>,
    /// Whether the rows contain the ids of the targets.
    with_ids: bool,
    size: Option<(usize, usize)>,
    started: BTreeSet<u64>,
    times_ms: Vec<f64>,
}

impl Run {
    /// A run on `threads` threads; `None` means one per core.
    pub fn new(
        config: TrackerConfig,
        threads: Option<usize>,
        with_ids: bool,
        sinks: Vec<Box<dyn Sink>>,
    ) -> Result<Self> {
        let pool = session::pool(threads).map_err(Failure::from)?;
        Ok(Self {
            tracker: ManyTargets::new(config, pool)?,
            sinks,
            with_ids,
            size: None,
            started: BTreeSet::new(),
            times_ms: Vec::new(),
        })
    }

    /// Number of threads.
    pub fn threads(&self) -> usize {
        self.tracker.threads()
    }

    /// Number of targets so far.
    pub fn targets(&self) -> usize {
        self.started.len()
    }

    /// Milliseconds for each frame so far that had targets.
    pub fn times_ms(&self) -> &[f64] {
        &self.times_ms
    }

    /// Frames per second so far.
    pub fn fps(&self) -> f64 {
        let total: f64 = self.times_ms.iter().sum();
        if total > 0.0 { 1e3 * self.times_ms.len() as f64 / total } else { 0.0 }
    }

    /// The outputs, for the caller to complete.
    pub fn into_sinks(self) -> Vec<Box<dyn Sink>> {
        self.sinks
    }

    /// Processes the next frame: ends targets, tracks the others, starts new ones. Returns the targets in the
    /// order of their ids, and the time in milliseconds.
    pub fn track(
        &mut self,
        index: usize,
        picture: &Picture,
        events: &[Event],
    ) -> Result<(Vec<TrackedTarget>, f64)> {
        self.check_size(index, picture)?;
        let frame = picture.frame()?;
        for event in events.iter().filter(|event| event.bbox.is_none()) {
            if !self.tracker.end(event.id)? {
                return Err(not_tracked(event.id, index).into());
            }
        }
        let begin: Vec<_> =
            events.iter().filter_map(|event| Some((event.id, event.bbox?))).collect();
        let (found, seconds) = self
            .tracker
            .step(&frame, &begin)
            .map_err(|error| failed(format!("the tracker stopped in frame {index}: {error}")))?;
        let ms = seconds * 1e3;
        self.started.extend(found.iter().map(|target| target.id));
        if !found.is_empty() {
            self.times_ms.push(ms);
        }
        Ok((found, ms))
    }

    /// Passes a tracked frame to the outputs. An output that fails is dropped; the others still get the
    /// frame.
    pub fn write(
        &mut self,
        index: usize,
        picture: &Picture,
        found: Vec<TrackedTarget>,
        ms: f64,
    ) -> Result<Vec<Seen>> {
        let seen = |TrackedTarget { id, bbox, estimate }| {
            let mut row = Row::new(index, &bbox, &estimate, ms);
            row.id = self.with_ids.then_some(id);
            Seen { row, estimate }
        };
        let targets: Vec<Seen> = found.into_iter().map(seen).collect();
        let tracked = Tracked { frame: index, targets: &targets, picture };
        let mut result = Ok(());
        self.sinks.retain_mut(|sink| match sink.write(&tracked) {
            Ok(()) => true,
            Err(error) => {
                result = Err(error);
                false
            }
        });
        result.map(|()| targets)
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
