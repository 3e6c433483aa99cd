//! Weighs the candidates of a frame: codes, features and likelihoods, of all of them or of those that can win.

use super::crew::Crew;
use super::elimination::{Field, Race, Size};
use super::likelihood::{Feature, LikelihoodRules};
use super::scale::{Findings, Scale, Worker};
use crate::sparse::codes::Code;
use crate::sparse::somp::batched::BLOCK;
use std::sync::{Mutex, MutexGuard, PoisonError, RwLock};

/// The candidates of a frame and what is found of them.
#[derive(Debug)]
pub struct Weighing<'a> {
    /// What codes are made of.
    pub coding: Coding<'a>,
    /// How features become likelihoods.
    pub rules: LikelihoodRules,
    /// What is found at the large scale.
    pub large_findings: &'a mut Findings,
    /// What is found at the small scale.
    pub small_findings: &'a mut Findings,
}

/// What codes are made of: the same for all threads.
#[derive(Debug, Clone, Copy)]
pub struct Coding<'a> {
    candidates: (&'a [f32], usize),
    large: &'a Scale,
    small: &'a Scale,
    workers: &'a Workers,
}

/// Room for the threads that code candidates.
#[derive(Debug, Default)]
pub struct Workers {
    /// One for each thread of the pool, and one for a caller that is in none.
    each: Vec<Mutex<Worker>>,
    round: RwLock<Round>,
}

/// Candidates that are coded at some locations, a block of them and one location a task.
#[derive(Debug, Default)]
struct Round {
    size: Option<Size>,
    candidates: Vec<u32>,
    locations: Vec<u32>,
    /// What each task finds.
    found: Vec<Mutex<Vec<(Code, Feature)>>>,
}

impl Workers {
    /// Makes room for all threads of the pool.
    fn prepare(&mut self) {
        self.each.resize_with(rayon::current_num_threads() + 1, Mutex::default);
    }

    fn at_hand(&self) -> MutexGuard<'_, Worker> {
        let thread = rayon::current_thread_index().map_or(0, |k| k + 1);
        lock(&self.each[thread % self.each.len()])
    }
}

impl Round {
    /// Blocks of candidates.
    fn blocks(&self) -> usize {
        self.candidates.len().div_ceil(BLOCK)
    }

