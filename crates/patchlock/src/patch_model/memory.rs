//! What a patch model remembers (Sec. 2.5): templates, buffers and the subspace, and how they learn
//! from a tracked candidate. A saved state holds exactly this; the dictionaries follow from it.

use super::buffer;
use super::params::PatchParams;
use super::sparse::dictionary::DictionaryScratch;
use super::subspace::{self, Subspace};
use super::templates;
use super::update::NewTemplate;
use super::visibility::Visibility;
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};

/// Templates and buffers are normalised candidates, row by row.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PatchMemory {
    /// The first template first, then from the oldest to the newest.
    pub templates: Vec<Vec<f32>>,
    /// The templates when the small dictionary was last made.
    pub small_templates: Vec<Vec<f32>>,
    /// The buffer of the large scale, the oldest entry first.
    pub large_buffer: Vec<Vec<f32>>,
    /// The buffer of the small scale, the oldest entry first.
    pub small_buffer: Vec<Vec<f32>>,
    /// The subspace of the tracked candidates.
    pub subspace: Subspace,
    /// Tracked candidates that the subspace has not taken in yet.
    pub batch: Vec<Vec<f32>>,
}

/// Which parts of the model learn on a frame. The caller decides.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LearningStep {
    /// Subspace, templates, large dictionary and large buffer.
    pub templates: bool,
    /// Small dictionary and small buffer.
    pub small_dictionary: bool,
}

/// What a learning step changed.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct LearningChanges {
    /// The index of the template that was replaced. The new one is the last.
    pub replaced: Option<usize>,
    /// Whether the large buffer took the candidate.
    pub large_buffer: bool,
    /// Whether the small dictionary was made again.
    pub small_dictionary: bool,
    /// Whether the small buffer took the candidate.
    pub small_buffer: bool,
}

/// Buffers for learning, so that nothing is allocated anew.
#[derive(Debug, Default)]
pub struct LearningScratch {
    /// Candidates that the subspace has taken in, to be overwritten.
    spare: Vec<Vec<f32>>,
    subspace: subspace::SubspaceScratch,
    new: NewTemplate,
    /// For the dictionaries.
    pub dictionary: DictionaryScratch,
}

impl LearningScratch {
    /// The occlusion mask of the template that was made last (Eq. 17).
    pub fn mask(&self) -> &[f64] {
        self.new.mask()
    }
}

impl PatchMemory {
    /// The memory after the first frame, with these first templates.
    pub fn begin(templates: Vec<Vec<f32>>, params: &PatchParams) -> Self {
        let buffer = buffer::begin(&templates, params.buffer);
        let mut memory = Self {
            small_templates: templates.clone(),
            large_buffer: buffer.clone(),
            small_buffer: buffer,
            subspace: Subspace::default(),
            batch: Vec::new(),
            templates,
        };
        let mut scratch = subspace::SubspaceScratch::default();
        memory.subspace.add(&memory.templates, &params.learning.subspace, &mut scratch);
        memory
    }

    /// Keeps a tracked candidate for the subspace, which takes them all in at the next large
    /// learning step.
    pub fn collect(&mut self, candidate: &[f32], scratch: &mut LearningScratch) {
        let mut copy = scratch.spare.pop().unwrap_or_default();
        copy.clear();
        copy.extend_from_slice(candidate);
        self.batch.push(copy);
    }

    /// Learns from a tracked candidate and its visibility map.
    pub fn learn(
        &mut self,
        (candidate, visibility): (&[f32], &Visibility),
        step: LearningStep,
        params: &PatchParams,
        rng: &mut Pcg64,
        scratch: &mut LearningScratch,
    ) -> LearningChanges {
        let learning = &params.learning;
        let mut learned = LearningChanges::default();
        if step.templates {
            self.subspace.add(&self.batch, &learning.subspace, &mut scratch.subspace);
            scratch.spare.append(&mut self.batch);
            learned.replaced =
                self.update_templates((candidate, visibility), params, rng, &mut scratch.new);
            if visibility.large.share() > learning.large_buffer_guard {
                buffer::push(&mut self.large_buffer, candidate);
                learned.large_buffer = true;
            }
        }
        if step.small_dictionary {
            self.small_templates.clone_from(&self.templates);
            learned.small_dictionary = true;
            if visibility.small.share() > learning.small_buffer_guard {
                buffer::push(&mut self.small_buffer, candidate);
                learned.small_buffer = true;
            }
        }
        learned
    }

    /// Replaces a template if enough of the candidate is visible (Eq. 20), and returns its index.
    fn update_templates(
        &mut self,
        (candidate, visibility): (&[f32], &Visibility),
        params: &PatchParams,
        rng: &mut Pcg64,
        new: &mut NewTemplate,
    ) -> Option<usize> {
        let learning = &params.learning;
        if visibility.small.share() + visibility.large.share() <= 2.0 * learning.delta {
            return None;
        }
        let visible = &visibility.large.visible;
        new.make(candidate, (&params.large, visible), &self.subspace, &learning.template);
        let growth = learning.replacement_growth;
        let replaced = templates::draw_replaced(self.templates.len(), growth, rng);
        templates::replace(&mut self.templates, replaced, new.template());
        Some(replaced)
    }

    /// The newest template.
    pub fn last_template(&self) -> &[f32] {
        self.templates.last().map_or(&[], Vec::as_slice)
    }

    /// Whether this could be the memory of a model with these parameters; if not, what does not
    /// fit. `batch_limit`: fewer candidates than this wait for the subspace.
    ///
    /// # Errors
    /// The first part that does not fit.
    pub fn check(&self, params: &PatchParams, batch_limit: usize) -> Result<(), &'static str> {
        let length = params.template_side * params.template_side;
        let sound = |all: &[Vec<f32>]| {
            all.iter().all(|t| t.len() == length && t.iter().all(|v| v.abs() <= 1.001))
        };
        let complete = |all: &[Vec<f32>]| all.len() == params.templates && sound(all);
        let buffers = [&self.large_buffer, &self.small_buffer];
        let checks = [
            (complete(&self.templates), "the templates do not fit the configuration"),
            (
                complete(&self.small_templates),
                "the small dictionary's templates do not fit the configuration",
            ),
            (
                buffers.iter().all(|buffer| buffer.len() == params.buffer && sound(buffer)),
                "the buffers do not fit the configuration",
            ),
            (
                self.batch.len() < batch_limit && sound(&self.batch),
                "the waiting candidates do not fit the configuration",
            ),
            (self.subspace.fits(length), "the subspace does not fit the configuration"),
        ];
        checks.iter().find(|(holds, _)| !holds).map_or(Ok(()), |(_, what)| Err(*what))
    }
}
