//! Makes the view of a frame for an observer.

use super::{PaperScratch, PaperTarget};
use crate::observe::{PaperView, PatchView, UpdateView};
use crate::patch_model::memory::LearningChanges;
use crate::patch_model::scale::PatchScores;

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
