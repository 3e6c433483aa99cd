//! What an observer is shown of a frame of the method `robust`.

use super::evidence::Evidence;
use super::pose::Pose;
use super::{RobustScratch, RobustTarget};
use crate::vision::frame::Frame;

/// The filters on one frame, after the estimate was found and learned from.
#[derive(Debug)]
#[non_exhaustive]
pub struct RobustView<'a> {
    /// Frames since the first one.
    pub frame: u64,
    /// What the filters do: `tracking`; `occluded`, where hardly anything of the target is visible and
    /// it is also searched for elsewhere; `verifying` a re-detection; `lost`, where it is only searched
    /// for.
    pub phase: &'static str,
    /// How sure the memory was of the estimate: its response there, relative to its mean over sure
    /// frames.
    pub certainty: f64,
    /// The memory's strongest response more than half the target's width or height away from the
    /// estimate, relative to that at the estimate, at least 0 and at most `elsewhere_most`.
    pub elsewhere: f64,
    /// How sure the memory was when it had seen no more than the first sure frames: the response of
    /// what it was then, relative to its mean then.
    pub early: f64,
    /// How well colour tells the target from what is around it, from -1 through 0, not at all, to
    /// 1.
    pub contrast: f64,
    /// The visible share of the target as it is reported, from 0 to 1; 0 while the target is given
    /// up.
    pub visible: f64,
    /// Its running mean over all frames, which the score counts.
    pub mean_visible: f64,
    /// The running mean of `elsewhere` over the last frames, which the score counts.
    pub mean_elsewhere: f64,
    /// The running mean of `early` over the last frames, each from 0 to 1.5, which the score counts.
    pub mean_early: f64,
    /// Cells on a side of the window around the estimate.
    pub side: usize,
    /// Frame pixels on a side of a cell.
    pub cell: f64,
    /// The response of the tracking filter to the window, without the map of
    /// colours, row by row: `side * side` values. The first stands for the estimate's centre, later
    /// ones for displacements to the right and down; beyond half the side they stand for
    /// displacements to the left and up.
    pub tracking_filter: &'a [f32],
    /// The memory's response, in the same order.
    pub memory: &'a [f32],
}

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
