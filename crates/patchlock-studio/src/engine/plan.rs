//! Which stretches of a video to track, from what a person has drawn.

use patchlock::BoundingBox;
use serde::Deserialize;

use crate::project::Target;

/// What to track.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(untagged, deny_unknown_fields)]
pub enum TrackRequest {
    /// What a new key frame changes: between the key frames before and after it. After the last key
    /// frame, up to the next hidden stretch or the end; before the first one, only where there are
    /// tracked boxes already.
    Around {
        target: u64,
        around: usize,
        /// Last frame to track after the last key frame.
        until: Option<usize>,
    },
    /// On from a frame that has a box, over further key frames up to the next hidden stretch.
    From {
        target: u64,
        from: usize,
        direction: Direction,
        /// The last frame of the direction; of both, that of the frames after `from`.
        until: Option<usize>,
    },
}

/// Where to track from a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Direction {
    Forward,
    Backward,
    Both,
}

/// A box in a frame, to start from.
pub type Anchor = (usize, BoundingBox);

/// A stretch of frames without key frames in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Span {
    /// Between two boxes that are right.
    Between { first: Anchor, last: Anchor },
    /// From a box to the frame `to`, after or before it, where there is no other box.
    Open { start: Anchor, to: usize },
}

impl Span {
    /// The number of frames that a tracker goes through.
    pub fn steps(&self) -> usize {
        match *self {
            Self::Between { first, last } => 2 * (last.0 - first.0),
            Self::Open { start, to } => start.0.abs_diff(to),
        }
    }
}

impl TrackRequest {
    pub fn target(&self) -> u64 {
        match *self {
            Self::Around { target, .. } | Self::From { target, .. } => target,
        }
    }
}

/// The spans to track, in a video with this number of frames.
///
/// # Errors
/// What is wrong with the request: a frame that the video does not have, or no box to start from.
pub fn spans(target: &Target, request: TrackRequest, frames: usize) -> Result<Vec<Span>, String> {
    let (TrackRequest::Around { around: frame, until, .. }
    | TrackRequest::From { from: frame, until, .. }) = request;
    for frame in std::iter::once(frame).chain(until) {
        ensure!(frame < frames, "there is no frame {frame}; the video has {frames} frames, from 0");
    }
    let plan = Plan { target, frames };
    let mut spans = match request {
        TrackRequest::Around { .. } => plan.around(frame, until)?,
        TrackRequest::From { direction, .. } => plan.from(frame, direction, until)?,
    };
    spans.retain(|span| match *span {
        Span::Between { first, last } => last.0 > first.0 + 1,
        Span::Open { start, to } => to != start.0,
    });
    Ok(spans)
}

struct Plan<'a> {
    target: &'a Target,
    frames: usize,
}

