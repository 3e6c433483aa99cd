//! The settings of the patch model, which `robust` and `paper` use.

use super::{Range, group, number};
use crate::Error;
use crate::patch_model::likelihood::LikelihoodParams;
use crate::patch_model::memory::LearningStep;
use crate::patch_model::params::{LearningParams, PatchParams};
use crate::patch_model::scale::ScaleParams;
use crate::patch_model::sparse::codes::{CodeParams, MAX_ATOMS};
use crate::patch_model::sparse::dictionary::MAX_DICTIONARY;
use crate::patch_model::subspace::SubspaceParams;
use crate::patch_model::update::TemplateParams;
use crate::vision::patches::PatchGrid;

group! {
    /// The settings of the paper's patch model, which says what parts of the target are visible.
    PatchModelConfig ("patches") {}
    "paper Sec. 2, Eq. 1-2" {
        /// Side of the square templates, in samples.
        template_side: usize = 32, number(4.0, 128.0);
        /// Side of a large patch, in samples.
        large_patch: usize = 16, number(2.0, 128.0);
        /// Distance of neighbouring large patches, in samples.
        large_step: usize = 8, number(1.0, 128.0);
        /// Side of a small patch, in samples.
        small_patch: usize = 8, number(2.0, 128.0);
        /// Distance of neighbouring small patches, in samples.
        small_step: usize = 2, number(1.0, 128.0);
        /// Whether each patch's mean is subtracted before its norm is made 1.
        subtract_mean: bool = false, Range::Flag;
    }
    "paper Sec. 2.1, Eq. 3-9" {
        /// Maximum number of atoms in a joint code.
        atoms: usize = 4, number(1.0, MAX_ATOMS as f64);
        /// Number of earlier patches that are coded jointly with the current one.
        buffer: usize = 4, number(0.0, 16.0);
    }
    "own choice: atoms that repeat others must not be chosen" {
        /// An atom is eligible while the squared norm of what the chosen atoms leave of it is at
        /// least this.
        min_residual: f64 = 1e-6, number(1e-7, 0.1);
    }
    "paper Sec. 2.3, Eq. 12-14, 18-19" {
        /// A patch is visible when the squared error of its own-location code is below this.
        epsilon: f64 = 0.08, number(0.0, 4.0);
    }
    "paper Sec. 2.5, Eq. 15-21" {
        /// Number of templates.
        templates: usize = 10, number(2.0, 40.0);
        /// Frames between updates of templates, large dictionary, large buffer and subspace.
        update_interval: usize = 5, number(1.0, 10_000.0);
        /// Frames between updates of the small dictionary and the small buffer.
        small_update_interval: usize = 20, number(1.0, 10_000.0);
        /// Templates are updated when the visible shares of both scales add to more than twice
        /// this.
        delta: f64 = 0.08, number(0.0, 1.0);
        /// The large buffer takes the candidate when more than this share of large patches is
        /// visible (o1).
        large_buffer_guard: f64 = 0.0, number(0.0, 1.0);
        /// The small buffer takes the candidate when more than this share of small patches is
        /// visible (o2).
        small_buffer_guard: f64 = 0.13, number(0.0, 1.0);
        /// The chance that a template is replaced grows by this factor from one to the next younger
        /// one.
        replacement_growth: f64 = 2.0, number(1.0, 100.0);
        /// Weight of the past in the subspace when a batch comes in (1 forgets nothing).
        forgetting: f64 = 1.0, number(0.01, 1.0);
        /// Eigenvectors are kept while their squared singular value is at least this share of the
        /// total.
        subspace_keep: f64 = 1e-6, number(0.0, 1.0);
        /// Maximum number of eigenvectors of the subspace.
        subspace_vectors: usize = 20, number(1.0, 64.0);
        /// Weight of the L1 norms in the reconstruction of the tracked candidate.
        lambda: f64 = 0.01, number(0.0, 1.0);
        /// Radius of the guided filter that smooths the occlusion mask, in samples; 0 turns it off.
        guided_radius: usize = 2, number(0.0, 32.0);
        /// Regularisation of the guided filter.
        guided_epsilon: f64 = 0.01, number(1e-9, 1.0);
    }
}

impl PatchModelConfig {
    /// Half as many small patches along each side: enough to see what is visible.
    pub(crate) fn coarse() -> Self {
        Self { small_step: 4, ..Self::default() }
    }

    /// The parameters of the patch model with this likelihood and these position weights.
    pub(crate) fn params(
        &self,
        likelihood: LikelihoodParams,
        beta: f64,
        position_weights: bool,
    ) -> PatchParams {
        let grid =
            |patch, step| PatchGrid::new(self.template_side, patch, step, self.subtract_mean);
        PatchParams {
            template_side: self.template_side,
            large: grid(self.large_patch, self.large_step),
            small: grid(self.small_patch, self.small_step),
            scale: ScaleParams {
                codes: CodeParams { atoms: self.atoms, min_residual: self.min_residual },
                beta,
                position_weights,
                keeps_products: true,
            },
            likelihood,
            templates: self.templates,
            buffer: self.buffer,
            learning: self.learning_params(),
        }
    }

    fn learning_params(&self) -> LearningParams {
        LearningParams {
            delta: self.delta,
            large_buffer_guard: self.large_buffer_guard,
            small_buffer_guard: self.small_buffer_guard,
            replacement_growth: self.replacement_growth,
            subspace: SubspaceParams {
                forgetting: self.forgetting,
                keep: self.subspace_keep,
                vectors: self.subspace_vectors,
            },
            template: TemplateParams {
                lambda: self.lambda,
                guided_radius: self.guided_radius,
                guided_epsilon: self.guided_epsilon,
            },
        }
    }

    /// What learns on the frame with this number (Sec. 2.5 of the paper); `robust` counts sure frames
    /// alone.
    pub(crate) fn learning_step(&self, frame: u64) -> LearningStep {
        let every = |interval: usize| frame.is_multiple_of(interval as u64);
        LearningStep {
            templates: every(self.update_interval),
            small_dictionary: every(self.small_update_interval),
        }
    }

    /// Checks that patches fit the templates, and dictionaries their limit.
    pub(crate) fn check(&self) -> Result<(), Error> {
        for (field, patch) in [("large_patch", self.large_patch), ("small_patch", self.small_patch)]
        {
            if patch > self.template_side {
                return Err(Error::Config {
                    field,
                    value: patch.to_string(),
                    allowed: format!("at most template_side = {}", self.template_side),
                });
            }
        }
        let locations = |patch, step| {
            PatchGrid::new(self.template_side, patch, step, self.subtract_mean).locations()
        };
        for (field, patch, step) in [
            ("large_step", self.large_patch, self.large_step),
            ("small_step", self.small_patch, self.small_step),
        ] {
            let atoms = self.templates * locations(patch, step);
            if atoms > MAX_DICTIONARY {
                return Err(Error::Config {
                    field,
                    value: step.to_string(),
                    allowed: format!(
                        "templates times locations at most {MAX_DICTIONARY}; this gives {atoms}"
                    ),
                });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn templates_and_small_dictionary_learn_at_their_own_intervals() {
        let config = PatchModelConfig::coarse();
        for (frame, templates, small_dictionary) in
            [(1, false, false), (5, true, false), (19, false, false), (20, true, true)]
        {
            let step = LearningStep { templates, small_dictionary };
            assert_eq!(config.learning_step(frame), step, "{frame}");
        }
    }
}
