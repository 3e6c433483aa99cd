//! Only the most likely candidate is wanted, so a candidate need not be coded further once it can't be that one.
//!
//! A patch adds at most its largest weight (its share is at most 1), and hides nothing at best. So after some of the locations a candidate's
//! likelihood is at most what these give with the best that the others could; and a candidate that can't reach
//! the likelihood of another one is dropped. The candidate with the largest likelihood never is, nor one that ties with it, and
//! the likelihoods of those that remain are computed as if none had been dropped: the estimate is the same, bit for bit.
//!
//! What order candidates and locations are taken in decides how soon the others drop out, and nothing else. A few candidates that
//! look like the last template are coded everywhere first, so that there is a high likelihood to reach. The others are coded location by location,
//! those first where most can be lost: at the large scale where a patch weighs most, at the small one where the first candidates lost most.
//! Those that look alike are coded next to each other, as they share more of the work.

use crate::sparse::somp::batched::BLOCK;

/// Candidates that are coded everywhere before the others, and again as many of those that look best at the large scale.
const LEADERS: usize = 3;

/// Most small locations that are coded together. The fewer, the sooner candidates are dropped.
const ROUND: usize = 8;

/// Blocks of candidates that are coded together, as far as [`ROUND`] allows: enough that no thread waits long for another.
const BLOCKS: usize = 32;

/// More than rounding can add to a likelihood.
const MARGIN: f64 = 1e-9;

/// The two patch scales.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Size {
    /// The large patches.
    Large,
    /// The small ones.
    Small,
}

/// What a race asks of the candidates.
pub trait Field {
    /// Codes these candidates at these locations.
    fn code(&mut self, size: Size, candidates: &[u32], locations: &[u32]);

    /// The most that a patch at this location can add to a likelihood, before anything that multiplies them all.
    fn most(&self, size: Size, location: u32) -> f64;

    /// What this candidate's small patch, which is coded, adds to its likelihood.
    fn gain(&self, candidate: u32, location: u32) -> f64;

    /// The most that the candidate's large patches can add to its likelihood together, when these are coded.
    fn large_part(&self, candidate: u32, coded: &[u32]) -> f64;
}

/// Who can still be the most likely candidate.
#[derive(Debug, Default)]
pub struct Race {
    remaining: Vec<u32>,
    /// For each candidate the most that its large patches can add, and what its small ones have added so far.
    large_parts: Vec<f64>,
    gains: Vec<f64>,
    /// A likelihood that some candidate has at least.
    best: f64,
    large_order: Vec<u32>,
    small_order: Vec<u32>,
    /// What the leaders lost at each small location.
    losses: Vec<f64>,
    /// Where each candidate stands in the order in which they are coded.
    places: Vec<u32>,
}

impl Race {
    /// The candidates that are still in it: coded everywhere once the race is run.
    pub fn remaining(&self) -> &[u32] {
        &self.remaining
    }

    /// Begins with `entries`, those that look best first, of the candidates in `order`, which has them all, each next to others that look like it.
    pub fn begin(&mut self, entries: &[u32], order: &[u32]) {
        self.remaining.clear();
        self.remaining.extend_from_slice(entries);
        let count = order.len();
        self.places.clear();
        self.places.resize(count, 0);
        for (place, &k) in order.iter().enumerate() {
            self.places[k as usize] = place as u32;
        }
        for values in [&mut self.large_parts, &mut self.gains] {
            values.clear();
            values.resize(count, 0.0);
        }
        self.best = f64::NEG_INFINITY;
    }

    /// Codes all candidates everywhere, at this many large and small locations.
    pub fn code_all(&mut self, (large, small): (usize, usize), field: &mut impl Field) {
        let Self { remaining, large_order, small_order, .. } = self;
        for (size, count, order) in
            [(Size::Large, large, large_order), (Size::Small, small, small_order)]
        {
            order.clear();
            order.extend(0..count as u32);
            field.code(size, remaining, order);
        }
    }

    /// Runs it over this many large and small locations.
    pub fn run(&mut self, (large, small): (usize, usize), field: &mut impl Field) {
        self.order_large(large, field);
        let leaders = LEADERS.min(self.remaining.len());
        self.code_large(0..leaders, large, field);
        self.small_order.clear();
        self.small_order.extend(0..small as u32);
        self.code_small(0..leaders, field);
        self.order_small(leaders, field);

        let bonus: f64 = (0..small as u32).map(|i| field.most(Size::Small, i)).sum();
        // Where large patches count for nothing, only those who remain are coded there, in the end.
        let counts = self.large_order.iter().any(|&i| field.most(Size::Large, i) > 0.0);
        let rounds = if counts { large } else { 0 };
        self.arrange(leaders);
        for done in 0..rounds {
            let locations = [self.large_order[done]];
            field.code(Size::Large, &self.remaining[leaders..], &locations);
            self.bound_large(leaders, done + 1, field);
            self.drop_hopeless(leaders, bonus);
        }
        let parts = &self.large_parts;
        self.remaining[leaders..].sort_unstable_by(|&a, &b| {
            parts[b as usize].total_cmp(&parts[a as usize]).then(a.cmp(&b))
        });
        let seconds = (leaders + LEADERS).min(self.remaining.len());
        self.code_small(leaders..seconds, field);
        self.arrange(seconds);
        self.run_small(seconds, bonus, field);
        if !counts {
            field.code(Size::Large, &self.remaining[leaders..], &self.large_order);
        }
    }

