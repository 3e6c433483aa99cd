//! Weighs the candidates of a frame (Eq. 24): codes, features and likelihoods of all of them, or of
//! those that can be the most likely one.

use super::likelihood::{Feature, LikelihoodParams};
use super::pruning::{Pruning, ScaleSize, UpperBounds};
use super::scale::{CodingScratch, PatchScores, Scale};
use crate::numeric::parallel::{current_num_threads, current_thread_index};
use crate::numeric::thread_team::ThreadTeam;
use crate::patch_model::sparse::codes::Code;
use crate::patch_model::sparse::somp::batched::BLOCK;
use std::sync::{Mutex, MutexGuard, PoisonError, RwLock};

/// The candidates whose likelihoods are wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LikelihoodRequest {
    /// All of them.
    All,
    /// The most likely one. The others may have minus infinity.
    Best,
}

/// The candidates of a frame and their scores.
#[derive(Debug)]
pub struct CandidateBatch<'a> {
    /// What codes are made from.
    pub coding: Coding<'a>,
    /// How features become likelihoods.
    pub params: LikelihoodParams,
    /// Scores at the large scale.
    pub large_scores: &'a mut PatchScores,
    /// Scores at the small scale.
    pub small_scores: &'a mut PatchScores,
}

/// What codes are made from: the same for all threads.
#[derive(Debug, Clone, Copy)]
pub struct Coding<'a> {
    candidates: (&'a [f32], usize),
    large: &'a Scale,
    small: &'a Scale,
    buffers: &'a ThreadBuffers,
}

/// Buffers of the threads that code candidates.
#[derive(Debug, Default)]
pub struct ThreadBuffers {
    /// One for each thread of the pool, and one for a caller outside of it.
    each: Vec<Mutex<CodingScratch>>,
    round: RwLock<Round>,
}

/// Candidates that are coded at some locations. A task is one block of them at one location.
#[derive(Debug, Default)]
struct Round {
    size: Option<ScaleSize>,
    candidates: Vec<u32>,
    locations: Vec<u32>,
    /// The result of each task.
    scores: Vec<Mutex<Vec<(Code, Feature)>>>,
}

impl ThreadBuffers {
    /// Makes room for all threads of the pool.
    fn prepare(&mut self) {
        self.each.resize_with(current_num_threads() + 1, Mutex::default);
    }

    fn of_this_thread(&self) -> MutexGuard<'_, CodingScratch> {
        let thread = current_thread_index().map_or(0, |k| k + 1);
        lock(&self.each[thread % self.each.len()])
    }
}

impl Round {
    /// Begins a round with these candidates and locations, and returns the number of its tasks.
    fn begin(&mut self, size: ScaleSize, candidates: &[u32], locations: &[u32]) -> usize {
        self.size = Some(size);
        self.candidates.clear();
        self.candidates.extend_from_slice(candidates);
        self.locations.clear();
        self.locations.extend_from_slice(locations);
        let tasks = self.blocks() * locations.len();
        if self.scores.len() < tasks {
            self.scores.resize_with(tasks, || Mutex::new(Vec::with_capacity(BLOCK)));
        }
        tasks
    }

