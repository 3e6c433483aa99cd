//! A target between two frames, as a snapshot holds it.

use super::follow::Follower;
use super::place::{Place, Window};
use super::status::Phase;
use super::turn::{Rotation, SavedTurning};
use super::visible::Visible;
use super::{Target, size};
use crate::config::TrackerConfig;
use crate::correlation::fhog::CELL;
use crate::correlation::fourier::{Complex32, smooth_side};
use crate::correlation::histogram::Histograms;
use crate::correlation::scale::{SavedScale, ScaleFilter};
use crate::patch_model::memory::PatchMemory;
use crate::patch_model::model::PatchModel;
use crate::vision::geometry::MAX_SIDE;
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};

/// More frames than any video has; counting on from here never overflows.
const MAX_FRAMES: u64 = 1 << 53;

/// The longest side of a window in cells.
const MAX_CELLS: usize = 512;

/// All that the target's next frames depend on. Spectra are pairs of real and imaginary parts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Saved {
    pub place: Place,
    pub base: [f64; 2],
    /// Frame pixels per pixel of the patch, at scale 1.
    pub pixel: f64,
    /// Cells on a side of the patch.
    pub cells: usize,
    pub colour: bool,
    /// Those of each filter whose mean follows.
    pub filters: Vec<Vec<[f32; 2]>>,
    pub memory: Vec<[f32; 2]>,
    pub memory_mean: f64,
    pub sure: u64,
    pub elsewhere: u32,
    pub colours: Histograms,
    pub size: SavedScale,
    pub rotation: SavedTurning,
    pub patches: PatchMemory,
    pub rng: Pcg64,
    pub phase: Phase,
    pub recent: f64,
    pub seen: f64,
    pub contrast: f64,
    pub frames: u64,
}

impl Target {
    /// The target as a snapshot holds it.
    pub fn saved(&self) -> Saved {
        let Self { place, window, follower, colours, size, rotation, visible, .. } = self;
        let Self { phase, recent, seen, contrast, frames, .. } = self;
        let pairs = |spectrum: &[Complex32]| spectrum.iter().map(|v| [v.re, v.im]).collect();
        Saved {
            place: *place,
            base: window.base(),
            pixel: window.pixel(),
            cells: window.features().fourier().side(),
            colour: window.colour(),
            filters: follower.spectra().map(pairs).collect(),
            memory: pairs(&follower.memory),
            memory_mean: follower.mean,
            sure: follower.sure,
            elsewhere: follower.elsewhere,
            colours: colours.clone(),
            size: size.saved(),
            rotation: rotation.saved(),
            patches: visible.model.memory().clone(),
            rng: visible.rng.clone(),
            phase: *phase,
            recent: *recent,
            seen: *seen,
            contrast: *contrast,
            frames: *frames,
        }
    }

    /// A target that continues from a saved one.
    ///
    /// # Errors
    /// What does not fit the configuration.
    pub fn restore(saved: Saved, config: &TrackerConfig) -> Result<Self, &'static str> {
        saved.check(config)?;
        let window = Window::new(saved.base, saved.pixel, saved.colour, saved.cells);
        let length = window.features().channels() * window.features().fourier().bins();
        let spectrum = |pairs: Vec<[f32; 2]>| {
            let sound = pairs.len() == length && pairs.iter().flatten().all(|v| v.is_finite());
            let values = pairs.into_iter().map(|[re, im]| Complex32::new(re, im)).collect();
            sound.then_some(values).ok_or("a filter is damaged")
        };
        if saved.filters.len() != config.robust.filters {
            return Err("the number of filters is not that of the configuration");
        }
        let filters = saved.filters.into_iter().map(spectrum).collect::<Result<_, _>>()?;
        let (memory, mean) = (spectrum(saved.memory)?, saved.memory_mean);
        let mut follower = Follower::restore(&window, &config.robust, filters, memory, mean);
        (follower.sure, follower.elsewhere) = (saved.sure, saved.elsewhere);
        let size = ScaleFilter::restore(saved.size, saved.base, size::rules(&config.robust))?;
        let rotation = Rotation::restore(saved.rotation)?;
        let model = PatchModel::restore(saved.patches, config.visible_rules());
        let visible = Visible::new(model, saved.rng, &config.patchwise);
        let Saved { place, colours, phase, recent, seen, contrast, frames, .. } = saved;
        Ok(Self {
            place,
            window,
            follower,
            colours,
            size,
            rotation,
            visible,
            phase,
            recent,
            seen,
            contrast,
            frames,
        })
    }
}

impl Saved {
    fn check(&self, config: &TrackerConfig) -> Result<(), &'static str> {
        let positive = |v: f64| v.is_finite() && v > 0.0;
        let sound = |place: &Place| {
            let Place { centre: [x, y], scale, rotation } = *place;
            [x, y, rotation].iter().all(|v| v.is_finite()) && positive(scale)
        };
        let back = match &self.phase {
            Phase::Trial { back, .. } => sound(back),
            _ => true,
        };
        let patch = self.pixel * (self.cells * CELL) as f64;
        let checks = [
            (
                self.frames.max(self.sure) <= MAX_FRAMES,
                "it has counted more frames than a video has",
            ),
            (sound(&self.place) && back, "its place is not finite, or its size not positive"),
            (
                self.base.iter().all(|&v| (1.0..=MAX_SIDE).contains(&v)) && positive(patch),
                "the target's first size is not a size",
            ),
            (
                self.cells <= MAX_CELLS && smooth_side(self.cells as f64) == self.cells,
                "the number of cells is not one that the tracker uses",
            ),
            (
                [self.recent, self.seen, self.contrast].iter().all(|mean| mean.is_finite()),
                "how sure the memory was, how much was visible, or the contrast, is not finite",
            ),
            (self.colours.is_sound(), "the histograms of colours are damaged"),
            (positive(self.memory_mean), "the memory's mean response is not positive"),
        ];
        if let Some((_, reason)) = checks.into_iter().find(|(holds, _)| !holds) {
            return Err(reason);
        }
        self.patches.check(&config.visible_rules(), config.patchwise.update_interval)
    }
}
