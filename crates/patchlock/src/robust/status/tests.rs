use super::*;
use crate::robust::score;

/// Thresholds with room between them; visible share and response elsewhere count alike in the score.
fn config() -> RobustConfig {
    RobustConfig {
        first_frames: 10,
        sure: 0.7,
        sure_visible: 0.1,
        sure_shown: 0.3,
        scale_below: 0.2,
        recent_rate: 0.05,
        lost_below: 0.4,
        lost_drop: 0.6,
        lost_after: 3,
        covered_visible: 0.35,
        covered_elsewhere: 0.6,
        covered_contrast: 0.75,
        covered_below: 0.55,
        covered_after: 5,
        unseen_below: 0.15,
        found_above: 0.65,
        seen_again: 0.25,
        seen_certainty: 0.5,
        gone_below: 0.3,
        trial: 4,
        trial_shown: 0.4,
        score_tracked: 0.5,
        visible_tracked: 0.15,
        score_lost: 0.25,
        ..score::tests::config()
    }
}

/// A place that the memory knows, with all of the target visible.
const KNOWN: Evidence = Evidence {
    certainty: 0.9,
    elsewhere: 0.2,
    early: 0.7,
    strictly_visible: 0.8,
    visible: 0.8,
    contrast: 0.5,
};

/// A place that the memory does not know.
const UNRECOGNISED: Evidence = Evidence { certainty: 0.1, ..KNOWN };

/// A place at which little is visible, the memory responds elsewhere, and the colours stand out
/// less.
const COVERED: Evidence = Evidence {
    certainty: 0.5,
    strictly_visible: 0.27,
    visible: 0.27,
    elsewhere: 0.61,
    contrast: 0.37,
    ..KNOWN
};

const STATE: TrackState = TrackState {
    phase: Phase::Tracking { doubtful: 0 },
    recent: 0.9,
    seen: 0.8,
    contrast: 0.5,
    means: RunningMeans {
        visible: 0.8,
        recent_visible: 0.8,
        elsewhere: 0.2,
        early: 0.7,
        first_contrast: 0.5,
    },
};

const BACK: Pose = Pose { centre: [3.0, 4.0], scale: 1.2, rotation: 0.1 };

/// The place on the frame before.
const LAST: Pose = Pose { centre: [5.0, 6.0], ..BACK };

/// The number of a frame after the first ones.
const LATER: u64 = 50;

fn in_phase(phase: Phase) -> TrackState {
    TrackState { phase, ..STATE }
}

fn tracking(doubtful: u32) -> TrackState {
    in_phase(Phase::Tracking { doubtful })
}

#[test]
fn the_phase_follows_from_the_evidence() {
    let trial = |left| Phase::Verifying { left, back: BACK };
    let tracking = |doubtful| Phase::Tracking { doubtful };
    let occluded = |last| Phase::Occluded { next: 0, unknown: 0, last };
    // The phase before, the evidence, the phase after, and whether the tracker goes back.
    for (before, evidence, after, goes_back) in [
        (tracking(0), KNOWN, tracking(0), false),
        (tracking(2), KNOWN, tracking(0), false),
        (tracking(0), UNRECOGNISED, tracking(1), false),
        (tracking(1), UNRECOGNISED, tracking(2), false),
        (tracking(2), UNRECOGNISED, occluded(LAST), false),
        // A cue of either kind counts on; its kind on the last frame decides how much is too
        // much.
        (tracking(0), COVERED, tracking(1), false),
        (tracking(2), COVERED, tracking(3), false),
        (tracking(4), COVERED, occluded(LAST), false),
        (tracking(3), UNRECOGNISED, occluded(LAST), false),
        (trial(4), KNOWN, trial(3), false),
        (trial(2), KNOWN, trial(1), false),
        (trial(1), KNOWN, tracking(0), false),
        // On trial, one frame is enough.
        (trial(4), UNRECOGNISED, occluded(BACK), true),
        (trial(1), COVERED, occluded(BACK), true),
        (Phase::Lost { next: 7 }, KNOWN, Phase::Lost { next: 7 }, false),
        (Phase::Lost { next: 7 }, UNRECOGNISED, Phase::Lost { next: 7 }, false),
    ] {
        let decision = in_phase(before).advance(&evidence, (LATER, LAST), &config());
        assert_eq!(decision.state.phase, after, "{before:?} {evidence:?}");
        assert_eq!(decision.back, goes_back.then_some(BACK), "{before:?} {evidence:?}");
        let is_lost = matches!(after, Phase::Lost { .. });
        assert_eq!(decision.update.is_none(), is_lost, "{before:?} {evidence:?}");
    }
}

