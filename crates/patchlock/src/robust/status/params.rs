//! The thresholds of the state machine.

use crate::config::RobustConfig;
use crate::robust::score::ScoreParams;

/// The thresholds of the state machine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct StatusParams {
    /// The number of first frames from which the long-term models learn whatever the certainty is,
    /// unless the target is hidden.
    pub first_frames: u64,
    /// The certainty, relative to its running mean (capped at 1), above which the long-term models
    /// learn.
    pub sure: f64,
    /// The strictly visible share, relative to its mean, from which the long-term models learn.
    pub sure_visible: f64,
    /// The visible share from which the long-term models learn.
    pub sure_shown: f64,
    /// The scale filter learns while the response elsewhere exceeds the strictly visible share by
    /// less than this.
    pub size_below: f64,
    /// The rate of the running means of certainty, visible share and contrast.
    pub recent_rate: f64,
    /// When the memory no longer recognises the target.
    pub unrecognised: UnrecognisedParams,
    /// When something covers the target.
    pub occlusion: OcclusionCueParams,
    /// The limits of [`Phase::Occluded`](super::Phase).
    pub occluded: OccludedParams,
    /// The number of frames for which a re-detection is verified.
    pub trial: u32,
    /// The mean visible share from which a verified re-detection is trusted.
    pub trial_shown: f64,
    /// The weights of the score.
    pub score: ScoreParams,
    /// The score from which the status is tracked.
    pub tracked: f64,
    /// The visible share from which the status is tracked.
    pub visible: f64,
    /// The score below which the status is lost.
    pub lost: f64,
}

/// When the memory no longer recognises the target: its certainty is low, and has fallen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct UnrecognisedParams {
    /// The certainty must be below this.
    pub below: f64,
    /// The certainty, relative to its running mean, must be below this.
    pub drop: f64,
    /// The number of consecutive frames after which the target is searched for.
    pub after: u32,
}

/// When something covers the target that the patch model half recognises: the certainty is low,
/// little is visible, the memory responds elsewhere as well, and the colours stand out less.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct OcclusionCueParams {
    /// The strictly visible share, relative to its mean, must be below this.
    pub visible: f64,
    /// The response elsewhere must be above this.
    pub elsewhere: f64,
    /// The contrast of colours, relative to its mean, must be below this.
    pub contrast: f64,
    /// The certainty must be below this.
    pub below: f64,
    /// The number of consecutive frames after which the target is searched for.
    pub after: u32,
}

/// When hardly anything is visible of the target at the pose that the filters follow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct OccludedParams {
    /// The mean visible share of the last frames below which the target is occluded.
    pub below: f64,
    /// The certainty below which the target is occluded; from it on the search would find the target
    /// there.
    pub certainty: f64,
    /// The mean visible share above which the target is tracked again.
    pub again: f64,
    /// The certainty above which the target is tracked again.
    pub again_certainty: f64,
    /// The certainty below which a frame counts towards giving up the pose.
    pub gone_below: f64,
    /// The number of such consecutive frames after which the target is lost.
    pub gone_after: u32,
}

impl StatusParams {
    pub fn new(config: &RobustConfig) -> Self {
        Self {
            first_frames: config.first_frames as u64,
            sure: config.sure,
            sure_visible: config.sure_visible,
            sure_shown: config.sure_shown,
            size_below: config.scale_below,
            recent_rate: config.recent_rate,
            unrecognised: UnrecognisedParams {
                below: config.lost_below,
                drop: config.lost_drop,
                after: config.lost_after as u32,
            },
            occlusion: OcclusionCueParams {
                visible: config.covered_visible,
                elsewhere: config.covered_elsewhere,
                contrast: config.covered_contrast,
                below: config.covered_below,
                after: config.covered_after as u32,
            },
            occluded: OccludedParams {
                below: config.unseen_below,
                certainty: config.found_above,
                again: config.seen_again,
                again_certainty: config.seen_certainty,
                gone_below: config.gone_below,
                gone_after: config.lost_after as u32,
            },
            trial: config.trial as u32,
            trial_shown: config.trial_shown,
            tracked: config.score_tracked,
            visible: config.visible_tracked,
            lost: config.score_lost,
            score: ScoreParams::new(config),
        }
    }
}
