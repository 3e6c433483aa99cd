//! The configuration: every number and choice, in one table, in groups.
//!
//! The macro call below *is* the table. Each row is a field with its type, default, range, purpose and
//! source; rows are grouped by what they configure: the common ones, and those of each method. The structs,
//! their defaults, the check of the ranges and [`PARAMETERS`] (what `patchlock config` prints) are all made
//! from it, so that they cannot disagree.

mod reading;
mod table;

use crate::Error;
use crate::patch_model::likelihood::{Gamma, LikelihoodRules, Scales};
use crate::patch_model::memory::LearningRules;
use crate::patch_model::model::PatchRules;
use crate::patch_model::scale::ScaleRules;
use crate::patch_model::sparse::codes::{CodeRules, MAX_ATOMS};
use crate::patch_model::sparse::dictionary::MAX_DICTIONARY;
use crate::patch_model::subspace::SubspaceRules;
use crate::patch_model::update::TemplateRules;
use crate::vision::patches::PatchGrid;
use serde::{Deserialize, Serialize};
pub use table::{Parameter, Range};
use table::{Value, number, parameters};

/// The names that [`TrackerConfig::preset`] knows.
pub const PRESETS: &[&str] = &["robust", "fast", "paper"];

/// The largest seed: every file format keeps whole numbers up to it.
const MAX_SEED: f64 = 9_007_199_254_740_991.0;

/// The methods of tracking.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// The paper's tracker: particles, weighed by structural local sparse appearance.
    Patchwise,
    /// Correlation filters that follow and remember the target, and the paper's patch model to see what is
    /// hidden.
    Robust,
}

impl Method {
    /// The values as a configuration file writes them.
    pub const WORDS: &'static [&'static str] = &["patchwise", "robust"];

    /// The value as a configuration file writes it.
    pub fn name(self) -> &'static str {
        Self::WORDS[self as usize]
    }
}

