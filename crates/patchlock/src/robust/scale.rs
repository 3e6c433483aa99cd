//! The target's size, which a filter along scale measures.

use super::pose::Pose;
use super::window::Window;
use crate::config::RobustConfig;
use crate::correlation::scale::{SavedScale, ScaleFilter, ScaleFilterParams, ScaleScratch};
use crate::vision::crop::Region;
use crate::vision::frame::Frame;

/// What is known about the target's size.
#[derive(Debug)]
pub(crate) struct ScaleEstimator {
    filter: ScaleFilter,
    base: [f64; 2],
    planes: usize,
}

impl ScaleEstimator {
    /// A filter that has learnt the target in this region.
    pub fn begin(
        frame: &Frame<'_>,
        region: Region,
        window: &Window,
        config: &RobustConfig,
        scratch: &mut ScaleScratch,
    ) -> Self {
        let (base, planes) = (window.base(), window.planes());
        let filter = ScaleFilter::begin(frame, planes, region, params(config), scratch);
        Self { filter, base, planes }
    }

    /// As a snapshot holds it.
    pub fn saved(&self) -> SavedScale {
        self.filter.saved()
    }

    /// From a snapshot.
    ///
    /// # Errors
    /// What does not fit the configuration.
    pub fn restore(
        saved: SavedScale,
        window: &Window,
        config: &RobustConfig,
    ) -> Result<Self, &'static str> {
        let (base, planes) = (window.base(), window.planes());
        Ok(Self { filter: ScaleFilter::restore(saved, base, params(config))?, base, planes })
    }

    /// The place with the size that is measured there.
    pub fn measured(&self, frame: &Frame<'_>, pose: Pose, scratch: &mut ScaleScratch) -> Pose {
        let factor = self.filter.find(frame, self.planes, pose.region(self.base), scratch);
        Pose { scale: pose.scale * factor, ..pose }
    }

    /// Learns the target in this region.
    pub fn learn(&mut self, frame: &Frame<'_>, region: Region, scratch: &mut ScaleScratch) {
        self.filter.update(frame, self.planes, region, scratch);
    }
}

fn params(config: &RobustConfig) -> ScaleFilterParams {
    ScaleFilterParams {
        scales: config.scale_count,
        step: config.scale_step,
        sigma: config.scale_label_width * (config.scale_count as f64).sqrt(),
        rate: config.scale_rate,
        area: config.scale_area,
    }
}
