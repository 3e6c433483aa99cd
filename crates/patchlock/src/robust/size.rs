//! The target's size: a filter along scale measures it, and the follower and the memory check it.

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
        let at = (self.place.centre, self.place.scale);
        self.place.scale *= self.size.find(frame, self.window.planes(), at, &mut scratch.scale);
    }

    /// Tries a size a step larger or, on every second frame, smaller, and keeps it if follower and memory
    /// respond stronger there. The scale filter learns at the sizes that it has measured, so without this its
    /// errors add up. Returns how sure the memory is of the place, and leaves its sample in the scratch.
    pub fn check_size(
        &mut self,
        frame: &Frame<'_>,
        config: &RobustConfig,
        scratch: &mut Scratch,
    ) -> f64 {
        let measured = self.place.scale;
        let (here, certainty) = self.responses(frame, scratch);
        let step = 1.0 + config.scale_check;
        std::mem::swap(&mut scratch.sample, &mut scratch.other);
        self.place.scale *= if self.frames.is_multiple_of(2) { step } else { 1.0 / step };
        self.place.keep_within(frame, self.window.base());
        let (there, certainty_there) = self.responses(frame, scratch);
        if there > here {
            return certainty_there;
        }
        self.place.scale = measured;
        std::mem::swap(&mut scratch.sample, &mut scratch.other);
        certainty
    }

    /// The sum of both responses at the place at hand, and the memory's share of it relative to its mean.
    fn responses(&self, frame: &Frame<'_>, scratch: &mut Scratch) -> (f64, f64) {
        let certainty = self.certainty(frame, scratch);
        let response = self.follower.response(&self.window, scratch);
        (response + certainty * self.follower.mean, certainty)
    }
}
