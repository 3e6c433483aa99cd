//! What a run measures: the time of each frame, the status of each target, and when targets were
//! lost.

use std::collections::BTreeMap;
use std::sync::Arc;

use patchlock::Status;
use serde::Serialize;

use super::TargetResult;
use super::summary::round;

#[derive(Debug, Default)]
pub struct Measurements {
    times_ms: Vec<f64>,
    /// All targets so far, by their ids; `None` if the run has a single target.
    targets: BTreeMap<Option<u64>, History>,
    /// How often each [`Status`] occurred, in their order.
    statuses: [usize; Status::NAMES.len()],
    losses: Vec<LostSpan>,
}

#[derive(Debug, Default)]
struct History {
    name: Option<Arc<str>>,
    /// If it is lost, its entry in `losses`.
    loss: Option<usize>,
    /// The score of each frame in which it was not lost.
    scores: Vec<(usize, f32)>,
}

/// A stretch of frames in which the score of a target stayed low: below one half with the methods
/// `robust` and `network`, whose score is a probability, and below half of the target's median
/// score with `paper`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LowScoreSpan {
    /// The target's id; with a single target there is no such field.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub id: Option<u64>,
    /// Its name in `--boxes`, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// The first of the frames, in the order of tracking.
    pub first_frame: usize,
    pub last_frame: usize,
    pub lowest: f64,
}

/// Shorter stretches of low scores are not reported, in tracked frames.
const LOW_FRAMES: usize = 10;

/// A stretch of frames in which a target was lost.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LostSpan {
    /// The target's id; with a single target there is no such field.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub id: Option<u64>,
    /// Its name in `--boxes`, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// The first frame in which it was lost.
    pub lost_frame: usize,
    /// The time of that frame in seconds from the start of the source; `None` as long as the frame
    /// rate is unknown.
    pub lost_seconds: Option<f64>,
    /// The first frame in which it was not lost any more; `None` if the target or the run ended
    /// before.
    pub return_frame: Option<usize>,
    pub return_seconds: Option<f64>,
}

impl Measurements {
    /// Adds a frame, which took `ms` milliseconds. A frame without targets is not counted.
    pub fn add(&mut self, frame: usize, targets: &[TargetResult], ms: f64) {
        // A target that has ended cannot return, even if another begins with the same id.
        for (id, known) in self.targets.iter_mut().filter(|(_, known)| known.loss.is_some()) {
            known.loss = known.loss.filter(|_| targets.iter().any(|it| it.id == *id));
        }
        if targets.is_empty() {
            return;
        }
        self.times_ms.push(ms);
        for &TargetResult { id, ref name, ref estimate, .. } in targets {
            self.statuses[estimate.status as usize] += 1;
            let first = || History { name: name.clone(), ..History::default() };
            let known = self.targets.entry(id).or_insert_with(first);
            if estimate.status != Status::Lost {
                known.scores.push((frame, estimate.score as f32));
                if let Some(k) = known.loss.take() {
                    self.losses[k].return_frame = Some(frame);
                }
            } else if known.loss.is_none() {
                known.loss = Some(self.losses.len());
                self.losses.push(LostSpan {
                    id,
                    name: name.as_deref().map(str::to_owned),
                    lost_frame: frame,
                    lost_seconds: None,
                    return_frame: None,
                    return_seconds: None,
                });
            }
        }
    }

    /// Milliseconds for each frame that had targets.
    pub fn times_ms(&self) -> &[f64] {
        &self.times_ms
    }

    /// Number of frames that had targets.
    pub fn frames(&self) -> usize {
        self.times_ms.len()
    }

    pub fn fps(&self) -> f64 {
        let total: f64 = self.times_ms.iter().sum();
        if total > 0.0 { 1e3 * self.frames() as f64 / total } else { 0.0 }
    }

    pub fn targets(&self) -> usize {
        self.targets.len()
    }

    /// Number of frames with this status, all targets together.
    pub fn count(&self, status: Status) -> usize {
        self.statuses[status as usize]
    }