#[test]
fn what_is_hardly_visible_and_hardly_known_is_searched_for_while_it_is_followed() {
    let occluded = |unknown, last| Phase::Occluded { next: 7, unknown, last };
    let new = |last| Phase::Occluded { next: 0, unknown: 0, last };
    let trial = |left| Phase::Verifying { left, back: BACK };
    let again = Phase::Tracking { doubtful: 0 };
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
        (occluded(0, LAST), 0.2, 0.28, 0.9, occluded(0, LAST), None),
        (occluded(0, LAST), 0.2, 0.32, 0.49, occluded(0, LAST), None),
        (occluded(2, LAST), 0.2, 0.32, 0.51, again, None),
        // The memory does not know it at all.
        (occluded(1, LAST), 0.2, 0.0, 0.29, occluded(2, LAST), None),
        (occluded(1, LAST), 0.2, 0.0, 0.31, occluded(0, LAST), None),
        (occluded(2, LAST), 0.2, 0.0, 0.29, lost, Some(LAST)),
    ] {
        let evidence = Evidence { certainty, visible: shown, strictly_visible: shown, ..KNOWN };
        let means = RunningMeans { recent_visible: lately, ..STATE.means };
        let state = TrackState { recent: 0.4, means, ..in_phase(before) };
        let decision = state.advance(&evidence, (LATER, LAST), &config());
        let name = format!("{before:?} {lately} {shown} {certainty}");
        assert_eq!((decision.state.phase, decision.back), (after, back), "{name}");
        // Filters go on learning, memory and patch model do not.
        let is_occluded = matches!(after, Phase::Occluded { .. });
        let sure = decision.update.is_some_and(|update| update.sure);
        assert_eq!(decision.update.is_none(), after == lost, "{name}");
        assert!(!(is_occluded && sure), "{name}");
        assert!(!is_occluded || decision.result.status != Status::Tracked, "{name}");
    }
}

#[test]
fn a_place_is_strange_if_the_memory_is_unsure_and_that_is_sudden() {
    let sudden = TrackState { recent: 0.9, ..STATE };
    let slow = TrackState { recent: 0.4, ..STATE };
    // The belief, the certainty, and whether the place is strange.
    for (state, certainty, unrecognised) in [
        (sudden, 0.39, true),
        (sudden, 0.4, false),
        // Below 0.6 times 0.4.
        (slow, 0.25, false),
        (slow, 0.23, true),
    ] {
        let evidence = Evidence { certainty, ..KNOWN };
        let cue = state.cue(&evidence, &config());
        assert_eq!(cue == FailureCue::Unrecognised, unrecognised, "{evidence:?} {cue:?}");
    }
}

#[test]
fn a_target_is_covered_if_the_memory_is_unsure_and_all_else_says_so() {
    let cue = |evidence: Evidence| STATE.cue(&evidence, &config());
    assert_eq!(cue(COVERED), FailureCue::Occlusion);
    for spared in [
        Evidence { certainty: 0.55, ..COVERED },
        Evidence { strictly_visible: 0.29, ..COVERED },
        Evidence { elsewhere: 0.6, ..COVERED },
        Evidence { contrast: 0.38, ..COVERED },
    ] {
        assert_eq!(cue(spared), FailureCue::None, "{spared:?}");
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
        let evidence = Evidence { certainty, strictly_visible: visible, ..KNOWN };
        let state = TrackState { recent, ..STATE };
        assert_eq!(state.is_sure(&evidence, &config()), sure, "{recent} {certainty} {visible}");
    }
    // Nor if the patch model knows too little of it.
    for (shown, sure) in [(0.31, true), (0.29, false)] {
        let evidence = Evidence { visible: shown, ..KNOWN };
        assert_eq!(STATE.is_sure(&evidence, &config()), sure, "{shown}");
    }
}

