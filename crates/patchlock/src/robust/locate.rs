//! The filter that tracks: from the place on the last frame to the one on this frame, whose rotation
//! and size are then measured.

use super::colours::Colours;
use super::follower::Follower;
use super::hypothesis::Hypothesis;
use super::memory::Memory;
use super::place::Place;
use super::size::Size;
use super::turn::{Rotation, SavedTurning};
use super::window::{Sample, SampleBuffers, Window};
use crate::config::RobustConfig;
use crate::correlation::filter::FilterScratch;
use crate::correlation::histogram::{Histograms, MapScratch};
use crate::correlation::response::ResponseBuffers;
use crate::correlation::rotation::RotationScratch;
use crate::correlation::scale::{SavedScale, ScaleScratch};
use crate::numeric::saved_numbers::SavedNumbers;
use crate::vision::frame::Frame;
use serde::{Deserialize, Serialize};

/// The filter that learns on every frame, and the target's colours.
#[derive(Debug)]
pub(crate) struct Locator {
    follower: Follower,
    colours: Colours,
    rotation: Rotation,
    size: Size,
}

/// A locator as a snapshot holds it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct SavedLocator {
    follower: SavedNumbers,
    colours: Histograms,
    rotation: SavedTurning,
    size: SavedScale,
}

/// The buffers of a locator.
#[derive(Debug, Default)]
pub(crate) struct LocatorScratch {
    pub follower: ResponseBuffers,
    pub memory: ResponseBuffers,
    map: MapScratch,
    filter: FilterScratch,
    rotation: RotationScratch,
    size: ScaleScratch,
}

/// What a place is located in: a frame, the window that cuts samples from it, and the memory.
#[derive(Clone, Copy)]
pub(crate) struct Setting<'a> {
    pub frame: &'a Frame<'a>,
    pub window: &'a Window,
    pub memory: &'a Memory,
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
        Self {
            follower: Follower::begin(sample, config, &mut scratch.filter),
            colours: Colours::begin(sample, config, &mut scratch.map),
            rotation: Rotation::begin(frame, region, config, &mut scratch.rotation),
            size: Size::begin(frame, region, window, config, &mut scratch.size),
        }
    }

    /// As a snapshot holds it.
    pub fn saved(&self) -> SavedLocator {
        SavedLocator {
            follower: self.follower.saved(),
            colours: self.colours.saved(),
            rotation: self.rotation.saved(),
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
        let SavedLocator { follower, colours, rotation, size } = saved;
        Ok(Self {
            follower: Follower::restore(follower, window, config)?,
            colours: Colours::restore(colours, config)?,
            rotation: Rotation::restore(rotation, config)?,
            size: Size::restore(size, window, config)?,
        })
    }

    /// The filter that follows.
    pub fn filter(&self) -> &[f32] {
        self.follower.filter()
    }

    /// How well colour tells the target from what is around it: from -1, through 0, not at all, to
    /// 1.
    pub fn contrast(&self) -> f64 {
        self.colours.contrast()
    }

    /// The target's place in a frame, from its last one.
    pub fn locate(
        &mut self,
        setting: Setting<'_>,
        last: Place,
        sample: &mut SampleBuffers,
        scratch: &mut LocatorScratch,
    ) -> Place {
        let followed = self.follow(setting, last, sample, scratch);
        let place = self.turned(setting, followed, sample, scratch);
        let place = self.size.measured(setting.frame, place, &mut scratch.size);
        setting.window.keep(place, setting.frame)
    }

    /// The place that was followed, with another rotation if one is measured to which follower and
    /// memory respond clearly stronger.
    fn turned(
        &mut self,
        setting: Setting<'_>,
        followed: Hypothesis,
        sample: &mut SampleBuffers,
        scratch: &mut LocatorScratch,
    ) -> Place {
        let place = followed.place;
        let (region, mean) = (place.region(setting.window.base()), setting.memory.mean());
        let (measured, rotation) = ((&followed, mean), &mut scratch.rotation);
        let suggestion = self.rotation.suggest(setting.frame, region, measured, rotation);
        let Some(suggestion) = suggestion else { return place };
        let turned =
            suggestion.places(place).map(|place| self.follow(setting, place, sample, scratch));
        let Some(accepted) = suggestion.accept(&followed, turned) else { return place };
        self.rotation.begin_turning();
        accepted.place
    }

    /// Where the follower responds strongest in the window around a place.
    fn follow(
        &self,
        setting: Setting<'_>,
        around: Place,
        sample: &mut SampleBuffers,
        scratch: &mut LocatorScratch,
    ) -> Hypothesis {
        let LocatorScratch { follower, memory, map, .. } = scratch;
        let sample = setting.window.sample(setting.frame, around, sample);
        let known = setting.memory.respond(&sample, memory);
        let map = self.colours.map(&sample, setting.memory.mean(), map);
        self.follower.propose(&sample, map, known, follower)
    }

    /// Begins again with what the memory knows.
    pub fn restart(&mut self, memory: &Memory) {
        self.follower.restart(memory.filter());
    }

    /// Learns the target in the middle of a sample of this frame; its size only where that is
    /// sound.
    pub fn learn(
        &mut self,
        frame: &Frame<'_>,
        sample: &Sample<'_>,
        learns_size: bool,
        scratch: &mut LocatorScratch,
    ) {
        let region = sample.region();
        self.follower.learn(sample, &mut scratch.filter);
        self.colours.learn(sample, &mut scratch.map);
        self.rotation.learn(frame, region, &mut scratch.rotation);
        if learns_size {
            self.size.learn(frame, region, &mut scratch.size);
        }
    }
}
