//! The configuration: every number of the paper, in one table.
//!
//! The macro call below *is* the table: one row a field with its type, its default (the preset `paper`), its
//! range, and the section of the paper's tracker that it belongs to. The struct, its defaults, the check of the ranges and
//! [`PARAMETERS`] (what `patchlock config` prints) are all made from it, so they can't disagree.

use crate::Error;
use serde::{Deserialize, Serialize};
use std::fmt;

/// The names that [`TrackerConfig::preset`] knows.
pub const PRESETS: &[&str] = &["paper", "fast"];

/// The most atoms that one code may hold.
pub const MAX_ATOMS: usize = 8;

/// The largest dictionary, in atoms; its Gram matrix then takes 512 MiB.
pub const MAX_DICTIONARY: usize = 8192;

/// The largest seed: every file format keeps whole numbers up to it.
const MAX_SEED: f64 = 9_007_199_254_740_991.0;

/// The values that a field may take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Range {
    /// A number between two bounds, both allowed.
    Number {
        /// Smallest value.
        min: f64,
        /// Largest value.
        max: f64,
    },
    /// One of these words.
    Words(&'static [&'static str]),
    /// `true` or `false`.
    Flag,
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Range::Number { min, max } => write!(f, "{min} to {max}"),
            Range::Words(words) => write!(f, "{}", words.join(", ")),
            Range::Flag => write!(f, "true, false"),
        }
    }
}

/// One row of the table: what `patchlock config` says of a field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// The field's name.
    pub name: &'static str,
    /// The values that it may take.
    pub range: Range,
    /// The section and equations of the paper's tracker that it belongs to.
    pub section: &'static str,
    /// What it does.
    pub purpose: &'static str,
}

/// A type that a field may have.
trait Field: fmt::Debug {
    fn within(&self, range: Range) -> bool;
}

macro_rules! number_field {
    ($($ty:ty),*) => {$(
        impl Field for $ty {
            fn within(&self, range: Range) -> bool {
                matches!(range, Range::Number { min, max } if (min..=max).contains(&(*self as f64)))
            }
        }
    )*};
}
number_field!(u64, usize, f64);

impl Field for bool {
    fn within(&self, _: Range) -> bool {
        true
    }
}

