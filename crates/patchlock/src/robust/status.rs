//! The state machine: from the evidence of a frame to phase, status, and which models learn. It sees
//! no frame.

use super::RobustConfig;
use super::evidence::Evidence;
use super::pose::Pose;
use super::score::RunningMeans;
use crate::estimate::Status;
use serde::{Deserialize, Serialize};

#[cfg(test)]
mod tests;

/// More windows than any search has; counting on from here never overflows.
const MAX_WINDOWS: u64 = 1 << 53;

/// What the tracker is doing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Phase {
    /// The filters follow the target. `doubtful` counts consecutive frames with a failure cue.
    Tracking { doubtful: u32 },
    /// The filters go on, but hardly anything of the target is visible there, so it is also searched
    /// for around the last pose at which it was. The status is never tracked. `next` is the number of
    /// the next window of the search; `unknown` counts consecutive frames on which the memory did not
    /// recognise the target at all.
    Occluded { next: u64, unknown: u32, last: Pose },
    /// The target is lost and searched for. `next` is the number of the next window of the search.
    Lost { next: u64 },
    /// The filters follow a re-detection. After `left` more frames it is trusted if enough of the
    /// target is visible; on a failure cue before, the tracker goes back to `back`.
    Verifying { left: u32, back: Pose },
}

/// The state from frame to frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct TrackState {
    pub phase: Phase,
    /// The running mean of the certainty over frames without a failure cue.
    recent: f64,
    /// The mean strictly visible share over sure frames.
    seen: f64,
    /// The mean contrast of colours over sure frames.
    contrast: f64,
    /// The running means that the score counts.
    means: RunningMeans,
}

/// What follows from the evidence of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Decision {
    /// The new state.
    pub state: TrackState,
    pub result: FrameResult,
    /// Which models learn; `None` while the target is lost.
    pub update: Option<UpdatePolicy>,
    /// The pose to go back to after a re-detection that was not confirmed.
    pub back: Option<Pose>,
}

/// Status and score of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FrameResult {
    pub status: Status,
    /// The probability that the box overlaps the target by at least half; at most `score_lost` while
    /// the target is lost.
    pub score: f64,
}

/// Which models learn on a frame, besides tracking filter, colours and rotation, which always do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct UpdatePolicy {
    /// Whether the frame is sure, so that the memory and the patch model learn.
    pub sure: bool,
    /// Whether the scale filter learns.
    pub size: bool,
}

/// A sign that the target is lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum FailureCue {
    /// The memory recognises the target.
    None,
    /// The memory does not recognise the target.
    Unrecognised,
    /// Something covers the target.
    Occlusion,
}

impl Phase {
    /// The name, as snapshots and observers have it.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Tracking { .. } => "tracking",
            Self::Occluded { .. } => "occluded",
            Self::Lost { .. } => "lost",
            Self::Verifying { .. } => "verifying",
        }
    }
}

impl TrackState {
    /// The state in the first frame.
    pub fn first(evidence: &Evidence) -> Self {
        let Evidence { strictly_visible: seen, contrast, .. } = *evidence;
        let (phase, means) = (Phase::Tracking { doubtful: 0 }, RunningMeans::first(evidence));
        Self { phase, recent: 1.0, seen, contrast, means }
    }

    /// Whether all numbers are ones that evidence can lead to.
    pub fn is_sound(&self) -> bool {
        let phase = match self.phase {
            Phase::Tracking { .. } => true,
            Phase::Occluded { next, last, .. } => next <= MAX_WINDOWS && last.is_sound(),
            Phase::Lost { next } => next <= MAX_WINDOWS,
            Phase::Verifying { back, .. } => back.is_sound(),
        };
        phase
            && self.means.is_sound()
            && [self.recent, self.seen, self.contrast].iter().all(|mean| mean.is_finite())
    }

    /// The running means that the score counts.
    pub fn means(&self) -> &RunningMeans {
        &self.means
    }

