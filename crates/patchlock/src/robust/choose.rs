//! Hypotheses of where the target is, and the choice among them.

use super::place::Place;
use crate::config::RobustConfig;

/// A place where the target may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hypothesis {
    pub place: Place,
    /// The model that proposes it.
    pub source: Source,
    /// That model's response there.
    pub response: f64,
    /// The memory's response there.
    pub memory: f64,
}

/// A model that proposes places.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Source {
    /// One that follows the target from frame to frame, and learns on every frame.
    Follower,
    /// The memory, which learns on sure frames only.
    Memory,
}

impl Hypothesis {
    /// The response of its model and that of the memory together.
    pub fn support(&self) -> f64 {
        self.response + self.memory
    }
}

/// When the memory's place is chosen instead of a follower's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct JumpParams {
    /// The memory must respond this many times stronger there than at the follower's place.
    ratio: f64,
    /// and at least with this share of its mean response at the target,
    least: f64,
    /// on this many consecutive frames.
    after: u32,
}

impl JumpParams {
    pub fn new(config: &RobustConfig) -> Self {
        let (ratio, least) = (config.jump_ratio, config.jump_least);
        Self { ratio, least, after: config.jump_after as u32 }
    }

    /// Whether the memory's place is much better than a follower's. `mean` is the memory's mean
    /// response at the target.
    fn is_far_better(&self, memory: &Hypothesis, follower: &Hypothesis, mean: f64) -> bool {
        memory.response > self.ratio * follower.memory.max(0.0)
            && memory.response > self.least * mean
    }
}

/// What was chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Choice {
    /// The hypothesis of a follower for which the memory responds strongest.
    pub follower: Hypothesis,
    /// The place that is chosen.
    pub place: Place,
    /// Whether it is the memory's, not the follower's.
    pub is_jump: bool,
    /// Consecutive frames, up to this one, on which the memory's place was much better.
    pub streak: u32,
}

/// Chooses among hypotheses: the follower's for which the memory responds strongest, unless the
/// memory's own was much better on [`JumpParams::after`] consecutive frames. `first` is a
/// follower's, `others` are any further ones, `streak` comes from the choice on the frame before.
pub(crate) fn choose(
    first: Hypothesis,
    others: &[Hypothesis],
    streak: u32,
    mean: f64,
    params: &JumpParams,
) -> Choice {
    let from = |source| others.iter().copied().filter(move |h| h.source == source);
    let follower = from(Source::Follower)
        .fold(first, |best, other| if other.memory > best.memory { other } else { best });
    let far_better = from(Source::Memory).find(|h| params.is_far_better(h, &follower, mean));
    let Some(memory) = far_better else {
        return Choice { follower, place: follower.place, is_jump: false, streak: 0 };
    };
    let streak = streak.saturating_add(1);
    if streak < params.after {
        return Choice { follower, place: follower.place, is_jump: false, streak };
    }
    Choice { follower, place: memory.place, is_jump: true, streak: 0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PARAMS: JumpParams = JumpParams { ratio: 2.5, least: 0.33, after: 2 };

    fn at(x: f64) -> Place {
        Place { centre: [x, 0.0], scale: 1.0, stretch: 1.0, rotation: 0.0 }
    }

    /// A follower's hypothesis, for which the memory responds like this.
    fn follower(x: f64, memory: f64) -> Hypothesis {
        Hypothesis { place: at(x), source: Source::Follower, response: 0.9, memory }
    }

    /// The memory's own hypothesis, with this response.
    fn memory(x: f64, response: f64) -> Hypothesis {
        Hypothesis { place: at(x), source: Source::Memory, response, memory: response }
    }

    #[test]
    fn the_memory_is_chosen_where_it_was_much_better_for_two_frames() {
        // The memory's response at the follower's place and at its own, its mean, the streak
        // before; then whether it jumps, and the streak after.
        for (here, there, mean, before, is_jump, after) in [
            // Not stronger by the ratio: the follower's place.
            (0.3, 0.75, 1.0, 1, false, 0),
            (0.3, 0.3, 1.0, 1, false, 0),
            // Stronger by the ratio, on the first and on the second frame.
            (0.3, 0.76, 1.0, 0, false, 1),
            (0.3, 0.76, 1.0, 1, true, 0),
            // A weak response is not trusted, however much stronger it is.
            (0.01, 0.33, 1.0, 1, false, 0),
            (0.01, 0.34, 1.0, 1, true, 0),
            (0.01, 0.34, 2.0, 1, false, 0),
            // A negative response counts as none.
            (-5.0, 0.34, 1.0, 1, true, 0),
            (-5.0, 0.32, 1.0, 1, false, 0),
        ] {
            let choice = choose(follower(1.0, here), &[memory(2.0, there)], before, mean, &PARAMS);
            let x = if is_jump { 2.0 } else { 1.0 };
            let follower = follower(1.0, here);
            let expected = Choice { follower, place: at(x), is_jump, streak: after };
            assert_eq!(choice, expected, "{here} {there} {mean} {before}");
        }
    }

    #[test]
    fn a_streak_ends_on_a_frame_on_which_the_memory_is_not_much_better() {
        let mut streak = 0;
        let jumps = [0.9, 0.5, 0.9, 0.9, 0.9].map(|there| {
            let choice = choose(follower(1.0, 0.3), &[memory(2.0, there)], streak, 1.0, &PARAMS);
            streak = choice.streak;
            choice.is_jump
        });
        assert_eq!(jumps, [false, false, false, true, false]);
    }

    #[test]
    fn of_two_followers_the_one_that_the_memory_knows_is_chosen() {
        for (first, second, x) in [(0.5, 0.6, 2.0), (0.6, 0.5, 1.0), (0.5, 0.5, 1.0)] {
            let others = [memory(3.0, 0.7), follower(2.0, second)];
            let choice = choose(follower(1.0, first), &others, 1, 1.0, &PARAMS);
            assert_eq!((choice.place, choice.follower.place), (at(x), at(x)));
            assert!(!choice.is_jump);
        }
        // The memory must be much better than the better follower.
        let others = [memory(3.0, 0.9), follower(2.0, 0.1)];
        assert!(!choose(follower(1.0, 0.4), &others, 1, 1.0, &PARAMS).is_jump);
        assert!(choose(follower(1.0, 0.2), &others, 1, 1.0, &PARAMS).is_jump);
    }

    #[test]
    fn support_counts_both_responses() {
        assert_eq!(follower(1.0, 0.25).support(), 1.15);
    }
}
