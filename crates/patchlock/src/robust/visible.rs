//! The paper's patch model, asked about the one box that was found: which parts of the target are visible.

use crate::config::{PatchwiseConfig, TrackerConfig};
use crate::patch_model::memory::{LearningScratch, LearningStep};
use crate::patch_model::model::{LookScratch, PatchModel};
use crate::patch_model::templates;
use crate::patch_model::visibility::Visibility;
use crate::vision::crop::{CropScratch, Planes, Region};
use crate::vision::frame::Frame;
use crate::vision::patches::normalise;
use rand_pcg::Pcg64;

/// The stream of the random numbers that choose which template is replaced.
const STREAM: u128 = 0x726f_6275_7374;

/// The patch model of a target.
#[derive(Debug)]
pub(crate) struct Visible {
    pub model: PatchModel,
    pub rng: Pcg64,
    side: usize,
}

/// Buffers of a patch model.
#[derive(Debug, Default)]
pub(crate) struct VisibleScratch {
    crop: CropScratch,
    /// The candidate at hand.
    candidate: Planes,
    look: LookScratch,
    learning: LearningScratch,
}

impl Visible {
    /// The model of the target in this region.
    pub fn begin(frame: &Frame<'_>, region: Region, config: &TrackerConfig) -> Self {
        let (rules, mut scratch) = (config.visible_rules(), VisibleScratch::default());
        let first = templates::shifts(rules.templates).into_iter().map(|[dx, dy]| {
            let centre = [region.centre[0] + dx, region.centre[1] + dy];
            cut(frame, Region { centre, ..region }, rules.template_side, &mut scratch);
            scratch.candidate.samples.clone()
        });
        let model = PatchModel::of_templates(first.collect(), rules);
        Self::new(model, Pcg64::new(u128::from(config.seed), STREAM), &config.patchwise)
    }

    pub fn new(model: PatchModel, rng: Pcg64, config: &PatchwiseConfig) -> Self {
        Self { model, rng, side: config.template_side }
    }

    /// Which parts of the region are visible. Leaves its candidate in the scratch.
    pub fn look(
        &self,
        frame: &Frame<'_>,
        region: Region,
        scratch: &mut VisibleScratch,
        out: &mut Visibility,
    ) {
        cut(frame, region, self.side, scratch);
        self.model.look(&scratch.candidate.samples, &mut scratch.look, out);
    }

    /// Learns the candidate that was looked at last, on every so many sure frames, as Sec. 2.5 of the paper
    /// says of all frames; `sure` counts them.
    pub fn learn(
        &mut self,
        sure: u64,
        visibility: &Visibility,
        config: &TrackerConfig,
        scratch: &mut VisibleScratch,
    ) {
        let VisibleScratch { candidate, learning, .. } = scratch;
        let candidate = candidate.samples.as_slice();
        let every = |interval: usize| sure.is_multiple_of(interval as u64);
        let step = LearningStep {
            templates: every(config.patchwise.update_interval),
            small_dictionary: every(config.patchwise.small_update_interval),
        };
        self.model.collect(candidate, learning);
        self.model.learn((candidate, visibility), step, &mut self.rng, learning);
    }
}

/// The candidate of a region: luma, resampled to the template's side, with norm 1.
fn cut(frame: &Frame<'_>, region: Region, side: usize, scratch: &mut VisibleScratch) {
    region.crop([side; 2]).cut(frame, 1, &mut scratch.crop, &mut scratch.candidate);
    normalise(&mut scratch.candidate.samples);
}
