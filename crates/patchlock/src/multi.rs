//! Many targets in one video. Each is tracked as by a [`Tracker`](crate::Tracker) of its own, to the same
//! boxes, bit for bit, but the frame is converted once, and buffers belong to threads rather than to targets.
//!
//! The targets are split over the threads of the pool in consecutive groups. A thread that has finished its
//! run helps with the candidates of the others, so that all threads have work with fewer targets than
//! threads.

use crate::Error;
use crate::config::TrackerConfig;
use crate::estimate::Estimate;
use crate::method::{Images, Scratch, Target};
use crate::numeric::instructions::Instructions;
use crate::snapshot::{MultiParts, MultiSnapshot};
use crate::target_id::TargetId;
use crate::vision::frame::{Frame, FrameSize};
use crate::vision::geometry::BoundingBox;
use rayon::prelude::*;

/// Follows many targets through the frames of a video. They come and go at any frame.
///
/// ```
/// use patchlock::{BoundingBox, Frame, MultiTracker, TrackerConfig};
///
/// let mut config = TrackerConfig::preset("paper")?;
/// config.patchwise.particles = 50;
/// let mut tracker = MultiTracker::new(config)?;
/// let pixels: Vec<u8> = (0..120 * 90).map(|k| (k * k % 251) as u8).collect();
/// let frame = Frame::grey8(&pixels, 120, 90)?;
/// let (first, _) = tracker.add(&frame, BoundingBox { x: 30.0, y: 20.0, w: 40.0, h: 32.0 })?;
/// tracker.add(&frame, BoundingBox { x: 70.0, y: 40.0, w: 24.0, h: 24.0 })?;
/// for (id, estimate) in tracker.update(&frame)? {
///     println!("{id}: {:?}, score {:.2}", estimate.bbox, estimate.score);
/// }
/// tracker.remove(first)?;
/// # Ok::<(), patchlock::Error>(())
/// ```
///
/// On a frame where some targets continue and others begin, call [`update`](Self::update) first and
/// [`add`](Self::add) after it. As with a `Tracker`, the `rayon` pool of the caller decides the number of
/// threads, and the boxes do not depend on it. All targets have the same configuration, the seed included.
///
/// A target holds its dictionaries and what follows from them, about 20 MB in the preset `paper`. Buffers for
/// candidates are held once per thread.
#[derive(Debug)]
pub struct MultiTracker {
    config: TrackerConfig,
    targets: Vec<(TargetId, Target)>,
    next: u64,
    /// The size of the frames that the targets are tracked in.
    size: Option<FrameSize>,
    images: Images,
    /// One for each thread.
    scratches: Vec<Scratch>,
}

impl MultiTracker {
    /// A tracker without targets yet.
    ///
    /// # Errors
    /// As [`Tracker::new`](crate::Tracker::new).
    pub fn new(config: TrackerConfig) -> Result<Self, Error> {
        config.validate()?;
        Instructions::chosen()?;
        Ok(Self {
            config,
            targets: Vec::new(),
            next: 1,
            size: None,
            images: Images::default(),
            scratches: Vec::new(),
        })
    }

    /// The configuration of all targets.
    pub fn config(&self) -> &TrackerConfig {
        &self.config
    }

    /// The targets, in the order in which they were added.
    pub fn ids(&self) -> impl ExactSizeIterator<Item = TargetId> {
        self.targets.iter().map(|(id, _)| *id)
    }

    /// Begins on the target in this box of this frame. Returns its id, and what a new `Tracker` would say of
    /// the frame.
    ///
    /// # Errors
    /// [`Error::BoxShape`], [`Error::BoxOutside`] or [`Error::Frame`]; [`Error::FrameSize`] where the other
    /// targets are tracked on frames of another size. Then nothing has changed.
    pub fn add(
        &mut self,
        frame: &Frame<'_>,
        bbox: BoundingBox,
    ) -> Result<(TargetId, Estimate), Error> {
        let (target, estimate) = self.begin(frame, bbox)?;
        let id = TargetId::from(self.next);
        self.next = self.next.saturating_add(1);
        self.targets.push((id, target));
        Ok((id, estimate))
    }

