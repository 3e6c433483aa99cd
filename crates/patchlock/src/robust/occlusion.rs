//! The paper's patch model, asked about the one box that was found: which parts of the target are
//! visible.

use super::RobustConfig;
use crate::patch_model::memory::{LearningScratch, PatchMemory};
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
}

/// A patch model as a snapshot holds it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct SavedOcclusionModel {
    patches: PatchMemory,
    rng: Pcg64,
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
        Self { model, rng }
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
        let params = config.patch_params();
        patches.check(&params, config.patches.update_interval)?;
        Ok(Self { model: PatchModel::restore(patches, params), rng })
    }

    /// Which parts of the target are visible in this region; `reported` becomes what is reported.
    pub fn observe<'a>(
        &self,
        frame: &Frame<'_>,
        region: Region,
        config: &RobustConfig,
        buffers: &'a mut OcclusionScratch,
        reported: &mut Visibility,
    ) -> PatchObservation<'a> {
        buffers.cut(frame, region, config.patches.template_side);
        let OcclusionScratch { candidate, look, visibility, .. } = buffers;
        let errors = self.model.look(&candidate.samples, look);
        errors.visibility(config.shown_epsilon, reported);
        errors.visibility(config.patches.epsilon, visibility);
        let shares = VisibleShares { strict: visibility.share(), reported: reported.share() };
        PatchObservation { candidate: &candidate.samples, visibility, shares }
    }

    /// Learns what was seen on a sure frame; `sure` is the number of these.
    pub fn learn(
        &mut self,
        seen: PatchObservation<'_>,
        sure: u64,
        config: &RobustConfig,
        scratch: &mut LearningScratch,
    ) {
        let PatchObservation { candidate, visibility, .. } = seen;
        let step = config.patches.learning_step(sure);
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