/// Declares an enum that is written as a word in a configuration file.
macro_rules! words {
    ($(#[doc = $doc:literal])* $name:ident { $($(#[doc = $vdoc:literal])* $variant:ident = $word:literal,)* }) => {
        $(#[doc = $doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
        pub enum $name {
            $($(#[doc = $vdoc])* #[serde(rename = $word)] $variant,)*
        }
        impl $name {
            /// The words, as a configuration file writes them.
            pub const WORDS: &'static [&'static str] = &[$($word),*];
        }
        impl Field for $name {
            fn within(&self, _: Range) -> bool {
                true
            }
        }
    };
}

words! {
    /// What the motion of the scale is measured in.
    ScaleMotion {
        /// Added to the scale as it is.
        Absolute = "absolute",
        /// Multiplied by the last scale first.
        Relative = "relative",
    }
}
words! {
    /// What becomes of a candidate that leaves the frame.
    Outside {
        /// Its samples outside the frame are 0.
        Zero = "zero",
        /// A candidate with a corner outside the frame is never the estimate.
        Reject = "reject",
    }
}
words! {
    /// How an atom is chosen.
    Selection {
        /// The largest share of the signals' energy that the atom adds (order-recursive matching pursuit, as SPAMS does it).
        OrderRecursive = "order_recursive",
        /// The largest correlation with the residual (textbook simultaneous orthogonal matching pursuit).
        Textbook = "textbook",
    }
}
words! {
    /// Which part of the codes' signed coefficients is pooled.
    Coefficients {
        /// Their absolute values.
        Absolute = "absolute",
        /// Their positive part.
        Positive = "positive",
    }
}
words! {
    /// The weight of the large scale in the likelihood.
    Gamma {
        /// exp(mean visibility - 1).
        ExpVisible = "exp_visible",
        /// 1.
        One = "one",
        /// The mean visibility.
        Visible = "visible",
        /// exp(-mean error of the masked reconstruction).
        ExpError = "exp_error",
    }
}
words! {
    /// Which scales the likelihood adds.
    Scales {
        /// Large and small patches.
        Both = "both",
        /// Large patches only.
        Large = "large",
        /// Small patches only.
        Small = "small",
    }
}
words! {
    /// How the first templates are gathered.
    FirstTemplates {
        /// The first box and shifts of it by up to two pixels.
        Shifts = "shifts",
        /// Shifts; then the next frames each replace the second template by the tracked candidate.
        WarmUp = "warm_up",
        /// The box, then on the next frames the candidate nearest to the last template.
        Nearest = "nearest",
    }
}

macro_rules! parameters {
    ($($section:literal { $($(#[doc = $doc:literal])+ $name:ident : $ty:ty = $default:expr, $range:expr;)* })*) => {
        /// Every number and choice of the tracker. The default is the preset `paper`.
        ///
        /// Make one with [`TrackerConfig::preset`] or `TrackerConfig::default()`, change fields, and give it to
        /// [`Tracker::new`](crate::Tracker::new), which checks it.
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
        #[serde(default, deny_unknown_fields)]
        pub struct TrackerConfig {
            $($(
                $(#[doc = $doc])+
                #[doc = concat!("\n\nDefault `", stringify!($default), "`; allowed: `", stringify!($range), "`; ", $section, ".")]
                pub $name: $ty,
            )*)*
        }

        impl Default for TrackerConfig {
            fn default() -> Self {
                Self { $($($name: $default,)*)* }
            }
        }

        /// The table of all fields, in the order of the paper's steps.
        pub const PARAMETERS: &[Parameter] = &[$($(
            Parameter { name: stringify!($name), range: $range, section: $section, purpose: concat!($($doc),+).trim_ascii() },
        )*)*];

        impl TrackerConfig {
            fn check_ranges(&self) -> Result<(), Error> {
                $($(
                    if !self.$name.within($range) {
                        return Err(Error::Config {
                            field: stringify!($name),
                            value: format!("{:?}", self.$name),
                            allowed: $range.to_string(),
                        });
                    }
                )*)*
                Ok(())
            }
        }
    };
}

/// Any number from `min` to `max`.
const fn number(min: f64, max: f64) -> Range {
    Range::Number { min, max }
}

parameters! {
    "Sec. 2, motion" {
        /// Seed of all randomness: the same seed gives the same boxes.
        seed: u64 = 0, number(0.0, MAX_SEED);
        /// Number of particles, the candidates weighed on each frame.
        particles: usize = 650, number(1.0, 100_000.0);
        /// Standard deviation of the centre's motion along x, in pixels a frame.
        sigma_x: f64 = 6.0, number(0.0, 1000.0);
        /// Standard deviation of the centre's motion along y, in pixels a frame.
        sigma_y: f64 = 6.0, number(0.0, 1000.0);
        /// Standard deviation of the scale (box width / template side).
        sigma_scale: f64 = 0.02, number(0.0, 10.0);
        /// Standard deviation of the rotation, in radians.
        sigma_rotation: f64 = 0.002, number(0.0, 10.0);
        /// Standard deviation of the aspect ratio (height / width).
        sigma_aspect: f64 = 0.002, number(0.0, 10.0);
        /// Standard deviation of the skew, in radians.
        sigma_skew: f64 = 0.0, number(0.0, 10.0);
        /// Whether the scale's motion is absolute or relative to the scale.
        scale_motion: ScaleMotion = ScaleMotion::Absolute, Range::Words(ScaleMotion::WORDS);
        /// What becomes of candidates that leave the frame.
        outside: Outside = Outside::Zero, Range::Words(Outside::WORDS);
    }
    "Sec. 2, Eq. 1-2" {
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
    "Sec. 2.1, Eq. 3-9" {
        /// Most atoms in a joint code.
        atoms: usize = 4, number(1.0, MAX_ATOMS as f64);
        /// How the next atom of a code is chosen.
        selection: Selection = Selection::OrderRecursive, Range::Words(Selection::WORDS);
        /// An atom is eligible while the squared norm of what the chosen atoms leave of it is at least this.
        min_residual: f64 = 1e-6, number(1e-7, 0.1);
        /// A code is complete when at most this energy remains per column.
        stop_energy: f64 = 0.0, number(0.0, 1.0);
        /// Number of earlier patches that are coded jointly with the current one.
        buffer: usize = 4, number(0.0, 16.0);
    }
    "Sec. 2.2, Eq. 10-11" {
        /// Which part of the coefficients is pooled.
        coefficients: Coefficients = Coefficients::Absolute, Range::Words(Coefficients::WORDS);
        /// Whether pooled coefficients are divided by their total.
        divide: bool = true, Range::Flag;
    }
    "Sec. 2.3, Eq. 12-14, 18-19" {
        /// A patch is visible when the squared error of its own-location code is below this.
        epsilon: f64 = 0.08, number(0.0, 4.0);
        /// How fast the position weight falls with the distance from the centre, per patch.
        beta: f64 = 0.8, number(0.0, 100.0);
        /// Whether patches are weighed by their position at all.
        position_weights: bool = true, Range::Flag;
        /// Whether hidden patches lose their position weight.
        occlusion_weights: bool = true, Range::Flag;
    }
    "Sec. 2.4, Eq. 24" {
        /// Weight of the large scale in the likelihood.
        gamma: Gamma = Gamma::ExpVisible, Range::Words(Gamma::WORDS);
        /// Which scales the likelihood adds.
        scales: Scales = Scales::Both, Range::Words(Scales::WORDS);
    }
    "Sec. 2.5, Eq. 15-21" {
        /// Number of templates.
        templates: usize = 10, number(2.0, 40.0);
        /// How the first templates are gathered.
        first_templates: FirstTemplates = FirstTemplates::Shifts, Range::Words(FirstTemplates::WORDS);
        /// Frames after the first that `first_templates = "warm_up"` uses (`"nearest"` needs as many as there are templates to find).
        warm_up_frames: usize = 9, number(1.0, 1000.0);
        /// Frames between updates of templates, large dictionary, large buffer and subspace.
        update_interval: usize = 5, number(1.0, 10_000.0);
        /// Frames between updates of the small dictionary and the small buffer.
        small_update_interval: usize = 20, number(1.0, 10_000.0);
        /// Templates are updated when the visible shares of both scales add to more than twice this.
        delta: f64 = 0.08, number(0.0, 1.0);
        /// The large buffer takes the estimate when more than this share of large patches is visible (o1).
        large_buffer_guard: f64 = 0.0, number(0.0, 1.0);
        /// The small buffer takes the estimate when more than this share of small patches is visible (o2).
        small_buffer_guard: f64 = 0.13, number(0.0, 1.0);
        /// The chance that a template is replaced grows by this factor from one to the next younger one.
        replacement_growth: f64 = 2.0, number(1.0, 100.0);
        /// Weight of the past in the subspace when a batch comes in (1 forgets nothing).
        forgetting: f64 = 1.0, number(0.01, 1.0);
        /// Eigenvectors are kept while their squared singular value is at least this share of the total.
        subspace_keep: f64 = 1e-6, number(0.0, 1.0);
        /// Most eigenvectors of the subspace.
        subspace_vectors: usize = 20, number(1.0, 64.0);
        /// Weight of the L1 norms in the reconstruction of the tracked candidate.
        lambda: f64 = 0.01, number(0.0, 1.0);
        /// Radius of the guided filter that smooths the occlusion mask, in samples; 0 turns it off.
        guided_radius: usize = 2, number(0.0, 32.0);
        /// Regularisation of the guided filter.
        guided_epsilon: f64 = 0.01, number(1e-9, 1.0);
    }
}

impl TrackerConfig {
    /// The configuration of a preset. `paper` is the tracker of the paper; `fast` is the same with 400 particles and small patches 4 samples apart (7 x 7
    /// instead of 13 x 13), which costs a small part of the time.
    ///
    /// # Errors
    /// [`Error::UnknownPreset`] names the presets that exist.
    pub fn preset(name: &str) -> Result<Self, Error> {
        match name {
            "paper" => Ok(Self::default()),
            "fast" => Ok(Self { particles: 400, small_step: 4, ..Self::default() }),
            _ => Err(Error::UnknownPreset { name: name.to_owned(), known: PRESETS.join(", ") }),
        }
    }

    /// Checks every field against its range, and the fields that must fit each other.
    ///
    /// # Errors
    /// [`Error::Config`] names the first field that is wrong, its value and what is allowed.
    pub fn validate(&self) -> Result<(), Error> {
        self.check_ranges()?;
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
        for (field, patch, step) in [
            ("large_step", self.large_patch, self.large_step),
            ("small_step", self.small_patch, self.small_step),
        ] {
            let per_side = (self.template_side - patch) / step + 1;
            let atoms = self.templates * per_side * per_side;
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
