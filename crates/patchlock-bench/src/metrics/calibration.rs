//! Compares the score that a tracker gives, read as the probability that its box is on the target,
//! with the overlap.

use serde::Serialize;

use crate::protocol::HIT_OVERLAP;

/// Number of bins of equal width between the scores 0 and 1.
pub const BINS: usize = 10;

/// The frames whose scores are in one bin.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Bin {
    /// Number of frames.
    pub frames: usize,
    /// Mean score; 0 without frames.
    pub score: f64,
    /// Share of the frames in which the box is on the target; 0 without frames.
    pub share: f64,
}

/// Scores of frames, each with whether the box is on the target (an overlap of at least 0.5; never
/// without truth). The first frame of a run does not count, because its box is given.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Calibration {
    frames: Vec<(f64, bool)>,
}

impl Calibration {
    /// Adds a run: score, 0 to 1, and overlap of each frame, with `None` for a frame without truth.
    pub fn add(&mut self, scores: &[f64], overlaps: &[Option<f64>]) {
        let is_on = |overlap: &Option<f64>| overlap.is_some_and(|overlap| overlap >= HIT_OVERLAP);
        let frames = scores.iter().zip(overlaps).skip(1);
        self.frames.extend(frames.map(|(&score, overlap)| (score, is_on(overlap))));
    }

    /// Adds the frames of other runs.
    pub fn join(&mut self, other: &Self) {
        self.frames.extend_from_slice(&other.frames);
    }

    /// The frames by score: bin k has the scores from k / 10 to less than (k + 1) / 10, the last
    /// one also 1.
    pub fn bins(&self) -> [Bin; BINS] {
        let mut bins = [Bin::default(); BINS];
        for &(score, is_on) in &self.frames {
            let bin = &mut bins[((score * BINS as f64) as usize).min(BINS - 1)];
            bin.frames += 1;
            bin.score += score;
            bin.share += f64::from(u8::from(is_on));
        }
        for bin in bins.iter_mut().filter(|bin| bin.frames > 0) {
            bin.score /= bin.frames as f64;
            bin.share /= bin.frames as f64;
        }
        bins
    }

    /// The expected calibration error: the mean over frames of the distance between mean score and
    /// share in their bin; `None` without frames.
    pub fn ece(&self) -> Option<f64> {
        let distance = |bin: &Bin| bin.frames as f64 * (bin.score - bin.share).abs();
        let sum: f64 = self.bins().iter().map(distance).sum();
        (!self.frames.is_empty()).then(|| sum / self.frames.len() as f64)
    }

    /// The area under the ROC curve: the probability that a frame with the box on the target has a
    /// larger score than one without, where equal scores count half; `None` unless there are frames
    /// of both kinds.
    pub fn auroc(&self) -> Option<f64> {
        let mut sorted = self.frames.clone();
        sorted.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let (mut on, mut off, mut pairs) = (0, 0, 0.0);
        for equal in sorted.chunk_by(|a, b| a.0 == b.0) {
            let on_here = equal.iter().filter(|(_, is_on)| *is_on).count();
            let off_here = equal.len() - on_here;
            pairs += on_here as f64 * (off as f64 + off_here as f64 / 2.0);
            on += on_here;
            off += off_here;
        }
        (on > 0 && off > 0).then(|| pairs / (on as f64 * off as f64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(frames: &[(f64, Option<f64>)]) -> Calibration {
        // The first frame does not count.
        let (scores, overlaps): (Vec<f64>, Vec<Option<f64>>) =
            [(0.0, Some(1.0))].iter().chain(frames).copied().unzip();
        let mut calibration = Calibration::default();
        calibration.add(&scores, &overlaps);
        calibration
    }

    fn close(value: Option<f64>, expected: f64) -> bool {
        value.is_some_and(|value| (value - expected).abs() < 1e-12)
    }

    #[test]
    fn the_error_weighs_bins_by_their_frames() {
        let frames = [
            (0.92, Some(0.5)),
            (0.98, Some(0.8)),
            (1.0, Some(0.49)), // 1 is in the last bin
            (0.25, Some(0.9)),
            (0.25, None), // absent: the box is not on the target
            (0.1, Some(0.0)),
        ];
        let calibration = of(&frames);
        let bins = calibration.bins();
        assert_eq!(bins.map(|bin| bin.frames), [0, 1, 2, 0, 0, 0, 0, 0, 0, 3]);
        assert_eq!((bins[2].score, bins[2].share, bins[1].share), (0.25, 0.5, 0.0));
        assert!((bins[9].score - 2.9 / 3.0).abs() < 1e-12 && bins[9].share == 2.0 / 3.0);
        // (3 * 0.3 + 2 * 0.25 + 1 * 0.1) / 6
        assert!(close(calibration.ece(), 0.25), "{:?}", calibration.ece());
    }

    #[test]
    fn scores_that_equal_the_shares_have_no_error() {
        let frames: Vec<_> = (0..4).map(|k| (0.75, Some(if k == 0 { 0.2 } else { 0.7 }))).collect();
        assert_eq!(of(&frames).ece(), Some(0.0));
    }

    #[test]
    fn the_area_is_the_share_of_pairs_in_the_right_order() {
        let (on, off) = (Some(0.5), Some(0.4));
        assert_eq!(of(&[(0.9, on), (0.8, on), (0.3, off), (0.1, None)]).auroc(), Some(1.0));
        assert_eq!(of(&[(0.1, on), (0.8, off)]).auroc(), Some(0.0));
        assert_eq!(of(&[(0.5, on), (0.5, off), (0.5, on)]).auroc(), Some(0.5));
        // Of the six pairs, (0.6, 0.2), (0.6, 0.4), (0.4, 0.2) are in order, and (0.4, 0.4) counts
        // half.
        let mixed = of(&[(0.6, on), (0.4, on), (0.4, off), (0.2, off), (0.7, off)]);
        assert!(close(mixed.auroc(), 3.5 / 6.0));
    }

    #[test]
    fn some_measures_need_frames_of_both_kinds() {
        assert_eq!((of(&[]).ece(), of(&[]).auroc()), (None, None));
        assert_eq!(of(&[(0.9, Some(0.9))]).auroc(), None);
        assert_eq!(of(&[(0.9, Some(0.2))]).auroc(), None);
    }

    #[test]
    fn runs_are_joined() {
        let mut all = of(&[(0.9, Some(0.9))]);
        all.join(&of(&[(0.1, Some(0.2))]));
        assert_eq!((all.auroc(), all.bins()[1].frames), (Some(1.0), 1));
    }
}
