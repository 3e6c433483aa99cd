//! The score: how probably the box is right.

use super::RobustConfig;
use super::evidence::Evidence;
use serde::{Deserialize, Serialize};

/// The contrast of colours in the first frame counts as at least this,
const LEAST_CONTRAST: f64 = 0.05;

/// and later contrast, relative to it, as at most this.
const MOST_CONTRAST: f64 = 1.2;

/// The range in which the certainty of the early memory counts.
const EARLY: [f64; 2] = [0.0, 1.5];

/// Running means of the evidence: what is off the target for long, or was until now, is less certain,
/// and one bad frame is no loss.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct RunningMeans {
    /// The reported share over many frames, 0 while the target is lost.
    pub visible: f64,
    /// The reported share of the last frames.
    pub recent_visible: f64,
    /// The response elsewhere on the last frames.
    pub elsewhere: f64,
    /// The certainty of the early memory on the last frames.
    pub early: f64,
    /// The contrast of colours in the first frame.
    pub first_contrast: f64,
}

impl RunningMeans {
    /// In the first frame.
    pub fn first(evidence: &Evidence) -> Self {
        let Evidence { visible, elsewhere, contrast: first_contrast, .. } = *evidence;
        let early = early(evidence);
        Self { visible, recent_visible: visible, elsewhere, early, first_contrast }
    }

    /// Whether all numbers are ones that evidence can lead to.
    pub fn is_sound(&self) -> bool {
        let Self { visible, recent_visible, elsewhere, early, first_contrast } = *self;
        [visible, recent_visible, elsewhere, early, first_contrast]
            .iter()
            .all(|mean| mean.is_finite())
    }

    /// With one frame more, at a place that was found: those of the last frames begin anew.
    pub fn restarted(self, evidence: &Evidence, config: &RobustConfig) -> Self {
        let Self { visible, .. } = self.after(evidence, config);
        Self { visible, first_contrast: self.first_contrast, ..Self::first(evidence) }
    }

    /// With one frame more.
    pub fn after(mut self, evidence: &Evidence, config: &RobustConfig) -> Self {
        self.visible += config.score_rate * (evidence.visible - self.visible);
        self.recent_visible += config.unseen_rate * (evidence.visible - self.recent_visible);
        self.elsewhere += config.score_memory_rate * (evidence.elsewhere - self.elsewhere);
        self.early += config.score_memory_rate * (early(evidence) - self.early);
        self
    }

    /// The probability that the box overlaps the target by at least half, from the means with this
    /// frame and the frame itself: the logistic function of a sum, fitted to the development targets.
    pub fn score(&self, evidence: &Evidence, config: &RobustConfig) -> f64 {
        let first = self.first_contrast.max(LEAST_CONTRAST);
        let contrast = (evidence.contrast / first).min(MOST_CONTRAST);
        let sum = config.score_bias
            + config.score_visible * self.visible
            + config.score_elsewhere * self.elsewhere
            + config.score_contrast * contrast
            + config.score_early * self.early;
        1.0 / (1.0 + (-sum).exp())
    }
}

/// How sure the early memory is, as it counts.
fn early(evidence: &Evidence) -> f64 {
    evidence.early.clamp(EARLY[0], EARLY[1])
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Visible share and response elsewhere count alike.
    pub fn config() -> RobustConfig {
        RobustConfig {
            score_rate: 0.1,
            unseen_rate: 0.5,
            score_memory_rate: 0.25,
            score_bias: 0.0,
            score_visible: 4.0,
            score_elsewhere: -4.0,
            score_contrast: 0.0,
            score_early: 0.0,
            ..Default::default()
        }
    }

    const EVIDENCE: Evidence = Evidence {
        certainty: 0.9,
        elsewhere: 0.2,
        early: 0.7,
        strictly_visible: 0.7,
        visible: 0.8,
        contrast: 0.5,
    };

    const MEANS: RunningMeans = RunningMeans {
        visible: 0.3,
        recent_visible: 0.3,
        elsewhere: 0.6,
        early: 1.0,
        first_contrast: 0.4,
    };

    fn logistic(sum: f64) -> f64 {
        1.0 / (1.0 + (-sum).exp())
    }

    #[test]
    fn the_sum_has_a_term_for_each_number() {
        let config =
            RobustConfig { score_bias: 0.5, score_contrast: 3.0, score_early: 2.0, ..config() };
        let means = RunningMeans { first_contrast: 0.5, ..MEANS };
        let evidence = Evidence { contrast: 0.25, ..EVIDENCE };
        let sum = 0.5 + 4.0 * 0.3 - 4.0 * 0.6 + 3.0 * 0.5 + 2.0 * 1.0;
        assert!((means.score(&evidence, &config) - logistic(sum)).abs() < 1e-12);
    }

    #[test]
    fn contrast_counts_relative_to_the_first_frame() {
        let config = RobustConfig {
            score_bias: -1.0,
            score_visible: 0.0,
            score_elsewhere: 0.0,
            score_contrast: 2.0,
            ..config()
        };
        // The sum is -1 and twice the relative contrast.
        for (first_contrast, contrast, sum) in [
            (0.5, 0.25, 0.0),
            (0.5, 0.5, 1.0),
            (0.25, 1.0, 1.4),
            (0.0, 0.025, 0.0),
            (0.5, -0.5, -3.0),
        ] {
            let evidence = Evidence { contrast, ..EVIDENCE };
            let score = RunningMeans { first_contrast, ..MEANS }.score(&evidence, &config);
            assert!((score - logistic(sum)).abs() < 1e-12, "{first_contrast} {contrast}");
        }
    }

    #[test]
    fn the_means_move_towards_the_frame_by_the_rate() {
        let near = |a: f64, b: f64| (a - b).abs() < 1e-12;
        for (early, after) in [(0.6, 0.9), (9.0, 1.125), (-3.0, 0.75)] {
            let means = MEANS.after(&Evidence { early, ..EVIDENCE }, &config());
            assert!(near(means.visible, 0.35) && near(means.recent_visible, 0.55), "{means:?}");
            assert!(near(means.elsewhere, 0.5), "{means:?}");
            assert!(near(means.early, after), "{early} {means:?}");
            assert!(near(means.first_contrast, 0.4));
        }
    }

    #[test]
    fn at_a_place_that_was_found_the_means_of_the_last_frames_begin_anew() {
        let begun = MEANS.restarted(&EVIDENCE, &config());
        let RunningMeans { visible, .. } = MEANS.after(&EVIDENCE, &config());
        let first_contrast = MEANS.first_contrast;
        assert_eq!(
            begun,
            RunningMeans { visible, first_contrast, ..RunningMeans::first(&EVIDENCE) }
        );
    }

    #[test]
    fn the_first_means_are_the_first_frame() {
        let first = RunningMeans::first(&EVIDENCE);
        let Evidence { visible, elsewhere, early, contrast: first_contrast, .. } = EVIDENCE;
        assert_eq!(
            first,
            RunningMeans { visible, recent_visible: visible, elsewhere, early, first_contrast }
        );
        assert!(first.is_sound());
        assert!(!RunningMeans { elsewhere: f64::INFINITY, ..first }.is_sound());
    }
}