    /// The number of blocks.
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
    /// For these candidates, one after the other, with so many samples each, by the large and the
    /// small scale.
    pub fn new(
        candidates: (&'a [f32], usize),
        (large, small): (&'a Scale, &'a Scale),
        buffers: &'a mut ThreadBuffers,
    ) -> Self {
        buffers.prepare();
        Self { candidates, large, small, buffers }
    }

    fn scale(&self, size: ScaleSize) -> &Scale {
        match size {
            ScaleSize::Large => self.large,
            ScaleSize::Small => self.small,
        }
    }

    /// Runs one task of the round.
    fn run_task(&self, task: usize) {
        let round = self.buffers.round.read().unwrap_or_else(PoisonError::into_inner);
        let Some(size) = round.size else { return };
        let (location, block) = round.part(task);
        let (candidates, length) = self.candidates;
        let templates = block.iter().map(|&k| &candidates[k as usize * length..][..length]);
        let mut scores = lock(&round.scores[task]);
        scores.resize(block.len(), Default::default());
        let mut scratch = self.buffers.of_this_thread();
        self.scale(size).code_block(location, templates, &mut scratch, &mut scores);
    }
}

impl CandidateBatch<'_> {
    /// Codes the candidates with a team of threads: all of them everywhere, or until those that
    /// remain are coded everywhere and the most likely one is among them.
    pub fn run(&mut self, wanted: LikelihoodRequest, pruning: &mut Pruning) {
        let coding = self.coding;
        let locations = (coding.large.grid().locations(), coding.small.grid().locations());
        ThreadTeam::run(&|task| coding.run_task(task), |team| {
            let mut weighing = TeamBatch { weighing: self, team };
            match wanted {
                LikelihoodRequest::All => pruning.code_all(locations, &mut weighing),
                LikelihoodRequest::Best => pruning.run(locations, &mut weighing),
            }
        });
    }

    /// The likelihood of a candidate that is coded everywhere (Eq. 24).
    pub fn likelihood(&self, candidate: u32) -> f64 {
        let k = candidate as usize;
        let large =
            self.large_scores.features(k).zip(self.coding.large.positions().iter().copied());
        let small =
            self.small_scores.features(k).zip(self.coding.small.positions().iter().copied());
        self.params.likelihood(large, small)
    }
}

/// A weighing together with the threads that share its coding.
struct TeamBatch<'a, 'b> {
    weighing: &'a mut CandidateBatch<'b>,
    team: &'a ThreadTeam<'a>,
}

impl UpperBounds for TeamBatch<'_, '_> {
    fn code(&mut self, size: ScaleSize, candidates: &[u32], locations: &[u32]) {
        let CandidateBatch { coding, large_scores, small_scores, .. } = &mut *self.weighing;
        let all_scores = match size {
            ScaleSize::Large => &mut **large_scores,
            ScaleSize::Small => &mut **small_scores,
        };
        let round = &coding.buffers.round;
        let tasks = {
            let mut round = round.write().unwrap_or_else(PoisonError::into_inner);
            round.begin(size, candidates, locations)
        };
        self.team.round(tasks);
        let round = round.read().unwrap_or_else(PoisonError::into_inner);
        for (task, scores) in round.scores[..tasks].iter().enumerate() {
            let (location, block) = round.part(task);
            all_scores.store(location, block, &lock(scores));
        }
    }

    fn gain_at_most(&self, size: ScaleSize, location: u32) -> f64 {
        let CandidateBatch { params, coding, .. } = &*self.weighing;
        let position = |scale: &Scale| scale.positions()[location as usize];
        match size {
            ScaleSize::Large if !params.counts_large() => 0.0,
            ScaleSize::Large => params.weighted_at_most(position(coding.large)),
            ScaleSize::Small if !params.counts_small() => 0.0,
            ScaleSize::Small => {
                params.weighted_at_most(position(coding.small))
                    / coding.small.positions().len() as f64
            }
        }
    }

    fn gain(&self, candidate: u32, location: u32) -> f64 {
        let CandidateBatch { params, coding, small_scores, .. } = &*self.weighing;
        if !params.counts_small() {
            return 0.0;
        }
        let feature = small_scores.feature(candidate as usize, location as usize);
        let positions = coding.small.positions();
        params.weighted(&feature, positions[location as usize]) / positions.len() as f64
    }

    fn large_part(&self, candidate: u32, coded: &[u32]) -> f64 {
        let CandidateBatch { params, coding, large_scores, .. } = &*self.weighing;
        let feature = |i: usize| -> Option<Feature> {
            let known = coded.contains(&(i as u32));
            known.then(|| large_scores.feature(candidate as usize, i))
        };
        let positions = coding.large.positions().iter().enumerate();
        params.large_part_at_most(positions.map(|(i, &position)| (feature(i), position)))
    }
}
