//! One track of a forward and a backward one.

use patchlock::{BoundingBox, Status};

use super::Found;
use crate::project::Tracked;

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
/// most their overlap. What one of them has lost stays lost, unless the other one tracks the target
/// there: then it alone has an opinion, and there is no agreement.
pub fn join(
    first: BoundingBox,
    forward: &[Found],
    backward: &[Found],
    last: BoundingBox,
) -> Vec<Tracked> {
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
    let join = |(at, (forward, backward)): (usize, (&Found, &Found))| {
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
        judge(Found { bbox, ..found }, agreement, [*forward, *backward])
    };
    forward.iter().zip(&backward).enumerate().map(join).collect()
}

/// What two tracks say of a box to which they lead.
fn judge(found: Found, agreement: f64, tracks: [Found; 2]) -> Tracked {
    let joined = Tracked { agreement: Some(agreement), ..found.into() };
    if tracks.iter().all(|track| track.status != Status::Lost) {
        return match agreement >= AGREED {
            true => joined,
            false => {
                let score = found.score.min(agreement);
                Tracked { score, status: Status::Uncertain, ..joined }
            }
        };
    }
    let tracks_it = |track: &Found| {
        track.status == Status::Tracked && track.bbox.overlap(&found.bbox) >= AGREED
    };
    match tracks.into_iter().find(tracks_it) {
        Some(alone) => Found { bbox: found.bbox, ..alone }.into(),
        None => {
            let score = tracks.iter().fold(found.score, |least, track| least.min(track.score));
            Tracked { score, status: Status::Lost, ..joined }
        }
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
    fn between(forward: &[Found], backward: &[Found]) -> Option<Self> {
        let is_unsure = |found: &Found| found.status == Status::Lost || found.score < SURE;
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

/// What was found, each box without a share of the drift.
fn without(drift: Option<Drift>, found: &[Found], share: impl Fn(usize) -> f64) -> Vec<Found> {
    let frames = found.iter().enumerate();
    let corrected = frames.map(|(at, found)| Found {
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
fn best_switch(forward: &[Found], backward: &[Found]) -> usize {
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

    fn found(bbox: BoundingBox, score: f64) -> Found {
        Found { bbox, score, status: Status::Tracked, visible: None }
    }

    fn assert_near(joined: &[Tracked], truth: impl Fn(usize) -> BoundingBox) {
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
        let joined = join(truth(0), &forward, &backward, truth(n));
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
        let joined = join(truth(0), &forward, &backward, truth(n));
        assert_near(&joined, truth);
        assert!(joined[4].agreement.unwrap() < 0.1);
    }

    #[test]
    fn short_spans_in_which_tracks_disagree_are_straight() {
        let truth = |k: usize| at(30.0 * k as f64, 20.0);
        let (forward, backward) = (vec![found(truth(0), 0.9); 6], vec![found(truth(6), 0.9); 6]);
        let joined = join(truth(0), &forward, &backward, truth(6));
        assert_near(&joined, truth);
        assert!(joined.iter().all(|tracked| tracked.agreement.unwrap() < 0.5));
        // One track follows the target, the other does not.
        let forward: Vec<_> = (1..=6).map(|k| found(truth(k), 0.9)).collect();
        let joined = join(truth(0), &forward, &backward, truth(6));
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
        let joined = join(truth(0), &forward, &backward, truth(n));
        assert_near(&joined, truth);
        assert!((1..n).all(|k| (joined[k - 1].agreement.unwrap() < 0.5) || !hidden(k)));
    }

    #[test]
    fn spans_without_frames_between() {
        let one = [found(at(0.0, 20.0), 0.9)];
        assert_eq!(join(at(0.0, 20.0), &one, &one, at(1.0, 20.0)), []);
        assert_eq!(join(at(0.0, 20.0), &[], &[], at(1.0, 20.0)), []);
    }
}
