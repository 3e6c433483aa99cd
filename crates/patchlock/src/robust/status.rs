//! The state machine: turns evidence into phase, status and lessons. It sees no frame.

use super::evidence::Evidence;
use super::place::Place;
use super::score::{Means, ScoreParams};
use crate::config::RobustConfig;
use crate::estimate::Status;
use serde::{Deserialize, Serialize};

/// More windows than any search has; counting on from here never overflows.
const MAX_WINDOWS: u64 = 1 << 53;

/// What the tracker is doing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Phase {
    /// It follows the target; on this many consecutive frames the memory has not known the place.
    Following { doubtful: u32 },
    /// It goes on following, but hardly sees the target there, and searches for it around the last
    /// place at which it did. The target is never tracked. `next` is the number of the next window of
    /// the search; on this many consecutive frames the memory has not known the place at all.
    Unseen { next: u64, unknown: u32, last: Place },
    /// It has lost the target and searches; `next` is the number of the next window of the search.
    Lost { next: u64 },
    /// It follows what it found while lost. After this many more frames that is trusted if enough of
    /// it is visible; if the memory does not know the place before, the tracker goes back.
    Trial { left: u32, back: Place },
}

/// What is believed of the target from frame to frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Belief {
    pub phase: Phase,
    /// The running mean of how sure the memory was on recent frames on which the place was known.
    recent: f64,
    /// The mean visible share on sure frames.
    seen: f64,
    /// The mean contrast of colours on sure frames.
    contrast: f64,
    /// The running means that the score counts.
    means: Means,
}

/// What follows from the evidence of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Decision {
    /// What is believed now.
    pub belief: Belief,
    pub verdict: Verdict,
    /// What learns, unless the target is lost.
    pub lessons: Option<Lessons>,
    /// The place to go back to, if a trial failed.
    pub back: Option<Place>,
}

/// What is said of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Verdict {
    pub status: Status,
    /// The probability that the box overlaps the target by at least half; at most `score_lost` once
    /// the target is given up.
    pub score: f64,
}

/// What learns on a frame besides follower, colours and rotation, which always do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Lessons {
    /// Memory and patch model: the frame is sure.
    pub sure: bool,
    /// The filter over scale.
    pub size: bool,
}

/// The thresholds of the state machine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct StatusParams {
    /// The first frames are sure, whatever the memory says, unless the target is hidden.
    first_frames: u64,
    /// A frame is sure above this share of the recent certainty, or of 1 if that is less,
    sure: f64,
    /// if at least this share is visible of what was visible on sure frames,
    sure_visible: f64,
    /// and if at least this share of the target is reported as visible.
    sure_shown: f64,
    /// The size learns if the response elsewhere exceeds the visible share by less than this.
    size_below: f64,
    /// Rate of the running means of certainty, and of visible share and contrast on sure frames.
    recent_rate: f64,
    strange: StrangeParams,
    covered: CoveredParams,
    unseen: UnseenParams,
    /// Frames of a trial,
    trial: u32,
    /// at whose end the mean reported share is above this.
    trial_shown: f64,
    score: ScoreParams,
    /// From this score on the target is tracked,
    tracked: f64,
    /// if at least this share of it is visible.
    visible: f64,
    /// The target counts as lost below this score,
    lost: f64,
}

/// When the memory does not know a place: its certainty is low, and has fallen.
#[derive(Debug, Clone, Copy, PartialEq)]
struct StrangeParams {
    /// The certainty is below this,
    below: f64,
    /// and below this share of the recent certainty.
    drop: f64,
    /// The target is lost after this many consecutive frames.
    after: u32,
}

/// When something covers the target that the patch model half recognises: the certainty is low,
/// little is visible, the memory responds elsewhere as well, and the colours stand out less.
#[derive(Debug, Clone, Copy, PartialEq)]
struct CoveredParams {
    /// Less than this share is visible of what was visible on sure frames.
    visible: f64,
    /// The response elsewhere is above this.
    elsewhere: f64,
    /// The contrast of colours is below this share of what it was on sure frames.
    contrast: f64,
    /// The certainty is below this.
    below: f64,
    /// The target is lost after this many consecutive frames.
    after: u32,
}

