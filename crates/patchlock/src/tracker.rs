//! One target in one video: frames are checked here, and the method does the rest.

use crate::Error;
use crate::config::TrackerConfig;
use crate::estimate::Estimate;
use crate::method::{Images, Scratch, Target};
use crate::numeric::instructions::Instructions;
use crate::observe::Observer;
use crate::snapshot::Snapshot;
use crate::vision::frame::{Frame, FrameSize};
use crate::vision::geometry::BoundingBox;

/// Follows one target through the frames of a video.
///
/// ```
/// use patchlock::{BoundingBox, Frame, Tracker, TrackerConfig};
///
/// let mut config = TrackerConfig::preset("paper")?;
/// config.patchwise.particles = 50;
/// let mut tracker = Tracker::new(config)?;
/// let pixels: Vec<u8> = (0..120 * 90).map(|k| (k * k % 251) as u8).collect();
/// let frame = Frame::grey8(&pixels, 120, 90)?;
/// tracker.init(&frame, BoundingBox { x: 30.0, y: 20.0, w: 40.0, h: 32.0 })?;
/// let estimate = tracker.update(&frame)?;
/// println!("{:?}, score {:.2}", estimate.bbox, estimate.score);
/// # Ok::<(), patchlock::Error>(())
/// ```
///
/// The work is shared by the `rayon` pool of the caller, so `pool.install(|| tracker.update(&frame))` chooses
/// the number of threads. For the same seed the boxes are the same, bit for bit, on any number of them.
#[derive(Debug)]
pub struct Tracker {
    config: TrackerConfig,
    /// The target, and the size of the frames that it is tracked in.
    target: Option<(FrameSize, Target)>,
    images: Images,
    scratch: Scratch,
}

impl Tracker {
    /// A tracker without a target yet.
    ///
    /// # Errors
    /// [`Error::Config`] names the field that is wrong, its value and what is allowed.
    /// [`Error::Instructions`] where the environment asks for instructions that the processor does not have.
    pub fn new(config: TrackerConfig) -> Result<Self, Error> {
        config.validate()?;
        Instructions::chosen()?;
        Ok(Self { config, target: None, images: Images::default(), scratch: Scratch::default() })
    }

    /// The configuration.
    pub fn config(&self) -> &TrackerConfig {
        &self.config
    }

    /// Begins on the target in this box of this frame. An earlier target is forgotten: the result is what a
    /// new tracker would give.
    ///
    /// # Errors
    /// [`Error::BoxShape`], [`Error::BoxOutside`] or [`Error::Frame`]; then the tracker is unchanged.
    pub fn init(&mut self, frame: &Frame<'_>, bbox: BoundingBox) -> Result<Estimate, Error> {
        let Self { config, target, images, scratch } = self;
        bbox.check_in(frame.width(), frame.height())?;
        images.fill(frame, config.method)?;
        let (begun, estimate) = Target::begin((frame, images), bbox, config, scratch);
        *target = Some((frame.size(), begun));
        Ok(estimate)
    }

    /// Begins again on a box of this frame, to correct the track by hand or after a loss; the same as
    /// [`Tracker::init`].
    ///
    /// # Errors
    /// As [`Tracker::init`].
    pub fn reinit(&mut self, frame: &Frame<'_>, bbox: BoundingBox) -> Result<Estimate, Error> {
        self.init(frame, bbox)
    }

    /// Finds the target in the next frame and learns from it.
    ///
    /// # Errors
    /// [`Error::NotInitialised`] before the first `init`; [`Error::FrameSize`] or [`Error::Frame`] where the
    /// frame does not fit, and then the tracker is unchanged.
    pub fn update(&mut self, frame: &Frame<'_>) -> Result<Estimate, Error> {
        let mut estimate = Estimate::empty();
        self.step(frame, None, &mut estimate)?;
        Ok(estimate)
    }

    /// As [`Tracker::update`], but reuses an estimate from `init` or an earlier frame and the buffers in it.
    /// Nothing else is allocated once all buffers have grown.
    ///
    /// # Errors
    /// As [`Tracker::update`]; then the estimate is unchanged too.
    pub fn update_into(&mut self, frame: &Frame<'_>, estimate: &mut Estimate) -> Result<(), Error> {
        self.step(frame, None, estimate)
    }

    /// As [`Tracker::update`], and shows the observer what happened. The boxes are the same.
    ///
    /// # Errors
    /// As [`Tracker::update`].
    pub fn update_observed(
        &mut self,
        frame: &Frame<'_>,
        observer: &mut dyn Observer,
    ) -> Result<Estimate, Error> {
        let mut estimate = Estimate::empty();
        self.step(frame, Some(observer), &mut estimate)?;
        Ok(estimate)
    }

    /// Everything that is needed to continue to the same boxes later; see [`Snapshot`].
    pub fn snapshot(&self) -> Snapshot {
        let target = self.target.as_ref();
        Snapshot::new(&self.config, target.map(|(size, target)| (*size, target.saved())))
    }

    /// A tracker that continues where the snapshot was taken.
    ///
    /// # Errors
    /// [`Error::Snapshot`] or [`Error::Config`] where the parts do not fit together; [`Error::Instructions`]
    /// as in [`Tracker::new`].
    pub fn restore(snapshot: Snapshot) -> Result<Self, Error> {
        let (config, target) = snapshot.into_parts();
        let mut tracker = Self::new(config)?;
        if let Some((size, saved)) = target {
            tracker.target = Some((size.checked()?, Target::restore(saved, &tracker.config)?));
        }
        Ok(tracker)
    }

    fn step(
        &mut self,
        frame: &Frame<'_>,
        observer: Option<&mut dyn Observer>,
        estimate: &mut Estimate,
    ) -> Result<(), Error> {
        let Self { config, target, images, scratch } = self;
        let (size, target) = target.as_mut().ok_or(Error::NotInitialised)?;
        size.expect(frame.size())?;
        images.fill(frame, config.method)?;
        target.step((frame, images), config, scratch, observer, estimate);
        Ok(())
    }
}
