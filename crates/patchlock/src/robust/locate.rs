//! The filter that tracks: from the place on the last frame to the one on this frame, whose rotation
//! and size are then measured.

use super::camera::{CameraBuffers, CameraRotation, MARGIN};
use super::colours;
use super::hypothesis::Hypothesis;
use super::memory::Memory;
use super::pose::Pose;
use super::rotation::{RotationEstimator, SavedRotationEstimator};
use super::tracking_filter;
use super::window::{Sample, SampleBuffers, Window};
use crate::config::RobustConfig;
use crate::correlation::filter::{FilterLearner, FilterScratch};
use crate::correlation::histogram::{Histograms, MapScratch, Rates};
use crate::correlation::response::ResponseBuffers;
use crate::correlation::rotation::RotationScratch;
use crate::correlation::scale::{SavedScale, ScaleFilter, ScaleFilterParams, ScaleScratch};
use crate::numeric::saved_numbers::SavedNumbers;
use crate::vision::frame::Frame;
use serde::{Deserialize, Serialize};

/// The filter that learns on every frame, and the target's colours.
#[derive(Debug)]
pub(crate) struct Locator {
    learner: FilterLearner,
    /// The filter that follows: its cells inside the window's mask, a twentieth of its spectra.
    filter: Vec<f32>,
    colours: Histograms,
    rotation: RotationEstimator,
    camera: CameraRotation,
    size: ScaleFilter,
}

/// A locator as a snapshot holds it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct SavedLocator {
    tracking_filter: SavedNumbers,
    colours: Histograms,
    rotation: SavedRotationEstimator,
    camera: CameraRotation,
    size: SavedScale,
}

/// The buffers of a locator.
#[derive(Debug, Default)]
pub(crate) struct LocatorScratch {
    pub tracking_filter: ResponseBuffers,
    pub memory: ResponseBuffers,
    map: MapScratch,
    filter: FilterScratch,
    rotation: RotationScratch,
    camera: CameraBuffers,
    size: ScaleScratch,
}

/// What a place is located in: a frame, the window that cuts samples from it, and the memory; and by
/// which settings.
#[derive(Clone, Copy)]
pub(crate) struct FrameContext<'a> {
    pub frame: &'a Frame<'a>,
    pub window: &'a Window,
    pub memory: &'a Memory,
    pub config: &'a RobustConfig,
}

impl FrameContext<'_> {
    /// The place, moved into the frame and limited in size.
    pub fn keep(&self, pose: Pose) -> Pose {
        pose.kept_within(self.frame.size(), self.window.base(), self.config.least_side)
    }
}

impl Locator {
    /// Filters and colours that have learnt the target in the middle of a sample of this frame.
    pub fn begin(
        frame: &Frame<'_>,
        sample: &Sample<'_>,
        config: &RobustConfig,
        scratch: &mut LocatorScratch,
    ) -> Self {
        let (region, window, scale) = (sample.region(), sample.window, scale_params(config));
        let learner = tracking_filter::learner(window, config);
        Self {
            filter: learner.begin(window.fourier(), sample.spectra, &mut scratch.filter),
            learner,
            colours: Histograms::begin(sample.patch, window.pixels(), &mut scratch.map),
            rotation: RotationEstimator::begin(frame, region, config, &mut scratch.rotation),
            camera: CameraRotation::begin(frame, config.rotate, &mut scratch.camera),
            size: ScaleFilter::begin(frame, window.planes(), region, scale, &mut scratch.size),
        }
    }

    /// As a snapshot holds it.
    pub fn saved(&self) -> SavedLocator {
        SavedLocator {
            tracking_filter: SavedNumbers::of(&self.filter),
            colours: self.colours.clone(),
            rotation: self.rotation.saved(),
            camera: self.camera.clone(),
            size: self.size.saved(),
        }
    }