    /// Puts the candidates behind the leaders into the order in which they are coded.
    fn arrange(&mut self, leaders: usize) {
        let places = &self.places;
        self.remaining[leaders..].sort_unstable_by_key(|&k| places[k as usize]);
    }

    /// The large locations, those first where a patch weighs most.
    fn order_large(&mut self, count: usize, field: &impl Field) {
        self.large_order.clear();
        self.large_order.extend(0..count as u32);
        let most = |i: &u32| field.most(Size::Large, *i);
        self.large_order.sort_by(|a, b| most(b).total_cmp(&most(a)).then(a.cmp(b)));
    }

    /// The small locations, those first where the leaders lost most.
    fn order_small(&mut self, leaders: usize, field: &impl Field) {
        let losses = &mut self.losses;
        losses.clear();
        losses.extend((0..self.small_order.len() as u32).map(|i| {
            let gain: f64 = self.remaining[..leaders].iter().map(|&k| field.gain(k, i)).sum();
            field.most(Size::Small, i) * leaders as f64 - gain
        }));
        let order = &mut self.small_order;
        order.sort_by(|&a, &b| losses[b as usize].total_cmp(&losses[a as usize]).then(a.cmp(&b)));
    }

    /// Codes some of the remaining candidates at all large locations.
    fn code_large(&mut self, which: std::ops::Range<usize>, large: usize, field: &mut impl Field) {
        field.code(Size::Large, &self.remaining[which.clone()], &self.large_order);
        for &k in &self.remaining[which] {
            self.large_parts[k as usize] = field.large_part(k, &self.large_order[..large]);
        }
    }

    /// Codes some of the remaining candidates at all small locations; then their likelihoods are known.
    fn code_small(&mut self, which: std::ops::Range<usize>, field: &mut impl Field) {
        field.code(Size::Small, &self.remaining[which.clone()], &self.small_order);
        for &k in &self.remaining[which] {
            let gain: f64 = self.small_order.iter().map(|&i| field.gain(k, i)).sum();
            self.gains[k as usize] = gain;
            self.best = self.best.max(self.large_parts[k as usize] + gain);
        }
    }

    fn bound_large(&mut self, leaders: usize, done: usize, field: &impl Field) {
        for &k in &self.remaining[leaders..] {
            self.large_parts[k as usize] = field.large_part(k, &self.large_order[..done]);
        }
    }

    /// Codes the candidates behind the leaders at the small locations, round by round.
    fn run_small(&mut self, leaders: usize, bonus: f64, field: &mut impl Field) {
        let order = std::mem::take(&mut self.small_order);
        let (mut left, mut rest) = (bonus, order.as_slice());
        while !rest.is_empty() {
            self.drop_hopeless(leaders, left);
            let blocks = (self.remaining.len() - leaders).div_ceil(BLOCK).max(1);
            let round = (BLOCKS / blocks).clamp(2, ROUND).min(rest.len());
            let locations;
            (locations, rest) = rest.split_at(round);
            field.code(Size::Small, &self.remaining[leaders..], locations);
            for &k in &self.remaining[leaders..] {
                let gain: f64 = locations.iter().map(|&i| field.gain(k, i)).sum();
                self.gains[k as usize] += gain;
                self.best = self.best.max(self.large_parts[k as usize] + self.gains[k as usize]);
            }
            left -= locations.iter().map(|&i| field.most(Size::Small, i)).sum::<f64>();
        }
        self.small_order = order;
    }

