//! Weighs the candidates of a frame: codes, features and likelihoods, of all of them or of those that can win.

use super::elimination::{Field, Race, Size};
use super::likelihood::{Feature, LikelihoodRules};
use super::scale::{Findings, Scale, Workers};

/// The candidates of a frame and what is found of them.
#[derive(Debug)]
pub struct Weighing<'a> {
    /// The candidates, one after the other, and how many samples each has.
    pub candidates: (&'a [f32], usize),
    /// How features become likelihoods.
    pub rules: LikelihoodRules,
    /// The large scale.
    pub large: &'a Scale,
    /// The small scale.
    pub small: &'a Scale,
    /// What is found at the large scale.
    pub large_findings: &'a mut Findings,
    /// What is found at the small scale.
    pub small_findings: &'a mut Findings,
    /// Room for the threads.
    pub workers: &'a mut Workers,
}

impl Weighing<'_> {
    /// Codes these candidates everywhere.
    pub fn code_all(&mut self, candidates: &[u32]) {
        for (size, scale) in [(Size::Large, self.large), (Size::Small, self.small)] {
            let locations: Vec<u32> = (0..scale.grid().locations() as u32).collect();
            self.code(size, candidates, &locations);
        }
    }

    /// Runs a race: who remains is coded everywhere, and the most likely candidate does.
    pub fn run(&mut self, race: &mut Race) {
        race.run((self.large.grid().locations(), self.small.grid().locations()), self);
    }

    /// The likelihood of a candidate that is coded everywhere (Eq. 24).
    pub fn likelihood(&self, candidate: u32) -> f64 {
        let k = candidate as usize;
        let large = self.large_findings.features(k).zip(self.large.positions().iter().copied());
        let small = self.small_findings.features(k).zip(self.small.positions().iter().copied());
        self.rules.likelihood(large, small)
    }
}

impl Field for Weighing<'_> {
    fn code(&mut self, size: Size, candidates: &[u32], locations: &[u32]) {
        let (scale, findings) = match size {
            Size::Large => (self.large, &mut *self.large_findings),
            Size::Small => (self.small, &mut *self.small_findings),
        };
        scale.weigh(self.candidates, candidates, locations, self.workers, findings);
    }

    fn most(&self, size: Size, location: u32) -> f64 {
        match size {
            Size::Large if !self.rules.counts_large() => 0.0,
            Size::Large => self.rules.most(self.large.positions()[location as usize]),
            Size::Small if !self.rules.counts_small() => 0.0,
            Size::Small => {
                let positions = self.small.positions();
                self.rules.most(positions[location as usize]) / positions.len() as f64
            }
        }
    }

    fn gain(&self, candidate: u32, location: u32) -> f64 {
        if !self.rules.counts_small() {
            return 0.0;
        }
        let feature = self.small_findings.feature(candidate as usize, location as usize);
        let positions = self.small.positions();
        self.rules.weighted(&feature, positions[location as usize]) / positions.len() as f64
    }

    fn large_part(&self, candidate: u32, coded: &[u32]) -> f64 {
        let feature = |i: usize| -> Option<Feature> {
            let known = coded.contains(&(i as u32));
            known.then(|| self.large_findings.feature(candidate as usize, i))
        };
        let positions = self.large.positions().iter().enumerate();
        self.rules.large_part_at_most(positions.map(|(i, &position)| (feature(i), position)))
    }
}
