//! A way to look inside the tracker without touching its loop.

use crate::appearance::likelihood::Feature;
use crate::filter::state::State;
use crate::sparse::codes::Code;

/// What happened on one frame, after the estimate was found and learned from.
#[derive(Debug)]
#[non_exhaustive]
pub struct FrameView<'a> {
    /// Frames since the first one.
    pub frame: u64,
    /// All particles, in the order in which they were drawn.
    pub particles: &'a [State],
    /// Their likelihoods, in the same order. Where a candidate was refused it is minus infinity.
    pub likelihoods: &'a [f64],
    /// The index of the estimate among them.
    pub best: usize,
    /// The estimate's candidate: the warped, normalised template, row by row.
    pub candidate: &'a [f32],
    /// The estimate's patches at the large and at the small scale; none while first templates are gathered by nearest neighbour.
    pub large: Vec<PatchView>,
    /// As `large`.
    pub small: Vec<PatchView>,
    /// The templates after this frame, the first one first.
    pub templates: &'a [Vec<f32>],
    /// Set where a template was replaced on this frame.
    pub update: Option<UpdateView<'a>>,
}

/// One patch of the estimate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PatchView {
    /// Its joint code: atom `j * locations + i` is location `i` of template `j`.
    pub code: Code,
    /// Its pooled share and masked error.
    pub feature: Feature,
    /// Its occlusion level: whether it is visible.
    pub visible: bool,
}

/// One replacement of a template.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UpdateView<'a> {
    /// The index that the removed template had; the new one is the last.
    pub replaced: usize,
    /// The smoothed occlusion mask it was made with, 1 where visible; empty where the tracker took the candidate as it was.
    pub mask: &'a [f64],
}

/// Looks at each frame; any `FnMut(&FrameView)` is one.
pub trait Observer {
    /// Called once for each frame that [`Tracker::update_observed`](crate::Tracker::update_observed) tracks.
    fn observe(&mut self, view: &FrameView<'_>);
}

impl<F: FnMut(&FrameView<'_>)> Observer for F {
    fn observe(&mut self, view: &FrameView<'_>) {
        self(view);
    }
}
