//! The settings of the method `robust`.

use crate::Error;
use crate::config::{
    MethodConfig, MethodInfo, NetworkUse, Parameter, PatchModelConfig, Range, STABLE, group, number,
};
use crate::patch_model::likelihood::{Gamma, LikelihoodParams, Scales};
use crate::patch_model::params::PatchParams;

group! {
    /// The settings of the default tracker, the method `robust`.
    RobustConfig ("robust") { patches: PatchModelConfig = PatchModelConfig::coarse() }
    "Li et al. 2018 (STRCF)" {
        /// Side of the search window, in roots of the target's area.
        search: f64 = 5.0, number(1.5, 20.0), STABLE;
        /// Standard deviation of the filter's label, in roots of the target's area.
        label_width: f64 = 0.0625, number(0.01, 1.0);
        /// How strongly the filter is drawn to the one before; larger values learn more slowly.
        temporal: f64 = 10.0, number(0.0, 1e6), STABLE;
        /// How closely the second iteration of learning follows the masked filter of the first.
        penalty: f64 = 0.1, number(1e-3, 10.0);
        /// Side of the patch that the search window is resampled to, in pixels.
        patch: f64 = 150.0, number(32.0, 512.0), STABLE;
        /// Shortest side to which the target may shrink, in pixels.
        least_side: f64 = 5.0, number(1.0, 1000.0), STABLE;
    }
    "Danelljan et al. 2014 (DSST)" {
        /// Number of scales that are tried on each frame; an odd number.
        scale_count: usize = 33, number(3.0, 99.0), STABLE;
        /// Ratio of neighbouring scales.
        scale_step: f64 = 1.02, number(1.001, 1.2), STABLE;
        /// Standard deviation of the scale filter's label, in roots of the number of scales.
        scale_label_width: f64 = 0.25, number(0.01, 1.0);
        /// Learning rate of the scale filter.
        scale_rate: f64 = 0.025, number(0.0, 1.0), STABLE;
        /// Area of the crops of the scale filter, in pixels.
        scale_area: f64 = 512.0, number(64.0, 4096.0);
    }
    "Li et al. 2019 (LDES), with our own numbers" {
        /// Whether rotation in the frame is followed.
        rotate: bool = true, Range::Flag, STABLE;
        /// Rotation is measured while the memory's response is below this share of its mean.
        rotation_below: f64 = 0.8, number(0.0, 10.0);
        /// A measured rotation counts from this many radians.
        rotation_least: f64 = 0.18, number(0.0, 3.2);
        /// A rotation is accepted if tracking filters and memory together respond this many times
        /// stronger.
        rotation_margin: f64 = 1.1, number(0.0, 10.0);
        /// Learning rate of the filter over rotation.
        rotation_rate: f64 = 0.1, number(0.0, 1.0);
        /// A measured rotation is clear if the filter responds at least with this share of its mean
        /// response.
        rotation_clear: f64 = 0.4, number(0.0, 10.0);
        /// A measured rotation counts up to this many radians.
        rotation_most: f64 = 0.35, number(0.0, 3.2);
        /// Mean response of the filter over rotation before anything was measured.
        rotation_mean: f64 = 0.3, number(0.0, 10.0);
        /// Rate of the mean response of the filter over rotation.
        rotation_mean_rate: f64 = 0.05, number(0.0, 1.0);
        /// `rotation_least` while the target turns.
        turning_least: f64 = 0.03, number(0.0, 3.2);
        /// `rotation_margin` while the target turns.
        turning_margin: f64 = 1.02, number(0.0, 10.0);
        /// `rotation_rate` while the target turns.
        turning_rate: f64 = 0.2, number(0.0, 1.0);
        /// Number of frames without rotation after which the target no longer counts as turning.
        turning_frames: usize = 10, number(0.0, 10_000.0);
    }
    "Bertinetto et al. 2016 (Staple), with our own numbers" {
        /// Weight of the map of the target's colours, relative to the memory's mean response.
        colour_weight: f64 = 0.3, number(0.0, 10.0), STABLE;
        /// The map of colours counts while the contrast of the target's colours to its
        /// surroundings is at least this: 0 is none, 1 is full.
        colour_contrast: f64 = 0.2, number(-1.0, 1.0);
        /// Learning rate of the histogram of the target's colours.
        colour_rate: f64 = 0.04, number(0.0, 1.0);
        /// Learning rate of the histogram of the colours around the target.
        around_rate: f64 = 0.3, number(0.0, 1.0);
    }
    "own measurement" {
        /// Learning rate of the memory, which averages the tracking filters over sure frames.
        memory_rate: f64 = 0.02, number(0.0, 1.0), STABLE;
        /// A frame is sure while the memory's response is above this share of its recent value,
        /// or of its mean if that is lower.
        sure: f64 = 0.7, number(0.0, 10.0);
        /// No frame is sure below this part of the visible share on sure frames.
        sure_visible: f64 = 0.1, number(0.0, 10.0);
        /// No frame is sure if less than this share of the target is reported as
        /// visible.
        sure_shown: f64 = 0.5, number(0.0, 1.0);
        /// Number of first frames that count as sure whatever the memory responds.
        first_frames: usize = 10, number(0.0, 10_000.0);
        /// Rate of the running means of the memory's response, the visible share and the contrast.
        recent_rate: f64 = 0.05, number(0.0, 1.0);
        /// Upper limit of the memory's response away from the box, relative to its response at the
        /// box.
        elsewhere_most: f64 = 2.0, number(0.0, 1e6);
        /// A frame is doubtful if the memory's response is below this share of its mean and
        /// `lost_drop` holds.
        lost_below: f64 = 0.4, number(0.0, 10.0);
        /// A doubtful frame has a memory response below this share of its recent value.
        lost_drop: f64 = 0.6, number(0.0, 10.0);
        /// The target is lost after this many consecutive doubtful frames.
        lost_after: usize = 5, number(1.0, 10_000.0), STABLE;
        /// The target may be covered below this part of the visible share on sure frames, if
        /// `covered_elsewhere`, `covered_contrast` and `covered_below` hold too.
        covered_visible: f64 = 0.3, number(0.0, 10.0);
        /// The target may be covered if the memory responds away from the box with more than this
        /// share of its response at the box.
        covered_elsewhere: f64 = 0.6, number(0.0, 10.0);
        /// The target may be covered if the contrast of its colours is below this share of the
        /// contrast on sure frames.
        covered_contrast: f64 = 0.75, number(0.0, 10.0);
        /// The target may be covered if the memory's response is below this share of its mean.
        covered_below: f64 = 0.55, number(0.0, 10.0);
        /// The target is lost after this many consecutive covered frames.
        covered_after: usize = 10, number(1.0, 10_000.0);
        /// While the target is lost, a place counts as found if the memory's response is above
        /// this share of its mean.
        found_above: f64 = 0.65, number(0.0, 10.0), STABLE;
        /// A place that was found is accepted after this many frames that do not count as lost.
        trial: usize = 5, number(1.0, 10_000.0), STABLE;
        /// A place that was found is not accepted if the mean share of the target that was reported
        /// as visible on the last frames is below this.
        trial_shown: f64 = 0.4, number(0.0, 1.0), STABLE;
        /// The target counts as unseen where it is followed, and is searched for elsewhere, if the
        /// mean share that was reported as visible on the last frames is below this and the
        /// memory's response is below `found_above`.
        unseen_below: f64 = 0.15, number(0.0, 1.0);
        /// Rate of the mean share that was reported as visible on the last frames.
        unseen_rate: f64 = 0.15, number(0.0, 1.0);
        /// An unseen target is seen again if the mean share is above this and `seen_certainty`
        /// holds; a place that is found elsewhere has to show at least this share of it.
        seen_again: f64 = 0.25, number(0.0, 1.0);
        /// An unseen target is seen again only if the memory's response is above this share of its
        /// mean.
        seen_certainty: f64 = 0.5, number(0.0, 10.0);
        /// An unseen target is no longer followed after `lost_after` consecutive frames with a
        /// response of the memory below this share of its mean.
        gone_below: f64 = 0.3, number(0.0, 10.0);
        /// Number of windows that are searched on each frame while the target is lost.
        search_windows: usize = 5, number(1.0, 1000.0), STABLE;
        /// Share of their side by which the windows of the search overlap.
        search_overlap: f64 = 0.5, number(0.0, 0.9);
        /// Size of the target in the second of four passes of the search over the frame, relative
        /// to the last one.
        search_larger: f64 = 1.2, number(0.1, 10.0), STABLE;
        /// Size of the target in the third of four passes of the search over the frame, relative to
        /// the last one.
        search_smaller: f64 = 0.8, number(0.1, 10.0), STABLE;
        /// A peak in a window of the search is examined if it is above this share of `found_above`.
        found_promising: f64 = 0.5, number(0.0, 10.0);
        /// Larger size that is tried at a place that was found, relative to the last one.
        found_larger: f64 = 1.25, number(0.1, 10.0);
        /// Smaller size that is tried at a place that was found, relative to the last one.
        found_smaller: f64 = 0.8, number(0.1, 10.0);
        /// The scale filter learns only if the memory's strongest response away from the box,
        /// relative to its response at the box, exceeds the visible share by less than this.
        scale_below: f64 = 0.89, number(-1.0, 10.0);
        /// Constant term of the score, a logistic function of a weighted sum.
        score_bias: f64 = -2.8, number(-100.0, 100.0);
        /// Rate of the mean visible share in the score; the share is 0 while the target is lost.
        score_rate: f64 = 0.02, number(0.0, 1.0);
        /// Rate of the means of what the memory says in the score.
        score_memory_rate: f64 = 0.3, number(0.0, 1.0);
        /// Weight of the mean visible share in the score.
        score_visible: f64 = 2.9, number(-100.0, 100.0);
        /// Weight in the score of the memory's strongest response away from the box, relative to
        /// its response at the box, as a mean over the last frames.
        score_elsewhere: f64 = -3.1, number(-100.0, 100.0);
        /// Weight in the score of how well colours tell the target from what is around it, relative
        /// to the first frame.
        score_contrast: f64 = 2.2, number(-100.0, 100.0);
        /// Weight in the score of how sure the memory was when it had seen no more than the first
        /// sure frames, as a mean over the last frames.
        score_early: f64 = 3.4, number(-100.0, 100.0);
        /// A patch is reported as visible, and counts for score and status, when the squared error
        /// of its own-location code is below this. What is learned, and whether the target is
        /// covered, is decided with the stricter `epsilon`.
        shown_epsilon: f64 = 0.2, number(0.0, 4.0), STABLE;
        /// The target counts as tracked from this score on.
        score_tracked: f64 = 0.7, number(0.0, 1.0), STABLE;
        /// The target counts as tracked only if at least this share of it is visible and, with a
        /// network, filters and network agree; or, with a network, from a score of 0.9 on if their
        /// boxes touch. If less is visible then, `visibility` is not known.
        visible_tracked: f64 = 0.25, number(0.0, 1.0), STABLE;
        /// The target counts as lost below this score, also before it is given up. The score is at
        /// most this once it is given up.
        score_lost: f64 = 0.5, number(0.0, 1.0), STABLE;
    }
    "own measurement; only with a network" {
        /// Share of the difference between the box of the first frame and what the network sees
        /// there, on a logarithmic scale, that is taken out of all its later boxes.
        network_fit: f64 = 0.6, number(0.0, 1.0), STABLE;
        /// Default tracker and network agree while their boxes overlap by more than this.
        agree_overlap: f64 = 0.4, number(0.0, 1.0);
    }
}

