//! The patch model: the appearance model of the paper as one value (Sec. 2.1 to 2.5).
//!
//! It remembers a target as templates, patch dictionaries at two scales, buffers of recent patches
//! and a subspace.
//!
//! - [`PatchModel::begin`] makes it from one position in a frame;
//! - [`PatchModel::look`] says which patches of one candidate are visible;
//! - [`PatchModel::weigh`] gives the likelihoods of many candidates;
//! - [`PatchModel::learn`] takes a tracked candidate in. The caller decides when.

use super::likelihood::Feature;
use super::memory::{LearningChanges, LearningScratch, LearningStep, PatchMemory};
use super::params::PatchParams;
use super::pruning::Pruning;
use super::scale::{CodingScratch, PatchScores, Scale};
use super::templates;
use super::visibility::{Visibility, VisibilityMap};
pub use super::weighing::LikelihoodRequest;
use super::weighing::{CandidateBatch, Coding, ThreadBuffers};
use crate::numeric::parallel::*;
use crate::vision::frame::GreyImage;
use crate::vision::patches::{normalise, similarity};
use crate::vision::warp::{Affine, warp};
use rand_pcg::Pcg64;

/// The appearance of one target.
#[derive(Debug)]
pub struct PatchModel {
    params: PatchParams,
    memory: PatchMemory,
    large: Scale,
    small: Scale,
}

/// Candidates of a frame: warped and normalised templates.
#[derive(Debug, Clone, Copy)]
pub struct Candidates<'a> {
    /// `template_side * template_side` samples each, one candidate after the other.
    pub samples: &'a [f32],
    /// All candidates, each next to similar ones. It decides how fast they are weighed, and nothing
    /// else.
    pub order: &'a [u32],
}

/// The likelihoods and patch scores of the candidates that were weighed last, and the buffers to
/// weigh with.
#[derive(Debug, Default)]
pub struct CandidateScores {
    likelihoods: Vec<f64>,
    large: PatchScores,
    small: PatchScores,
    buffers: ThreadBuffers,
    /// The similarity of each candidate to the last template, and the candidates in that order.
    similarity: Vec<f64>,
    ranked: Vec<u32>,
    pruning: Pruning,
}

/// Buffers of [`PatchModel::look`].
#[derive(Debug, Default)]
pub struct PatchErrorScratch {
    coding: CodingScratch,
    large: Vec<f64>,
    small: Vec<f64>,
}

/// The squared errors of a candidate's patches (Eq. 12, 18), row by row at each scale.
#[derive(Debug, Clone, Copy)]
pub struct PatchErrors<'a> {
    large: (usize, &'a [f64]),
    small: (usize, &'a [f64]),
}

impl PatchErrors<'_> {
    /// Which patches are visible: those with an error below the limit.
    pub fn visibility(self, limit: f64, out: &mut Visibility) {
        for ((per_side, errors), map) in
            [(self.large, &mut out.large), (self.small, &mut out.small)]
        {
            map.fill(per_side, errors.iter().map(|&error| error < limit));
        }
    }
}

impl PatchModel {
    /// The model of the target that `map` takes a template's grid to.
    pub fn begin(image: &GreyImage, map: &Affine, params: PatchParams) -> Self {
        let cut = |[dx, dy]: [f64; 2]| {
            let [[a, b, x], [c, d, y]] = *map;
            let mut template = vec![0.0; params.template_side * params.template_side];
            cut_candidate(image, &[[a, b, x + dx], [c, d, y + dy]], &params, &mut template);
            template
        };
        let first = templates::shifts(params.templates).into_iter().map(cut).collect();
        Self::of_templates(first, params)
    }

    /// The model that begins with these templates, as many as the parameters say.
    pub fn of_templates(first: Vec<Vec<f32>>, params: PatchParams) -> Self {
        Self::restore(PatchMemory::begin(first, &params), params)
    }

    /// The model with this memory, which must fit the parameters ([`PatchMemory::check`]).
    pub fn restore(memory: PatchMemory, params: PatchParams) -> Self {
        let (large_buffer, small_buffer) = (&memory.large_buffer, &memory.small_buffer);
        let large = Scale::new(params.large, params.scale, &memory.templates, large_buffer);
        let small = Scale::new(params.small, params.scale, &memory.small_templates, small_buffer);
        Self { params, memory, large, small }
    }

    /// What it remembers.
    pub fn memory(&self) -> &PatchMemory {
        &self.memory
    }

