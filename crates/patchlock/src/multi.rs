//! Many targets in one video. Each is tracked as by a [`Tracker`](crate::Tracker) of its own, to
//! the same boxes, bit for bit, but the frame is converted once, and buffers belong to threads
//! rather than to targets.
//!
//! The targets are split over the threads of the pool in consecutive groups. A thread that has
//! finished its run helps with the candidates of the others, so that all threads have work with
//! fewer targets than threads.

use crate::Error;
use crate::estimate::Estimate;
use crate::methods::{DynTracker, FrameView, TrackerConfig};
use crate::numeric::instructions::Instructions;
use crate::numeric::parallel::*;
use crate::snapshot::{MultiSnapshot, SavedTrack, VERSION};
use crate::target::{self, Images};
use crate::target_id::TargetId;
use crate::target_tracker::Scratch;
use crate::vision::frame::{Frame, FrameSize};
use crate::vision::geometry::BoundingBox;

/// A target of a [`MultiTracker`] in one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct TargetEstimate {
    /// The target.
    pub id: TargetId,
    /// Where it is.
    pub estimate: Estimate,
}

/// Follows many targets through the frames of a video. They come and go at any frame.
///
/// ```
/// use patchlock::{Frame, MultiTracker, Preset};
///
/// let mut tracker = MultiTracker::new(Preset::Robust)?;
/// let pixels: Vec<u8> = (0..120 * 90).map(|k| (k * k % 251) as u8).collect();
/// let frame = Frame::grey8(&pixels, 120, 90)?;
/// let first = tracker.add(&frame, [30.0, 20.0, 40.0, 32.0])?.id;
/// tracker.add(&frame, [70.0, 40.0, 24.0, 24.0])?;
/// for tracked in tracker.update(&frame)? {
///     println!("{}: {:?}", tracked.id, tracked.estimate.bbox);
/// }
/// tracker.remove(first)?;
/// # Ok::<(), patchlock::Error>(())
/// ```
///
/// On a frame where some targets continue and others begin, call [`update`](Self::update) first and
/// [`add`](Self::add) after it. As with a `Tracker`, the `rayon` pool of the caller decides the
/// number of threads, and the boxes do not depend on it. All targets have the same configuration,
/// the seed included.
///
/// A target holds its dictionaries and what follows from them, about 20 MB in the preset `paper`
/// and 1 MB in `robust`, which makes what follows anew for each frame.
/// Buffers for candidates are held once per thread.
#[derive(Debug)]
pub struct MultiTracker {
    config: TrackerConfig,
    targets: Vec<Box<dyn DynTracker>>,
    /// The ids and latest estimates of the targets, in the same order.
    tracked: Vec<TargetEstimate>,
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
    /// [`Error::Config`] names the setting that is wrong, its value and what is allowed.
    /// [`Error::Instructions`] if the environment asks for instructions that the processor does not
    /// have. [`Error::Network`] if the method needs a network and there is none.
    pub fn new(config: impl Into<TrackerConfig>) -> Result<Self, Error> {
        let tracker = Self::empty(config.into())?;
        tracker.config.check_network()?;
        Ok(tracker)
    }