parameters! {
    common {
        "own choice" {
            /// The method that follows the target.
            method: Method = Method::Robust, Range::Words(Method::WORDS);
            /// Seed of all randomness: the same seed gives the same boxes.
            seed: u64 = 0, number(0.0, MAX_SEED);
        }
    }
    /// The numbers and choices of the method `patchwise`, the paper's tracker.
    patchwise: PatchwiseConfig {
        "paper Sec. 2" {
            /// Number of particles, which are weighed on each frame.
            particles: usize = 650, number(1.0, 100_000.0);
            /// Standard deviation of the centre's motion along x, in pixels per frame.
            sigma_x: f64 = 6.0, number(0.0, 1000.0);
            /// Standard deviation of the centre's motion along y, in pixels per frame.
            sigma_y: f64 = 6.0, number(0.0, 1000.0);
            /// Standard deviation of the change of scale (box width / template side) per frame.
            sigma_scale: f64 = 0.02, number(0.0, 10.0);
            /// Standard deviation of the change of rotation, in radians per frame.
            sigma_rotation: f64 = 0.002, number(0.0, 10.0);
            /// Standard deviation of the change of the aspect ratio (height / width) per frame.
            sigma_aspect: f64 = 0.002, number(0.0, 10.0);
            /// Standard deviation of the change of skew, in radians per frame.
            sigma_skew: f64 = 0.0, number(0.0, 10.0);
        }
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
            /// An atom is eligible while the squared norm of what the chosen atoms leave of it is at least
            /// this.
            min_residual: f64 = 1e-6, number(1e-7, 0.1);
        }
        "paper Sec. 2.3, Eq. 12-14, 18-19" {
            /// A patch is visible when the squared error of its own-location code is below this.
            epsilon: f64 = 0.08, number(0.0, 4.0);
            /// How fast the position weight falls with the distance from the centre, per patch.
            beta: f64 = 0.8, number(0.0, 100.0);
            /// Whether patches have position weights at all.
            position_weights: bool = true, Range::Flag;
            /// Whether hidden patches lose their position weight.
            occlusion_weights: bool = true, Range::Flag;
        }
        "paper Sec. 2.4, Eq. 24" {
            /// Weight of the large scale in the likelihood.
            gamma: Gamma = Gamma::ExpVisible, Range::Words(Gamma::WORDS);
            /// Which scales the likelihood adds.
            scales: Scales = Scales::Both, Range::Words(Scales::WORDS);
        }
        "paper Sec. 2.5, Eq. 15-21" {
            /// Number of templates.
            templates: usize = 10, number(2.0, 40.0);
            /// Frames between updates of templates, large dictionary, large buffer and subspace.
            update_interval: usize = 5, number(1.0, 10_000.0);
            /// Frames between updates of the small dictionary and the small buffer.
            small_update_interval: usize = 20, number(1.0, 10_000.0);
            /// Templates are updated when the visible shares of both scales add to more than twice this.
            delta: f64 = 0.08, number(0.0, 1.0);
            /// The large buffer takes the candidate when more than this share of large patches is visible
            /// (o1).
            large_buffer_guard: f64 = 0.0, number(0.0, 1.0);
            /// The small buffer takes the candidate when more than this share of small patches is visible
            /// (o2).
            small_buffer_guard: f64 = 0.13, number(0.0, 1.0);
            /// The chance that a template is replaced grows by this factor from one to the next younger one.
            replacement_growth: f64 = 2.0, number(1.0, 100.0);
            /// Weight of the past in the subspace when a batch comes in (1 forgets nothing).
            forgetting: f64 = 1.0, number(0.01, 1.0);
            /// Eigenvectors are kept while their squared singular value is at least this share of the total.
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
    /// The numbers and choices of the method `robust`.
    robust: RobustConfig {
        "Li et al. 2018 (STRCF)" {
            /// Side of the search window, in roots of the target's area.
            search: f64 = 5.0, number(1.5, 20.0);
            /// Standard deviation of the filter's label, in roots of the target's area.
            label_width: f64 = 0.0625, number(0.01, 1.0);
            /// How strongly the filter is drawn to the one before; larger learns more slowly.
            temporal: f64 = 10.0, number(0.0, 1e6);
            /// How closely the second round of learning is held to the masked filter of the first.
            penalty: f64 = 0.1, number(1e-3, 10.0);
            /// The largest side of the patch that the search window is resampled to, in pixels.
            max_patch: f64 = 200.0, number(32.0, 512.0);
            /// The smallest side of the patch that the search window is resampled to, in pixels.
            min_patch: f64 = 150.0, number(32.0, 512.0);
        }
        "own measurement: filters that differ err in different places" {
            /// The follower is the mean of this many filters: that of the rows above, a wide and a slow one.
            filters: usize = 3, number(1.0, 3.0);
            /// Width and height of the part of the patch that the wide filter sees, relative to the target.
            wide_mask: f64 = 1.2, number(0.1, 20.0);
            /// `temporal` of the wide filter.
            wide_temporal: f64 = 8.0, number(0.0, 1e6);
            /// `penalty` of the wide filter.
            wide_penalty: f64 = 0.3, number(1e-3, 10.0);
            /// `temporal` of the slow filter.
            slow_temporal: f64 = 20.0, number(0.0, 1e6);
            /// `penalty` of the slow filter.
            slow_penalty: f64 = 0.05, number(1e-3, 10.0);
        }
        "Danelljan et al. 2014 (DSST)" {
            /// Number of scales that are tried on each frame, odd.
            scale_count: usize = 33, number(3.0, 99.0);
            /// Ratio of neighbouring scales.
            scale_step: f64 = 1.02, number(1.001, 1.2);
            /// Standard deviation of the scale filter's label, in roots of the number of scales.
            scale_label_width: f64 = 0.25, number(0.01, 1.0);
            /// Learning rate of the scale filter.
            scale_rate: f64 = 0.025, number(0.0, 1.0);
            /// Area of the crops of the scale filter, in pixels.
            scale_area: f64 = 512.0, number(64.0, 4096.0);
        }
        "Li et al. 2019 (LDES), with our own numbers" {
            /// Whether rotation in the frame is followed.
            rotate: bool = true, Range::Flag;
            /// Rotation is measured where the memory's response is below this share of its mean,
            rotation_below: f64 = 0.8, number(0.0, 10.0);
            /// believed from this many radians since it was learnt,
            rotation_least: f64 = 0.18, number(0.0, 3.2);
            /// and where follower and memory respond this many times stronger.
            rotation_margin: f64 = 1.1, number(0.0, 10.0);
            /// Learning rate of the filter over rotation.
            rotation_rate: f64 = 0.1, number(0.0, 1.0);
        }
        "Bertinetto et al. 2016 (Staple), with our own numbers" {
            /// Weight of the map of the target's colours, relative to the memory's mean response.
            colour_weight: f64 = 0.3, number(0.0, 10.0);
            /// The map counts while colour tells the target from what is around it at least this well: 0 is
            /// not at all, 1 is entirely.
            colour_contrast: f64 = 0.2, number(-1.0, 1.0);
            /// Learning rate of the colours of the target,
            colour_rate: f64 = 0.04, number(0.0, 1.0);
            /// and of those around it.
            around_rate: f64 = 0.3, number(0.0, 1.0);
        }
        "own measurement" {
            /// Learning rate of the memory, which is the mean of the follower's filters over sure frames.
            memory_rate: f64 = 0.02, number(0.0, 1.0);
            /// A frame is sure while the memory's response is above this share of what it was on recent
            /// frames, or of its own mean if that is less.
            sure: f64 = 0.7, number(0.0, 10.0);
            /// The first frames are sure, whatever the memory says.
            first_frames: usize = 10, number(0.0, 10_000.0);
            /// The memory is believed where it responds this many times stronger elsewhere, twice on end,
            jump_ratio: f64 = 2.5, number(1.0, 1e6);
            /// and at least with this share of its mean.
            jump_least: f64 = 0.33, number(0.0, 10.0);
            /// The target is lost when the memory's response stays below this share of its mean,
            lost_below: f64 = 0.4, number(0.0, 10.0);
            /// and below this share of what it was on recent frames,
            lost_drop: f64 = 0.6, number(0.0, 10.0);
            /// or less than this share is visible of what was visible on sure frames,
            lost_hidden: f64 = 0.3, number(0.0, 10.0);
            /// for this many frames on end.
            lost_after: usize = 5, number(1.0, 10_000.0);
            /// A frame is never sure if less than this share is visible of what was visible on sure frames.
            covered_share: f64 = 0.1, number(0.0, 10.0);
            /// The target is lost, too, when that stays so, with a score below one half; or when less than
            /// this share is visible of what was visible on sure frames,
            covered_visible: f64 = 0.3, number(0.0, 10.0);
            /// the memory responds more than half the target's size away with more than this share of its
            /// response at the box,
            covered_elsewhere: f64 = 0.6, number(0.0, 10.0);
            /// and the contrast of the target's colours to those around it is below this share of what it was
            /// on sure frames;
            covered_contrast: f64 = 0.75, number(0.0, 10.0);
            /// in both cases with the memory's response below this share of its mean,
            covered_below: f64 = 0.55, number(0.0, 10.0);
            /// for this many frames on end.
            covered_after: usize = 10, number(1.0, 10_000.0);
            /// While lost, a place is found where the memory's response is above this share of its mean.
            found_above: f64 = 0.65, number(0.0, 10.0);
            /// What was found is believed after this many frames on which it did not count as lost.
            trial: usize = 5, number(1.0, 10_000.0);
            /// Windows of the frame that are searched on each frame while the target is lost.
            search_windows: usize = 5, number(1.0, 1000.0);
            /// The scale filter learns only where the score is at least this.
            scale_least: f64 = 0.3, number(0.0, 1.0);
            /// Distance of neighbouring small patches of the patch model, in samples; its other numbers are
            /// those of the group `patchwise`.
            visible_step: usize = 4, number(1.0, 128.0);
            /// The score is the logistic function of a sum: this number,
            score_bias: f64 = 2.9, number(-100.0, 100.0);
            /// this one times the visible share of the target, 0 while it is lost,
            score_visible: f64 = 3.8, number(-100.0, 100.0);
            /// and this one times the memory's strongest response more than half the target's width or height
            /// away, as a share of that at the box, at most 2. While the target is lost it is at most 0.5.
            score_elsewhere: f64 = -4.2, number(-100.0, 100.0);
        }
    }
}

/// The rows of the group `patchwise` that the method `robust` does not use: it draws no particles and weighs
/// none, and has its own distance of the small patches.
const ONLY_PATCHWISE: &[&str] = &[
    "particles",
    "sigma_x",
    "sigma_y",
    "sigma_scale",
    "sigma_rotation",
    "sigma_aspect",
    "sigma_skew",
    "small_step",
    "beta",
    "position_weights",
    "occlusion_weights",
    "gamma",
    "scales",
];

impl Parameter {
    /// Whether this method uses the field; `robust` also uses those of the group `patchwise` that belong to
    /// its patch model.
    pub fn is_used_by(&self, method: Method) -> bool {
        match (self.group, method) {
            ("patchwise", Method::Robust) => !ONLY_PATCHWISE.contains(&self.name),
            (group, method) => group.is_empty() || group == method.name(),
        }
    }
}

impl TrackerConfig {
    /// The configuration of a preset. `robust`, the default, follows with correlation filters, remembers what
    /// was sure, and finds the target again after a loss. `fast` is the same with one filter instead of
    /// three, a smaller patch, and without rotation; it takes less than half the time. `paper` is the tracker
    /// of the paper.
    ///
    /// # Errors
    /// [`Error::UnknownPreset`] names the presets that exist.
    pub fn preset(name: &str) -> Result<Self, Error> {
        let default = Self::default();
        match name {
            "robust" => Ok(default),
            "fast" => {
                let robust =
                    RobustConfig { filters: 1, max_patch: 150.0, rotate: false, ..default.robust };
                Ok(Self { robust, ..default })
            }
            "paper" => Ok(Self { method: Method::Patchwise, ..default }),
            _ => Err(Error::UnknownPreset { name: name.to_owned(), known: PRESETS.join(", ") }),
        }
    }

    /// Checks every field against its range, and the fields that must fit each other.
    ///
    /// # Errors
    /// [`Error::Config`] names the first field that is wrong, its value and what is allowed.
    pub fn validate(&self) -> Result<(), Error> {
        self.check_ranges()?;
        self.patchwise.check_patches()?;
        if self.robust.scale_count.is_multiple_of(2) {
            return Err(Error::Config {
                field: "scale_count",
                value: self.robust.scale_count.to_string(),
                allowed: "an odd number".to_owned(),
            });
        }
        Ok(())
    }

    /// The rules of the patch model that the method `robust` asks what is visible.
    pub(crate) fn visible_rules(&self) -> PatchRules {
        let small_step = self.robust.visible_step;
        PatchwiseConfig { small_step, ..self.patchwise.clone() }.patch_rules()
    }
}

impl PatchwiseConfig {
    /// The rules of the patch model.
    #[doc(hidden)]
    pub fn patch_rules(&self) -> PatchRules {
        let grid =
            |patch, step| PatchGrid::new(self.template_side, patch, step, self.subtract_mean);
        PatchRules {
            template_side: self.template_side,
            large: grid(self.large_patch, self.large_step),
            small: grid(self.small_patch, self.small_step),
            scale: ScaleRules {
                codes: CodeRules { atoms: self.atoms, min_residual: self.min_residual },
                beta: self.beta,
                position_weights: self.position_weights,
            },
            likelihood: LikelihoodRules {
                epsilon: self.epsilon,
                occlusion_weights: self.occlusion_weights,
                gamma: self.gamma,
                scales: self.scales,
            },
            templates: self.templates,
            buffer: self.buffer,
            learning: self.learning_rules(),
        }
    }

    fn learning_rules(&self) -> LearningRules {
        LearningRules {
            delta: self.delta,
            large_buffer_guard: self.large_buffer_guard,
            small_buffer_guard: self.small_buffer_guard,
            replacement_growth: self.replacement_growth,
            subspace: SubspaceRules {
                forgetting: self.forgetting,
                keep: self.subspace_keep,
                vectors: self.subspace_vectors,
            },
            template: TemplateRules {
                lambda: self.lambda,
                guided_radius: self.guided_radius,
                guided_epsilon: self.guided_epsilon,
            },
        }
    }

    /// Checks that patches fit the templates, and dictionaries their limit.
    fn check_patches(&self) -> Result<(), Error> {
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
        let rules = self.patch_rules();
        for (field, step, grid) in [
            ("large_step", self.large_step, rules.large),
            ("small_step", self.small_step, rules.small),
        ] {
            let atoms = self.templates * grid.locations();
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
