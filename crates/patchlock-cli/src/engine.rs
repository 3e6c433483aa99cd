//! The tracker on its threads, with a clock.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

use anyhow::{Context, Result};
use patchlock::{BoundingBox, Estimate, Frame, MultiTracker, TargetId, TrackerConfig};
use rayon::ThreadPool;

use crate::complaint::{Complaint, failed, usage};
use crate::targets::Event;
use patchlock_eval::picture::Picture;

/// More threads than any machine has: a number above it is a slip.
pub const MOST_THREADS: usize = 1024;

/// So many threads; without a number, one for each core.
pub fn pool(threads: Option<usize>) -> Result<ThreadPool> {
    if let Some(threads) = threads.filter(|threads| !(1..=MOST_THREADS).contains(threads)) {
        return Err(usage(format!("--threads {threads}: it must be 1 to {MOST_THREADS}"))
            .hint("leave it out to use every core; the boxes are the same for any number")
            .into());
    }
    let threads =
        threads.or_else(|| std::thread::available_parallelism().ok().map(usize::from)).unwrap_or(1);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.context("cannot start the threads")
}

/// A tracker and what it runs on.
pub struct Engine {
    tracker: MultiTracker,
    pool: ThreadPool,
    /// The targets as the user calls them, and as the tracker does.
    ids: Vec<(u64, TargetId)>,
    begun: BTreeSet<u64>,
    size: Option<(usize, usize)>,
    times_ms: Vec<f64>,
}

/// One target in one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// The target, as the user calls it.
    pub id: u64,
    /// Its box: as it was given where it begins, as it was found elsewhere.
    pub bbox: BoundingBox,
    /// What the tracker says.
    pub estimate: Estimate,
}

impl Engine {
    /// A tracker on so many threads; without a number, one for each core.
    pub fn new(config: TrackerConfig, threads: Option<usize>) -> Result<Self> {
        let pool = pool(threads)?;
        Ok(Self {
            tracker: MultiTracker::new(config)?,
            pool,
            ids: Vec::new(),
            begun: BTreeSet::new(),
            size: None,
            times_ms: Vec::new(),
        })
    }

    /// Number of threads.
    pub fn threads(&self) -> usize {
        self.pool.current_num_threads()
    }

    /// Number of targets that were begun so far.
    pub fn targets(&self) -> usize {
        self.begun.len()
    }

    /// Milliseconds of each frame so far in which there were targets.
    pub fn times_ms(&self) -> &[f64] {
        &self.times_ms
    }

    /// Frames a second so far.
    pub fn fps(&self) -> f64 {
        let total: f64 = self.times_ms.iter().sum();
        if total > 0.0 { 1e3 * self.times_ms.len() as f64 / total } else { 0.0 }
    }

    /// The next frame: ends targets, follows the others, begins new ones. Gives them by id, and the milliseconds that it took.
    pub fn step(
        &mut self,
        index: usize,
        picture: &Picture,
        events: &[Event],
    ) -> Result<(Vec<Found>, f64)> {
        self.check_size(index, picture)?;
        let frame = picture.frame()?;
        let stopped = |error| failed(format!("the tracker stopped in frame {index}: {error}"));
        let Self { tracker, pool, ids, begun, times_ms, .. } = self;
        for event in events.iter().filter(|event| event.bbox.is_none()) {
            end(tracker, ids, event.id, index)?;
        }
        let start = Instant::now();
        let found = pool.install(|| step(tracker, ids, &frame, events)).map_err(stopped)?;
        let ms = start.elapsed().as_secs_f64() * 1e3;
        begun.extend(found.iter().map(|found| found.id));
        if !found.is_empty() {
            times_ms.push(ms);
        }
        Ok((found, ms))
    }

    fn check_size(&mut self, index: usize, picture: &Picture) -> Result<(), Complaint> {
        let size = (picture.width, picture.height);
        let (width, height) = *self.size.get_or_insert(size);
        if size == (width, height) {
            return Ok(());
        }
        Err(failed(format!(
            "frame {index} is {} x {} pixels, but the frames before it are {width} x {height}",
            picture.width, picture.height
        ))
        .hint("all frames of a source must have one size; --end stops before that frame"))
    }
}

/// Follows the targets that there are, and begins those that are new or begin anew.
fn step(
    tracker: &mut MultiTracker,
    ids: &mut Vec<(u64, TargetId)>,
    frame: &Frame<'_>,
    events: &[Event],
) -> Result<Vec<Found>, patchlock::Error> {
    let mut found: BTreeMap<u64, Found> = BTreeMap::new();
    if !ids.is_empty() {
        // Both are in the order in which the targets were added.
        for (&(id, _), (_, estimate)) in ids.iter().zip(tracker.update(frame)?) {
            found.insert(id, Found { id, bbox: estimate.bbox, estimate });
        }
    }
    for (id, bbox) in events.iter().filter_map(|event| Some((event.id, event.bbox?))) {
        let known = ids.iter().find(|(known, _)| *known == id);
        let estimate = match known {
            Some((_, target)) => tracker.reinit(*target, frame, bbox)?,
            None => {
                let (target, estimate) = tracker.add(frame, bbox)?;
                ids.push((id, target));
                estimate
            }
        };
        found.insert(id, Found { id, bbox, estimate });
    }
    Ok(found.into_values().collect())
}

fn end(
    tracker: &mut MultiTracker,
    ids: &mut Vec<(u64, TargetId)>,
    id: u64,
    index: usize,
) -> Result<()> {
    let place = ids.iter().position(|(known, _)| *known == id).ok_or_else(|| {
        usage(format!("--boxes: target {id} ends in frame {index}, but it is not tracked there"))
            .hint("a line without x, y, w and h ends a target that an earlier line began")
    })?;
    let (_, target) = ids.remove(place);
    Ok(tracker.remove(target)?)
}
