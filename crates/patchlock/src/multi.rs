//! Many targets in one video: each is tracked as a [`Tracker`](crate::Tracker) of its own would, to the same boxes, bit for bit, but the frame becomes
//! grey once, and buffers belong to threads rather than to targets.
//!
//! Targets are dealt out to the threads of the pool in runs of equal length. A thread that is done helps the others with the candidates of theirs, so that
//! all threads have work also where there are fewer targets than threads.

use crate::config::TrackerConfig;
use crate::memory::Memory;
use crate::simd::instructions::Instructions;
use crate::tracker::{Target, Work};
use crate::vision::frame::{Frame, GreyImage};
use crate::vision::geometry::BoundingBox;
use crate::{Error, Estimate};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Follows many targets through the frames of a video. They come and go at any frame.
///
/// ```
/// use patchlock::{BoundingBox, Frame, MultiTracker, TrackerConfig};
///
/// let mut tracker = MultiTracker::new(TrackerConfig { particles: 50, ..TrackerConfig::preset("paper")? })?;
/// let pixels: Vec<u8> = (0..120 * 90).map(|k| (k * k % 251) as u8).collect();
/// let frame = Frame::grey8(&pixels, 120, 90)?;
/// let (first, _) = tracker.add(&frame, BoundingBox { x: 30.0, y: 20.0, w: 40.0, h: 32.0 })?;
/// tracker.add(&frame, BoundingBox { x: 70.0, y: 40.0, w: 24.0, h: 24.0 })?;
/// for (id, estimate) in tracker.update(&frame)? {
///     println!("{id}: {:?}, visibility {:.2}", estimate.bbox, estimate.score);
/// }
/// tracker.remove(first)?;
/// # Ok::<(), patchlock::Error>(())
/// ```
///
/// On a frame where targets go on and others begin, call [`update`](Self::update) first and [`add`](Self::add) after it. As with a `Tracker`,
/// the `rayon` pool that the caller is in decides on the number of threads, and the boxes do not depend on it. All targets have one configuration,
/// the seed included.
///
/// A target holds its dictionaries and what follows from them, about 20 MB in the preset `paper`; what candidates need is held once for each thread.
#[derive(Debug)]
pub struct MultiTracker {
    config: TrackerConfig,
    targets: Vec<(TargetId, Target)>,
    next: u64,
    image: GreyImage,
    /// One for each thread.
    works: Vec<Work>,
}

/// Names a target of a [`MultiTracker`]: 1 for the first that was added, 2 for the next. A number is never given twice.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct TargetId(u64);

impl TargetId {
    /// The number.
    pub fn number(self) -> u64 {
        self.0
    }
}

impl From<u64> for TargetId {
    /// The id with this number; whether there is such a target is for the tracker to say.
    fn from(number: u64) -> Self {
        Self(number)
    }
}

impl fmt::Display for TargetId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl MultiTracker {
    /// A tracker without targets yet.
    ///
    /// # Errors
    /// As [`Tracker::new`](crate::Tracker::new).
    pub fn new(config: TrackerConfig) -> Result<Self, Error> {
        config.validate()?;
        Instructions::chosen()?;
        Ok(Self::with(config, Vec::new(), 1))
    }

    fn with(config: TrackerConfig, targets: Vec<(TargetId, Target)>, next: u64) -> Self {
        Self { config, targets, next, image: GreyImage::default(), works: Vec::new() }
    }

    /// The configuration of all targets.
    pub fn config(&self) -> &TrackerConfig {
        &self.config
    }

    /// The targets, in the order in which they were added.
    pub fn ids(&self) -> impl ExactSizeIterator<Item = TargetId> {
        self.targets.iter().map(|(id, _)| *id)
    }

    /// Begins on the target in this box of this frame. Gives its id, and what a new `Tracker` would say of the frame.
    ///
    /// # Errors
    /// [`Error::BoxShape`], [`Error::BoxOutside`] or [`Error::Frame`]; [`Error::FrameSize`] where the frame has another size than the targets so far
    /// are tracked on. Then nothing has changed.
    pub fn add(
        &mut self,
        frame: &Frame<'_>,
        bbox: BoundingBox,
    ) -> Result<(TargetId, Estimate), Error> {
        let (target, estimate) = self.begin(frame, bbox)?;
        let id = TargetId(self.next);
        self.next = self.next.saturating_add(1);
        self.targets.push((id, target));
        Ok((id, estimate))
    }

    /// Begins anew with a target that there is, on a box of this frame, to correct its track by hand or after a loss.
    ///
    /// # Errors
    /// As [`add`](Self::add), and [`Error::UnknownTarget`].
    pub fn reinit(
        &mut self,
        id: TargetId,
        frame: &Frame<'_>,
        bbox: BoundingBox,
    ) -> Result<Estimate, Error> {
        let place = self.place(id)?;
        let (target, estimate) = self.begin(frame, bbox)?;
        self.targets[place].1 = target;
        Ok(estimate)
    }

