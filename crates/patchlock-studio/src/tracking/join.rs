//! One track of a forward and a backward one.

use patchlock::{BoundingBox, Status};

use crate::project::TrackedBox;

/// Boxes that overlap by at least this much are on the same target.
const LEAST_OVERLAP: f64 = 0.3;

/// In spans of at most this many frames, a straight line is better than tracks that disagree. With
/// the development sequences of `examples/annotator.rs`, 6 and 24 give nearly the same number of
/// key frames.
const SHORT: usize = 12;

/// A track with a lower score is not sure.
const SURE: f64 = 0.5;

/// Boxes that overlap by at least this much agree on where the target is.
pub(super) const AGREED: f64 = 0.5;

/// The target is clearly visible where it is tracked and at least this share is visible.
const CLEAR: f64 = 0.75;

/// A tracker that began this many frames ago knows the target. One that began shortly before the
/// target was hidden learns what hides it, and takes up to .76 of that for the target; others at
/// most .27 (rendered scenes, `tests/tracking.rs`).
const SETTLED: usize = 20;

/// Below this visible share, a track may be on what hides the target.
const HIDDEN: f64 = 0.3;

/// The highest score of a lost target.
const LOST: f64 = 0.5;

/// Joins what was found between two neighbouring key frames, `first` and `last`.
///
/// `forward` was tracked from the first key frame and holds the frames after it, up to and with the
/// last key frame. `backward` was tracked from the last key frame and holds, in the order of the
/// video, the first key frame and the frames after it, without the last. Both have one element per
/// frame of the span, `n`; the result has the `n - 1` frames between the key frames. If one is
/// longer, its further elements are ignored.
///
/// A track that arrives at the other key frame loses its drift, in equal parts on each frame. Where
/// both arrive and agree, the box moves from the one to the other. Elsewhere it is on a straight
/// line from where the forward track was last sure to where the backward track is sure again, or,
/// in short spans, between the key frames. In all other frames it is that of one track up to a
/// frame and of the other from there on.
///
/// The result is never surer than what the tracks have seen. Where they are apart, the score is at
/// most their overlap, and where one of them sees little of the target and the other does not
/// see it clearly, at most the visible share. What one of them has lost stays lost, unless the
/// other one sees the target there: then it alone has an opinion, and there is no agreement.
///
/// `before` is asked for each frame of the result, by its position. It answers what was known of a
/// frame in which the target was not seen so far, as [`doubtful`](super::review::doubtful) does; then
/// the frame becomes surer only if one of the tracks sees the target there.
pub fn join(
    first: BoundingBox,
    forward: &[TrackedBox],
    backward: &[TrackedBox],
    last: BoundingBox,
    before: impl Fn(usize) -> Option<TrackedBox>,
) -> Vec<TrackedBox> {
    let span = forward.len().min(backward.len());
    if span == 0 {
        return Vec::new();
    }
    let share = |at: usize| (at + 1) as f64 / span as f64;
    let there = Drift::of(forward[span - 1].bbox, last);
    let back = Drift::of(backward[0].bbox, first);
    let arrived = there.is_some() && back.is_some();
    let forward = without(there, &forward[..span - 1], share);
    let backward = without(back, &backward[1..span], |at| 1.0 - share(at));
    let switch = best_switch(&forward, &backward);
    let gap = Gap::between(&forward, &backward);
    let seen_forward = seen(forward.iter());
    let mut seen_backward = seen(backward.iter().rev());
    seen_backward.reverse();
    let join = |(at, (forward, backward)): (usize, (&TrackedBox, &TrackedBox))| {
        let mut agreement = forward.bbox.overlap(&backward.bbox);
        let found = if at < switch { *forward } else { *backward };
        let bbox = if arrived && agreement >= LEAST_OVERLAP {
            between(forward.bbox, backward.bbox, share(at))
        } else if let Some(bbox) = gap.as_ref().and_then(|gap| gap.at(at)) {
            bbox
        } else if span <= SHORT {
            let line = between(first, last, share(at));
            // A line that one of the tracks is on is probably right.
            agreement =
                agreement.max(line.overlap(&forward.bbox)).max(line.overlap(&backward.bbox));
            line
        } else {
            found.bbox
        };
        let tracks = [(forward, seen_forward[at]), (backward, seen_backward[at])];
        judge(TrackedBox { bbox, ..found }, agreement, tracks, before(at))
    };
    forward.iter().zip(&backward).enumerate().map(join).collect()
}