    /// The errors of the patches of one candidate (Eq. 12, 18): the candidate of a box is what
    /// [`cut_candidate`] makes of the matrix of
    /// [`State::from_box`](crate::vision::state::State::from_box). The benchmark `look` times it.
    /// Nothing is allocated once the buffers have grown, and nothing is learned.
    pub fn look<'a>(
        &self,
        candidate: &[f32],
        scratch: &'a mut PatchErrorScratch,
    ) -> PatchErrors<'a> {
        let PatchErrorScratch { coding, large, small } = scratch;
        for (scale, errors) in [(&self.large, &mut *large), (&self.small, &mut *small)] {
            errors.clear();
            scale.code_everywhere(candidate, coding, |_, feature| errors.push(feature.error));
        }
        PatchErrors {
            large: (self.large.grid().per_side(), large),
            small: (self.small.grid().per_side(), small),
        }
    }

    /// The likelihoods of many candidates (Eq. 24), all of them or those that can be the most
    /// likely one. The work is shared by the `rayon` pool of the caller; the likelihoods are the
    /// same on any number of threads.
    pub fn weigh(
        &self,
        candidates: Candidates<'_>,
        wanted: LikelihoodRequest,
        out: &mut CandidateScores,
    ) {
        let length = self.params.template_side * self.params.template_side;
        out.rank(candidates, self.memory.last_template());
        let CandidateScores { likelihoods, large, small, buffers, pruning, .. } = out;
        let count = candidates.order.len();
        large.begin(count, self.large.grid().locations());
        small.begin(count, self.small.grid().locations());
        let mut weighing = CandidateBatch {
            coding: Coding::new((candidates.samples, length), (&self.large, &self.small), buffers),
            params: self.params.likelihood,
            large_scores: large,
            small_scores: small,
        };
        weighing.run(wanted, pruning);
        likelihoods.clear();
        likelihoods.resize(count, f64::NEG_INFINITY);
        for &k in pruning.remaining() {
            likelihoods[k as usize] = weighing.likelihood(k);
        }
    }

    /// Which patches of a candidate that was weighed are visible. It must be one that was wanted.
    pub fn visibility(&self, weighed: &CandidateScores, candidate: usize, out: &mut Visibility) {
        let fill = |map: &mut VisibilityMap, scale: &Scale, scores: &PatchScores| {
            let visible = scores.features(candidate).map(|f| self.params.likelihood.visible(&f));
            map.fill(scale.grid().per_side(), visible);
        };
        fill(&mut out.large, &self.large, &weighed.large);
        fill(&mut out.small, &self.small, &weighed.small);
    }

    /// Whether a patch with this feature is visible (Eq. 12, 18).
    pub fn is_visible(&self, feature: &Feature) -> bool {
        self.params.likelihood.visible(feature)
    }

    /// Keeps a tracked candidate for the subspace until the next large learning step.
    pub fn collect(&mut self, candidate: &[f32], scratch: &mut LearningScratch) {
        self.memory.collect(candidate, scratch);
    }

    /// Learns from a tracked candidate and its visibility (Sec. 2.5): the subspace, templates and
    /// buffers if enough is visible (Eq. 20), then the dictionaries. `step` says what learns on
    /// this frame.
    pub fn learn(
        &mut self,
        tracked: (&[f32], &Visibility),
        step: LearningStep,
        rng: &mut Pcg64,
        scratch: &mut LearningScratch,
    ) -> LearningChanges {
        let learned = self.memory.learn(tracked, step, &self.params, rng, scratch);
        let memory = &self.memory;
        self.large.learn(
            learned.replaced.map(|_| memory.templates.as_slice()),
            learned.large_buffer.then_some(memory.large_buffer.as_slice()),
            &mut scratch.dictionary,
        );
        self.small.learn(
            learned.small_dictionary.then_some(memory.small_templates.as_slice()),
            learned.small_buffer.then_some(memory.small_buffer.as_slice()),
            &mut scratch.dictionary,
        );
        learned
    }
}

impl CandidateScores {
    /// The likelihood of each candidate; minus infinity for one that was not wanted.
    pub fn likelihoods(&self) -> &[f64] {
        &self.likelihoods
    }

    /// The scores of the large patches.
    pub fn large(&self) -> &PatchScores {
        &self.large
    }

    /// The scores of the small patches.
    pub fn small(&self) -> &PatchScores {
        &self.small
    }

    /// Ranks the candidates by their similarity to a template.
    fn rank(&mut self, candidates: Candidates<'_>, template: &[f32]) {
        let Self { similarity, ranked, pruning, .. } = self;
        let each = candidates.samples.par_chunks_exact(template.len().max(1));
        each.map(|candidate| self::similarity(candidate, template)).collect_into_vec(similarity);
        ranked.clear();
        ranked.extend(0..candidates.order.len() as u32);
        let similarity = |k: u32| similarity[k as usize];
        // No two compare as equal, and a stable sort would allocate.
        ranked.sort_unstable_by(|&a, &b| similarity(b).total_cmp(&similarity(a)).then(a.cmp(&b)));
        pruning.begin(ranked, candidates.order);
    }
}

/// Warps and normalises the candidate that `map` takes the template's grid to.
pub fn cut_candidate(image: &GreyImage, map: &Affine, params: &PatchParams, out: &mut [f32]) {
    warp(image, map, params.template_side, out);
    normalise(out);
}