    /// Forgets a target.
    ///
    /// # Errors
    /// [`Error::UnknownTarget`] where there is none with this id.
    pub fn remove(&mut self, id: TargetId) -> Result<(), Error> {
        let place = self.place(id)?;
        self.targets.remove(place);
        Ok(())
    }

    /// Finds all targets in the next frame and learns from it; the estimates come in the order of [`ids`](Self::ids). Without targets
    /// there are none.
    ///
    /// # Errors
    /// [`Error::FrameSize`] or [`Error::Frame`] where the frame does not fit, and then all targets are as they were. Nothing can go wrong with one
    /// target alone: one that is lost or outside the frame has an estimate with a low score.
    pub fn update(&mut self, frame: &Frame<'_>) -> Result<Vec<(TargetId, Estimate)>, Error> {
        self.check_size(frame)?;
        self.image.fill(frame)?;
        let threads = rayon::current_num_threads().max(1);
        let run = self.targets.len().div_ceil(threads).max(1);
        let (config, image) = (&self.config, &self.image);
        self.works.resize_with(threads, Work::default);
        let runs = self.targets.par_chunks_mut(run).zip(&mut self.works);
        let estimates = runs.flat_map_iter(|(targets, work)| {
            targets.iter_mut().map(|(id, target)| {
                let mut estimate = Estimate::empty();
                target.step(image, config, &mut *work, None, &mut estimate);
                (*id, estimate)
            })
        });
        Ok(estimates.collect())
    }

    /// Everything that is needed to go on to the same boxes later; see [`Tracker::snapshot`](crate::Tracker::snapshot).
    pub fn snapshot(&self) -> MultiSnapshot {
        let targets = self.targets.iter();
        MultiSnapshot {
            version: VERSION,
            config: self.config.clone(),
            next: self.next,
            targets: targets.map(|(id, target)| (*id, target.memory().clone())).collect(),
        }
    }

    /// A tracker that goes on where the snapshot was taken.
    ///
    /// # Errors
    /// [`Error::Snapshot`] or [`Error::Config`] where the parts do not fit together; [`Error::Instructions`] as in [`MultiTracker::new`].
    pub fn restore(snapshot: MultiSnapshot) -> Result<Self, Error> {
        snapshot.check()?;
        Instructions::chosen()?;
        let MultiSnapshot { config, next, targets, .. } = snapshot;
        let target = |(id, memory)| (id, Target::new(memory, &config));
        let targets = targets.into_iter().map(target).collect();
        Ok(Self::with(config, targets, next))
    }

    fn begin(&mut self, frame: &Frame<'_>, bbox: BoundingBox) -> Result<(Target, Estimate), Error> {
        bbox.check_in(frame.width(), frame.height())?;
        self.check_size(frame)?;
        self.image.fill(frame)?;
        if self.works.is_empty() {
            self.works.push(Work::default());
        }
        Ok(Target::begin(&self.image, bbox, &self.config, &mut self.works[0]))
    }

    /// Refuses frames of another size than the targets began on.
    fn check_size(&self, frame: &Frame<'_>) -> Result<(), Error> {
        match self.targets.first() {
            Some((_, target)) => target.memory().check_size(frame.width(), frame.height()),
            None => Ok(()),
        }
    }

    fn place(&self, id: TargetId) -> Result<usize, Error> {
        let place = self.targets.iter().position(|(known, _)| *known == id);
        place.ok_or_else(|| Error::UnknownTarget {
            id: id.0,
            known: self.ids().map(|id| id.to_string()).collect::<Vec<_>>().join(", "),
        })
    }
}

/// The version of the saved form; raised when the meaning of its fields changes.
const VERSION: u32 = 1;

/// The state of many targets between two frames, made by [`MultiTracker::snapshot`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MultiSnapshot {
    version: u32,
    config: TrackerConfig,
    next: u64,
    targets: Vec<(TargetId, Memory)>,
}

impl MultiSnapshot {
    fn check(&self) -> Result<(), Error> {
        let wrong = |what: String| Err(Error::Snapshot(what));
        if self.version != VERSION {
            return wrong(format!(
                "its version is {}, this program reads version {VERSION}",
                self.version
            ));
        }
        self.config.validate()?;
        // Ids only grow, so those that are in use stand in rising order.
        let ids: Vec<u64> = self.targets.iter().map(|(id, _)| id.0).chain([self.next]).collect();
        if ids[0] == 0 || !ids.is_sorted_by(|a, b| a < b) {
            return wrong(format!("its ids {ids:?} do not rise from 1"));
        }
        for (id, memory) in &self.targets {
            memory.check(&self.config)?;
            if memory.size() != self.targets[0].1.size() {
                return wrong(format!("target {id} is tracked on frames of another size"));
            }
        }
        Ok(())
    }
}
