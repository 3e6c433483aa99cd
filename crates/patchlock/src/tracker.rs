//! One target in one video: frames are checked here, and the method does the rest.

use crate::Error;
use crate::estimate::Estimate;
use crate::methods::{DynTracker, Observer, TrackerConfig};
use crate::numeric::instructions::Instructions;
use crate::snapshot::{SavedTrack, Snapshot, VERSION};
use crate::target::{self, Images};
use crate::target_tracker::Scratch;
use crate::vision::frame::{Frame, FrameSize};
use crate::vision::geometry::BoundingBox;

/// Follows one target through the frames of a video.
///
/// ```
/// use patchlock::{Frame, Preset, Tracker};
///
/// let pixels: Vec<u8> = (0..120 * 90).map(|k| (k * k % 251) as u8).collect();
/// let frame = Frame::grey8(&pixels, 120, 90)?;
/// let mut tracker = Tracker::start(Preset::Robust, &frame, [30.0, 20.0, 40.0, 32.0])?;
/// let estimate = tracker.update(&frame)?;
/// println!("{:?}, {}, score {:.2}", estimate.bbox, estimate.status, estimate.score);
/// # Ok::<(), patchlock::Error>(())
/// ```
///
/// The work is shared by the `rayon` pool of the caller, so `pool.install(||
/// tracker.update(&frame))` chooses the number of threads. For the same seed the boxes are the
/// same, bit for bit, on any number of them.
#[derive(Debug)]
pub struct Tracker {
    config: TrackerConfig,
    /// The size of the frames that the target is tracked in.
    size: FrameSize,
    target: Box<dyn DynTracker>,
    estimate: Estimate,
    images: Images,
    scratch: Scratch,
}

impl Tracker {
    /// A tracker that follows the target in this box of this frame. A
    /// [`Preset`](crate::Preset) is a configuration, too, and `[x, y, w, h]` a box.
    ///
    /// # Errors
    /// [`Error::Config`] names the setting that is wrong, its value and what is allowed.
    /// [`Error::BoxShape`], [`Error::BoxTooSmall`], [`Error::BoxOutside`] or [`Error::Frame`]. [`Error::Instructions`] if
    /// the environment asks for instructions that the processor does not have. [`Error::Network`] if
    /// the method needs a network and there is none.
    pub fn start(
        config: impl Into<TrackerConfig>,
        frame: &Frame<'_>,
        bbox: impl Into<BoundingBox>,
    ) -> Result<Self, Error> {
        Self::begin(config.into(), frame, bbox.into())
    }

    fn begin(config: TrackerConfig, frame: &Frame<'_>, bbox: BoundingBox) -> Result<Self, Error> {
        config.validate()?;
        config.check_network()?;
        Instructions::chosen()?;
        bbox.check_in(frame.width(), frame.height())?;
        let (mut images, mut scratch) = (Images::default(), Scratch::default());
        images.fill(frame, &config.method)?;
        let (target, estimate) = target::begin(images.of(frame), bbox, &config, &mut scratch)?;
        Ok(Self { config, size: frame.size(), target, estimate, images, scratch })
    }

    /// Starts again on a box of this frame, which may have another size, with the same
    /// configuration. The result is that of a new tracker, without allocating its buffers again.
    ///
    /// # Errors
    /// [`Error::BoxShape`], [`Error::BoxTooSmall`], [`Error::BoxOutside`] or [`Error::Frame`]; then the tracker is
    /// unchanged.
    pub fn restart(
        &mut self,
        frame: &Frame<'_>,
        bbox: impl Into<BoundingBox>,
    ) -> Result<&Estimate, Error> {
        let Self { config, images, scratch, .. } = self;
        let bbox = bbox.into();
        bbox.check_in(frame.width(), frame.height())?;
        images.fill(frame, &config.method)?;
        (self.target, self.estimate) = target::begin(images.of(frame), bbox, config, scratch)?;
        self.size = frame.size();
        Ok(&self.estimate)
    }

    /// The configuration.
    pub fn config(&self) -> &TrackerConfig {
        &self.config
    }

    /// The estimate in the latest frame.
    pub fn estimate(&self) -> &Estimate {
        &self.estimate
    }

    /// Finds the target in the next frame and learns from it. Nothing is allocated once all buffers
    /// have grown.
    ///
    /// # Errors
    /// [`Error::FrameSize`] or [`Error::Frame`] if the frame does not fit; then the tracker is
    /// unchanged. [`Error::Network`] if the runtime of a network fails; then the method `network` is
    /// unchanged, but `robust` may have used the frame in part: restore a snapshot or start again.
    pub fn update(&mut self, frame: &Frame<'_>) -> Result<&Estimate, Error> {
        self.step(frame, None)
    }

    /// As [`Tracker::update`], and shows the observer what happened. The boxes are the same.
    ///
    /// # Errors
    /// As [`Tracker::update`].
    pub fn update_observed(
        &mut self,
        frame: &Frame<'_>,
        observer: &mut dyn Observer,
    ) -> Result<&Estimate, Error> {
        self.step(frame, Some(observer))
    }

    /// Everything that is needed to continue to the same boxes later; see [`Snapshot`].
    pub fn snapshot(&self) -> Snapshot {
        let track = SavedTrack { target: self.target.saved(), estimate: self.estimate.clone() };
        // A network is a file of its own, which the text of a snapshot does not hold.
        let config = TrackerConfig { network: None, ..self.config.clone() };
        Snapshot { version: VERSION, config, frame_size: self.size, track }
    }

    /// A tracker that continues where the snapshot was taken.
    ///
    /// # Errors
    /// [`Error::Snapshot`] or [`Error::Config`] if the parts do not fit together; [`Error::Network`]
    /// if the snapshot needs a network that it does not have, see [`Snapshot::with_network`];
    /// [`Error::Instructions`] as in [`Tracker::start`].
    pub fn restore(snapshot: Snapshot) -> Result<Self, Error> {
        let Snapshot { config, frame_size: size, track, .. } = snapshot;
        let SavedTrack { target, estimate } = track;
        config.validate()?;
        estimate.check()?;
        Instructions::chosen()?;
        let target = target::restore(target, &config)?;
        let (images, scratch) = (Images::default(), Scratch::default());
        Ok(Self { config, size: size.checked()?, target, estimate, images, scratch })
    }

    fn step(
        &mut self,
        frame: &Frame<'_>,
        observer: Option<&mut dyn Observer>,
    ) -> Result<&Estimate, Error> {
        let Self { config, size, target, estimate, images, scratch } = self;
        size.expect(frame.size())?;
        images.fill(frame, &config.method)?;
        target.update(images.of(frame), scratch, observer, estimate)?;
        Ok(estimate)
    }
}
