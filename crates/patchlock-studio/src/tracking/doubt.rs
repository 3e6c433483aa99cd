//! Which frames of a target to look at next.

use std::fmt;

use patchlock::Status;

use crate::project::{Target, Tracked};

/// Frames with at least this probability of a wrong box are doubtful.
const DOUBTFUL: f64 = 0.5;

/// Share of the frames, far from a key frame and not doubtful, that a key frame is expected to
/// improve. Between two key frames, it is this share of the expected number of wrong boxes.
const UNCHECKED: f64 = 0.05;

/// Shorter stretches without a key frame need no look.
const LEAST_UNCHECKED: usize = 10;

/// A stretch without a key frame needs no look if fewer boxes than this are expected to be wrong.
const LEAST_WRONG: f64 = 1.0;

/// Tracks from both sides with at least this overlap agree on where the target is.
const AGREED: f64 = 0.5;

/// A frame whose box may be wrong.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Doubt {
    /// The frame.
    pub frame: usize,
    /// The number of frames that a correction here is expected to repair.
    pub gain: f64,
    /// Why the frame is doubtful.
    pub reason: Reason,
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
        }
    }
}

/// The frames of a target to look at, the one whose correction is expected to repair most frames
/// first: one for each stretch of doubtful frames, and one for each span without a key frame.
pub fn doubts(target: &Target) -> Vec<Doubt> {
    let mut found = Vec::new();
    for span in spans(target) {
        let stretches = span.chunk_by(|a, b| is_doubtful(&a.1) == is_doubtful(&b.1));
        found.extend(stretches.filter(|frames| is_doubtful(&frames[0].1)).map(middle));
        found.extend(unchecked(target, &span));
    }
    found.sort_by(|a, b| b.gain.total_cmp(&a.gain).then(a.frame.cmp(&b.frame)));
    found
}

/// How many boxes of a target are expected to be wrong.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Left {
    /// The boxes that no person has drawn or confirmed. Those of lost frames are none.
    pub boxes: usize,
    /// The number of them that are expected to be wrong: the sum of their probabilities.
    pub expected: f64,
    /// The number of them that are more probably wrong than right.
    pub probable: usize,
}

/// What is left to check of a target.
pub fn left(target: &Target) -> Left {
    let boxes = target.tracked.values().filter(|tracked| tracked.status != Status::Lost);
    boxes.fold(Left::default(), |left, tracked| Left {
        boxes: left.boxes + 1,
        expected: left.expected + wrong(tracked),
        probable: left.probable + usize::from(wrong(tracked) > DOUBTFUL),
    })
}

/// The probability that a box overlaps the target by less than half. The score is calibrated: on
/// sets that it was not fitted to, the share of right boxes differs from it by .03 in the mean
/// (METHODOLOGY.md). Nothing was measured of the agreement, so it counts only where the tracks from
/// both sides are apart.
fn wrong(tracked: &Tracked) -> f64 {
    let apart = tracked.agreement.filter(|&agreement| agreement < AGREED);
    1.0 - tracked.score.min(apart.unwrap_or(1.0))
}

type Span = Vec<(usize, Tracked)>;

/// The tracked frames, divided where a key frame or a frame without a box lies between.
fn spans(target: &Target) -> Vec<Span> {
    let frames: Span = target.tracked.iter().map(|(&frame, &tracked)| (frame, tracked)).collect();
    frames.chunk_by(|a, b| a.0 + 1 == b.0).map(<[_]>::to_vec).collect()
}

/// The probability that the box of a frame is wrong.
fn risk(tracked: &Tracked) -> f64 {
    1.0 - tracked.score.min(tracked.agreement.unwrap_or(1.0))
}

fn is_doubtful(tracked: &Tracked) -> bool {
    risk(tracked) > DOUBTFUL || tracked.status == Status::Lost
}

/// The middle of a stretch of doubtful frames: from there, both sides can be tracked again.
fn middle(frames: &[(usize, Tracked)]) -> Doubt {
    let (frame, tracked) = frames[frames.len() / 2];
    let gain = frames.iter().map(|(_, tracked)| risk(tracked)).sum();
    Doubt { frame, gain, reason: reason(&tracked) }
}

