//! Which frames of a target to look at next.

use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::fmt;

use patchlock::Status;
use serde::Serialize;

use super::join::AGREED;
use crate::project::{Target, TrackedBox};

/// Frames with at least this probability of a wrong box are doubtful.
const DOUBTFUL: f64 = 0.5;

/// Share of the frames, far from a key frame and not doubtful, that a key frame is expected to
/// improve. Between two key frames, it is this share of the expected number of wrong boxes.
const UNCHECKED: f64 = 0.05;

/// Shorter stretches without a key frame need no look.
const LEAST_UNCHECKED: usize = 10;

/// A stretch without a key frame needs no look if fewer boxes than this are expected to be wrong.
const LEAST_WRONG: f64 = 1.0;

/// A frame whose box may be wrong, or of which nothing is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReviewSuggestion {
    /// The frame to look at.
    pub frame: usize,
    /// First and last frame of the stretch that the reason is about.
    pub stretch: [usize; 2],
    /// The number of frames that a correction here is expected to repair.
    pub gain: f64,
    /// Why the frame is doubtful.
    pub reason: Reason,
    /// What is probably wrong or missing is 0, what was not checked 1. Frames before the first box
    /// are 2: there, most targets have not appeared yet.
    rank: u8,
}

impl ReviewSuggestion {
    /// The order in which to look at places: by rank, then the largest gain first.
    pub fn order(&self, other: &Self) -> Ordering {
        let by_gain = other.gain.total_cmp(&self.gain).then(self.frame.cmp(&other.frame));
        self.rank.cmp(&other.rank).then(by_gain)
    }
}

/// Why a frame is doubtful. Its text is for a person to read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reason {
    /// The tracker lost the target.
    Lost,
    /// Tracked forward and backward, the boxes overlap by only this share.
    Disagreement(f64),
    /// This share of the target seems to be hidden.
    Hidden(f64),
    /// The score is this low.
    Unsure(f64),
    /// Nothing is wrong as far as is known, but the next key frame is this many frames away.
    Unchecked(usize),
    /// Nothing is known of this many frames: they were never tracked.
    Untracked(usize),
}

impl Reason {
    /// Whether nothing is known of the frames.
    pub fn is_untracked(self) -> bool {
        matches!(self, Self::Untracked(_))
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Lost => write!(f, "lost, or out of the frame"),
            Self::Disagreement(overlap) => {
                write!(f, "forward and backward tracks overlap by {:.0} %", 100.0 * overlap)
            }
            Self::Hidden(share) => write!(f, "hidden {:.0} %", 100.0 * share),
            Self::Unsure(score) => write!(f, "looks different: score {score:.2}"),
            Self::Unchecked(frames) => write!(f, "unchecked: {frames} frames from a key frame"),
            Self::Untracked(1) => write!(f, "not tracked yet: 1 frame"),
            Self::Untracked(frames) => write!(f, "not tracked yet: {frames} frames"),
        }
    }
}

/// The frames of a target to look at, in a video with this number of frames: one for each stretch of
/// doubtful frames, one for each stretch that was never tracked, and one for each span without a key
/// frame. What is probably wrong or missing comes before what is only unchecked; among these, the
/// frame whose correction is expected to repair most frames comes first.
pub fn suggestions(target: &Target, frames: usize) -> Vec<ReviewSuggestion> {
    let mut found: Vec<ReviewSuggestion> = untracked(target, frames);
    for span in spans(target) {
        let stretches = span.chunk_by(|a, b| is_doubtful(&a.1) == is_doubtful(&b.1));
        found.extend(stretches.filter(|frames| is_doubtful(&frames[0].1)).map(middle));
        found.extend(unchecked(target, &span));
    }
    found.sort_by(ReviewSuggestion::order);
    found
}

/// The stretches of which nothing is known: neither a box nor that the target is not visible.
pub fn unknown(target: &Target, frames: usize) -> Vec<[usize; 2]> {
    let boxes = target.keys.keys().chain(target.tracked.keys()).map(|&frame| [frame; 2]);
    let mut known: Vec<[usize; 2]> = boxes.chain(target.hidden.iter().copied()).collect();
    known.sort_unstable();
    let (mut unknown, mut next) = (Vec::new(), 0);
    for [first, last] in known.into_iter().chain([[frames; 2]]) {
        let end = first.min(frames);
        if next < end {
            unknown.push([next, end - 1]);
        }
        next = next.max(last + 1);
    }
    unknown
}