    /// Whether the target is lost, and nothing is followed.
    pub fn is_lost(&self) -> bool {
        matches!(self.phase, Phase::Lost { .. })
    }

    /// Whether the target is searched for.
    fn is_searched(&self) -> bool {
        matches!(self.phase, Phase::Lost { .. } | Phase::Occluded { .. })
    }

    /// Begins to verify a re-detection; `back` is the last pose before.
    pub fn begin_verification(&mut self, back: Pose, config: &RobustConfig) {
        self.phase = Phase::Verifying { left: config.trial as u32, back };
    }

    /// Goes on with the search, after this many windows in which nothing was found.
    pub fn search_on(&mut self, windows: u64) {
        if let Phase::Lost { next } | Phase::Occluded { next, .. } = &mut self.phase {
            *next += windows;
        }
    }

    /// The decision on the frame with this number, where the filters went from the pose `last`; the
    /// first frame has number 0. While the target is lost, only the means of the score change.
    pub fn advance(
        mut self,
        evidence: &Evidence,
        (frame, last): (u64, Pose),
        config: &RobustConfig,
    ) -> Decision {
        self.means = match self.phase {
            Phase::Verifying { left, .. } if left == config.trial as u32 => {
                self.means.restarted(evidence, config)
            }
            _ => self.means.after(evidence, config),
        };
        if self.is_lost() {
            let result = self.result(evidence, config);
            return Decision { state: self, result, update: None, back: None };
        }
        let cue = self.cue(evidence, config);
        let mut state = self.learned(evidence, cue, config);
        state.phase = self.next_phase(evidence, cue, last, config);
        let back = match (self.phase, state.phase) {
            (Phase::Verifying { back, .. }, Phase::Lost { .. } | Phase::Occluded { .. }) => {
                Some(back)
            }
            (Phase::Occluded { last, .. }, Phase::Lost { .. }) => Some(last),
            _ => None,
        };
        let result = state.result(evidence, config);
        let update = (!state.is_lost()).then(|| state.update_policy(evidence, frame, config));
        Decision { state, result, update, back }
    }

    /// Status and score.
    pub fn result(&self, evidence: &Evidence, config: &RobustConfig) -> FrameResult {
        let score = self.means.score(evidence, config);
        let status = match self.phase {
            Phase::Lost { .. } => Status::Lost,
            // The score calls a target lost before it is given up.
            _ if score < config.score_lost => Status::Lost,
            Phase::Tracking { .. }
                if score >= config.score_tracked && evidence.visible >= config.visible_tracked =>
            {
                Status::Tracked
            }
            _ => Status::Uncertain,
        };
        let score = if self.is_lost() { score.min(config.score_lost) } else { score };
        FrameResult { status, score }
    }

    /// The failure cue of a frame.
    fn cue(&self, evidence: &Evidence, config: &RobustConfig) -> FailureCue {
        let certainty = evidence.certainty;
        // Appearance that changes slowly makes the memory less sure, too, but never suddenly.
        if certainty < config.lost_below && certainty < config.lost_drop * self.recent {
            FailureCue::Unrecognised
        } else if self.is_occlusion_cue(evidence, config) {
            FailureCue::Occlusion
        } else {
            FailureCue::None
        }
    }

    /// Whether the memory is so sure of a place that it can learn from it. Appearance that changes
    /// slowly makes it less sure; it then learns the change, but neither what hides the target slowly
    /// nor what the patch model does not know.
    fn is_sure(&self, evidence: &Evidence, config: &RobustConfig) -> bool {
        evidence.certainty > config.sure * self.recent.min(1.0)
            && evidence.visible >= config.sure_shown
            && !self.is_hidden(evidence, config)
    }

    /// Whether next to nothing of the target is visible.
    fn is_hidden(&self, evidence: &Evidence, config: &RobustConfig) -> bool {
        evidence.strictly_visible < config.sure_visible * self.seen
    }