    /// Begins again with a known target on a box of this frame, to correct its track by hand or after a loss.
    ///
    /// # Errors
    /// As [`add`](Self::add), and [`Error::UnknownTarget`].
    pub fn reinit(
        &mut self,
        id: TargetId,
        frame: &Frame<'_>,
        bbox: BoundingBox,
    ) -> Result<Estimate, Error> {
        let index = self.index(id)?;
        let (target, estimate) = self.begin(frame, bbox)?;
        self.targets[index].1 = target;
        Ok(estimate)
    }

    /// Forgets a target.
    ///
    /// # Errors
    /// [`Error::UnknownTarget`] where there is none with this id.
    pub fn remove(&mut self, id: TargetId) -> Result<(), Error> {
        let index = self.index(id)?;
        self.targets.remove(index);
        Ok(())
    }

    /// Finds all targets in the next frame and learns from it. The estimates come in the order of
    /// [`ids`](Self::ids); without targets there are none.
    ///
    /// # Errors
    /// [`Error::FrameSize`] or [`Error::Frame`] where the frame does not fit, and then all targets are
    /// unchanged. No error concerns a single target: one that is lost or outside the frame has an estimate
    /// with a low score.
    pub fn update(&mut self, frame: &Frame<'_>) -> Result<Vec<(TargetId, Estimate)>, Error> {
        self.check_size(frame)?;
        self.images.fill(frame, self.config.method)?;
        let threads = rayon::current_num_threads().max(1);
        let run = self.targets.len().div_ceil(threads).max(1);
        let (config, images) = (&self.config, &self.images);
        self.scratches.resize_with(threads, Scratch::default);
        let runs = self.targets.par_chunks_mut(run).zip(&mut self.scratches);
        let estimates = runs.flat_map_iter(|(targets, scratch)| {
            targets.iter_mut().map(|(id, target)| {
                let mut estimate = Estimate::empty();
                target.step((frame, images), config, &mut *scratch, None, &mut estimate);
                (*id, estimate)
            })
        });
        Ok(estimates.collect())
    }

    /// Everything that is needed to continue to the same boxes later; see [`MultiSnapshot`].
    pub fn snapshot(&self) -> MultiSnapshot {
        let targets = self.targets.iter().map(|(id, target)| (*id, target.saved())).collect();
        MultiSnapshot::new(MultiParts {
            config: self.config.clone(),
            next: self.next,
            frame_size: self.known_size(),
            targets,
        })
    }

    /// A tracker that continues where the snapshot was taken.
    ///
    /// # Errors
    /// [`Error::Snapshot`] or [`Error::Config`] where the parts do not fit together; [`Error::Instructions`]
    /// as in [`MultiTracker::new`].
    pub fn restore(snapshot: MultiSnapshot) -> Result<Self, Error> {
        let MultiParts { config, next, frame_size, targets } = snapshot.into_parts()?;
        let mut tracker = Self::new(config)?;
        tracker.next = next;
        tracker.size = frame_size.map(FrameSize::checked).transpose()?;
        for (id, saved) in targets {
            tracker.targets.push((id, Target::restore(saved, &tracker.config)?));
        }
        Ok(tracker)
    }

    fn begin(&mut self, frame: &Frame<'_>, bbox: BoundingBox) -> Result<(Target, Estimate), Error> {
        bbox.check_in(frame.width(), frame.height())?;
        self.check_size(frame)?;
        self.images.fill(frame, self.config.method)?;
        if self.scratches.is_empty() {
            self.scratches.push(Scratch::default());
        }
        self.size = Some(frame.size());
        Ok(Target::begin((frame, &self.images), bbox, &self.config, &mut self.scratches[0]))
    }

    /// The size of the frames, while there are targets.
    fn known_size(&self) -> Option<FrameSize> {
        self.size.filter(|_| !self.targets.is_empty())
    }

    /// Refuses frames of another size than the targets began on.
    fn check_size(&self, frame: &Frame<'_>) -> Result<(), Error> {
        self.known_size().map_or(Ok(()), |size| size.expect(frame.size()))
    }

    fn index(&self, id: TargetId) -> Result<usize, Error> {
        let index = self.targets.iter().position(|(known, _)| *known == id);
        index.ok_or_else(|| Error::UnknownTarget {
            id: id.number(),
            known: self.ids().map(|id| id.to_string()).collect::<Vec<_>>().join(", "),
        })
    }
}
