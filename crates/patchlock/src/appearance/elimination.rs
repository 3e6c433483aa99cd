//! Only the most likely candidate is wanted, so a candidate need not be coded further once it can't be that one.
//!
//! A small patch adds at most its largest weight (its share is at most 1). So after some of the locations a candidate's likelihood
//! lies between what it has so far, and that plus the largest weights of the other locations; and a candidate whose upper end is
//! below the lower end of another one is dropped. The candidate with the largest likelihood never is, nor one that ties with it, and
//! the likelihoods of those that remain are computed as if none had been dropped: the estimate is the same, bit for bit.

/// Candidates that are coded at all locations first, so that there is a high lower end to begin with.
const LEADERS: usize = 16;

/// Parts in which the locations of the others are coded.
const ROUNDS: usize = 21;

/// More than rounding can add to a likelihood.
const MARGIN: f64 = 1e-9;

/// Which locations are wanted.
pub type Wanted<'a> = dyn Fn(usize) -> bool + Sync + 'a;

/// Codes candidates at the locations that are wanted, and returns what these add to each one's sum.
pub type Coder<'a> = dyn FnMut(&[u32], &Wanted<'_>) -> Vec<f64> + 'a;

/// Who can still be the most likely candidate.
#[derive(Debug, Default)]
pub struct Elimination {
    /// What each candidate has so far.
    so_far: Vec<f64>,
    remaining: Vec<u32>,
    best: f64,
}

impl Elimination {
    /// Begins with what each candidate has from the large patches; minus infinity is out from the start.
    /// The leaders come first in [`Self::remaining`].
    pub fn begin(&mut self, large_parts: impl Iterator<Item = f64>) {
        self.so_far.clear();
        self.so_far.extend(large_parts);
        self.best = f64::NEG_INFINITY;
        let so_far = &self.so_far;
        self.remaining.clear();
        self.remaining
            .extend((0..so_far.len() as u32).filter(|&k| so_far[k as usize] > f64::NEG_INFINITY));
        self.remaining.sort_by(|&a, &b| so_far[b as usize].total_cmp(&so_far[a as usize]));
    }

    /// The candidates that are still in it.
    pub fn remaining(&self) -> &[u32] {
        &self.remaining
    }

    /// How many of them are leaders.
    fn leaders(&self) -> usize {
        LEADERS.min(self.remaining.len())
    }

    /// Codes leaders, then the others round by round. `code` codes candidates at the locations that it is told and returns what these
    /// add to each one's sum over `locations`; `most` is the most that a location can add.
    pub fn run(&mut self, locations: usize, most: impl Fn(usize) -> f64, code: &mut Coder<'_>) {
        let leaders = self.leaders();
        self.take(0..leaders, locations, code, &|_| true);
        for round in 0..ROUNDS {
            let left: f64 = (0..locations).filter(|i| i % ROUNDS >= round).map(&most).sum();
            self.drop_hopeless(left / locations as f64);
            self.take(leaders..self.remaining.len(), locations, code, &|i| i % ROUNDS == round);
        }
    }

    /// Codes these of the remaining candidates and adds what they gain.
    fn take(
        &mut self,
        which: std::ops::Range<usize>,
        locations: usize,
        code: &mut Coder<'_>,
        wanted: &Wanted<'_>,
    ) {
        let gains = code(&self.remaining[which.clone()], wanted);
        for (place, gain) in which.zip(gains) {
            self.add(self.remaining[place], gain / locations as f64);
        }
    }

    /// Adds to what a candidate has.
    fn add(&mut self, candidate: u32, amount: f64) {
        let so_far = &mut self.so_far[candidate as usize];
        *so_far += amount;
        self.best = self.best.max(*so_far);
    }

    /// Drops every candidate, leaders aside, that can't reach the best with at most `left` more.
    fn drop_hopeless(&mut self, left: f64) {
        let leaders = self.leaders();
        let (so_far, best) = (&self.so_far, self.best);
        let mut place = 0;
        self.remaining.retain(|&k| {
            place += 1;
            place <= leaders || so_far[k as usize] + left + MARGIN >= best
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Whatever the patches give, the best candidates and all that tie with it remain.
        #[test]
        fn the_winner_is_never_dropped(
            large in prop::collection::vec(0.0..1.5f64, 40),
            patches in prop::collection::vec(prop::collection::vec(0.0..1.0f64, ROUNDS), 40),
        ) {
            let total = |k: usize| large[k] + patches[k].iter().sum::<f64>() / ROUNDS as f64;
            let mut race = Elimination::default();
            race.begin(large.iter().copied());
            race.run(ROUNDS, |_| 1.0, &mut |which, wanted| {
                let gain = |k: u32| (0..ROUNDS).filter(|&i| wanted(i)).map(|i| patches[k as usize][i]).sum();
                which.iter().map(|&k| gain(k)).collect()
            });
            let best = (0..40).map(total).fold(0.0, f64::max);
            for k in (0..40).filter(|&k| total(k) >= best) {
                prop_assert!(race.remaining().contains(&(k as u32)));
            }
        }
    }

    #[test]
    fn refused_candidates_are_out_and_leaders_first() {
        let mut race = Elimination::default();
        race.begin([0.1, f64::NEG_INFINITY, 0.3, 0.2].into_iter());
        assert_eq!(race.remaining(), [2, 3, 0]);
        assert_eq!(race.leaders(), 3);
    }
}
