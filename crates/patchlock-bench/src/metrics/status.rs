//! Compares the status that a tracker gives with the overlap of its boxes.

use patchlock::Status;

use crate::protocol::{HIT_OVERLAP, LOST_OVERLAP};

/// Counts of frames by status and truth, summed over several runs before they are divided.
///
/// The target is *gone* in a frame without truth or with an overlap below 0.1; the box is *on* it
/// with an overlap of at least 0.5. The first frame of a run does not count, because its box is
/// given.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct StatusCounts {
    /// Frames with the status lost.
    pub lost: usize,
    /// Frames in which the target is gone.
    pub gone: usize,
    /// Frames with the status lost in which the target is gone.
    pub lost_and_gone: usize,
    /// Frames in which the box is on the target.
    pub on: usize,
    /// Frames with the status lost in which the box is on the target.
    pub lost_and_on: usize,
    /// Runs in which the status is ever lost.
    pub runs_with_lost: usize,
    /// The sum over these runs of the number of frames before the first with the status lost.
    pub frames_until_lost: usize,
    /// Stretches of consecutive frames with the status lost.
    pub losses: usize,
    /// Losses that are followed, before the next one, by a frame with the status tracked in which
    /// the box is on the target.
    pub recoveries: usize,
}

impl StatusCounts {
    /// Adds a run: status and overlap of each frame, with `None` for a frame without truth.
    pub fn add(&mut self, statuses: &[Status], overlaps: &[Option<f64>]) {
        if let Some(frame) = statuses.iter().skip(1).position(|&status| status == Status::Lost) {
            self.runs_with_lost += 1;
            self.frames_until_lost += frame + 1;
        }
        let mut before = Status::Tracked;
        let mut is_open = false; // a loss without a recovery so far
        for (&status, overlap) in statuses.iter().zip(overlaps).skip(1) {
            let is_lost = status == Status::Lost;
            let is_on = overlap.is_some_and(|overlap| overlap >= HIT_OVERLAP);
            self.add_frame(is_lost, overlap.is_none_or(|overlap| overlap < LOST_OVERLAP), is_on);
            if is_lost && before != Status::Lost {
                self.losses += 1;
                is_open = true;
            } else if is_open && status == Status::Tracked && is_on {
                self.recoveries += 1;
                is_open = false;
            }
            before = status;
        }
    }

    fn add_frame(&mut self, is_lost: bool, is_gone: bool, is_on: bool) {
        self.lost += usize::from(is_lost);
        self.gone += usize::from(is_gone);
        self.lost_and_gone += usize::from(is_lost && is_gone);
        self.on += usize::from(is_on);
        self.lost_and_on += usize::from(is_lost && is_on);
    }

    /// Adds the counts of other runs.
    pub fn join(&mut self, other: &Self) {
        self.lost += other.lost;
        self.gone += other.gone;
        self.lost_and_gone += other.lost_and_gone;
        self.on += other.on;
        self.lost_and_on += other.lost_and_on;
        self.runs_with_lost += other.runs_with_lost;
        self.frames_until_lost += other.frames_until_lost;
        self.losses += other.losses;
        self.recoveries += other.recoveries;
    }

    /// Share of the frames with the status lost in which the target is gone; `None` without such
    /// frames.
    pub fn precision(&self) -> Option<f64> {
        share(self.lost_and_gone, self.lost)
    }

    /// Share of the frames in which the target is gone that have the status lost; `None` if it
    /// never is.
    pub fn recall(&self) -> Option<f64> {
        share(self.lost_and_gone, self.gone)
    }

    /// Share of the frames in which the box is on the target that have the status lost; `None`
    /// without such frames.
    pub fn false_lost(&self) -> Option<f64> {
        share(self.lost_and_on, self.on)
    }

    /// Mean number of frames before the first with the status lost, over the runs that have one;
    /// `None` if none has.
    pub fn first_lost(&self) -> Option<f64> {
        share(self.frames_until_lost, self.runs_with_lost)
    }
}

fn share(part: usize, whole: usize) -> Option<f64> {
    (whole > 0).then(|| part as f64 / whole as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One letter per frame: tracked, uncertain, lost.
    fn statuses(letters: &str) -> Vec<Status> {
        let status = |letter| match letter {
            't' => Status::Tracked,
            'u' => Status::Uncertain,
            _ => Status::Lost,
        };
        letters.chars().map(status).collect()
    }

    fn counts(letters: &str, overlaps: &[Option<f64>]) -> StatusCounts {
        let mut counts = StatusCounts::default();
        counts.add(&statuses(letters), overlaps);
        counts
    }

    #[test]
    fn precision_and_recall_count_absent_and_lost_targets() {
        let overlaps = [1.0, 0.9, 0.05, 0.09, 0.1, 0.5, 0.0].map(Some);
        let overlaps = [&overlaps[..], &[None, None]].concat();
        // Gone: frames 2, 3, 6, 7, 8. On: frames 1, 5. The first frame does not count.
        let counts = counts("lttlllulu", &overlaps);
        assert_eq!((counts.lost, counts.gone, counts.lost_and_gone), (4, 5, 2));
        assert_eq!((counts.on, counts.lost_and_on), (2, 1));
        assert_eq!((counts.precision(), counts.recall()), (Some(0.5), Some(0.4)));
        assert_eq!(counts.false_lost(), Some(0.5));
        assert_eq!(counts.first_lost(), Some(3.0));
    }

    #[test]
    fn a_recovery_is_tracked_on_the_target_before_the_next_loss() {
        let on = vec![Some(0.5); 9];
        let count = |letters: &str, overlaps: &[Option<f64>]| {
            let counts = counts(letters, overlaps);
            (counts.losses, counts.recoveries)
        };
        assert_eq!(count("ttllttllt", &on), (2, 2));
        assert_eq!(count("ttllullut", &on), (2, 1), "uncertain is no recovery");
        assert_eq!(count("ttlltttll", &on), (2, 1), "the last loss lasts to the end");
        let off: Vec<_> = on.iter().map(|_| Some(0.49)).collect();
        assert_eq!(count("ttllttttt", &off), (1, 0), "on something else");
        let late = [vec![Some(0.2); 6], vec![Some(0.8); 3]].concat();
        assert_eq!(count("ttllttttt", &late), (1, 1), "a recovery may come later");
        assert_eq!(count("ttttttttt", &on), (0, 0));
    }

    #[test]
    fn without_frames_of_a_kind_there_is_no_share() {
        let never = counts("ttt", &[Some(1.0), Some(0.3), Some(0.3)]);
        assert_eq!((never.precision(), never.recall()), (None, None));
        assert_eq!((never.false_lost(), never.first_lost()), (None, None));
    }

    #[test]
    fn runs_are_joined_before_shares_are_taken() {
        let mut all = counts("ttl", &[Some(1.0), Some(0.8), Some(0.0)]);
        all.join(&counts("tlt", &[Some(1.0), Some(0.8), Some(0.7)]));
        all.join(&counts("ttt", &[Some(1.0), Some(0.8), None]));
        assert_eq!((all.precision(), all.recall()), (Some(0.5), Some(0.5)));
        assert_eq!((all.false_lost(), all.first_lost()), (Some(0.25), Some(1.5)));
        assert_eq!((all.losses, all.recoveries), (2, 1));
    }
}
