//! Makes the view of a frame for an observer.

use super::particles::Particles;
use crate::observe::{PaperView, PatchView, UpdateView};
use crate::patch_model::memory::{LearningChanges, LearningScratch};
use crate::patch_model::model::{CandidateScores, PatchModel};
use crate::patch_model::scale::PatchScores;

/// The parts of a frame that a view is made from.
pub(crate) struct ViewParts<'a> {
    pub particles: &'a Particles,
    pub weighed: &'a CandidateScores,
    pub learning: &'a LearningScratch,
    pub best: usize,
    pub learned: &'a LearningChanges,
}

impl<'a> ViewParts<'a> {
    pub fn view(&self, frame: u64, model: &'a PatchModel) -> PaperView<'a> {
        let Self { particles, weighed, learning, best, learned } = *self;
        let patches = |scores: &PatchScores| {
            let coded = scores.codes(best).zip(scores.features(best));
            let view =
                |(&code, feature)| PatchView { code, feature, visible: model.is_visible(&feature) };
            coded.map(view).collect()
        };
        PaperView {
            frame,
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