/// What is known of the frames that are doubtful, without the stretches in which there is a key
/// frame: it says that the target is there.
pub fn doubtful(target: &Target) -> BTreeMap<usize, TrackedBox> {
    let mut doubtful = target.tracked.clone();
    doubtful.retain(|_, tracked| is_doubtful(tracked));
    let keys: Vec<usize> = target.keys.keys().copied().collect();
    for keys in keys.chunk_by(|a, b| a + 1 == *b) {
        let (before, after) = (keys[0].checked_sub(1), keys[keys.len() - 1] + 1);
        let Some(before) = before.filter(|before| doubtful.contains_key(before)) else { continue };
        if doubtful.contains_key(&after) {
            (0..=before).rev().take_while(|at| doubtful.remove(at).is_some()).for_each(drop);
            (after..).take_while(|at| doubtful.remove(at).is_some()).for_each(drop);
        }
    }
    doubtful
}

/// A suggestion for each stretch that was never tracked, at its end beside a box.
fn untracked(target: &Target, frames: usize) -> Vec<ReviewSuggestion> {
    let is_known = |frame: usize| target.box_at(frame).is_some();
    let boxes = target.keys.keys().chain(target.tracked.keys());
    let first_box = boxes.min().copied().unwrap_or(0);
    let suggestion = |[first, last]: [usize; 2]| {
        let is_before = !first.checked_sub(1).is_some_and(is_known) && is_known(last + 1);
        let count = last - first + 1;
        ReviewSuggestion {
            frame: if is_before { last } else { first },
            stretch: [first, last],
            gain: count as f64,
            reason: Reason::Untracked(count),
            rank: if last < first_box { 2 } else { 0 },
        }
    };
    unknown(target, frames).into_iter().map(suggestion).collect()
}

/// How many boxes of a target are expected to be wrong.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct ReviewStats {
    /// The boxes that no person has drawn or confirmed. Those of lost frames are none.
    pub boxes: usize,
    /// The number of them that are expected to be wrong: the sum of their probabilities.
    pub expected: f64,
    /// The number of them that are more probably wrong than right.
    pub probable: usize,
    /// The number of frames of which nothing is known.
    pub unknown: usize,
}

impl std::iter::Sum for ReviewStats {
    fn sum<I: Iterator<Item = Self>>(all: I) -> Self {
        all.fold(Self::default(), |sum, one| Self {
            boxes: sum.boxes + one.boxes,
            expected: sum.expected + one.expected,
            probable: sum.probable + one.probable,
            unknown: sum.unknown + one.unknown,
        })
    }
}

/// What is left to check of a target, in a video with this number of frames.
pub fn review_stats(target: &Target, frames: usize) -> ReviewStats {
    let boxes = target.tracked.values().filter(|tracked| tracked.status != Status::Lost);
    let boxes = boxes.map(|tracked| ReviewStats {
        boxes: 1,
        expected: wrong(tracked),
        probable: usize::from(wrong(tracked) > DOUBTFUL),
        unknown: 0,
    });
    let unknown = unknown(target, frames).iter().map(|[first, last]| last - first + 1).sum();
    ReviewStats { unknown, ..boxes.sum::<ReviewStats>() }
}

/// The probability that a box overlaps the target by less than half. The score is calibrated: on
/// targets that it was not fitted to, the share of right boxes differs from it by .01 in the mean
/// (ECE, `benchmarks/record/committee.md`). Nothing was measured of the agreement, so it counts only
/// where the tracks from both sides are apart.
fn wrong(tracked: &TrackedBox) -> f64 {
    let apart = tracked.agreement.filter(|&agreement| agreement < AGREED);
    1.0 - tracked.score.min(apart.unwrap_or(1.0))
}

type Span = Vec<(usize, TrackedBox)>;

/// The tracked frames, divided where a key frame or a frame without a box lies between.
fn spans(target: &Target) -> Vec<Span> {
    let frames: Span = target.tracked.iter().map(|(&frame, &tracked)| (frame, tracked)).collect();
    frames.chunk_by(|a, b| a.0 + 1 == b.0).map(<[_]>::to_vec).collect()
}

/// The probability that the box of a frame is wrong.
fn risk(tracked: &TrackedBox) -> f64 {
    1.0 - tracked.score.min(tracked.agreement.unwrap_or(1.0))
}

fn is_doubtful(tracked: &TrackedBox) -> bool {
    risk(tracked) > DOUBTFUL || tracked.status == Status::Lost
}

