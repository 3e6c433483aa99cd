//! The filter that tracks: from the place on the last frame to the one on this frame, whose rotation
//! and size are then measured.

use super::RobustConfig;
use super::camera::{CameraBuffers, CameraRotation, MARGIN};
use super::colours;
use super::hypothesis::Hypothesis;
use super::memory::Memory;
use super::pose::Pose;
use super::rotation::RotationEstimator;
use super::tracking_filter;
use super::window::{Sample, SampleBuffers, Window};
use crate::correlation::filter::{FilterLearner, FilterScratch};
use crate::correlation::histogram::{Histograms, MapScratch, Rates};
use crate::correlation::response::ResponseBuffers;
use crate::correlation::rotation::{RotationLearner, RotationScratch};
use crate::correlation::scale::{ScaleFilterParams, ScaleLearner, ScaleScratch};
use crate::correlation::spectral_filter::SpectralFilter;
use crate::numeric::numbers::Numbers;
use crate::vision::frame::Frame;
use serde::{Deserialize, Serialize};

/// The filter that learns on every frame, and the target's colours.
#[derive(Debug)]
pub(crate) struct Locator {
    learners: Learners,
    state: LocatorState,
}

/// All of a locator that changes from frame to frame, which is what a snapshot holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct LocatorState {
    /// The filter that follows: its cells inside the window's mask, a twentieth of its spectra.
    tracking_filter: Numbers,
    colours: Histograms,
    rotation: RotationEstimator,
    camera: CameraRotation,
    size: SpectralFilter,
}

/// What the filters learn with.
#[derive(Debug)]
struct Learners {
    tracking_filter: FilterLearner,
    rotation: RotationLearner,
    size: ScaleLearner,
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

impl Learners {
    fn new(window: &Window, config: &RobustConfig) -> Self {
        let scale = ScaleFilterParams {
            scales: config.scale_count,
            step: config.scale_step,
            sigma: config.scale_label_width * (config.scale_count as f64).sqrt(),
            area: config.scale_area,
        };
        Self {
            tracking_filter: tracking_filter::learner(window, config),
            rotation: RotationLearner::default(),
            size: ScaleLearner::new(window.base(), window.planes(), scale),
        }
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
        let (region, window) = (sample.region(), sample.window);
        let learners = Learners::new(window, config);
        let Learners { tracking_filter, rotation, size } = &learners;
        let filter = tracking_filter.begin(window.fourier(), sample.spectra, &mut scratch.filter);
        let state = LocatorState {
            tracking_filter: filter.into(),
            colours: Histograms::begin(sample.patch, window.pixels(), &mut scratch.map),
            rotation: RotationEstimator::of(
                rotation.begin(frame, region, &mut scratch.rotation),
                config,
            ),
            camera: CameraRotation::begin(frame, config.rotate, &mut scratch.camera),
            size: size.begin(frame, region, &mut scratch.size),
        };
        Self { learners, state }
    }

    /// As a snapshot holds it.
    pub fn saved(&self) -> LocatorState {
        self.state.clone()
    }

    /// From a snapshot.
    ///
    /// # Errors
    /// What is damaged, or does not fit the configuration.
    pub fn restore(
        state: LocatorState,
        window: &Window,
        config: &RobustConfig,
    ) -> Result<Self, &'static str> {
        if !state.camera.is_sound() || state.camera.follows() != config.rotate {
            return Err("the rotation of the camera is damaged");
        }
        if !state.tracking_filter.is_sound(window.filter()) {
            return Err("the filter is damaged");
        }
        if !state.colours.is_sound() {
            return Err("the histograms of colours are damaged");
        }
        let learners = Learners::new(window, config);
        state.rotation.check(&learners.rotation)?;
        if !learners.size.fits(&state.size) {
            return Err("the scale filter is damaged, or does not fit the configuration");
        }
        Ok(Self { learners, state })
    }

    /// The filter that follows.
    pub fn filter(&self) -> &[f32] {
        &self.state.tracking_filter
    }

    /// How well colour tells the target from what is around it: from -1, through 0, not at all, to
    /// 1.
    pub fn contrast(&self) -> f64 {
        self.state.colours.contrast().into()
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
        let (Learners { size, .. }, region) = (&self.learners, pose.region(context.window.base()));
        let factor = size.find(&self.state.size, context.frame, region, &mut scratch.size);
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
        let Some(turned) = self.state.camera.advance(context.frame, &mut scratch.camera) else {
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
        let (Self { learners, state }, rotation) = (&mut *self, &mut scratch.rotation);
        let suggestion = state.rotation.suggest(&learners.rotation, context, &followed, rotation);
        let Some(suggestion) = suggestion else { return pose };
        let turned = suggestion.poses(pose).map(|pose| self.follow(context, pose, sample, scratch));
        let Some(accepted) = suggestion.accept(&followed, turned) else { return pose };
        self.state.rotation.begin_turning(context.config);
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
        let map = colours::map(&self.state.colours, &sample, context, map);
        tracking_filter::propose(&self.state.tracking_filter, &sample, map, known, response)
    }

    /// Begins again with what the memory knows.
    pub fn restart(&mut self, memory: &Memory) {
        self.state.tracking_filter.copy_from_slice(memory.filter());
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
        let Self { learners: Learners { tracking_filter, rotation, size }, state } = self;
        let filter = &mut state.tracking_filter;
        tracking_filter.learn(window.fourier(), spectra, filter, &mut scratch.filter);
        let (target, around) = (config.colour_rate as f32, config.around_rate as f32);
        state.colours.learn(patch, window.pixels(), Rates { target, around }, &mut scratch.map);
        state.rotation.learn(rotation, frame, region, config, &mut scratch.rotation);
        if learns_size {
            let rate = config.scale_rate as f32;
            size.learn(&mut state.size, frame, region, rate, &mut scratch.size);
        }
    }
}
