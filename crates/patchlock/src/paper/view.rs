//! What an observer is shown of a frame of the paper's tracker.

use super::{PaperScratch, PaperTarget};
use crate::patch_model::likelihood::Feature;
use crate::patch_model::memory::LearningChanges;
use crate::patch_model::scale::PatchScores;
use crate::patch_model::sparse::codes::Code;
use crate::vision::state::State;

/// What happened on one frame, after the estimate was found and learned from.
#[derive(Debug)]
#[non_exhaustive]
pub struct PaperView<'a> {
    /// Frames since the first one.
    pub frame: u64,
    /// All particles, in the order in which they were drawn.
    pub particles: &'a [State],
    /// Their likelihoods `p` (Eq. 24), in the same order; larger is better, with no fixed scale.
    pub likelihoods: &'a [f64],
    /// The index of the estimate among the particles.
    pub best: usize,
    /// The estimate's candidate: the warped, normalised template, row by row.
    pub candidate: &'a [f32],
    /// The estimate's patches at the large scale.
    pub large: Vec<PatchView>,
    /// The estimate's patches at the small scale.
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
    /// The index of the removed template; the new one is the last.
    pub replaced: usize,
    /// The smoothed occlusion mask that the new template was made with, 1 where visible.
    pub mask: &'a [f64],
}

impl PaperTarget {
    /// What was found in a frame, with the best particle of this number, and learned from it.
    pub fn view<'a>(
        &'a self,
        best: usize,
        learned: &LearningChanges,
        scratch: &'a PaperScratch,
    ) -> PaperView<'a> {
        let (Self { model, frames, .. }, PaperScratch { particles, weighed, learning, .. }) =
            (self, scratch);
        let patches = |scores: &PatchScores| {
            let coded = scores.codes(best).zip(scores.features(best));
            let view =
                |(&code, feature)| PatchView { code, feature, visible: model.is_visible(&feature) };
            coded.map(view).collect()
        };
        PaperView {
            frame: *frames,
            particles: particles.states(),
            likelihoods: weighed.likelihoods(),
            best,
            candidate: particles.candidate(best),
            large: patches(weighed.large()),
            small: patches(weighed.small()),
            templates: &model.memory().templates,
            update: learned.replaced.map(|replaced| UpdateView { replaced, mask: learning.mask() }),
        }
    }
}