    /// The location and the candidates of a task.
    fn part(&self, task: usize) -> (usize, &[u32]) {
        let (location, block) = (task / self.blocks(), task % self.blocks());
        let candidates = self.candidates.chunks(BLOCK).nth(block).unwrap_or_default();
        (self.locations[location] as usize, candidates)
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl<'a> Coding<'a> {
    /// Of the candidates, one after the other, with so many samples each; by the large and the small scale; with room for the threads.
    pub fn new(
        candidates: (&'a [f32], usize),
        (large, small): (&'a Scale, &'a Scale),
        workers: &'a mut Workers,
    ) -> Self {
        workers.prepare();
        Self { candidates, large, small, workers }
    }

    fn scale(&self, size: Size) -> &Scale {
        match size {
            Size::Large => self.large,
            Size::Small => self.small,
        }
    }

    /// Does a task of the round.
    fn work(&self, task: usize) {
        let round = self.workers.round.read().unwrap_or_else(PoisonError::into_inner);
        let Some(size) = round.size else { return };
        let (location, block) = round.part(task);
        let (candidates, length) = self.candidates;
        let templates = block.iter().map(|&k| &candidates[k as usize * length..][..length]);
        let mut found = lock(&round.found[task]);
        found.resize(block.len(), Default::default());
        let mut worker = self.workers.at_hand();
        self.scale(size).code_block(location, templates, &mut worker, &mut found);
    }

    /// Codes these candidates at these locations.
    fn code(
        &self,
        crew: &Crew<'_>,
        size: Size,
        (candidates, locations): (&[u32], &[u32]),
        findings: &mut Findings,
    ) {
        let tasks;
        {
            let mut round = self.workers.round.write().unwrap_or_else(PoisonError::into_inner);
            round.size = Some(size);
            round.candidates.clear();
            round.candidates.extend_from_slice(candidates);
            round.locations.clear();
            round.locations.extend_from_slice(locations);
            tasks = round.blocks() * locations.len();
            if round.found.len() < tasks {
                round.found.resize_with(tasks, || Mutex::new(Vec::with_capacity(BLOCK)));
            }
        }
        crew.round(tasks);
        let round = self.workers.round.read().unwrap_or_else(PoisonError::into_inner);
        for (task, found) in round.found[..tasks].iter().enumerate() {
            let (location, block) = round.part(task);
            findings.note(location, block, &lock(found));
        }
    }
}

impl Weighing<'_> {
    /// Codes all candidates of a race everywhere.
    pub fn code_all(&mut self, race: &mut Race) {
        let locations = self.locations();
        self.together(|field| race.code_all(locations, field));
    }

    /// Runs a race: who remains is coded everywhere, and the most likely candidate does.
    pub fn run(&mut self, race: &mut Race) {
        let locations = self.locations();
        self.together(|field| race.run(locations, field));
    }

    /// Where no candidate is to be coded: of all of them, everything counts as hidden.
    pub fn hide(&mut self) {
        self.large_findings.hide();
        self.small_findings.hide();
    }

    /// How many there are at the large and the small scale.
    fn locations(&self) -> (usize, usize) {
        let Coding { large, small, .. } = self.coding;
        (large.grid().locations(), small.grid().locations())
    }

    /// Calls `lead` where idle threads help with what it has coded.
    fn together(&mut self, lead: impl FnOnce(&mut Together<'_, '_>) + Send) {
        let coding = self.coding;
        let task = |number| coding.work(number);
        Crew::gather(&task, |crew| lead(&mut Together { weighing: self, crew }));
    }

    /// The likelihood of a candidate that is coded everywhere (Eq. 24).
    pub fn likelihood(&self, candidate: u32) -> f64 {
        let k = candidate as usize;
        let large =
            self.large_findings.features(k).zip(self.coding.large.positions().iter().copied());
        let small =
            self.small_findings.features(k).zip(self.coding.small.positions().iter().copied());
        self.rules.likelihood(large, small)
    }
}

/// A weighing with the threads that help.
struct Together<'a, 'b> {
    weighing: &'a mut Weighing<'b>,
    crew: &'a Crew<'a>,
}

impl Field for Together<'_, '_> {
    fn code(&mut self, size: Size, candidates: &[u32], locations: &[u32]) {
        let Weighing { coding, large_findings, small_findings, .. } = &mut *self.weighing;
        let findings = match size {
            Size::Large => &mut **large_findings,
            Size::Small => &mut **small_findings,
        };
        coding.code(self.crew, size, (candidates, locations), findings);
    }

    fn most(&self, size: Size, location: u32) -> f64 {
        match size {
            Size::Large if !self.weighing.rules.counts_large() => 0.0,
            Size::Large => {
                self.weighing.rules.most(self.weighing.coding.large.positions()[location as usize])
            }
            Size::Small if !self.weighing.rules.counts_small() => 0.0,
            Size::Small => {
                let positions = self.weighing.coding.small.positions();
                self.weighing.rules.most(positions[location as usize]) / positions.len() as f64
            }
        }
    }

    fn gain(&self, candidate: u32, location: u32) -> f64 {
        if !self.weighing.rules.counts_small() {
            return 0.0;
        }
        let feature = self.weighing.small_findings.feature(candidate as usize, location as usize);
        let positions = self.weighing.coding.small.positions();
        self.weighing.rules.weighted(&feature, positions[location as usize])
            / positions.len() as f64
    }

    fn large_part(&self, candidate: u32, coded: &[u32]) -> f64 {
        let feature = |i: usize| -> Option<Feature> {
            let known = coded.contains(&(i as u32));
            known.then(|| self.weighing.large_findings.feature(candidate as usize, i))
        };
        let positions = self.weighing.coding.large.positions().iter().enumerate();
        self.weighing
            .rules
            .large_part_at_most(positions.map(|(i, &position)| (feature(i), position)))
    }
}