fn reason(tracked: &Tracked) -> Reason {
    let agreement = tracked.agreement.unwrap_or(1.0);
    match tracked.visible {
        _ if tracked.status == Status::Lost => Reason::Lost,
        _ if agreement < tracked.score => Reason::Disagreement(agreement),
        Some(visible) if visible < 0.5 => Reason::Hidden(1.0 - visible),
        _ => Reason::Unsure(tracked.score),
    }
}

/// Where a span is farthest from a key frame: at its open end, or in its middle.
fn unchecked(target: &Target, span: &[(usize, Tracked)]) -> Option<Doubt> {
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
    (away >= LEAST_UNCHECKED && expected >= LEAST_WRONG).then_some(Doubt {
        frame,
        gain,
        reason: Reason::Unchecked(away),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::project::Key;
    use patchlock::BoundingBox;
    use std::collections::BTreeMap;

    const BOX: BoundingBox = BoundingBox { x: 10.0, y: 10.0, w: 20.0, h: 20.0 };

    fn sure() -> Tracked {
        let status = Status::Tracked;
        Tracked { bbox: BOX, score: 0.95, status, visible: Some(0.9), agreement: Some(0.9) }
    }

    /// Key frames at 0 and 100, tracked between and beyond, up to 159.
    fn target() -> Target {
        let key = Key { bbox: BOX, occluded: false, truncated: false };
        Target {
            id: 1,
            label: "car".into(),
            attributes: BTreeMap::new(),
            changes: BTreeMap::new(),
            keys: BTreeMap::from([(0, key), (100, key)]),
            tracked: (1..160).filter(|&frame| frame != 100).map(|frame| (frame, sure())).collect(),
            hidden: Vec::new(),
        }
    }

    #[test]
    fn without_doubt_open_spans_come_before_those_between_key_frames() {
        let found = doubts(&target());
        let found: Vec<_> = found.iter().map(|doubt| (doubt.frame, doubt.reason)).collect();
        assert_eq!(found, [(159, Reason::Unchecked(59)), (50, Reason::Unchecked(50))]);
    }

    #[test]
    fn the_middle_of_a_doubtful_stretch_comes_first_with_its_reason() {
        let cases = [
            (Tracked { agreement: Some(0.1), ..sure() }, Reason::Disagreement(0.1)),
            (Tracked { score: 0.2, visible: Some(0.1), ..sure() }, Reason::Hidden(0.9)),
            (Tracked { score: 0.2, ..sure() }, Reason::Unsure(0.2)),
            (Tracked { score: 0.4, status: Status::Lost, ..sure() }, Reason::Lost),
        ];
        for (doubtful, reason) in cases {
            let mut target = target();
            target.tracked.extend((20..41).map(|frame| (frame, doubtful)));
            let first = doubts(&target)[0];
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
        assert_eq!(doubts(&with_scores(0.98)).len(), 2);
        assert_eq!(doubts(&with_scores(0.985)).len(), 1);
        assert_eq!(doubts(&with_scores(0.995)), []);
        // A box that is probably wrong is never left out.
        let mut target = with_scores(1.0);
        target.tracked.insert(30, Tracked { score: 0.4, ..sure() });
        assert_eq!(doubts(&target).iter().map(|doubt| doubt.frame).collect::<Vec<_>>(), [30]);
    }

    #[test]
    fn what_is_left_is_the_sum_of_probabilities() {
        let mut target = target();
        target.tracked = BTreeMap::from([
            (1, sure()),
            (2, Tracked { score: 0.3, ..sure() }),
            (3, Tracked { agreement: Some(0.1), ..sure() }),
            (4, Tracked { score: 0.2, status: Status::Lost, ..sure() }),
        ]);
        let Left { boxes, expected, probable } = left(&target);
        assert_eq!((boxes, probable), (3, 2));
        assert!((expected - (0.05 + 0.7 + 0.9)).abs() < 1e-9, "{expected}");
    }

    #[test]
    fn targets_without_tracked_frames_have_no_doubts() {
        assert_eq!(doubts(&Target { tracked: BTreeMap::new(), ..target() }), []);
    }

    #[test]
    fn frames_before_the_first_key_are_open_at_their_beginning() {
        let mut target = target();
        target.keys.remove(&0);
        assert!(doubts(&target).iter().any(|doubt| doubt.frame == 1));
    }
}