#[test]
fn memory_and_patch_model_learn_on_sure_and_on_first_frames_outside_trials() {
    let unsure = Evidence { certainty: 0.5, ..KNOWN };
    let hidden = Evidence { strictly_visible: 0.0, elsewhere: 0.0, certainty: 0.6, ..KNOWN };
    let trial = in_phase(Phase::Verifying { left: 2, back: BACK });
    let last_of_trial = in_phase(Phase::Verifying { left: 1, back: BACK });
    for (state, evidence, frame, sure) in [
        (STATE, KNOWN, LATER, true),
        (STATE, unsure, LATER, false),
        (STATE, unsure, 10, true),
        (STATE, unsure, 11, false),
        (STATE, hidden, 10, false),
        (trial, KNOWN, LATER, false),
        (last_of_trial, KNOWN, LATER, true),
    ] {
        let update = state.advance(&evidence, (frame, LAST), &config()).update.unwrap();
        assert_eq!(update.sure, sure, "{:?} {evidence:?} {frame}", state.phase);
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
        let evidence = Evidence { strictly_visible: visible, elsewhere, ..KNOWN };
        let update = STATE.advance(&evidence, (LATER, LAST), &config()).update.unwrap();
        assert_eq!(update.size, size, "{visible} {elsewhere}");
    }
}

#[test]
fn the_means_follow_known_and_sure_frames() {
    let near = |a: f64, b: f64| (a - b).abs() < 1e-12;
    let after = |evidence| STATE.advance(&evidence, (LATER, LAST), &config()).state;
    let evidence =
        Evidence { certainty: 1.1, strictly_visible: 0.4, elsewhere: 0.0, contrast: 0.9, ..KNOWN };
    // Sure: all three move by a twentieth of the way.
    let sure = after(evidence);
    assert!(near(sure.recent, 0.91) && near(sure.seen, 0.78) && near(sure.contrast, 0.52));
    // Known, but not sure: the certainty alone.
    let known = after(Evidence { certainty: 0.5, ..evidence });
    assert!(near(known.recent, 0.88), "{known:?}");
    assert_eq!((known.seen, known.contrast), (STATE.seen, STATE.contrast));
    // Neither in doubt nor while lost.
    for unchanged in [after(UNRECOGNISED), after(COVERED)] {
        let TrackState { phase, means, .. } = STATE;
        assert_eq!(TrackState { phase, means, ..unchanged }, STATE);
    }
    let lost = in_phase(Phase::Lost { next: 3 });
    let after = lost.advance(&evidence, (LATER, LAST), &config()).state;
    assert_eq!(TrackState { means: STATE.means, ..after }, lost);
}

#[test]
fn the_means_of_the_score_count_every_frame_and_begin_anew_with_a_trial() {
    let trial = |left| in_phase(Phase::Verifying { left, back: BACK });
    let lost = in_phase(Phase::Lost { next: 3 });
    let hidden = Evidence { visible: 0.3, elsewhere: 0.4, early: 0.5, ..KNOWN };
    let after = |state: TrackState, evidence| {
        state.advance(&evidence, (LATER, LAST), &config()).state.means
    };
    for state in [STATE, lost, trial(3)] {
        assert_eq!(after(state, hidden), state.means.after(&hidden, &config()));
    }
    let mut found = lost;
    found.begin_verification(BACK, &config());
    assert_eq!(found, trial(4));
    assert_eq!(after(found, hidden), found.means.restarted(&hidden, &config()));
}

