//! One track of a forward and a backward one.

use patchlock::BoundingBox;

use super::Found;
use crate::project::Tracked;

/// Joins what was found between two neighbouring key frames, `first` and `last`.
///
/// `forward` was tracked from the first key frame and holds the frames after it, up to and with the last key
/// frame. `backward` was tracked from the last key frame and holds, in the order of the video, the first key
/// frame and the frames after it, without the last. Both have one element per frame of the span, `n`; the
/// result has the `n - 1` frames between the key frames.
///
/// # Panics
/// If the two differ in length or are empty.
pub fn join(
    first: BoundingBox,
    forward: &[Found],
    backward: &[Found],
    last: BoundingBox,
) -> Vec<Tracked> {
    assert!(forward.len() == backward.len() && !forward.is_empty(), "one element per frame");
    let span = forward.len();
    let _ = (first, last);
    let switch = best_switch(&forward[..span - 1], &backward[1..]);
    let pairs = forward[..span - 1].iter().zip(&backward[1..]);
    pairs
        .enumerate()
        .map(|(at, (forward, backward))| {
            let found = if at < switch { *forward } else { *backward };
            let agreement = Some(forward.bbox.overlap(&backward.bbox));
            Tracked { agreement, ..found.into() }
        })
        .collect()
}

/// The number of frames to take from the forward track, the rest being taken from the backward track: where
/// the two are sure on their sides, and agree.
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