/// When the target is hardly seen at the place that is followed.
#[derive(Debug, Clone, Copy, PartialEq)]
struct UnseenParams {
    /// The mean reported share of the last frames is below this,
    below: f64,
    /// and the certainty is below this: the search would not find the target there.
    certainty: f64,
    /// The target is seen again if the mean is above this,
    again: f64,
    /// and the certainty above this.
    again_certainty: f64,
    /// The place is given up while the certainty is below this,
    gone_below: f64,
    /// after this many consecutive frames.
    gone_after: u32,
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
            strange: StrangeParams {
                below: config.lost_below,
                drop: config.lost_drop,
                after: config.lost_after as u32,
            },
            covered: CoveredParams {
                visible: config.covered_visible,
                elsewhere: config.covered_elsewhere,
                contrast: config.covered_contrast,
                below: config.covered_below,
                after: config.covered_after as u32,
            },
            unseen: UnseenParams {
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

/// What the evidence of a frame says of the target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Doubt {
    /// The memory knows the place.
    None,
    /// The memory does not know the place.
    Strange,
    /// Something covers the target.
    Covered,
}

impl Belief {
    /// What is believed of the target in the first frame.
    pub fn first(evidence: &Evidence) -> Self {
        let Evidence { visible: seen, contrast, .. } = *evidence;
        let (phase, means) = (Phase::Following { doubtful: 0 }, Means::first(evidence));
        Self { phase, recent: 1.0, seen, contrast, means }
    }

    /// Whether all numbers are ones that evidence can lead to.
    pub fn is_sound(&self) -> bool {
        let phase = match self.phase {
            Phase::Following { .. } => true,
            Phase::Unseen { next, last, .. } => next <= MAX_WINDOWS && last.is_sound(),
            Phase::Lost { next } => next <= MAX_WINDOWS,
            Phase::Trial { back, .. } => back.is_sound(),
        };
        phase
            && self.means.is_sound()
            && [self.recent, self.seen, self.contrast].iter().all(|mean| mean.is_finite())
    }

    /// The running means that the score counts.
    pub fn means(&self) -> &Means {
        &self.means
    }

    /// Whether the target is lost, and nothing is followed.
    pub fn is_lost(&self) -> bool {
        matches!(self.phase, Phase::Lost { .. })
    }

    /// Whether the target is searched for.
    fn is_searched(&self) -> bool {
        matches!(self.phase, Phase::Lost { .. } | Phase::Unseen { .. })
    }

    /// Puts a place on trial that was found while lost; `back` is the last place before.
    pub fn begin_trial(&mut self, back: Place, params: &StatusParams) {
        self.phase = Phase::Trial { left: params.trial, back };
    }

    /// Goes on with the search, after this many windows in which nothing was found.
    pub fn search_on(&mut self, windows: u64) {
        if let Phase::Lost { next } | Phase::Unseen { next, .. } = &mut self.phase {
            *next += windows;
        }
    }

    /// What follows from the evidence of the frame with this number, at the place that was followed
    /// from `last`; the first frame has number 0. While the target is lost, nothing but the means of
    /// the score changes.
    pub fn advance(
        mut self,
        evidence: &Evidence,
        (frame, last): (u64, Place),
        params: &StatusParams,
    ) -> Decision {
        let score = &params.score;
        self.means = match self.phase {
            Phase::Trial { left, .. } if left == params.trial => self.means.begun(evidence, score),
            _ => self.means.after(evidence, score),
        };
        if self.is_lost() {
            let verdict = self.verdict(evidence, params);
            return Decision { belief: self, verdict, lessons: None, back: None };
        }
        let doubt = self.doubt(evidence, params);
        let mut belief = self.learned(evidence, doubt, params);
        belief.phase = self.next_phase(evidence, doubt, last, params);
        let back = match (self.phase, belief.phase) {
            (Phase::Trial { back, .. }, Phase::Lost { .. } | Phase::Unseen { .. }) => Some(back),
            (Phase::Unseen { last, .. }, Phase::Lost { .. }) => Some(last),
            _ => None,
        };
        let verdict = belief.verdict(evidence, params);
        let lessons = (!belief.is_lost()).then(|| belief.lessons(evidence, frame, params));
        Decision { belief, verdict, lessons, back }
    }

