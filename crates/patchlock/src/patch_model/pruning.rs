//! Pruning of candidates. Only the most likely candidate is needed, so a candidate is dropped once
//! it cannot be it.
//!
//! The share of a patch is at most 1, so a patch adds at most its largest weight to a likelihood.
//! After some locations have been coded, the likelihood of a candidate is at most what these
//! contribute plus the maximum of the others. A candidate is dropped if this upper bound is below a
//! likelihood that another candidate reaches. The candidate with the largest likelihood is never
//! dropped, and neither is one that ties with it. The likelihoods of the remaining candidates are
//! computed as if none had been dropped. So the estimate is the same, bit for bit.
//!
//! The order of candidates and locations affects only how early candidates are dropped. A few
//! *seeds*, the candidates most similar to the last template, are coded at all locations first, to
//! reach a high likelihood early. The others are coded location by location. The large locations
//! come in the order of their weights, the small ones in the order of what the seeds lost there.
//! Similar candidates are coded next to each other, because they share more of the work.

use crate::patch_model::sparse::somp::batched::BLOCK;

/// Number of candidates coded at all locations before the others, and of further ones, selected by
/// their large patches.
const SEEDS: usize = 3;

/// Maximum number of small locations that are coded together. A smaller number drops candidates
/// earlier.
const ROUND: usize = 8;

/// Number of blocks of candidates that are coded together, as far as [`ROUND`] allows: enough that
/// no thread waits long for another.
const BLOCKS: usize = 32;

/// Exceeds the rounding error of a likelihood.
const MARGIN: f64 = 1e-9;

/// The two patch scales.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ScaleSize {
    /// The large patches.
    Large,
    /// The small patches.
    Small,
}

/// The bounds and codes of candidates that pruning needs.
pub trait UpperBounds {
    /// Codes these candidates at these locations.
    fn code(&mut self, size: ScaleSize, candidates: &[u32], locations: &[u32]);

    /// The maximum that a patch at this location can add to a likelihood, before any factor common
    /// to all patches.
    fn gain_at_most(&self, size: ScaleSize, location: u32) -> f64;

    /// What this candidate's small patch adds to its likelihood; the patch must have been coded.
    fn gain(&self, candidate: u32, location: u32) -> f64;

    /// The maximum that the candidate's large patches can add to its likelihood together, if those
    /// in `coded` are coded.
    fn large_part(&self, candidate: u32, coded: &[u32]) -> f64;
}

/// The candidates that can still be the most likely one.
#[derive(Debug, Default)]
pub struct Pruning {
    remaining: Vec<u32>,
    /// For each candidate, the maximum contribution of its large patches, and that of its small
    /// patches coded so far.
    large_parts: Vec<f64>,
    gains: Vec<f64>,
    /// The largest likelihood that some candidate is known to reach.
    best: f64,
    large_order: Vec<u32>,
    small_order: Vec<u32>,
    /// What the seeds lost at each small location.
    losses: Vec<f64>,
    /// The position of each candidate in the coding order.
    positions: Vec<u32>,
}

impl Pruning {
    /// The remaining candidates. After pruning, they have been coded at all locations.
    pub fn remaining(&self) -> &[u32] {
        &self.remaining
    }

    /// Begins with the candidates in `ranked`, the most promising first. `order` contains the same
    /// candidates, with similar ones next to each other.
    pub fn begin(&mut self, ranked: &[u32], order: &[u32]) {
        self.remaining.clear();
        self.remaining.extend_from_slice(ranked);
        let count = order.len();
        self.positions.clear();
        self.positions.resize(count, 0);
        for (position, &k) in order.iter().enumerate() {
            self.positions[k as usize] = position as u32;
        }
        for values in [&mut self.large_parts, &mut self.gains] {
            values.clear();
            values.resize(count, 0.0);
        }
        self.best = f64::NEG_INFINITY;
    }

    /// Codes all candidates at all locations: this many large and small ones.
    pub fn code_all(&mut self, (large, small): (usize, usize), bounds: &mut impl UpperBounds) {
        let Self { remaining, large_order, small_order, .. } = self;
        for (size, count, order) in
            [(ScaleSize::Large, large, large_order), (ScaleSize::Small, small, small_order)]
        {
            order.clear();
            order.extend(0..count as u32);
            bounds.code(size, remaining, order);
        }
    }

