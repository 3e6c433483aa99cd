//! The settings of the method `paper`.

use crate::config::{MethodConfig, MethodInfo, NetworkUse, PatchModelConfig, Range, group, number};
use crate::patch_model::likelihood::{Gamma, LikelihoodParams, Scales};
use crate::patch_model::params::PatchParams;

group! {
    /// The settings of the paper's tracker, the method `paper`.
    PaperConfig ("paper") { patches: PatchModelConfig = PatchModelConfig::default() }
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
    "paper Sec. 2.3, Eq. 12-14, 18-19" {
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
}

impl PaperConfig {
    /// The parameters of the patch model.
    #[doc(hidden)]
    pub fn patch_params(&self) -> PatchParams {
        let likelihood = LikelihoodParams {
            epsilon: self.patches.epsilon,
            occlusion_weights: self.occlusion_weights,
            gamma: self.gamma,
            scales: self.scales,
        };
        self.patches.params(likelihood, self.beta, self.position_weights)
    }
}

impl MethodConfig for PaperConfig {
    fn info(&self) -> &'static MethodInfo {
        &MethodInfo {
            name: Self::NAME,
            purpose: "the tracker of the paper, for comparison",
            family: "sparse appearance",
            title: "Visual object tracker by structural local sparse appearance",
            network: NetworkUse::Unused,
            score_is_probability: false,
            megabytes: 20,
        }
    }

    fn patches(&self) -> Option<&PatchModelConfig> {
        Some(&self.patches)
    }

    fn needs_grey(&self) -> bool {
        true
    }
}
