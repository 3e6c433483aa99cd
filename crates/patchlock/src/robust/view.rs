//! Makes the view of a frame for an observer.

use super::evidence::Evidence;
use super::pose::Pose;
use super::{RobustScratch, RobustTarget};
use crate::observe::RobustView;
use crate::vision::frame::Frame;

impl RobustTarget {
    /// Computes the responses to the window around the estimate again, with the filters as they are
    /// now.
    pub fn view<'a>(
        &'a self,
        (frame, pose): (&Frame<'_>, Pose),
        evidence: &Evidence,
        scratch: &'a mut RobustScratch,
    ) -> RobustView<'a> {
        let Self { window, locator, memory, .. } = self;
        let RobustScratch { sample, locator: buffers, .. } = scratch;
        let sample = window.sample(frame, pose, sample);
        let means = self.state.means();
        RobustView {
            frame: self.frames,
            phase: self.state.phase.name(),
            certainty: evidence.certainty,
            elsewhere: evidence.elsewhere,
            early: evidence.early,
            contrast: locator.contrast(),
            visible: evidence.visible,
            mean_visible: means.visible,
            mean_elsewhere: means.elsewhere,
            mean_early: means.early,
            side: window.fourier().side(),
            cell: window.cell(pose.scale),
            tracking_filter: sample.respond(locator.filter(), &mut buffers.tracking_filter).cells(),
            memory: memory.respond(&sample, &mut buffers.memory).cells(),
        }
    }
}
