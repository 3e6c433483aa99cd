//! The likelihood of a candidate (Eq. 24): the weighted features of both scales.

use super::weights::patch_weight;
use serde::{Deserialize, Serialize};

/// The contribution of one patch.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Feature {
    /// The pooled share of its code (`F_i` or `G_i`).
    pub share: f64,
    /// The squared error of its masked reconstruction; infinite for a patch of zero norm.
    pub error: f64,
}

/// The weight of the large scale in the likelihood.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Gamma {
    /// `exp(mean visibility - 1)`.
    ExpVisible,
    /// 1.
    One,
    /// The mean visibility.
    Visible,
    /// `exp(-mean error of the masked reconstruction)`.
    ExpError,
}

impl Gamma {
    /// All choices.
    pub const ALL: [Self; 4] = [Self::ExpVisible, Self::One, Self::Visible, Self::ExpError];
    /// The names used in configuration files.
    pub const WORDS: &'static [&'static str] = &["exp_visible", "one", "visible", "exp_error"];
}

/// The scales that contribute to the likelihood.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scales {
    /// Large and small patches.
    Both,
    /// Large patches only.
    Large,
    /// Small patches only.
    Small,
}

impl Scales {
    /// All choices.
    pub const ALL: [Self; 3] = [Self::Both, Self::Large, Self::Small];
    /// The names used in configuration files.
    pub const WORDS: &'static [&'static str] = &["both", "large", "small"];
}

/// How the features of a candidate are combined into its likelihood.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LikelihoodParams {
    /// A patch is visible if the squared error of its masked reconstruction is below this.
    pub epsilon: f64,
    /// Whether hidden patches lose their position weight.
    pub occlusion_weights: bool,
    /// Weight of the large scale.
    pub gamma: Gamma,
    /// The scales that contribute.
    pub scales: Scales,
}

impl LikelihoodParams {
    /// Whether a patch is visible: `kappa_i` or `tau_i`.
    pub fn visible(&self, feature: &Feature) -> bool {
        feature.error < self.epsilon
    }

    /// `p = gamma * mean_i(omega_i F_i) + mean_i(omega_i G_i)`. The inputs are features with their
    /// position weights.
    pub fn likelihood(
        &self,
        large: impl Iterator<Item = (Feature, f64)> + Clone,
        small: impl Iterator<Item = (Feature, f64)>,
    ) -> f64 {
        self.large_part(large) + self.small_part(small)
    }

    /// The contribution of the large patches, `gamma * mean_i(omega_i F_i)`.
    pub fn large_part(&self, large: impl Iterator<Item = (Feature, f64)> + Clone) -> f64 {
        if !self.counts_large() {
            return 0.0;
        }
        let gamma = self.gamma(large.clone().map(|(feature, _)| feature));
        gamma * mean(large.map(|(feature, position)| self.weighted(&feature, position)))
    }

    /// The contribution of the small patches, `mean_i(omega_i G_i)`.
    pub fn small_part(&self, small: impl Iterator<Item = (Feature, f64)>) -> f64 {
        if !self.counts_small() {
            return 0.0;
        }
        mean(small.map(|(feature, position)| self.weighted(&feature, position)))
    }

    /// `omega_i F_i` of one patch.
    pub fn weighted(&self, feature: &Feature, position: f64) -> f64 {
        let visible = !self.occlusion_weights || self.visible(feature);
        patch_weight(visible, position) * feature.share
    }

    /// The largest value of [`Self::weighted`] at this position weight; shares are at most 1.
    pub fn weighted_at_most(&self, position: f64) -> f64 {
        patch_weight(true, position)
    }

    /// An upper bound of [`Self::large_part`] where some features are not known yet; shares are at
    /// most 1.
    pub fn large_part_at_most(
        &self,
        large: impl Iterator<Item = (Option<Feature>, f64)> + Clone,
    ) -> f64 {
        // The best case: visible, with the whole code on atoms of its own location.
        let best = Feature { share: 1.0, error: f64::NEG_INFINITY };
        self.large_part(large.map(|(feature, position)| (feature.unwrap_or(best), position)))
    }

    /// Whether the large scale contributes.
    pub fn counts_large(&self) -> bool {
        self.scales != Scales::Small
    }

    /// Whether the small scale contributes.
    pub fn counts_small(&self) -> bool {
        self.scales != Scales::Large
    }

    fn gamma(&self, large: impl Iterator<Item = Feature>) -> f64 {
        let visible = |feature: Feature| f64::from(u8::from(self.visible(&feature)));
        match self.gamma {
            Gamma::ExpVisible => (mean(large.map(visible)) - 1.0).exp(),
            Gamma::One => 1.0,
            Gamma::Visible => mean(large.map(visible)),
            Gamma::ExpError => (-mean(large.map(|feature| feature.error.clamp(0.0, 1.0)))).exp(),
        }
    }
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), v| (sum + v, count + 1.0));
    if count > 0.0 { sum / count } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn features(shares: &[f64], errors: &[f64]) -> Vec<(Feature, f64)> {
        let feature = |(&share, &error)| (Feature { share, error }, 0.5);
        shares.iter().zip(errors).map(feature).collect()
    }

    const PAPER: LikelihoodParams = LikelihoodParams {
        epsilon: 0.08,
        occlusion_weights: true,
        gamma: Gamma::ExpVisible,
        scales: Scales::Both,
    };

    fn likelihood(params: &LikelihoodParams) -> f64 {
        let large = features(&[0.5, 1.0], &[0.01, 0.5]);
        let small = features(&[0.2, 0.4], &[0.5, 0.079]);
        params.likelihood(large.into_iter(), small.into_iter())
    }

    #[test]
    fn the_likelihood_is_eq_24() {
        // Large: one of two patches is visible, so gamma = exp(-1/2) and the weights are 1.5 and 1.
        // Small: the weights are 1 and 1.5.
        let (large, small) = ((1.5 * 0.5 + 1.0) / 2.0, (0.2 + 1.5 * 0.4) / 2.0);
        assert!((likelihood(&PAPER) - ((-0.5f64).exp() * large + small)).abs() < 1e-12);
        let with = |gamma, scales| likelihood(&LikelihoodParams { gamma, scales, ..PAPER });
        assert!((with(Gamma::One, Scales::Both) - (large + small)).abs() < 1e-12);
        assert!((with(Gamma::Visible, Scales::Large) - 0.5 * large).abs() < 1e-12);
        assert!((with(Gamma::ExpError, Scales::Large) - (-0.255f64).exp() * large).abs() < 1e-12);
        assert!((with(Gamma::One, Scales::Small) - small).abs() < 1e-12);
        let all = LikelihoodParams { occlusion_weights: false, scales: Scales::Small, ..PAPER };
        assert!((likelihood(&all) - 1.5 * 0.3).abs() < 1e-12);
    }
}