    /// Whether something that the patch model half recognises covers the target: little of it is
    /// visible, the memory responds elsewhere as well, and its colours stand out less from those
    /// around it, as where what covers it is larger. Similar things nearby do the first two, but
    /// not the third.
    fn is_occlusion_cue(&self, evidence: &Evidence, config: &RobustConfig) -> bool {
        evidence.certainty < config.covered_below
            && evidence.strictly_visible < config.covered_visible * self.seen
            && evidence.elsewhere > config.covered_elsewhere
            && evidence.contrast < config.covered_contrast * self.contrast
    }

    /// The running means after a frame.
    fn learned(mut self, evidence: &Evidence, cue: FailureCue, config: &RobustConfig) -> Self {
        if self.is_searched() {
            return self;
        }
        if self.is_sure(evidence, config) {
            self.seen += config.recent_rate * (evidence.strictly_visible - self.seen);
            self.contrast += config.recent_rate * (evidence.contrast - self.contrast);
        }
        if cue == FailureCue::None {
            self.recent += config.recent_rate * (evidence.certainty - self.recent);
        }
        self
    }

    /// The phase after a frame on which the filters went from the pose `last`.
    fn next_phase(
        &self,
        evidence: &Evidence,
        cue: FailureCue,
        last: Pose,
        config: &RobustConfig,
    ) -> Phase {
        let is_occluded = self.is_occluded(evidence, config);
        let most = match cue {
            FailureCue::None => None,
            FailureCue::Unrecognised => Some(config.lost_after as u32),
            FailureCue::Occlusion => Some(config.covered_after as u32),
        };
        let occluded = |last| Phase::Occluded { next: 0, unknown: 0, last };
        match self.phase {
            Phase::Tracking { doubtful } => match most {
                _ if is_occluded => occluded(last),
                None => Phase::Tracking { doubtful: 0 },
                Some(most) if doubtful.saturating_add(1) < most => {
                    Phase::Tracking { doubtful: doubtful + 1 }
                }
                Some(_) => occluded(last),
            },
            Phase::Verifying { left, back } if most.is_none() && !is_occluded => match left {
                2.. => Phase::Verifying { left: left - 1, back },
                _ if self.means.recent_visible < config.trial_shown => occluded(back),
                _ => Phase::Tracking { doubtful: 0 },
            },
            Phase::Verifying { back, .. } => occluded(back),
            Phase::Occluded { next, unknown, last } => {
                self.phase_of_searched(evidence, (next, unknown, last), config)
            }
            lost @ Phase::Lost { .. } => lost,
        }
    }

    /// Whether the target is hardly seen where it is followed.
    fn is_occluded(&self, evidence: &Evidence, config: &RobustConfig) -> bool {
        self.means.recent_visible < config.unseen_below && evidence.certainty < config.found_above
    }

    /// The phase after a frame on which the target was searched for: it is seen again where it is
    /// followed, or the memory has not known that place for long.
    fn phase_of_searched(
        &self,
        evidence: &Evidence,
        (next, unknown, last): (u64, u32, Pose),
        config: &RobustConfig,
    ) -> Phase {
        if self.means.recent_visible > config.seen_again
            && evidence.certainty > config.seen_certainty
        {
            return Phase::Tracking { doubtful: 0 };
        }
        let unknown =
            if evidence.certainty < config.gone_below { unknown.saturating_add(1) } else { 0 };
        match unknown < config.lost_after as u32 {
            true => Phase::Occluded { next, unknown, last },
            false => Phase::Lost { next },
        }
    }

    /// Which models learn on a frame.
    fn update_policy(
        &self,
        evidence: &Evidence,
        frame: u64,
        config: &RobustConfig,
    ) -> UpdatePolicy {
        let first = frame <= config.first_frames as u64;
        let known = self.is_sure(evidence, config) || first && !self.is_hidden(evidence, config);
        UpdatePolicy {
            sure: known && matches!(self.phase, Phase::Tracking { .. }),
            size: evidence.distraction() < config.scale_below,
        }
    }
}
