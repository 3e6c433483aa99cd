//! Tracks many targets, which the caller identifies by its own ids.

use std::sync::Arc;

use patchlock::{
    BoundingBox, Error, Estimate, Frame, MultiTracker, TargetEstimate, TargetId, TrackerConfig,
};
use rayon::ThreadPool;

use crate::session::timed_on;

/// A tracker of many targets with its threads.
pub struct ManyTargets {
    tracker: MultiTracker,
    pool: Arc<ThreadPool>,
    /// The caller's id and the tracker's id of each target, in the order in which they were added.
    ids: Vec<(u64, TargetId)>,
}

/// One target in one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackedTarget {
    /// The caller's id of the target.
    pub id: u64,
    /// Its box: the given one in the frame where the target starts, the tracked one in later
    /// frames.
    pub bbox: BoundingBox,
    /// The estimate of the tracker.
    pub estimate: Estimate,
}

impl ManyTargets {
    /// A tracker without targets.
    ///
    /// # Errors
    /// As [`MultiTracker::new`].
    pub fn new(config: TrackerConfig, pool: Arc<ThreadPool>) -> Result<Self, Error> {
        Ok(Self { tracker: MultiTracker::new(config)?, pool, ids: Vec::new() })
    }

    /// The configuration.
    pub fn config(&self) -> &TrackerConfig {
        self.tracker.config()
    }

    /// Number of threads.
    pub fn threads(&self) -> usize {
        self.pool.current_num_threads()
    }

    /// Removes all targets and resets the tracker.
    ///
    /// # Errors
    /// As [`ManyTargets::new`].
    pub fn forget(&mut self) -> Result<(), Error> {
        self.tracker = MultiTracker::new(self.tracker.config().clone())?;
        self.ids.clear();
        Ok(())
    }

    /// Removes a target. Returns false if there is no target with this id.
    ///
    /// # Errors
    /// As [`MultiTracker::remove`].
    pub fn end(&mut self, id: u64) -> Result<bool, Error> {
        let Some(index) = self.ids.iter().position(|(known, _)| *known == id) else {
            return Ok(false);
        };
        let (_, target) = self.ids.remove(index);
        self.tracker.remove(target)?;
        Ok(true)
    }

    /// Restarts a target on a box of this frame, which may be one that was processed before. A target
    /// that has ended stays so.
    ///
    /// # Errors
    /// The error of the tracker if it rejects the frame or the box; the target then stays as it is.
    pub fn restart(&mut self, id: u64, frame: &Frame<'_>, bbox: BoundingBox) -> Result<(), Error> {
        let Self { tracker, pool, ids } = self;
        match ids.iter().find(|(known, _)| *known == id) {
            Some(&(_, target)) => pool.install(|| tracker.restart(target, frame, bbox).map(|_| ())),
            None => Ok(()),
        }
    }

    /// Processes the next frame: tracks the existing targets, then starts the targets in `begin`,
    /// or restarts those whose id is known. Returns all targets in the order of their ids, and the
    /// elapsed seconds.
    ///
    /// # Errors
    /// The error of the tracker if it rejects the frame or a box.
    pub fn step(
        &mut self,
        frame: &Frame<'_>,
        begin: &[(u64, BoundingBox)],
    ) -> Result<(Vec<TrackedTarget>, f64), Error> {
        let Self { tracker, pool, ids } = self;
        timed_on(pool, || {
            let mut tracked: Vec<TrackedTarget> = Vec::new();
            let mut add = |target: TrackedTarget| match tracked
                .binary_search_by_key(&target.id, |known| known.id)
            {
                Ok(k) => tracked[k] = target,
                Err(k) => tracked.insert(k, target),
            };
            if !ids.is_empty() {
                // Both are in the order in which the targets were added.
                for (&(id, _), TargetEstimate { estimate, .. }) in
                    ids.iter().zip(tracker.update(frame)?)
                {
                    let estimate = estimate.clone();
                    add(TrackedTarget { id, bbox: estimate.bbox, estimate });
                }
            }
            for &(id, bbox) in begin {
                let known = ids.iter().find(|(known, _)| *known == id);
                let estimate = match known {
                    Some((_, target)) => tracker.restart(*target, frame, bbox)?.clone(),
                    None => {
                        let added = tracker.add(frame, bbox)?;
                        ids.push((id, added.id));
                        added.estimate.clone()
                    }
                };
                add(TrackedTarget { id, bbox, estimate });
            }
            Ok(tracked)
        })
    }
}