    /// From a snapshot.
    ///
    /// # Errors
    /// What is damaged, or does not fit the configuration.
    pub fn restore(
        saved: SavedLocator,
        window: &Window,
        config: &RobustConfig,
    ) -> Result<Self, &'static str> {
        let SavedLocator { tracking_filter, colours, rotation, camera, size } = saved;
        if !camera.is_sound() || camera.follows() != config.rotate {
            return Err("the rotation of the camera is damaged");
        }
        let filter = tracking_filter.restore(window.filter()).ok_or("the filter is damaged")?;
        if !colours.is_sound() {
            return Err("the histograms of colours are damaged");
        }
        Ok(Self {
            learner: tracking_filter::learner(window, config),
            filter,
            colours,
            rotation: RotationEstimator::restore(rotation)?,
            camera,
            size: ScaleFilter::restore(size, window.base(), scale_params(config))?,
        })
    }

    /// The filter that follows.
    pub fn filter(&self) -> &[f32] {
        &self.filter
    }

    /// How well colour tells the target from what is around it: from -1, through 0, not at all, to
    /// 1.
    pub fn contrast(&self) -> f64 {
        self.colours.contrast().into()
    }

    /// The target's place in a frame, from its last one.
    pub fn locate(
        &mut self,
        context: FrameContext<'_>,
        last: Pose,
        sample: &mut SampleBuffers,
        scratch: &mut LocatorScratch,
    ) -> Pose {
        let followed = self.follow(context, last, sample, scratch);
        let followed = self.turned_with_camera(context, followed, sample, scratch);
        let pose = self.turned(context, followed, sample, scratch);
        let FrameContext { frame, window, .. } = context;
        let region = pose.region(window.base());
        let factor = self.size.find(frame, window.planes(), region, &mut scratch.size);
        context.keep(Pose { scale: pose.scale * factor, ..pose })
    }

    /// The hypothesis turned with the camera, if tracking filter and memory respond stronger to it.
    fn turned_with_camera(
        &mut self,
        context: FrameContext<'_>,
        followed: Hypothesis,
        sample: &mut SampleBuffers,
        scratch: &mut LocatorScratch,
    ) -> Hypothesis {
        let Some(turned) = self.camera.advance(context.frame, &mut scratch.camera) else {
            return followed;
        };
        let pose = Pose { rotation: followed.pose.rotation + turned, ..followed.pose };
        let turned = self.follow(context, pose, sample, scratch);
        if turned.support() > MARGIN * followed.support() { turned } else { followed }
    }

    /// The place that was followed, with another rotation if one is measured to which tracking filter and
    /// memory respond clearly stronger.
    fn turned(
        &mut self,
        context: FrameContext<'_>,
        followed: Hypothesis,
        sample: &mut SampleBuffers,
        scratch: &mut LocatorScratch,
    ) -> Pose {
        let pose = followed.pose;
        let suggestion = self.rotation.suggest(context, &followed, &mut scratch.rotation);
        let Some(suggestion) = suggestion else { return pose };
        let turned = suggestion.poses(pose).map(|pose| self.follow(context, pose, sample, scratch));
        let Some(accepted) = suggestion.accept(&followed, turned) else { return pose };
        self.rotation.begin_turning(context.config);
        accepted.pose
    }

    /// Where the tracking filter responds strongest in the window around a place.
    fn follow(
        &self,
        context: FrameContext<'_>,
        around: Pose,
        sample: &mut SampleBuffers,
        scratch: &mut LocatorScratch,
    ) -> Hypothesis {
        let LocatorScratch { tracking_filter: response, memory, map, .. } = scratch;
        let sample = context.window.sample(context.frame, around, sample);
        let known = context.memory.respond(&sample, memory);
        let map = colours::map(&self.colours, &sample, context, map);
        tracking_filter::propose(&self.filter, &sample, map, known, response)
    }

    /// Begins again with what the memory knows.
    pub fn restart(&mut self, memory: &Memory) {
        self.filter.copy_from_slice(memory.filter());
    }

    /// Learns the target in the middle of a sample of this frame; its size only where that is
    /// sound.
    pub fn learn(
        &mut self,
        frame: &Frame<'_>,
        sample: &Sample<'_>,
        (config, learns_size): (&RobustConfig, bool),
        scratch: &mut LocatorScratch,
    ) {
        let (region, &Sample { window, patch, spectra, .. }) = (sample.region(), sample);
        let fourier = window.fourier();
        self.learner.learn(fourier, spectra, &mut self.filter, &mut scratch.filter);
        let (target, around) = (config.colour_rate as f32, config.around_rate as f32);
        self.colours.learn(patch, window.pixels(), Rates { target, around }, &mut scratch.map);
        self.rotation.learn(frame, region, config, &mut scratch.rotation);
        if learns_size {
            self.size.update(frame, window.planes(), region, &mut scratch.size);
        }
    }
}

fn scale_params(config: &RobustConfig) -> ScaleFilterParams {
    ScaleFilterParams {
        scales: config.scale_count,
        step: config.scale_step,
        sigma: config.scale_label_width * (config.scale_count as f64).sqrt(),
        rate: config.scale_rate,
        area: config.scale_area,
    }
}