/// What two tracks say of a box to which they lead, in a frame of which `before` was known if the
/// target was not seen there.
fn judge(
    found: TrackedBox,
    agreement: f64,
    tracks: [(&TrackedBox, bool); 2],
    before: Option<TrackedBox>,
) -> TrackedBox {
    let joined = TrackedBox { agreement: Some(agreement), ..found };
    let is_lost = |status| status == Status::Lost;
    let lost = tracks.iter().filter(|(track, _)| is_lost(track.status)).count();
    let was_lost = before.is_some_and(|before| is_lost(before.status));
    let sees =
        |(track, seen): &&(&TrackedBox, bool)| *seen && track.bbox.overlap(&found.bbox) >= AGREED;
    match tracks.iter().find(sees) {
        None if lost > 0 || was_lost => {
            let most = if agreement < AGREED { agreement.min(LOST) } else { LOST };
            let score = tracks.iter().fold(most, |least, (track, _)| least.min(track.score));
            return TrackedBox { score, status: Status::Lost, ..joined };
        }
        Some((alone, _)) if lost > 0 => {
            return TrackedBox { bbox: found.bbox, ..**alone };
        }
        Some(_) if agreement >= AGREED => return joined,
        _ => {}
    }
    let visible = tracks.iter().filter_map(|(track, _)| track.visible).fold(1.0, f64::min);
    let limits = [
        (agreement < AGREED).then_some(agreement),
        (visible < HIDDEN).then_some(visible),
        before.map(|before| before.score.min(before.agreement.unwrap_or(1.0))),
    ];
    match limits.into_iter().flatten().reduce(f64::min) {
        Some(most) => {
            TrackedBox { score: found.score.min(most), status: Status::Uncertain, ..joined }
        }
        None => joined,
    }
}

/// A stretch in which neither track is sure: what each finds there is no better than a straight
/// line.
struct Gap {
    /// The last frame before it, and the box of the forward track.
    before: (usize, BoundingBox),
    /// The first frame after it, and the box of the backward track.
    after: (usize, BoundingBox),
}

impl Gap {
    /// The gap between the frames in which the forward track is sure from the first on, and those
    /// in which the backward track is sure up to the last.
    fn between(forward: &[TrackedBox], backward: &[TrackedBox]) -> Option<Self> {
        let is_unsure = |found: &TrackedBox| found.status == Status::Lost || found.score < SURE;
        let before = forward.iter().position(is_unsure)?.checked_sub(1)?;
        let after = backward.iter().rposition(is_unsure)? + 1;
        let before = (before, forward[before].bbox);
        let after = (after, backward.get(after)?.bbox);
        (before.0 < after.0).then_some(Self { before, after })
    }

    /// The box on the line, within the gap.
    fn at(&self, frame: usize) -> Option<BoundingBox> {
        let (before, after) = (self.before.0, self.after.0);
        let share = |frame: usize| (frame - before) as f64 / (after - before) as f64;
        let is_within = before < frame && frame < after;
        is_within.then(|| between(self.before.1, self.after.1, share(frame)))
    }
}

/// Whether a track sees the target, frame by frame from its key frame on: it is clearly visible, and
/// has been since the key frame, or the tracker knows it for long.
fn seen<'a>(track: impl Iterator<Item = &'a TrackedBox>) -> Vec<bool> {
    let is_clear = |found: &TrackedBox| {
        found.status == Status::Tracked && found.visible.is_none_or(|visible| visible >= CLEAR)
    };
    let mut always = true;
    let seen = |(at, found): (usize, &TrackedBox)| {
        let is_clear = is_clear(found);
        always &= is_clear;
        is_clear && (always || at >= SETTLED)
    };
    track.enumerate().map(seen).collect()
}

/// What was found, each box without a share of the drift.
fn without(
    drift: Option<Drift>,
    found: &[TrackedBox],
    share: impl Fn(usize) -> f64,
) -> Vec<TrackedBox> {
    let frames = found.iter().enumerate();
    let corrected = frames.map(|(at, found)| TrackedBox {
        bbox: drift.map_or(found.bbox, |drift| drift.undo(found.bbox, share(at))),
        ..*found
    });
    corrected.collect()
}

/// By how much a track is off at its end.
#[derive(Debug, Clone, Copy)]
struct Drift {
    /// Displacement of the centre, in widths and heights of the box.
    shift: [f64; 2],
    /// Ratios of width and height.
    size: [f64; 2],
}