    /// Drops every candidate, leaders aside, that can't reach the best with at most `left` more.
    fn drop_hopeless(&mut self, leaders: usize, left: f64) {
        let Self { remaining, large_parts, gains, best, .. } = self;
        let mut place = 0;
        remaining.retain(|&k| {
            place += 1;
            let most = large_parts[k as usize] + gains[k as usize] + left;
            place <= leaders || most + MARGIN >= *best
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    /// Candidates whose patches give what is written here, and a note of who was coded where.
    struct Written {
        large: Vec<Vec<f64>>,
        small: Vec<Vec<f64>>,
        /// The most that a large patch gives, and a small one.
        most_large: f64,
        most_small: f64,
        coded: BTreeSet<(bool, u32, u32)>,
    }

    impl Written {
        fn likelihood(&self, k: usize) -> f64 {
            self.large[k].iter().sum::<f64>() + self.small[k].iter().sum::<f64>()
        }

        fn is_coded(&self, k: u32) -> bool {
            let everywhere =
                |large, n: usize| (0..n as u32).all(|i| self.coded.contains(&(large, k, i)));
            everywhere(true, self.large[0].len()) && everywhere(false, self.small[0].len())
        }
    }

    impl Field for Written {
        fn code(&mut self, size: Size, candidates: &[u32], locations: &[u32]) {
            for &k in candidates {
                self.coded.extend(locations.iter().map(|&i| (size == Size::Large, k, i)));
            }
        }

        fn most(&self, size: Size, _: u32) -> f64 {
            if size == Size::Large { self.most_large } else { self.most_small }
        }

        fn gain(&self, k: u32, i: u32) -> f64 {
            assert!(self.coded.contains(&(false, k, i)));
            self.small[k as usize][i as usize]
        }

        fn large_part(&self, k: u32, coded: &[u32]) -> f64 {
            let known: f64 = coded.iter().map(|&i| self.large[k as usize][i as usize]).sum();
            assert!(coded.iter().all(|&i| self.coded.contains(&(true, k, i))));
            known + self.most_large * (self.large[0].len() - coded.len()) as f64
        }
    }

    /// All of the 40 candidates, this one first.
    fn entries(first: u32) -> Vec<u32> {
        std::iter::once(first).chain((0..40).filter(|&k| k != first)).collect()
    }

    proptest! {
        /// Whatever the patches give, the best candidates and all that tie with it remain, coded everywhere.
        #[test]
        fn the_winner_is_never_dropped(
            large in prop::collection::vec(prop::collection::vec(0..3u8, 4), 40),
            small in prop::collection::vec(prop::collection::vec(0..3u8, 30), 40),
            counts in any::<bool>(),
            order in Just((0..40).collect::<Vec<u32>>()).prop_shuffle(),
        ) {
            // Few values, so that many tie; and none that sums without rounding.
            let (most_large, most_small) = (f64::from(u8::from(counts)) * 0.7, 0.1);
            let scaled = |rows: Vec<Vec<u8>>, most: f64| -> Vec<Vec<f64>> {
                let row = |row: Vec<u8>| row.into_iter().map(|v| f64::from(v) / 2.0 * most).collect();
                rows.into_iter().map(row).collect()
            };
            let (large, small) = (scaled(large, most_large), scaled(small, most_small));
            let mut field = Written { large, small, most_large, most_small, coded: BTreeSet::new() };
            let mut race = Race::default();
            race.begin(&entries(0), &order);
            race.run((4, 30), &mut field);
            let best = (0..40).map(|k| field.likelihood(k)).fold(0.0, f64::max);
            for k in (0..40).filter(|&k| field.likelihood(k) >= best) {
                prop_assert!(race.remaining().contains(&(k as u32)));
            }
            prop_assert!(race.remaining().iter().all(|&k| field.is_coded(k)));
        }
    }

    #[test]
    fn the_hopeless_are_not_coded_everywhere() {
        let value = |k: usize| if k == 7 { 0.9 } else { 0.1 };
        let rows = |n: usize| (0..40).map(|k| vec![value(k); n]).collect();
        let (large, small) = (rows(4), rows(30));
        let mut field =
            Written { large, small, most_large: 1.0, most_small: 1.0, coded: BTreeSet::new() };
        let mut race = Race::default();
        race.begin(&entries(7), &entries(0));
        race.run((4, 30), &mut field);
        assert!(race.remaining().len() <= 2 * LEADERS, "{:?}", race.remaining());
        assert!(!field.is_coded(39));
    }

    #[test]
    fn large_patches_that_count_for_nothing_are_not_coded() {
        let small = |k: usize| vec![if k == 7 { 0.9 } else { 0.1 }; 30];
        let (large, small) = (vec![vec![0.0; 4]; 40], (0..40).map(small).collect());
        let mut field =
            Written { large, small, most_large: 0.0, most_small: 1.0, coded: BTreeSet::new() };
        let mut race = Race::default();
        race.begin(&entries(0), &entries(0));
        race.run((4, 30), &mut field);
        assert!(race.remaining().contains(&7));
        let coded = |k: u32| field.coded.contains(&(true, k, 0));
        assert!((0..40).all(|k| coded(k) == race.remaining().contains(&k)));
    }
}