    /// A tracker whose network may be missing.
    fn empty(config: TrackerConfig) -> Result<Self, Error> {
        config.validate()?;
        Instructions::chosen()?;
        Ok(Self {
            config,
            targets: Vec::new(),
            tracked: Vec::new(),
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
        self.tracked.iter().map(|tracked| tracked.id)
    }

    /// The targets in the latest frame, in the order in which they were added.
    pub fn tracked(&self) -> &[TargetEstimate] {
        &self.tracked
    }

    /// Adds the target in this box of this frame. Returns its id and what a
    /// [`Tracker`](crate::Tracker) says of the frame.
    ///
    /// # Errors
    /// [`Error::BoxShape`], [`Error::BoxTooSmall`], [`Error::BoxOutside`] or [`Error::Frame`]; [`Error::FrameSize`] if the
    /// other targets are tracked on frames of another size. Then nothing has changed.
    pub fn add(
        &mut self,
        frame: &Frame<'_>,
        bbox: impl Into<BoundingBox>,
    ) -> Result<&TargetEstimate, Error> {
        let (target, estimate) = self.begin(frame, bbox.into())?;
        let id = TargetId::from(self.next);
        self.next = self.next.saturating_add(1);
        self.targets.push(target);
        self.tracked.push(TargetEstimate { id, estimate });
        Ok(&self.tracked[self.tracked.len() - 1])
    }

    /// Starts again with a known target on a box of this frame, to correct its track or after a
    /// loss.
    ///
    /// # Errors
    /// As [`add`](Self::add), and [`Error::UnknownTarget`].
    pub fn restart(
        &mut self,
        id: TargetId,
        frame: &Frame<'_>,
        bbox: impl Into<BoundingBox>,
    ) -> Result<&Estimate, Error> {
        let index = self.index(id)?;
        (self.targets[index], self.tracked[index].estimate) = self.begin(frame, bbox.into())?;
        Ok(&self.tracked[index].estimate)
    }

    /// Forgets a target.
    ///
    /// # Errors
    /// [`Error::UnknownTarget`] where there is none with this id.
    pub fn remove(&mut self, id: TargetId) -> Result<(), Error> {
        let index = self.index(id)?;
        self.targets.remove(index);
        self.tracked.remove(index);
        Ok(())
    }

    /// Finds all targets in the next frame and learns from it. The targets come in the order in
    /// which they were added. Nothing is allocated once all buffers have grown, except by `rayon`.
    ///
    /// # Errors
    /// [`Error::FrameSize`] or [`Error::Frame`] if the frame does not fit; then all targets are
    /// unchanged. [`Error::Network`] if the runtime of a network fails; then some targets may have
    /// moved. No other error concerns a single target: one that is lost or outside the frame has an
    /// estimate with a low score.
    pub fn update(&mut self, frame: &Frame<'_>) -> Result<&[TargetEstimate], Error> {
        let threads = self.prepare(frame)?;
        let run = self.targets.len().div_ceil(threads).max(1);
        let input = self.images.of(frame);
        let runs = self.targets.par_chunks_mut(run).zip(self.tracked.par_chunks_mut(run));
        runs.zip(&mut self.scratches).try_for_each(|((targets, tracked), scratch)| {
            targets.iter_mut().zip(tracked).try_for_each(|(target, tracked)| {
                target.update(input, scratch, None, &mut tracked.estimate)
            })
        })?;
        Ok(&self.tracked)
    }

    /// As [`update`](Self::update), and shows the observer what happened, target by target, without
    /// threads over targets. The boxes are the same.
    ///
    /// # Errors
    /// As [`update`](Self::update).
    pub fn update_observed(
        &mut self,
        frame: &Frame<'_>,
        observer: &mut dyn FnMut(TargetId, &FrameView<'_>),
    ) -> Result<&[TargetEstimate], Error> {
        self.prepare(frame)?;
        let input = self.images.of(frame);
        let scratch = &mut self.scratches[0];
        for (target, TargetEstimate { id, estimate }) in
            self.targets.iter_mut().zip(&mut self.tracked)
        {
            let mut show = |view: &FrameView<'_>| observer(*id, view);
            target.update(input, scratch, Some(&mut show), estimate)?;
        }
        Ok(&self.tracked)
    }

    /// Everything that is needed to continue to the same boxes later; see [`MultiSnapshot`].
    pub fn snapshot(&self) -> MultiSnapshot {
        let tracks = self.targets.iter().zip(&self.tracked).map(|(target, tracked)| {
            let (target, estimate) = (target.saved(), tracked.estimate.clone());
            (tracked.id, SavedTrack { target, estimate })
        });
        MultiSnapshot {
            version: VERSION,
            config: TrackerConfig { network: None, ..self.config.clone() },
            next: self.next,
            frame_size: self.known_size(),
            tracks: tracks.collect(),
        }
    }

    /// A tracker that continues where the snapshot was taken.
    ///
    /// # Errors
    /// [`Error::Snapshot`] or [`Error::Config`] where the parts do not fit together;
    /// [`Error::Network`] if the snapshot needs a network that it does not have, see
    /// [`MultiSnapshot::with_network`]; [`Error::Instructions`] as in [`MultiTracker::new`].
    pub fn restore(snapshot: MultiSnapshot) -> Result<Self, Error> {
        snapshot.check()?;
        let MultiSnapshot { config, next, frame_size, tracks, .. } = snapshot;
        let mut tracker = Self::empty(config)?;
        tracker.next = next;
        tracker.size = frame_size.map(FrameSize::checked).transpose()?;
        for (id, SavedTrack { target, estimate }) in tracks {
            estimate.check()?;
            tracker.targets.push(target::restore(target, &tracker.config)?);
            tracker.tracked.push(TargetEstimate { id, estimate });
        }
        // A target names the network that it needs, so this is checked after the targets.
        tracker.config.check_network()?;
        Ok(tracker)
    }

    /// Converts a frame and makes scratch memory for each thread. Returns the number of threads.
    fn prepare(&mut self, frame: &Frame<'_>) -> Result<usize, Error> {
        self.check_size(frame)?;
        self.images.fill(frame, &self.config.method)?;
        let threads = current_num_threads().max(1);
        self.scratches.resize_with(threads, Scratch::default);
        Ok(threads)
    }

    fn begin(
        &mut self,
        frame: &Frame<'_>,
        bbox: BoundingBox,
    ) -> Result<(Box<dyn DynTracker>, Estimate), Error> {
        bbox.check_in(frame.width(), frame.height())?;
        self.check_size(frame)?;
        self.images.fill(frame, &self.config.method)?;
        if self.scratches.is_empty() {
            self.scratches.push(Scratch::default());
        }
        self.size = Some(frame.size());
        target::begin(self.images.of(frame), bbox, &self.config, &mut self.scratches[0])
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
        let index = self.tracked.iter().position(|tracked| tracked.id == id);
        index.ok_or_else(|| Error::UnknownTarget {
            id: id.number(),
            known: self.ids().map(|id| id.to_string()).collect::<Vec<_>>().join(", "),
        })
    }
}