impl Drift {
    /// The drift of a track that has arrived; `None` if its box is elsewhere.
    fn of(found: BoundingBox, truth: BoundingBox) -> Option<Self> {
        let ([fx, fy], [tx, ty]) = (found.centre(), truth.centre());
        (found.overlap(&truth) >= LEAST_OVERLAP).then_some(Self {
            shift: [(tx - fx) / found.w, (ty - fy) / found.h],
            size: [truth.w / found.w, truth.h / found.h],
        })
    }

    /// The box without this share of the drift.
    fn undo(self, bbox: BoundingBox, share: f64) -> BoundingBox {
        let [x, y] = bbox.centre();
        let centre = [x + share * self.shift[0] * bbox.w, y + share * self.shift[1] * bbox.h];
        let [w, h] = self.size.map(|ratio| ratio.powf(share));
        BoundingBox::around(centre, bbox.w * w, bbox.h * h)
    }
}

/// The box at this share of the way from one to another, on straight lines.
pub fn between(from: BoundingBox, to: BoundingBox, share: f64) -> BoundingBox {
    let at = |from: f64, to: f64| from + share * (to - from);
    BoundingBox {
        x: at(from.x, to.x),
        y: at(from.y, to.y),
        w: at(from.w, to.w),
        h: at(from.h, to.h),
    }
}