#[test]
fn what_learns_is_decided_with_the_means_of_this_frame() {
    // Just below 0.7 times the recent certainty before, and above 0.7 times that with this
    // frame.
    let state = TrackState { recent: 0.8, ..STATE };
    let evidence = Evidence { certainty: 0.555, ..KNOWN };
    assert!(!state.is_sure(&evidence, &config()));
    let decision = state.advance(&evidence, (LATER, LAST), &config());
    assert!(decision.update.unwrap().sure);
    // The means of sure frames do not take it in.
    assert_eq!((decision.state.seen, decision.state.contrast), (state.seen, state.contrast));
}

#[test]
fn status_and_score() {
    let trial = in_phase(Phase::Verifying { left: 2, back: BACK });
    let lost = in_phase(Phase::Lost { next: 0 });
    let occluded = in_phase(Phase::Occluded { next: 0, unknown: 0, last: LAST });
    let with = |shown, elsewhere| RunningMeans { visible: shown, elsewhere, ..STATE.means };
    // A sum of 0, of 2, of -2 and of -1.
    let (even, high, low) = (with(0.5, 0.5), with(0.5, 0.0), with(0.0, 0.5));
    let (middle, little) = (with(0.25, 0.5), 1.0 / (1.0 + 1.0f64.exp()));
    let (most, least) = (1.0 / (1.0 + (-2.0f64).exp()), 1.0 / (1.0 + 2.0f64.exp()));
    for (state, means, status, score) in [
        (STATE, even, Status::Tracked, 0.5),
        (STATE, high, Status::Tracked, most),
        (STATE, middle, Status::Uncertain, little),
        (STATE, low, Status::Lost, least),
        (tracking(2), high, Status::Tracked, most),
        (trial, high, Status::Uncertain, most),
        (trial, low, Status::Lost, least),
        (lost, high, Status::Lost, 0.25),
        (lost, low, Status::Lost, least),
        (occluded, high, Status::Uncertain, most),
        (occluded, middle, Status::Uncertain, little),
        (occluded, low, Status::Lost, least),
    ] {
        let result = TrackState { means, ..state }.result(&KNOWN, &config());
        assert_eq!(result, FrameResult { status, score }, "{state:?} {means:?}");
    }
}

#[test]
fn the_verdict_is_that_of_the_new_phase() {
    let occluded = in_phase(Phase::Occluded { next: 0, unknown: 2, last: LAST });
    let decision = occluded.advance(&UNRECOGNISED, (LATER, LAST), &config());
    assert_eq!(decision.result, FrameResult { status: Status::Lost, score: 0.25 });
    let trial = in_phase(Phase::Verifying { left: 1, back: BACK });
    assert_eq!(trial.advance(&KNOWN, (LATER, LAST), &config()).result.status, Status::Tracked);
}

#[test]
fn a_search_goes_on_and_what_it_finds_is_on_trial() {
    let mut state = in_phase(Phase::Lost { next: 7 });
    state.search_on(4);
    assert_eq!(state, in_phase(Phase::Lost { next: 11 }));
    state.begin_verification(BACK, &config());
    assert_eq!(state.phase, Phase::Verifying { left: 4, back: BACK });
    let mut state = in_phase(Phase::Occluded { next: 7, unknown: 2, last: BACK });
    state.search_on(4);
    assert_eq!(state, in_phase(Phase::Occluded { next: 11, unknown: 2, last: BACK }));
}

#[test]
fn the_first_belief_is_the_first_frame() {
    let first = TrackState::first(&KNOWN);
    assert_eq!(first, TrackState { recent: 1.0, ..STATE });
    assert!(first.is_sound());
    assert!(!TrackState { seen: f64::NAN, ..first }.is_sound());
    assert!(!in_phase(Phase::Lost { next: u64::MAX }).is_sound());
    let nowhere = Pose { scale: 0.0, ..BACK };
    assert!(!in_phase(Phase::Verifying { left: 1, back: nowhere }).is_sound());
    assert!(!in_phase(Phase::Occluded { next: 0, unknown: 0, last: nowhere }).is_sound());
    let means = RunningMeans { visible: f64::NAN, ..first.means };
    assert!(!TrackState { means, ..first }.is_sound());
}