/// The middle of a stretch of doubtful frames: from there, both sides can be tracked again.
fn middle(frames: &[(usize, TrackedBox)]) -> ReviewSuggestion {
    let (frame, tracked) = frames[frames.len() / 2];
    let gain = frames.iter().map(|(_, tracked)| risk(tracked)).sum();
    let stretch = [frames[0].0, frames[frames.len() - 1].0];
    ReviewSuggestion { frame, stretch, gain, reason: reason(&tracked), rank: 0 }
}

fn reason(tracked: &TrackedBox) -> Reason {
    let agreement = tracked.agreement.unwrap_or(1.0);
    match tracked.visible {
        _ if tracked.status == Status::Lost => Reason::Lost,
        _ if agreement < tracked.score => Reason::Disagreement(agreement),
        Some(visible) if visible < 0.5 => Reason::Hidden(1.0 - visible),
        _ => Reason::Unsure(tracked.score),
    }
}

/// Where a span is farthest from a key frame: at its open end, or in its middle.
fn unchecked(target: &Target, span: &[(usize, TrackedBox)]) -> Option<ReviewSuggestion> {
    let (first, last) = (span.first()?.0, span.last()?.0);
    let is_key = |frame: Option<usize>| frame.is_some_and(|frame| target.keys.contains_key(&frame));
    let all = span.len() as f64;
    let (frame, away, uncertain) = match (is_key(first.checked_sub(1)), is_key(last.checked_add(1)))
    {
        (_, false) => (last, span.len(), all),
        (false, true) => (first, span.len(), all),
        // Where tracks from both sides agree, they check each other.
        (true, true) => {
            let risks: f64 = span.iter().map(|(_, tracked)| risk(tracked)).sum();
            (first + span.len() / 2, span.len().div_ceil(2), risks)
        }
    };
    let gain = UNCHECKED * uncertain;
    let expected: f64 = span.iter().map(|(_, tracked)| wrong(tracked)).sum();
    (away >= LEAST_UNCHECKED && expected >= LEAST_WRONG).then_some(ReviewSuggestion {
        frame,
        stretch: [first, last],
        gain,
        reason: Reason::Unchecked(away),
        rank: 1,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::project::Key;
    use patchlock::BoundingBox;

    /// The last tracked frame of [`target`] is the last one of the video.
    const FRAMES: usize = 160;
    const BOX: BoundingBox = BoundingBox { x: 10.0, y: 10.0, w: 20.0, h: 20.0 };

    fn sure() -> TrackedBox {
        let status = Status::Tracked;
        TrackedBox { bbox: BOX, score: 0.95, status, visible: Some(0.9), agreement: Some(0.9) }
    }

    /// Key frames at 0 and 100, tracked between and beyond, up to 159.
    fn target() -> Target {
        let key = Key::new(BOX);
        Target {
            id: 1,
            label: "car".into(),
            attributes: BTreeMap::new(),
            changes: BTreeMap::new(),
            keys: BTreeMap::from([(0, key.clone()), (100, key)]),
            tracked: (1..160).filter(|&frame| frame != 100).map(|frame| (frame, sure())).collect(),
            hidden: Vec::new(),
        }
    }

    #[test]
    fn open_spans_that_are_not_doubtful_come_before_those_between_key_frames() {
        let found = suggestions(&target(), FRAMES);
        let found: Vec<_> =
            found.iter().map(|suggestion| (suggestion.frame, suggestion.reason)).collect();
        assert_eq!(found, [(159, Reason::Unchecked(59)), (50, Reason::Unchecked(50))]);
    }

    #[test]
    fn the_middle_of_a_doubtful_stretch_comes_first_with_its_reason() {
        let cases = [
            (TrackedBox { agreement: Some(0.1), ..sure() }, Reason::Disagreement(0.1)),
            (TrackedBox { score: 0.2, visible: Some(0.1), ..sure() }, Reason::Hidden(0.9)),
            (TrackedBox { score: 0.2, ..sure() }, Reason::Unsure(0.2)),
            (TrackedBox { score: 0.4, status: Status::Lost, ..sure() }, Reason::Lost),
        ];
        for (doubtful, reason) in cases {
            let mut target = target();
            target.tracked.extend((20..41).map(|frame| (frame, doubtful)));
            let first = suggestions(&target, FRAMES)[0];
            assert_eq!((first.frame, first.reason), (30, reason));
        }
    }

    #[test]
    fn a_span_whose_boxes_are_expected_to_be_right_needs_no_look() {
        let with_scores = |score| {
            let mut target = target();
            target.tracked.values_mut().for_each(|tracked| tracked.score = score);
            target
        };
        // 99 boxes between the keys and 59 beyond: 1.98 and 1.18 wrong ones are expected, then less
        // than one.
        assert_eq!(suggestions(&with_scores(0.98), FRAMES).len(), 2);
        assert_eq!(suggestions(&with_scores(0.985), FRAMES).len(), 1);
        assert_eq!(suggestions(&with_scores(0.995), FRAMES), []);
        // A box that is probably wrong is never left out.
        let mut target = with_scores(1.0);
        target.tracked.insert(30, TrackedBox { score: 0.4, ..sure() });
        assert_eq!(
            suggestions(&target, FRAMES)
                .iter()
                .map(|suggestion| suggestion.frame)
                .collect::<Vec<_>>(),
            [30]
        );
    }

    #[test]
    fn what_is_left_is_the_sum_of_probabilities() {
        let mut target = target();
        target.tracked = BTreeMap::from([
            (1, sure()),
            (2, TrackedBox { score: 0.3, ..sure() }),
            (3, TrackedBox { agreement: Some(0.1), ..sure() }),
            (4, TrackedBox { score: 0.2, status: Status::Lost, ..sure() }),
        ]);
        let ReviewStats { boxes, expected, probable, unknown } = review_stats(&target, 102);
        // Those of two key frames are known, too.
        assert_eq!((boxes, probable, unknown), (3, 2, 102 - 6));
        assert!((expected - (0.05 + 0.7 + 0.9)).abs() < 1e-9, "{expected}");
    }

    /// As a target that was drawn while another one was tracked.
    #[test]
    fn frames_that_were_never_tracked_are_doubtful() {
        let places = |target: &Target| -> Vec<(usize, [usize; 2])> {
            let found = suggestions(target, FRAMES).into_iter();
            let found =
                found.filter(|suggestion| matches!(suggestion.reason, Reason::Untracked(_)));
            found.map(|suggestion| (suggestion.frame, suggestion.stretch)).collect()
        };
        let mut target = Target { tracked: BTreeMap::new(), ..target() };
        assert_eq!(places(&target), [(1, [1, 99]), (101, [101, 159])]);
        target.hidden = vec![[1, 99], [140, 159]];
        assert_eq!(places(&target), [(101, [101, 139])]);
        assert_eq!(
            suggestions(&target, FRAMES)[0].reason.to_string(),
            "not tracked yet: 39 frames"
        );
        // Most targets appear in their first box, so the frames before it come last.
        target.keys.remove(&0);
        target.tracked = (101..140).map(|frame| (frame, sure())).collect();
        target.hidden = vec![[140, 159]];
        let found = suggestions(&target, FRAMES);
        let found: Vec<_> =
            found.iter().map(|suggestion| (suggestion.frame, suggestion.reason)).collect();
        assert_eq!(found, [(139, Reason::Unchecked(39)), (99, Reason::Untracked(100))]);
        target.hidden.insert(0, [0, 99]);
        assert_eq!(places(&target), []);
        let (keys, tracked) = (BTreeMap::new(), BTreeMap::new());
        assert_eq!(suggestions(&Target { keys, tracked, ..target }, 0), []);
    }

    #[test]
    fn a_key_frame_in_a_doubtful_stretch_says_that_the_target_is_there() {
        let mut target = target();
        let lost = TrackedBox { score: 0.3, status: Status::Lost, ..sure() };
        let apart = TrackedBox { agreement: Some(0.1), ..sure() };
        target.tracked.extend((40..50).map(|frame| (frame, lost)));
        target.tracked.extend((101..105).map(|frame| (frame, apart)));
        let frames = |target: &Target| doubtful(target).into_keys().collect::<Vec<_>>();
        // The key frame 100 is beside one, and not in it.
        assert_eq!(frames(&target), (40..50).chain(101..105).collect::<Vec<_>>());
        let key = target.keys[&0].clone();
        for frame in [44, 45] {
            target.tracked.remove(&frame);
            target.keys.insert(frame, key.clone());
        }
        assert_eq!(frames(&target), (101..105).collect::<Vec<_>>());
    }

    #[test]
    fn losses_come_before_unchecked_ends() {
        let mut target = target();
        target.tracked.insert(40, TrackedBox { score: 0.3, status: Status::Lost, ..sure() });
        let found = suggestions(&target, FRAMES);
        assert_eq!((found[0].frame, found[0].reason), (40, Reason::Lost));
        assert!(found[1].gain > found[0].gain, "{found:?}");
    }

    #[test]
    fn frames_before_the_first_key_are_open_at_their_beginning() {
        let mut target = target();
        target.keys.remove(&0);
        assert!(suggestions(&target, FRAMES).iter().any(|suggestion| suggestion.frame == 1));
    }
}
