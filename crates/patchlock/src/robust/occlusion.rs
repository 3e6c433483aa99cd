//! The paper's patch model, asked about the one box that was found: which parts of the target are
//! visible.

use crate::config::RobustConfig;
use crate::patch_model::memory::{LearningScratch, LearningStep, PatchMemory};
use crate::patch_model::model::{PatchErrorScratch, PatchModel};
use crate::patch_model::templates;
use crate::patch_model::visibility::Visibility;
use crate::vision::crop::{CropScratch, Planes, Region};
use crate::vision::frame::Frame;
use crate::vision::patches::normalise;
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};

/// The stream of the random numbers that choose which template is replaced.
const STREAM: u128 = 0x726f_6275_7374;

/// The patch model of a target.
#[derive(Debug)]
pub(crate) struct OcclusionModel {
    model: PatchModel,
    rng: Pcg64,
    params: OcclusionParams,
}

/// A patch model as a snapshot holds it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct SavedOcclusionModel {
    patches: PatchMemory,
    rng: Pcg64,
}

#[derive(Debug, Clone, Copy)]
struct OcclusionParams {
    /// Side of a candidate in samples.
    side: usize,
    /// Sure frames between updates of templates, large dictionary, large buffer and subspace.
    update_interval: usize,
    /// Sure frames between updates of the small dictionary and the small buffer.
    small_update_interval: usize,
    /// Patches with an error below this are visible to the model that learns, and to the rules that
    /// say what is sure and what is covered.
    epsilon: f64,
    /// Patches with an error below this are reported as visible.
    shown_epsilon: f64,
}

/// What was seen of the target in a region.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PatchObservation<'a> {
    /// The region's luma, resampled to the template's side, with norm 1.
    candidate: &'a [f32],
    /// Which parts are visible by the strict limit.
    visibility: &'a Visibility,
    shares: VisibleShares,
}

/// The visible share of the target, from 0 to 1, by two limits; both 0 where it is unknown.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct VisibleShares {
    /// By the strict limit: next to nothing counts as visible of what covers the target.
    pub strict: f64,
    /// By the milder limit, as it is reported: changed looks of the target count as visible, too.
    pub reported: f64,
}

/// The buffers of a [`PatchObservation`].
#[derive(Debug, Default)]
pub(crate) struct OcclusionScratch {
    crop: CropScratch,
    candidate: Planes,
    look: PatchErrorScratch,
    visibility: Visibility,
}

impl OcclusionParams {
    fn new(config: &RobustConfig) -> Self {
        Self {
            side: config.patches.template_side,
            update_interval: config.patches.update_interval,
            small_update_interval: config.patches.small_update_interval,
            epsilon: config.patches.epsilon,
            shown_epsilon: config.shown_epsilon,
        }
    }

    /// What learns on this sure frame, as Sec. 2.5 of the paper says of all frames.
    fn step(&self, sure: u64) -> LearningStep {
        let every = |interval: usize| sure.is_multiple_of(interval as u64);
        LearningStep {
            templates: every(self.update_interval),
            small_dictionary: every(self.small_update_interval),
        }
    }
}

impl OcclusionModel {
    /// The model of the target in this region.
    pub fn begin(frame: &Frame<'_>, region: Region, (seed, config): (u64, &RobustConfig)) -> Self {
        let (params, mut buffers) = (config.patch_params(), OcclusionScratch::default());
        let first = templates::shifts(params.templates).into_iter().map(|[dx, dy]| {
            let centre = [region.centre[0] + dx, region.centre[1] + dy];
            buffers.cut(frame, Region { centre, ..region }, params.template_side);
            buffers.candidate.samples.clone()
        });
        let model = PatchModel::of_templates(first.collect(), params);
        let rng = Pcg64::new(u128::from(seed), STREAM);
        Self { model, rng, params: OcclusionParams::new(config) }
    }

    /// As a snapshot holds it.
    pub fn saved(&self) -> SavedOcclusionModel {
        SavedOcclusionModel { patches: self.model.memory().clone(), rng: self.rng.clone() }
    }

    /// From a snapshot.
    ///
    /// # Errors
    /// What does not fit the configuration.
    pub fn restore(
        saved: SavedOcclusionModel,
        config: &RobustConfig,
    ) -> Result<Self, &'static str> {
        let SavedOcclusionModel { patches, rng } = saved;
        let (patch_params, params) = (config.patch_params(), OcclusionParams::new(config));
        patches.check(&patch_params, params.update_interval)?;
        Ok(Self { model: PatchModel::restore(patches, patch_params), rng, params })
    }

    /// Which parts of the target are visible in this region; `reported` becomes what is reported.
    pub fn observe<'a>(
        &self,
        frame: &Frame<'_>,
        region: Region,
        buffers: &'a mut OcclusionScratch,
        reported: &mut Visibility,
    ) -> PatchObservation<'a> {
        buffers.cut(frame, region, self.params.side);
        let OcclusionScratch { candidate, look, visibility, .. } = buffers;
        let errors = self.model.look(&candidate.samples, look);
        errors.visibility(self.params.shown_epsilon, reported);
        errors.visibility(self.params.epsilon, visibility);
        let shares = VisibleShares { strict: visibility.share(), reported: reported.share() };
        PatchObservation { candidate: &candidate.samples, visibility, shares }
    }

    /// Learns what was seen on a sure frame; `sure` is the number of these.
    pub fn learn(&mut self, seen: PatchObservation<'_>, sure: u64, scratch: &mut LearningScratch) {
        let PatchObservation { candidate, visibility, .. } = seen;
        let step = self.params.step(sure);
        self.model.collect(candidate, scratch);
        self.model.learn((candidate, visibility), step, &mut self.rng, scratch);
    }
}

impl PatchObservation<'_> {
    /// The visible share of the target.
    pub fn shares(self) -> VisibleShares {
        self.shares
    }
}

impl OcclusionScratch {
    /// Cuts out the candidate of a region.
    fn cut(&mut self, frame: &Frame<'_>, region: Region, side: usize) {
        region.crop([side; 2]).cut(frame, 1, &mut self.crop, &mut self.candidate);
        normalise(&mut self.candidate.samples);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn templates_and_small_dictionary_learn_at_their_own_intervals() {
        let config = RobustConfig::default();
        let params = OcclusionParams::new(&config);
        for (sure, templates, small_dictionary) in
            [(1, false, false), (5, true, false), (19, false, false), (20, true, true)]
        {
            let step = LearningStep { templates, small_dictionary };
            assert_eq!(params.step(sure), step, "{sure}");
        }
    }
}
