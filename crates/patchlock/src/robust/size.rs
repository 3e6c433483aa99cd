//! The target's size, which a filter along scale measures.

use super::{Scratch, Target};
use crate::config::RobustConfig;
use crate::correlation::scale::ScaleRules;
use crate::vision::frame::Frame;

/// The rules of the scale filter.
pub(super) fn rules(config: &RobustConfig) -> ScaleRules {
    ScaleRules {
        scales: config.scale_count,
        step: config.scale_step,
        sigma: config.scale_label_width * (config.scale_count as f64).sqrt(),
        rate: config.scale_rate,
        area: config.scale_area,
    }
}

impl Target {
    /// Takes over what the scale filter measures.
    pub fn measure(&mut self, frame: &Frame<'_>, scratch: &mut Scratch) {
        let (region, channels) = (self.place.region(self.window.base()), self.window.planes());
        self.place.scale *= self.size.find(frame, channels, region, &mut scratch.scale);
    }
}