    /// Status and score.
    pub fn verdict(&self, evidence: &Evidence, params: &StatusParams) -> Verdict {
        let score = self.means.score(evidence, &params.score);
        let status = match self.phase {
            Phase::Lost { .. } => Status::Lost,
            // The score calls a target lost before it is given up.
            _ if score < params.lost => Status::Lost,
            Phase::Following { .. }
                if score >= params.tracked && evidence.shown >= params.visible =>
            {
                Status::Tracked
            }
            _ => Status::Uncertain,
        };
        let score = if self.is_lost() { score.min(params.lost) } else { score };
        Verdict { status, score }
    }

    /// Whether the place is known, and whether the target is covered.
    fn doubt(&self, evidence: &Evidence, params: &StatusParams) -> Doubt {
        let (strange, certainty) = (&params.strange, evidence.certainty);
        // Appearance that changes slowly makes the memory less sure, too, but never suddenly.
        if certainty < strange.below && certainty < strange.drop * self.recent {
            Doubt::Strange
        } else if self.is_covered(evidence, params) {
            Doubt::Covered
        } else {
            Doubt::None
        }
    }

    /// Whether the memory is so sure of a place that it can learn from it. Appearance that changes
    /// slowly makes it less sure; it then learns the change, but neither what hides the target slowly
    /// nor what the patch model does not know.
    fn is_sure(&self, evidence: &Evidence, params: &StatusParams) -> bool {
        evidence.certainty > params.sure * self.recent.min(1.0)
            && evidence.shown >= params.sure_shown
            && !self.is_hidden(evidence, params)
    }

    /// Whether next to nothing of the target is visible.
    fn is_hidden(&self, evidence: &Evidence, params: &StatusParams) -> bool {
        evidence.visible < params.sure_visible * self.seen
    }

    /// Whether something that the patch model half recognises covers the target: little of it is
    /// visible, the memory responds elsewhere as well, and its colours stand out less from those
    /// around it, as where what covers it is larger. Similar things nearby do the first two, but
    /// not the third.
    fn is_covered(&self, evidence: &Evidence, params: &StatusParams) -> bool {
        let covered = &params.covered;
        evidence.certainty < covered.below
            && evidence.visible < covered.visible * self.seen
            && evidence.elsewhere > covered.elsewhere
            && evidence.contrast < covered.contrast * self.contrast
    }

    /// The running means after a frame.
    fn learned(mut self, evidence: &Evidence, doubt: Doubt, params: &StatusParams) -> Self {
        if self.is_searched() {
            return self;
        }
        if self.is_sure(evidence, params) {
            self.seen += params.recent_rate * (evidence.visible - self.seen);
            self.contrast += params.recent_rate * (evidence.contrast - self.contrast);
        }
        if doubt == Doubt::None {
            self.recent += params.recent_rate * (evidence.certainty - self.recent);
        }
        self
    }

    /// The phase after a frame, whose place was followed from `last`.
    fn next_phase(
        &self,
        evidence: &Evidence,
        doubt: Doubt,
        last: Place,
        params: &StatusParams,
    ) -> Phase {
        let is_unseen = self.is_unseen(evidence, params);
        let most = match doubt {
            Doubt::None => None,
            Doubt::Strange => Some(params.strange.after),
            Doubt::Covered => Some(params.covered.after),
        };
        let lost = |last| Phase::Unseen { next: 0, unknown: 0, last };
        match self.phase {
            Phase::Following { doubtful } => match most {
                _ if is_unseen => lost(last),
                None => Phase::Following { doubtful: 0 },
                Some(most) if doubtful.saturating_add(1) < most => {
                    Phase::Following { doubtful: doubtful + 1 }
                }
                Some(_) => lost(last),
            },
            Phase::Trial { left, back } if most.is_none() && !is_unseen => match left {
                2.. => Phase::Trial { left: left - 1, back },
                _ if self.means.shown_lately < params.trial_shown => lost(back),
                _ => Phase::Following { doubtful: 0 },
            },
            Phase::Trial { back, .. } => lost(back),
            Phase::Unseen { next, unknown, last } => {
                self.seen_again(evidence, (next, unknown, last), &params.unseen)
            }
            lost @ Phase::Lost { .. } => lost,
        }
    }