/// The number of frames to take from the forward track, the rest being taken from the backward
/// track: where the two are sure on their sides, and agree.
fn best_switch(forward: &[TrackedBox], backward: &[TrackedBox]) -> usize {
    let total: f64 = backward.iter().map(|found| found.score).sum();
    let mut best = (f64::NEG_INFINITY, 0);
    let (mut before, mut after) = (0.0, total);
    for at in 0..=forward.len() {
        let agreement = match at {
            0 => 0.0,
            _ => forward[at - 1].bbox.overlap(&backward[at - 1].bbox),
        };
        let value = before + after + agreement;
        if value > best.0 {
            best = (value, at);
        }
        if at < forward.len() {
            before += forward[at].score;
            after -= backward[at].score;
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;
    use patchlock::Status;

    fn at(x: f64, w: f64) -> BoundingBox {
        BoundingBox { x, y: 50.0, w, h: 20.0 }
    }

    fn found(bbox: BoundingBox, score: f64) -> TrackedBox {
        TrackedBox { bbox, score, status: Status::Tracked, visible: None, agreement: None }
    }

    fn assert_near(joined: &[TrackedBox], truth: impl Fn(usize) -> BoundingBox) {
        for (k, tracked) in joined.iter().enumerate() {
            let overlap = tracked.bbox.overlap(&truth(k + 1));
            assert!(overlap > 0.999, "frame {}: {:?}, overlap {overlap}", k + 1, tracked.bbox);
        }
    }

    /// Both tracks drift evenly, in place and in size, to opposite sides.
    #[test]
    fn drift_is_taken_back() {
        let n = 40;
        let truth = |k: usize| at(3.0 * k as f64, 20.0);
        let drifted = |k: usize, by: usize| {
            let growth = 1.01f64.powi(by as i32);
            let [x, y] = truth(k).centre();
            found(BoundingBox::around([x, y], 20.0 * growth, 20.0 * growth), 0.9)
        };
        let forward: Vec<_> = (1..=n).map(|k| drifted(k, k)).collect();
        let backward: Vec<_> = (0..n).map(|k| drifted(k, n - k)).collect();
        let joined = join(truth(0), &forward, &backward, truth(n), |_| None);
        assert_eq!(joined.len(), n - 1);
        assert_near(&joined, truth);
    }

    /// The target is hidden at frame 25. The forward track stays there, the backward one too.
    #[test]
    fn each_side_is_taken_where_it_is_sure() {
        let n = 50;
        let truth = |k: usize| at(10.0 * k as f64, 20.0);
        let forward = |k: usize| found(truth(k.min(24)), if k < 25 { 0.9 } else { 0.1 });
        let backward = |k: usize| found(truth(k.max(25)), if k < 25 { 0.1 } else { 0.9 });
        let forward: Vec<_> = (1..=n).map(forward).collect();
        let backward: Vec<_> = (0..n).map(backward).collect();
        let joined = join(truth(0), &forward, &backward, truth(n), |_| None);
        assert_near(&joined, truth);
        assert!(joined[4].agreement.unwrap() < 0.1);
    }

    #[test]
    fn short_spans_in_which_tracks_disagree_are_straight() {
        let truth = |k: usize| at(30.0 * k as f64, 20.0);
        let (forward, backward) = (vec![found(truth(0), 0.9); 6], vec![found(truth(6), 0.9); 6]);
        let joined = join(truth(0), &forward, &backward, truth(6), |_| None);
        assert_near(&joined, truth);
        assert!(joined.iter().all(|tracked| tracked.agreement.unwrap() < 0.5));
        // One track follows the target, the other does not.
        let forward: Vec<_> = (1..=6).map(|k| found(truth(k), 0.9)).collect();
        let joined = join(truth(0), &forward, &backward, truth(6), |_| None);
        assert_near(&joined, truth);
        assert!(joined.iter().all(|tracked| tracked.agreement.unwrap() > 0.99));
    }

    /// The target is hidden from frame 20 to 39. Both tracks stay where it disappeared.
    #[test]
    fn where_neither_is_sure_the_box_is_on_a_line() {
        let n = 60;
        let truth = |k: usize| at(5.0 * k as f64, 20.0);
        let hidden = |k: usize| (20..40).contains(&k);
        let score = |sure: bool| if sure { 0.9 } else { 0.2 };
        let forward: Vec<_> = (1..=n).map(|k| found(truth(k.min(19)), score(k < 20))).collect();
        let backward: Vec<_> = (0..n).map(|k| found(truth(k.max(40)), score(k >= 40))).collect();
        let joined = join(truth(0), &forward, &backward, truth(n), |_| None);
        assert_near(&joined, truth);
        assert!((1..n).all(|k| (joined[k - 1].agreement.unwrap() < 0.5) || !hidden(k)));
    }

    /// Forward, backward, what was known before; the score and the status of the middle frame.
    #[test]
    fn nothing_is_surer_than_what_was_seen() {
        use Status::{Lost, Tracked as Sure, Uncertain};
        let truth = |_| at(50.0, 20.0);
        let (here, near, away) = (at(50.0, 20.0), at(52.0, 20.0), at(90.0, 20.0));
        let one = |bbox, score, status, visible| TrackedBox {
            bbox,
            score,
            status,
            visible: Some(visible),
            agreement: None,
        };
        let was = |score, status| Some(one(here, score, status, 0.1));
        let cases = [
            // What both have lost stays lost, and so does what one has lost and the other not seen.
            ((here, 0.4, Lost, 0.1), (near, 0.3, Lost, 0.1), None, (0.3, Lost)),
            ((here, 0.4, Lost, 0.1), (near, 0.94, Uncertain, 0.2), None, (0.4, Lost)),
            ((here, 0.4, Lost, 0.1), (here, 0.94, Sure, 0.6), None, (0.4, Lost)),
            ((here, 0.4, Lost, 0.1), (here, 0.94, Sure, 0.9), None, (0.94, Sure)),
            // Where they are apart, the score is at most the overlap.
            ((here, 0.9, Sure, 0.9), (away, 0.9, Sure, 0.9), None, (0.0, Uncertain)),
            // Both are on what hides the target.
            ((here, 0.79, Uncertain, 0.2), (near, 0.7, Uncertain, 0.6), None, (0.2, Uncertain)),
            ((here, 0.9, Sure, 0.9), (near, 0.7, Uncertain, 0.2), None, (0.9, Sure)),
            // What was not seen before becomes surer only if it is seen now.
            ((here, 0.9, Sure, 0.6), (near, 0.8, Sure, 0.6), was(0.3, Lost), (0.5, Lost)),
            ((here, 0.9, Sure, 0.6), (near, 0.8, Sure, 0.6), was(0.3, Uncertain), (0.3, Uncertain)),
            ((here, 0.9, Sure, 0.9), (near, 0.8, Sure, 0.6), was(0.3, Lost), (0.9, Sure)),
        ];
        for (forward, backward, before, expected) in cases {
            let found = |(bbox, score, status, visible)| one(bbox, score, status, visible);
            // The ends are key frames; long spans have no lines.
            let sides = |middle| {
                let mut side = vec![one(here, 0.9, Sure, 0.9); 21];
                side[10] = found(middle);
                side
            };
            let (ahead, mut back) = (sides(forward), sides(backward));
            back.rotate_left(20);
            let joined = join(truth(0), &ahead, &back, truth(21), |at| before.filter(|_| at == 10));
            let TrackedBox { score, status, .. } = joined[10];
            assert!((score - expected.0).abs() < 0.01 && status == expected.1, "{:?}", joined[10]);
        }
    }

    #[test]
    fn spans_without_frames_between() {
        let one = [found(at(0.0, 20.0), 0.9)];
        assert_eq!(join(at(0.0, 20.0), &one, &one, at(1.0, 20.0), |_| None), []);
        assert_eq!(join(at(0.0, 20.0), &[], &[], at(1.0, 20.0), |_| None), []);
    }
}