impl RobustConfig {
    /// The parameters of the patch model. Its weighing of candidates is not used.
    pub(crate) fn patch_params(&self) -> PatchParams {
        let likelihood = LikelihoodParams {
            epsilon: self.patches.epsilon,
            occlusion_weights: true,
            gamma: Gamma::ExpVisible,
            scales: Scales::Both,
        };
        let mut params = self.patches.params(likelihood, 0.8, true);
        // One candidate is looked at in each frame.
        params.scale.keeps_products = false;
        params
    }
}

impl MethodConfig for RobustConfig {
    fn info(&self) -> &'static MethodInfo {
        &MethodInfo {
            name: Self::NAME,
            purpose: "the most accurate; reports a loss and searches for the target",
            family: "correlation filters",
            title: "Visual object tracker by correlation filters with a long-term memory",
            network: NetworkUse::Optional,
            score_is_probability: true,
            megabytes: 1,
        }
    }

    fn patches(&self) -> Option<&PatchModelConfig> {
        Some(&self.patches)
    }

    // Those of rotation count only if it is followed, and some only with a network.
    fn reads(&self, name: &str, has_network: bool) -> bool {
        match name.split('_').next() {
            Some("rotation" | "turning") => self.rotate,
            Some("network" | "agree") => has_network,
            _ => true,
        }
    }

    fn is_stable(&self, row: &Parameter) -> bool {
        row.is_stable
    }

    fn check(&self) -> Result<(), Error> {
        if self.scale_count.is_multiple_of(2) {
            return Err(Error::Config {
                field: "scale_count",
                value: self.scale_count.to_string(),
                allowed: "an odd number".to_owned(),
            });
        }
        Ok(())
    }
}