    /// Whether the target is hardly seen where it is followed.
    fn is_unseen(&self, evidence: &Evidence, params: &StatusParams) -> bool {
        let UnseenParams { below, certainty, .. } = params.unseen;
        self.means.shown_lately < below && evidence.certainty < certainty
    }

    /// The phase after a frame on which the target was searched for: it is seen again where it is
    /// followed, or the memory has not known that place for long.
    fn seen_again(
        &self,
        evidence: &Evidence,
        (next, unknown, last): (u64, u32, Place),
        params: &UnseenParams,
    ) -> Phase {
        if self.means.shown_lately > params.again && evidence.certainty > params.again_certainty {
            return Phase::Following { doubtful: 0 };
        }
        let unknown =
            if evidence.certainty < params.gone_below { unknown.saturating_add(1) } else { 0 };
        match unknown < params.gone_after {
            true => Phase::Unseen { next, unknown, last },
            false => Phase::Lost { next },
        }
    }

    /// What learns on a frame.
    fn lessons(&self, evidence: &Evidence, frame: u64, params: &StatusParams) -> Lessons {
        let first = frame <= params.first_frames;
        let known = self.is_sure(evidence, params) || first && !self.is_hidden(evidence, params);
        Lessons {
            sure: known && matches!(self.phase, Phase::Following { .. }),
            size: evidence.distraction() < params.size_below,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robust::score;

    /// Thresholds with room between them.
    const PARAMS: StatusParams = StatusParams {
        first_frames: 10,
        sure: 0.7,
        sure_visible: 0.1,
        sure_shown: 0.3,
        size_below: 0.2,
        recent_rate: 0.05,
        strange: StrangeParams { below: 0.4, drop: 0.6, after: 3 },
        covered: CoveredParams {
            visible: 0.35,
            elsewhere: 0.6,
            contrast: 0.75,
            below: 0.55,
            after: 5,
        },
        unseen: UnseenParams {
            below: 0.15,
            certainty: 0.65,
            again: 0.25,
            again_certainty: 0.5,
            gone_below: 0.3,
            gone_after: 3,
        },
        trial: 4,
        trial_shown: 0.4,
        score: score::tests::PARAMS,
        tracked: 0.5,
        visible: 0.15,
        lost: 0.25,
    };

    /// A place that the memory knows, with all of the target visible.
    const KNOWN: Evidence = Evidence {
        certainty: 0.9,
        elsewhere: 0.2,
        early: 0.7,
        visible: 0.8,
        shown: 0.8,
        contrast: 0.5,
    };

    /// A place that the memory does not know.
    const STRANGE: Evidence = Evidence { certainty: 0.1, ..KNOWN };

    /// A place at which little is visible, the memory responds elsewhere, and the colours stand out
    /// less.
    const COVERED: Evidence = Evidence {
        certainty: 0.5,
        visible: 0.27,
        shown: 0.27,
        elsewhere: 0.61,
        contrast: 0.37,
        ..KNOWN
    };

    const BELIEF: Belief = Belief {
        phase: Phase::Following { doubtful: 0 },
        recent: 0.9,
        seen: 0.8,
        contrast: 0.5,
        means: Means {
            shown: 0.8,
            shown_lately: 0.8,
            elsewhere: 0.2,
            early: 0.7,
            first_contrast: 0.5,
        },
    };

    const BACK: Place = Place { centre: [3.0, 4.0], scale: 1.2, rotation: 0.1 };

    /// The place on the frame before.
    const LAST: Place = Place { centre: [5.0, 6.0], ..BACK };

    /// The number of a frame after the first ones.
    const LATER: u64 = 50;

    fn in_phase(phase: Phase) -> Belief {
        Belief { phase, ..BELIEF }
    }

    fn following(doubtful: u32) -> Belief {
        in_phase(Phase::Following { doubtful })
    }

    #[test]
    fn the_phase_follows_from_the_evidence() {
        let trial = |left| Phase::Trial { left, back: BACK };
        let following = |doubtful| Phase::Following { doubtful };
        let unseen = |last| Phase::Unseen { next: 0, unknown: 0, last };
        // The phase before, the evidence, the phase after, and whether the tracker goes back.
        for (before, evidence, after, goes_back) in [
            (following(0), KNOWN, following(0), false),
            (following(2), KNOWN, following(0), false),
            (following(0), STRANGE, following(1), false),
            (following(1), STRANGE, following(2), false),
            (following(2), STRANGE, unseen(LAST), false),
            // Doubt of either kind counts on; its kind on the last frame decides how much is too
            // much.
            (following(0), COVERED, following(1), false),
            (following(2), COVERED, following(3), false),
            (following(4), COVERED, unseen(LAST), false),
            (following(3), STRANGE, unseen(LAST), false),
            (trial(4), KNOWN, trial(3), false),
            (trial(2), KNOWN, trial(1), false),
            (trial(1), KNOWN, following(0), false),
            // On trial, one frame is enough.
            (trial(4), STRANGE, unseen(BACK), true),
            (trial(1), COVERED, unseen(BACK), true),
            (Phase::Lost { next: 7 }, KNOWN, Phase::Lost { next: 7 }, false),
            (Phase::Lost { next: 7 }, STRANGE, Phase::Lost { next: 7 }, false),
        ] {
            let decision = in_phase(before).advance(&evidence, (LATER, LAST), &PARAMS);
            assert_eq!(decision.belief.phase, after, "{before:?} {evidence:?}");
            assert_eq!(decision.back, goes_back.then_some(BACK), "{before:?} {evidence:?}");
            let is_lost = matches!(after, Phase::Lost { .. });
            assert_eq!(decision.lessons.is_none(), is_lost, "{before:?} {evidence:?}");
        }
    }

    #[test]
    fn what_is_hardly_visible_and_hardly_known_is_searched_for_while_it_is_followed() {
        let unseen = |unknown, last| Phase::Unseen { next: 7, unknown, last };
        let new = |last| Phase::Unseen { next: 0, unknown: 0, last };
        let trial = |left| Phase::Trial { left, back: BACK };
        let again = Phase::Following { doubtful: 0 };
        let lost = Phase::Lost { next: 7 };
        // The phase before, the mean share before, the share and the certainty of this frame, the
        // phase after, and the place to go back to. The mean moves half of the way.
        for (before, lately, shown, certainty, after, back) in [
            (again, 0.2, 0.08, 0.64, new(LAST), None),
            // Not while the memory would find it there,
            (again, 0.2, 0.08, 0.66, again, None),
            // nor if enough was visible lately.
            (again, 0.2, 0.12, 0.64, again, None),
            (trial(3), 0.2, 0.08, 0.64, new(BACK), Some(BACK)),
            // At the end of a trial more has to be visible.
            (trial(1), 0.4, 0.38, 0.9, new(BACK), Some(BACK)),
            (trial(1), 0.4, 0.42, 0.9, again, None),
            (trial(2), 0.4, 0.38, 0.9, trial(1), None),
            (unseen(0, LAST), 0.2, 0.28, 0.9, unseen(0, LAST), None),
            (unseen(0, LAST), 0.2, 0.32, 0.49, unseen(0, LAST), None),
            (unseen(2, LAST), 0.2, 0.32, 0.51, again, None),
            // The memory does not know it at all.
            (unseen(1, LAST), 0.2, 0.0, 0.29, unseen(2, LAST), None),
            (unseen(1, LAST), 0.2, 0.0, 0.31, unseen(0, LAST), None),
            (unseen(2, LAST), 0.2, 0.0, 0.29, lost, Some(LAST)),
        ] {
            let evidence = Evidence { certainty, shown, visible: shown, ..KNOWN };
            let means = Means { shown_lately: lately, ..BELIEF.means };
            let belief = Belief { recent: 0.4, means, ..in_phase(before) };
            let decision = belief.advance(&evidence, (LATER, LAST), &PARAMS);
            let name = format!("{before:?} {lately} {shown} {certainty}");
            assert_eq!((decision.belief.phase, decision.back), (after, back), "{name}");
            // Filters go on learning, memory and patch model do not.
            let is_unseen = matches!(after, Phase::Unseen { .. });
            let sure = decision.lessons.is_some_and(|lessons| lessons.sure);
            assert_eq!(decision.lessons.is_none(), after == lost, "{name}");
            assert!(!(is_unseen && sure), "{name}");
            assert!(!is_unseen || decision.verdict.status != Status::Tracked, "{name}");
        }
    }

    #[test]
    fn a_place_is_strange_if_the_memory_is_unsure_and_that_is_sudden() {
        let sudden = Belief { recent: 0.9, ..BELIEF };
        let slow = Belief { recent: 0.4, ..BELIEF };
        // The belief, the certainty, and whether the place is strange.
        for (belief, certainty, strange) in [
            (sudden, 0.39, true),
            (sudden, 0.4, false),
            // Below 0.6 times 0.4.
            (slow, 0.25, false),
            (slow, 0.23, true),
        ] {
            let evidence = Evidence { certainty, ..KNOWN };
            let doubt = belief.doubt(&evidence, &PARAMS);
            assert_eq!(doubt == Doubt::Strange, strange, "{evidence:?} {doubt:?}");
        }
    }

    #[test]
    fn a_target_is_covered_if_the_memory_is_unsure_and_all_else_says_so() {
        let doubt = |evidence: Evidence| BELIEF.doubt(&evidence, &PARAMS);
        assert_eq!(doubt(COVERED), Doubt::Covered);
        for spared in [
            Evidence { certainty: 0.55, ..COVERED },
            Evidence { visible: 0.29, ..COVERED },
            Evidence { elsewhere: 0.6, ..COVERED },
            Evidence { contrast: 0.38, ..COVERED },
        ] {
            assert_eq!(doubt(spared), Doubt::None, "{spared:?}");
        }
    }

    #[test]
    fn a_frame_is_sure_if_the_memory_is_about_as_sure_as_before() {
        // How sure the memory was, is, and what is visible; whether the frame is sure.
        for (recent, certainty, visible, sure) in [
            (0.9, 0.64, 0.8, true),
            (0.9, 0.62, 0.8, false),
            // Where it was surer than its mean, its mean counts.
            (2.0, 0.71, 0.8, true),
            (2.0, 0.7, 0.8, false),
            // Never if next to nothing is visible.
            (0.9, 0.9, 0.09, true),
            (0.9, 0.9, 0.07, false),
        ] {
            let evidence = Evidence { certainty, visible, ..KNOWN };
            let belief = Belief { recent, ..BELIEF };
            assert_eq!(belief.is_sure(&evidence, &PARAMS), sure, "{recent} {certainty} {visible}");
        }
        // Nor if the patch model knows too little of it.
        for (shown, sure) in [(0.31, true), (0.29, false)] {
            let evidence = Evidence { shown, ..KNOWN };
            assert_eq!(BELIEF.is_sure(&evidence, &PARAMS), sure, "{shown}");
        }
    }

    #[test]
    fn memory_and_patch_model_learn_on_sure_and_on_first_frames_outside_trials() {
        let unsure = Evidence { certainty: 0.5, ..KNOWN };
        let hidden = Evidence { visible: 0.0, elsewhere: 0.0, certainty: 0.6, ..KNOWN };
        let trial = in_phase(Phase::Trial { left: 2, back: BACK });
        let last_of_trial = in_phase(Phase::Trial { left: 1, back: BACK });
        for (belief, evidence, frame, sure) in [
            (BELIEF, KNOWN, LATER, true),
            (BELIEF, unsure, LATER, false),
            (BELIEF, unsure, 10, true),
            (BELIEF, unsure, 11, false),
            (BELIEF, hidden, 10, false),
            (trial, KNOWN, LATER, false),
            (last_of_trial, KNOWN, LATER, true),
        ] {
            let lessons = belief.advance(&evidence, (frame, LAST), &PARAMS).lessons.unwrap();
            assert_eq!(lessons.sure, sure, "{:?} {evidence:?} {frame}", belief.phase);
        }
    }

    #[test]
    fn the_size_learns_where_the_memory_responds_little_elsewhere_for_what_is_visible() {
        for (visible, elsewhere, size) in [
            (0.0, 0.19, true),
            (0.0, 0.2, false),
            (0.0, 2.0, false),
            (0.8, 0.99, true),
            (0.8, 1.01, false),
        ] {
            let evidence = Evidence { visible, elsewhere, ..KNOWN };
            let lessons = BELIEF.advance(&evidence, (LATER, LAST), &PARAMS).lessons.unwrap();
            assert_eq!(lessons.size, size, "{visible} {elsewhere}");
        }
    }

    #[test]
    fn the_means_follow_known_and_sure_frames() {
        let near = |a: f64, b: f64| (a - b).abs() < 1e-12;
        let after = |evidence| BELIEF.advance(&evidence, (LATER, LAST), &PARAMS).belief;
        let evidence =
            Evidence { certainty: 1.1, visible: 0.4, elsewhere: 0.0, contrast: 0.9, ..KNOWN };
        // Sure: all three move by a twentieth of the way.
        let sure = after(evidence);
        assert!(near(sure.recent, 0.91) && near(sure.seen, 0.78) && near(sure.contrast, 0.52));
        // Known, but not sure: the certainty alone.
        let known = after(Evidence { certainty: 0.5, ..evidence });
        assert!(near(known.recent, 0.88), "{known:?}");
        assert_eq!((known.seen, known.contrast), (BELIEF.seen, BELIEF.contrast));
        // Neither in doubt nor while lost.
        for unchanged in [after(STRANGE), after(COVERED)] {
            let Belief { phase, means, .. } = BELIEF;
            assert_eq!(Belief { phase, means, ..unchanged }, BELIEF);
        }
        let lost = in_phase(Phase::Lost { next: 3 });
        let after = lost.advance(&evidence, (LATER, LAST), &PARAMS).belief;
        assert_eq!(Belief { means: BELIEF.means, ..after }, lost);
    }

    #[test]
    fn the_means_of_the_score_count_every_frame_and_begin_anew_with_a_trial() {
        let trial = |left| in_phase(Phase::Trial { left, back: BACK });
        let lost = in_phase(Phase::Lost { next: 3 });
        let hidden = Evidence { shown: 0.3, elsewhere: 0.4, early: 0.5, ..KNOWN };
        let after = |belief: Belief, evidence| {
            belief.advance(&evidence, (LATER, LAST), &PARAMS).belief.means
        };
        for belief in [BELIEF, lost, trial(PARAMS.trial - 1)] {
            assert_eq!(after(belief, hidden), belief.means.after(&hidden, &PARAMS.score));
        }
        let mut found = lost;
        found.begin_trial(BACK, &PARAMS);
        assert_eq!(found, trial(PARAMS.trial));
        assert_eq!(after(found, hidden), found.means.begun(&hidden, &PARAMS.score));
    }

    #[test]
    fn what_learns_is_decided_with_the_means_of_this_frame() {
        // Just below 0.7 times the recent certainty before, and above 0.7 times that with this
        // frame.
        let belief = Belief { recent: 0.8, ..BELIEF };
        let evidence = Evidence { certainty: 0.555, ..KNOWN };
        assert!(!belief.is_sure(&evidence, &PARAMS));
        let decision = belief.advance(&evidence, (LATER, LAST), &PARAMS);
        assert!(decision.lessons.unwrap().sure);
        // The means of sure frames do not take it in.
        assert_eq!(
            (decision.belief.seen, decision.belief.contrast),
            (belief.seen, belief.contrast)
        );
    }

    #[test]
    fn status_and_score() {
        let trial = in_phase(Phase::Trial { left: 2, back: BACK });
        let lost = in_phase(Phase::Lost { next: 0 });
        let unseen = in_phase(Phase::Unseen { next: 0, unknown: 0, last: LAST });
        let with = |shown, elsewhere| Means { shown, elsewhere, ..BELIEF.means };
        // A sum of 0, of 2, of -2 and of -1.
        let (even, high, low) = (with(0.5, 0.5), with(0.5, 0.0), with(0.0, 0.5));
        let (middle, little) = (with(0.25, 0.5), 1.0 / (1.0 + 1.0f64.exp()));
        let (most, least) = (1.0 / (1.0 + (-2.0f64).exp()), 1.0 / (1.0 + 2.0f64.exp()));
        for (belief, means, status, score) in [
            (BELIEF, even, Status::Tracked, 0.5),
            (BELIEF, high, Status::Tracked, most),
            (BELIEF, middle, Status::Uncertain, little),
            (BELIEF, low, Status::Lost, least),
            (following(2), high, Status::Tracked, most),
            (trial, high, Status::Uncertain, most),
            (trial, low, Status::Lost, least),
            (lost, high, Status::Lost, 0.25),
            (lost, low, Status::Lost, least),
            (unseen, high, Status::Uncertain, most),
            (unseen, middle, Status::Uncertain, little),
            (unseen, low, Status::Lost, least),
        ] {
            let verdict = Belief { means, ..belief }.verdict(&KNOWN, &PARAMS);
            assert_eq!(verdict, Verdict { status, score }, "{belief:?} {means:?}");
        }
    }

    #[test]
    fn the_verdict_is_that_of_the_new_phase() {
        let unseen = in_phase(Phase::Unseen { next: 0, unknown: 2, last: LAST });
        let decision = unseen.advance(&STRANGE, (LATER, LAST), &PARAMS);
        assert_eq!(decision.verdict, Verdict { status: Status::Lost, score: 0.25 });
        let trial = in_phase(Phase::Trial { left: 1, back: BACK });
        assert_eq!(trial.advance(&KNOWN, (LATER, LAST), &PARAMS).verdict.status, Status::Tracked);
    }

    #[test]
    fn a_search_goes_on_and_what_it_finds_is_on_trial() {
        let mut belief = in_phase(Phase::Lost { next: 7 });
        belief.search_on(4);
        assert_eq!(belief, in_phase(Phase::Lost { next: 11 }));
        belief.begin_trial(BACK, &PARAMS);
        assert_eq!(belief.phase, Phase::Trial { left: 4, back: BACK });
        let mut belief = in_phase(Phase::Unseen { next: 7, unknown: 2, last: BACK });
        belief.search_on(4);
        assert_eq!(belief, in_phase(Phase::Unseen { next: 11, unknown: 2, last: BACK }));
    }

    #[test]
    fn the_first_belief_is_the_first_frame() {
        let first = Belief::first(&KNOWN);
        assert_eq!(first, Belief { recent: 1.0, ..BELIEF });
        assert!(first.is_sound());
        assert!(!Belief { seen: f64::NAN, ..first }.is_sound());
        assert!(!in_phase(Phase::Lost { next: u64::MAX }).is_sound());
        let nowhere = Place { scale: 0.0, ..BACK };
        assert!(!in_phase(Phase::Trial { left: 1, back: nowhere }).is_sound());
        assert!(!in_phase(Phase::Unseen { next: 0, unknown: 0, last: nowhere }).is_sound());
        let means = Means { shown: f64::NAN, ..first.means };
        assert!(!Belief { means, ..first }.is_sound());
    }
}