    /// Codes and drops candidates; there are this many large and small locations.
    pub fn run(&mut self, (large, small): (usize, usize), bounds: &mut impl UpperBounds) {
        self.order_large(large, bounds);
        let seeds = SEEDS.min(self.remaining.len());
        self.code_large(0..seeds, large, bounds);
        self.small_order.clear();
        self.small_order.extend(0..small as u32);
        self.code_small(0..seeds, bounds);
        self.order_small(seeds, bounds);

        let small_bound: f64 =
            (0..small as u32).map(|i| bounds.gain_at_most(ScaleSize::Small, i)).sum();
        // If large patches have no weight, they are coded at the end, and only for the remaining
        // candidates.
        let large_counts =
            self.large_order.iter().any(|&i| bounds.gain_at_most(ScaleSize::Large, i) > 0.0);
        let rounds = if large_counts { large } else { 0 };
        self.sort_by_position(seeds);
        for done in 0..rounds {
            let locations = [self.large_order[done]];
            bounds.code(ScaleSize::Large, &self.remaining[seeds..], &locations);
            self.bound_large(seeds, done + 1, bounds);
            self.drop_impossible(seeds, small_bound);
        }
        let parts = &self.large_parts;
        self.remaining[seeds..].sort_unstable_by(|&a, &b| {
            parts[b as usize].total_cmp(&parts[a as usize]).then(a.cmp(&b))
        });
        let second_seeds = (seeds + SEEDS).min(self.remaining.len());
        self.code_small(seeds..second_seeds, bounds);
        self.sort_by_position(second_seeds);
        self.run_small(second_seeds, small_bound, bounds);
        if !large_counts {
            bounds.code(ScaleSize::Large, &self.remaining[seeds..], &self.large_order);
        }
    }

    /// Sorts the candidates after the seeds by their position in the coding order.
    fn sort_by_position(&mut self, seeds: usize) {
        let positions = &self.positions;
        self.remaining[seeds..].sort_unstable_by_key(|&k| positions[k as usize]);
    }

    /// Sorts the large locations by the weight of a patch, largest first.
    fn order_large(&mut self, count: usize, bounds: &impl UpperBounds) {
        self.large_order.clear();
        self.large_order.extend(0..count as u32);
        let most = |i: &u32| bounds.gain_at_most(ScaleSize::Large, *i);
        self.large_order.sort_by(|a, b| most(b).total_cmp(&most(a)).then(a.cmp(b)));
    }

    /// Sorts the small locations by what the seeds lost there, largest first.
    fn order_small(&mut self, seeds: usize, bounds: &impl UpperBounds) {
        let losses = &mut self.losses;
        losses.clear();
        losses.extend((0..self.small_order.len() as u32).map(|i| {
            let gain: f64 = self.remaining[..seeds].iter().map(|&k| bounds.gain(k, i)).sum();
            bounds.gain_at_most(ScaleSize::Small, i) * seeds as f64 - gain
        }));
        let order = &mut self.small_order;
        order.sort_by(|&a, &b| losses[b as usize].total_cmp(&losses[a as usize]).then(a.cmp(&b)));
    }

    /// Codes some of the remaining candidates at all large locations.
    fn code_large(
        &mut self,
        which: std::ops::Range<usize>,
        large: usize,
        bounds: &mut impl UpperBounds,
    ) {
        bounds.code(ScaleSize::Large, &self.remaining[which.clone()], &self.large_order);
        for &k in &self.remaining[which] {
            self.large_parts[k as usize] = bounds.large_part(k, &self.large_order[..large]);
        }
    }

    /// Codes some of the remaining candidates at all small locations, which completes their
    /// likelihoods.
    fn code_small(&mut self, which: std::ops::Range<usize>, bounds: &mut impl UpperBounds) {
        bounds.code(ScaleSize::Small, &self.remaining[which.clone()], &self.small_order);
        for &k in &self.remaining[which] {
            let gain: f64 = self.small_order.iter().map(|&i| bounds.gain(k, i)).sum();
            self.gains[k as usize] = gain;
            self.best = self.best.max(self.large_parts[k as usize] + gain);
        }
    }

    fn bound_large(&mut self, seeds: usize, done: usize, bounds: &impl UpperBounds) {
        for &k in &self.remaining[seeds..] {
            self.large_parts[k as usize] = bounds.large_part(k, &self.large_order[..done]);
        }
    }

    /// Codes the candidates after the seeds at the small locations, in rounds.
    fn run_small(&mut self, seeds: usize, small_bound: f64, bounds: &mut impl UpperBounds) {
        let order = std::mem::take(&mut self.small_order);
        let (mut left, mut rest) = (small_bound, order.as_slice());
        while !rest.is_empty() {
            self.drop_impossible(seeds, left);
            let blocks = (self.remaining.len() - seeds).div_ceil(BLOCK).max(1);
            let round = (BLOCKS / blocks).clamp(2, ROUND).min(rest.len());
            let locations;
            (locations, rest) = rest.split_at(round);
            bounds.code(ScaleSize::Small, &self.remaining[seeds..], locations);
            for &k in &self.remaining[seeds..] {
                let gain: f64 = locations.iter().map(|&i| bounds.gain(k, i)).sum();
                self.gains[k as usize] += gain;
                self.best = self.best.max(self.large_parts[k as usize] + self.gains[k as usize]);
            }
            left -=
                locations.iter().map(|&i| bounds.gain_at_most(ScaleSize::Small, i)).sum::<f64>();
        }
        self.small_order = order;
    }

