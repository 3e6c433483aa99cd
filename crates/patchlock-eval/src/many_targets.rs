//! Many targets, called by the ids that the caller gives them.

use std::collections::BTreeMap;
use std::sync::Arc;

use patchlock::{BoundingBox, Error, Estimate, Frame, MultiTracker, TargetId, TrackerConfig};
use rayon::ThreadPool;

use crate::session::Session;

/// A tracker of many targets at work.
pub struct ManyTargets {
    session: Session<MultiTracker>,
    /// The targets as the caller calls them and as the tracker does, in the order in which they were added.
    ids: Vec<(u64, TargetId)>,
}

/// One target in one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackedTarget {
    /// The target, as the caller calls it.
    pub id: u64,
    /// Its box: as it was given where it begins, as it was found elsewhere.
    pub bbox: BoundingBox,
    /// What the tracker says.
    pub estimate: Estimate,
}

impl ManyTargets {
    /// No targets yet.
    ///
    /// # Errors
    /// As [`MultiTracker::new`].
    pub fn new(config: TrackerConfig, pool: Arc<ThreadPool>) -> Result<Self, Error> {
        let session = Session::new(MultiTracker::new(config)?, pool);
        Ok(Self { session, ids: Vec::new() })
    }

    /// Number of threads.
    pub fn threads(&self) -> usize {
        self.session.threads()
    }

    /// Forgets all targets, as if nothing had been tracked before.
    ///
    /// # Errors
    /// As [`ManyTargets::new`].
    pub fn forget(&mut self) -> Result<(), Error> {
        let tracker = self.session.tracker_mut();
        *tracker = MultiTracker::new(tracker.config().clone())?;
        self.ids.clear();
        Ok(())
    }

    /// Ends a target; gives whether there was one of this id.
    ///
    /// # Errors
    /// As [`MultiTracker::remove`].
    pub fn end(&mut self, id: u64) -> Result<bool, Error> {
        let Some(place) = self.ids.iter().position(|(known, _)| *known == id) else {
            return Ok(false);
        };
        let (_, target) = self.ids.remove(place);
        self.session.tracker_mut().remove(target)?;
        Ok(true)
    }

    /// The next frame: follows the targets that there are, then begins those that are new, or begin anew.
    /// Gives all of them in the order of their ids, and the seconds that it took.
    ///
    /// # Errors
    /// Why the tracker refuses the frame or a box.
    pub fn step(
        &mut self,
        frame: &Frame<'_>,
        begin: &[(u64, BoundingBox)],
    ) -> Result<(Vec<TrackedTarget>, f64), Error> {
        let Self { session, ids } = self;
        session.step(|tracker| step(tracker, ids, frame, begin))
    }
}

fn step(
    tracker: &mut MultiTracker,
    ids: &mut Vec<(u64, TargetId)>,
    frame: &Frame<'_>,
    begin: &[(u64, BoundingBox)],
) -> Result<Vec<TrackedTarget>, Error> {
    let mut tracked: BTreeMap<u64, TrackedTarget> = BTreeMap::new();
    if !ids.is_empty() {
        // Both are in the order in which the targets were added.
        for (&(id, _), (_, estimate)) in ids.iter().zip(tracker.update(frame)?) {
            tracked.insert(id, TrackedTarget { id, bbox: estimate.bbox, estimate });
        }
    }
    for &(id, bbox) in begin {
        let known = ids.iter().find(|(known, _)| *known == id);
        let estimate = match known {
            Some((_, target)) => tracker.reinit(*target, frame, bbox)?,
            None => {
                let (target, estimate) = tracker.add(frame, bbox)?;
                ids.push((id, target));
                estimate
            }
        };
        tracked.insert(id, TrackedTarget { id, bbox, estimate });
    }
    Ok(tracked.into_values().collect())
}