impl Plan<'_> {
    fn around(&self, frame: usize, until: Option<usize>) -> Result<Vec<Span>, String> {
        let id = self.target.id;
        ensure!(!self.target.keys.is_empty(), "target {id} has no key frame to track from");
        ensure!(
            !self.target.is_hidden(frame),
            "target {id} is not visible in frame {frame}, as was said: nothing is tracked there"
        );
        let (before, after) = (self.key_before(frame), self.key_after(frame));
        let mut spans = Vec::new();
        match self.target.keys.get(&frame) {
            Some(key) => {
                let here = (frame, key.bbox);
                match before {
                    Some(first) => spans.extend(self.between(first, here)),
                    None => spans.extend(self.tracked_before(here)),
                }
                match after {
                    Some(last) => spans.extend(self.between(here, last)),
                    None => spans.push(self.after(here, until)),
                }
            }
            None => match (before, after) {
                (Some(first), Some(last)) => spans.extend(self.between(first, last)),
                (Some(start), None) => spans.push(self.after(start, until)),
                (None, Some(start)) => spans.push(self.before(start, 0)),
                (None, None) => {}
            },
        }
        Ok(spans)
    }

    fn from(
        &self,
        frame: usize,
        direction: Direction,
        until: Option<usize>,
    ) -> Result<Vec<Span>, String> {
        let Some(bbox) = self.target.box_at(frame) else {
            let id = self.target.id;
            return Err(format!("target {id} has no box in frame {frame} to track from"));
        };
        let here = (frame, bbox);
        let mut spans = Vec::new();
        if direction != Direction::Forward {
            let until = if direction == Direction::Backward { until } else { None };
            if let Some(until) = until.filter(|&until| until > frame) {
                return Err(format!("frame {until} is not before frame {frame}"));
            }
            spans.extend(self.backward(here, until.unwrap_or(0)));
        }
        if direction != Direction::Backward {
            if let Some(until) = until.filter(|&until| until < frame) {
                return Err(format!("frame {until} is not after frame {frame}"));
            }
            spans.extend(self.forward(here, until.unwrap_or(self.frames - 1)));
        }
        Ok(spans)
    }

    /// The spans after a box, over key frames, up to the frame `end` or a hidden stretch.
    fn forward(&self, start: Anchor, end: usize) -> Vec<Span> {
        let end = self.visible_until(start.0).min(end);
        let (mut spans, mut here) = (Vec::new(), start);
        while let Some(next) = self.key_after(here.0).filter(|next| next.0 <= end) {
            spans.push(Span::Between { first: here, last: next });
            here = next;
        }
        match self.key_after(here.0).filter(|next| next.0 <= self.visible_until(start.0)) {
            // The frame `end` is between two key frames: the second one helps all the same.
            Some(next) if here.0 < end => spans.push(Span::Between { first: here, last: next }),
            _ => spans.push(Span::Open { start: here, to: end }),
        }
        spans
    }

    /// The same for the frames before a box, the nearest first.
    fn backward(&self, start: Anchor, end: usize) -> Vec<Span> {
        let end = self.visible_from(start.0).max(end);
        let (mut spans, mut here) = (Vec::new(), start);
        while let Some(next) = self.key_before(here.0).filter(|next| next.0 >= end) {
            spans.push(Span::Between { first: next, last: here });
            here = next;
        }
        match self.key_before(here.0).filter(|next| next.0 >= self.visible_from(start.0)) {
            Some(next) if here.0 > end => spans.push(Span::Between { first: next, last: here }),
            _ => spans.push(Span::Open { start: here, to: end }),
        }
        spans
    }

    /// The spans between two neighbouring key frames: two, with a gap, if the target is hidden in
    /// between.
    fn between(&self, first: Anchor, last: Anchor) -> Vec<Span> {
        let (end, begin) = (self.visible_until(first.0), self.visible_from(last.0));
        if end >= last.0 {
            return vec![Span::Between { first, last }];
        }
        vec![Span::Open { start: first, to: end }, Span::Open { start: last, to: begin }]
    }

    fn after(&self, start: Anchor, until: Option<usize>) -> Span {
        let end = self.visible_until(start.0);
        Span::Open { start, to: until.map_or(end, |until| until.clamp(start.0, end)) }
    }

    fn before(&self, start: Anchor, to: usize) -> Span {
        Span::Open { start, to: self.visible_from(start.0).max(to) }
    }

    /// The frames before the first key frame, if they were tracked before.
    fn tracked_before(&self, here: Anchor) -> Option<Span> {
        let first = *self.target.tracked.range(..here.0).next()?.0;
        Some(self.before(here, first))
    }

    fn key_before(&self, frame: usize) -> Option<Anchor> {
        self.target.keys.range(..frame).next_back().map(|(&frame, key)| (frame, key.bbox))
    }

    fn key_after(&self, frame: usize) -> Option<Anchor> {
        self.target.keys.range(frame + 1..).next().map(|(&frame, key)| (frame, key.bbox))
    }

    /// The last frame before the next hidden stretch.
    fn visible_until(&self, frame: usize) -> usize {
        let next = self.target.hidden.iter().map(|stretch| stretch[0]).find(|&from| from > frame);
        next.map_or(self.frames - 1, |from| from - 1)
    }

    /// The first frame after the hidden stretch before.
    fn visible_from(&self, frame: usize) -> usize {
        let before = self.target.hidden.iter().map(|stretch| stretch[1]);
        before.filter(|&to| to < frame).max().map_or(0, |to| to + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::project::{Key, TrackedBox};

    const FRAMES: usize = 100;

    /// A box that tells its frame.
    fn at(frame: usize) -> Anchor {
        (frame, BoundingBox { x: frame as f64, y: 0.0, w: 10.0, h: 10.0 })
    }

    fn target(keys: &[usize], hidden: &[[usize; 2]], tracked: &[usize]) -> Target {
        let key = |&frame: &usize| (frame, Key::new(at(frame).1));
        let found = |&frame: &usize| {
            let (bbox, status) = (at(frame).1, patchlock::Status::Tracked);
            (frame, TrackedBox { bbox, score: 1.0, status, visible: None, agreement: None })
        };
        Target {
            keys: keys.iter().map(key).collect(),
            tracked: tracked.iter().map(found).collect(),
            hidden: hidden.to_vec(),
            ..Target::new(1, "target".into())
        }
    }

    fn around(target: &Target, around: usize) -> Vec<Span> {
        spans(target, TrackRequest::Around { target: 1, around, until: None }, FRAMES)
            .expect("is possible")
    }

    fn from(target: &Target, from: usize, direction: Direction, until: Option<usize>) -> Vec<Span> {
        spans(target, TrackRequest::From { target: 1, from, direction, until }, FRAMES)
            .expect("is possible")
    }

    fn between(first: usize, last: usize) -> Span {
        Span::Between { first: at(first), last: at(last) }
    }

    fn open(start: usize, to: usize) -> Span {
        Span::Open { start: at(start), to }
    }

    #[test]
    fn a_correction_concerns_the_frames_up_to_the_neighbouring_keys() {
        let five = target(&[0, 20, 40, 60, 80], &[], &[]);
        assert_eq!(around(&five, 40), [between(20, 40), between(40, 60)]);
        assert_eq!(around(&five, 30), [between(20, 40)]);
        assert_eq!(around(&five, 80), [between(60, 80), open(80, 99)]);
        assert_eq!(around(&five, 99), [open(80, 99)]);
        // Nothing is between neighbours.
        assert_eq!(around(&target(&[4, 5, 6], &[], &[]), 5), []);
    }

    #[test]
    fn frames_before_the_first_key_are_tracked_only_where_they_were() {
        assert_eq!(around(&target(&[30], &[], &[]), 30), [open(30, 99)]);
        let tracked = target(&[30], &[], &[12, 13]);
        assert_eq!(around(&tracked, 30), [open(30, 12), open(30, 99)]);
        assert_eq!(around(&target(&[30], &[], &[]), 10), [open(30, 0)]);
    }

    #[test]
    fn nothing_is_tracked_where_the_target_is_hidden() {
        let hidden = target(&[10, 50], &[[20, 29], [70, 75]], &[]);
        assert_eq!(around(&hidden, 50), [open(10, 19), open(50, 30), open(50, 69)]);
        assert_eq!(from(&hidden, 10, Direction::Forward, None), [open(10, 19)]);
        assert_eq!(from(&hidden, 50, Direction::Both, None), [open(50, 30), open(50, 69)]);
        let request = TrackRequest::Around { target: 1, around: 25, until: None };
        assert!(spans(&hidden, request, FRAMES).unwrap_err().contains("not visible in frame 25"));
        // A hidden stretch beside a key leaves nothing.
        assert_eq!(from(&target(&[10], &[[11, 20]], &[]), 10, Direction::Forward, None), []);
    }

    #[test]
    fn tracking_on_goes_over_key_frames() {
        let keys = target(&[10, 30, 50], &[], &[5]);
        assert_eq!(
            from(&keys, 10, Direction::Forward, None),
            [between(10, 30), between(30, 50), open(50, 99)]
        );
        assert_eq!(
            from(&keys, 50, Direction::Backward, Some(20)),
            [between(30, 50), between(10, 30)]
        );
        assert_eq!(
            from(&keys, 10, Direction::Forward, Some(40)),
            [between(10, 30), between(30, 50)]
        );
        assert_eq!(from(&keys, 50, Direction::Forward, Some(60)), [open(50, 60)]);
        assert_eq!(from(&keys, 5, Direction::Both, None)[..2], [open(5, 0), between(5, 10)]);
        assert_eq!(from(&keys, 10, Direction::Backward, Some(3)), [open(10, 3)]);
    }

    #[test]
    fn what_cannot_be_tracked_is_refused() {
        let one = target(&[10], &[], &[]);
        for (request, reason) in [
            (TrackRequest::Around { target: 1, around: 100, until: None }, "no frame 100"),
            (
                TrackRequest::From { target: 1, from: 11, direction: Direction::Both, until: None },
                "no box in frame 11",
            ),
            (
                TrackRequest::From {
                    target: 1,
                    from: 10,
                    direction: Direction::Forward,
                    until: Some(3),
                },
                "not after",
            ),
            (
                TrackRequest::From {
                    target: 1,
                    from: 10,
                    direction: Direction::Backward,
                    until: Some(30),
                },
                "not before",
            ),
        ] {
            let refused = spans(&one, request, FRAMES).unwrap_err();
            assert!(refused.contains(reason), "{refused}");
        }
        let request = TrackRequest::Around { target: 1, around: 5, until: None };
        assert!(spans(&target(&[], &[], &[]), request, FRAMES).is_err());
    }

    #[test]
    fn the_length_of_a_job_is_known() {
        assert_eq!([between(10, 30), open(5, 9), open(9, 2)].map(|span| span.steps()), [40, 4, 7]);
    }
}
