//! The parameters of a patch model.

use super::likelihood::LikelihoodParams;
use super::scale::ScaleParams;
use super::subspace::SubspaceParams;
use super::update::TemplateParams;
use crate::vision::patches::PatchGrid;

/// All parameters of a patch model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PatchParams {
    /// Side of the square templates, in samples.
    pub template_side: usize,
    /// The large patches.
    pub large: PatchGrid,
    /// The small patches.
    pub small: PatchGrid,
    /// How patches are coded and weighted.
    pub scale: ScaleParams,
    /// How features become a likelihood, and when a patch is visible.
    pub likelihood: LikelihoodParams,
    /// Number of templates.
    pub templates: usize,
    /// Number of earlier patches that are coded jointly with the current one.
    pub buffer: usize,
    /// How it learns.
    pub learning: LearningParams,
}

/// How a patch model learns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LearningParams {
    /// Templates are updated when the visible shares of both scales add to more than twice this
    /// (Eq. 20).
    pub delta: f64,
    /// The large buffer takes the candidate when more than this share of large patches is visible
    /// (o1).
    pub large_buffer_guard: f64,
    /// The small buffer takes the candidate when more than this share of small patches is visible
    /// (o2).
    pub small_buffer_guard: f64,
    /// The chance that a template is replaced grows by this factor from one to the next younger
    /// one.
    pub replacement_growth: f64,
    /// How the subspace forgets and what it keeps.
    pub subspace: SubspaceParams,
    /// How a new template is made.
    pub template: TemplateParams,
}