    /// The stretches of at least ten frames with a low score: below one half, if the score is a
    /// probability, and otherwise below half of the target's median score.
    pub fn low_scores(&self, is_probability: bool) -> Vec<LowScoreSpan> {
        let mut all = Vec::new();
        for (&id, History { name, scores, .. }) in &self.targets {
            let mut sorted: Vec<f32> = scores.iter().map(|(_, score)| *score).collect();
            sorted.sort_unstable_by(f32::total_cmp);
            let Some(median) = sorted.get(sorted.len() / 2) else { continue };
            let limit = if is_probability { 0.5 } else { 0.5 * median };
            let runs = scores.chunk_by(|a, b| (a.1 < limit) == (b.1 < limit));
            let low = runs.filter(|run| run[0].1 < limit && run.len() >= LOW_FRAMES);
            all.extend(low.map(|run| LowScoreSpan {
                id,
                name: name.as_deref().map(str::to_owned),
                first_frame: run[0].0,
                last_frame: run[run.len() - 1].0,
                lowest: round(run.iter().map(|(_, score)| *score).fold(f32::MAX, f32::min).into()),
            }));
        }
        all
    }

    /// All losses, in the order in which they began.
    pub fn losses(&self) -> &[LostSpan] {
        &self.losses
    }
}

#[cfg(test)]
mod tests {
    use super::super::example;
    use super::*;

    fn loss(id: Option<u64>, lost_frame: usize, return_frame: Option<usize>) -> LostSpan {
        let (name, lost_seconds, return_seconds) = (None, None, None);
        LostSpan { id, name, lost_frame, lost_seconds, return_frame, return_seconds }
    }

    #[test]
    fn statuses_are_counted_and_losses_have_their_frames() {
        use Status::{Lost, Tracked, Uncertain};
        let mut measurements = Measurements::default();
        let statuses = [Tracked, Uncertain, Lost, Lost, Uncertain, Tracked, Lost];
        for (k, status) in statuses.into_iter().enumerate() {
            measurements.add(10 + 2 * k, &[example::target(status)], 4.0);
        }
        assert_eq!([Tracked, Uncertain, Lost].map(|status| measurements.count(status)), [2, 2, 3]);
        assert_eq!(measurements.losses(), [loss(None, 14, Some(18)), loss(None, 22, None)]);
        assert_eq!(
            (measurements.frames(), measurements.targets(), measurements.fps()),
            (7, 1, 250.0)
        );
    }

    #[test]
    fn each_target_has_its_own_losses() {
        let target = |id, status| TargetResult { id: Some(id), ..example::target(status) };
        let mut measurements = Measurements::default();
        measurements.add(0, &[target(1, Status::Lost), target(2, Status::Tracked)], 1.0);
        measurements.add(1, &[target(1, Status::Tracked), target(2, Status::Lost)], 1.0);
        // Target 2 ends; what begins under its id is another one.
        measurements.add(2, &[target(1, Status::Lost)], 1.0);
        measurements.add(3, &[], 1.0);
        measurements.add(4, &[target(1, Status::Tracked), target(2, Status::Tracked)], 1.0);
        let expected = [loss(Some(1), 0, Some(1)), loss(Some(2), 1, None), loss(Some(1), 2, None)];
        assert_eq!(measurements.losses(), expected);
        assert_eq!(
            (measurements.frames(), measurements.targets(), measurements.count(Status::Lost)),
            (4, 2, 3)
        );
    }

    #[test]
    fn long_stretches_of_low_scores_are_found() {
        let mut measurements = Measurements::default();
        for frame in 0..60 {
            let low = (10..19).contains(&frame) || (30..40).contains(&frame);
            let mut target = example::target(Status::Tracked);
            target.estimate.score = if low { 0.25 } else { 0.75 };
            measurements.add(frame, &[target], 4.0);
        }
        // Nine frames are too few.
        let (id, name) = (None, None);
        let low = [LowScoreSpan { id, name, first_frame: 30, last_frame: 39, lowest: 0.25 }];
        assert_eq!(measurements.low_scores(true), low);
        // Relative to the median of .75, a quarter is low, and more than three eighths is not.
        assert_eq!(measurements.low_scores(false), low);
        let mut even = Measurements::default();
        let mut target = example::target(Status::Tracked);
        target.estimate.score = 0.4;
        (0..60).for_each(|frame| even.add(frame, std::slice::from_ref(&target), 4.0));
        assert_eq!((even.low_scores(true).len(), even.low_scores(false).len()), (1, 0));
    }
}