    /// Drops every candidate, except the seeds, that cannot reach `best` by gaining `left`.
    fn drop_impossible(&mut self, seeds: usize, left: f64) {
        let Self { remaining, large_parts, gains, best, .. } = self;
        let mut position = 0;
        remaining.retain(|&k| {
            position += 1;
            let most = large_parts[k as usize] + gains[k as usize] + left;
            position <= seeds || most + MARGIN >= *best
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    /// Candidates whose patches have fixed gains; records which of them were coded where.
    struct FixedGains {
        large: Vec<Vec<f64>>,
        small: Vec<Vec<f64>>,
        /// The maximum gain of a large patch and of a small patch.
        most_large: f64,
        most_small: f64,
        coded: BTreeSet<(bool, u32, u32)>,
    }

    impl FixedGains {
        fn likelihood(&self, k: usize) -> f64 {
            self.large[k].iter().sum::<f64>() + self.small[k].iter().sum::<f64>()
        }

        fn is_coded(&self, k: u32) -> bool {
            let everywhere =
                |large, n: usize| (0..n as u32).all(|i| self.coded.contains(&(large, k, i)));
            everywhere(true, self.large[0].len()) && everywhere(false, self.small[0].len())
        }
    }

    impl UpperBounds for FixedGains {
        fn code(&mut self, size: ScaleSize, candidates: &[u32], locations: &[u32]) {
            for &k in candidates {
                self.coded.extend(locations.iter().map(|&i| (size == ScaleSize::Large, k, i)));
            }
        }

        fn gain_at_most(&self, size: ScaleSize, _: u32) -> f64 {
            if size == ScaleSize::Large { self.most_large } else { self.most_small }
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

    /// All 40 candidates, this one first.
    fn ranked(first: u32) -> Vec<u32> {
        std::iter::once(first).chain((0..40).filter(|&k| k != first)).collect()
    }

    proptest! {
        /// For any gains, the best candidate and all that tie with it remain and are coded at all
        /// locations.
        #[test]
        fn the_most_likely_candidate_is_never_dropped(
            large in prop::collection::vec(prop::collection::vec(0..3u8, 4), 40),
            small in prop::collection::vec(prop::collection::vec(0..3u8, 30), 40),
            counts in any::<bool>(),
            order in Just((0..40).collect::<Vec<u32>>()).prop_shuffle(),
        ) {
            // Few distinct values, so that many candidates tie, and values whose sums are rounded.
            let (most_large, most_small) = (f64::from(u8::from(counts)) * 0.7, 0.1);
            let scaled = |rows: Vec<Vec<u8>>, most: f64| -> Vec<Vec<f64>> {
                let row = |row: Vec<u8>| row.into_iter().map(|v| f64::from(v) / 2.0 * most).collect();
                rows.into_iter().map(row).collect()
            };
            let (large, small) = (scaled(large, most_large), scaled(small, most_small));
            let mut bounds = FixedGains { large, small, most_large, most_small, coded: BTreeSet::new() };
            let mut pruning = Pruning::default();
            pruning.begin(&ranked(0), &order);
            pruning.run((4, 30), &mut bounds);
            let best = (0..40).map(|k| bounds.likelihood(k)).fold(0.0, f64::max);
            for k in (0..40).filter(|&k| bounds.likelihood(k) >= best) {
                prop_assert!(pruning.remaining().contains(&(k as u32)));
            }
            prop_assert!(pruning.remaining().iter().all(|&k| bounds.is_coded(k)));
        }
    }

    #[test]
    fn dropped_candidates_are_not_coded_everywhere() {
        let value = |k: usize| if k == 7 { 0.9 } else { 0.1 };
        let rows = |n: usize| (0..40).map(|k| vec![value(k); n]).collect();
        let (large, small) = (rows(4), rows(30));
        let mut bounds =
            FixedGains { large, small, most_large: 1.0, most_small: 1.0, coded: BTreeSet::new() };
        let mut pruning = Pruning::default();
        pruning.begin(&ranked(7), &ranked(0));
        pruning.run((4, 30), &mut bounds);
        assert!(pruning.remaining().len() <= 2 * SEEDS, "{:?}", pruning.remaining());
        assert!(!bounds.is_coded(39));
    }

    #[test]
    fn large_patches_without_weight_are_not_coded_first() {
        let small = |k: usize| vec![if k == 7 { 0.9 } else { 0.1 }; 30];
        let (large, small) = (vec![vec![0.0; 4]; 40], (0..40).map(small).collect());
        let mut bounds =
            FixedGains { large, small, most_large: 0.0, most_small: 1.0, coded: BTreeSet::new() };
        let mut pruning = Pruning::default();
        pruning.begin(&ranked(0), &ranked(0));
        pruning.run((4, 30), &mut bounds);
        assert!(pruning.remaining().contains(&7));
        let coded = |k: u32| bounds.coded.contains(&(true, k, 0));
        assert!((0..40).all(|k| coded(k) == pruning.remaining().contains(&k)));
    }
}
