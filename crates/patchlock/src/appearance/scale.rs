//! One of the two patch scales: its grid, dictionary and buffer, and what they say of candidates.

use super::likelihood::Feature;
use super::pooling::{PoolRules, own_share};
use super::weights::masked_error;
use crate::sparse::codes::{Code, CodeRules};
use crate::sparse::dictionary::Dictionary;
use crate::sparse::somp::batched;
use crate::vision::patches::PatchGrid;
use rayon::prelude::*;
use std::sync::{Mutex, PoisonError};

/// Grid, dictionary and buffer of a scale.
#[derive(Debug, Clone)]
pub struct Scale {
    grid: PatchGrid,
    dictionary: Dictionary,
    /// The buffer's patches, location by location: `locations` times `buffer length` patches.
    shared: Vec<f32>,
}

/// How patches are coded and pooled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScaleRules {
    /// How codes are made.
    pub codes: CodeRules,
    /// How they are pooled.
    pub pool: PoolRules,
}

/// What [`Scale::weigh`] finds, location by location: entry `location * candidates + candidate`.
#[derive(Debug, Default)]
pub struct Findings {
    candidates: usize,
    codes: Vec<Code>,
    features: Vec<Feature>,
}

/// Room for the threads that weigh candidates.
#[derive(Debug, Default)]
pub struct Workers(Vec<Mutex<Worker>>);

#[derive(Debug, Default)]
struct Worker {
    patches: Vec<f32>,
    codes: Vec<Code>,
    solver: batched::Scratch,
}

impl Scale {
    /// A scale with the dictionary of these templates and a buffer of these.
    pub fn new(grid: PatchGrid, templates: &[Vec<f32>], buffer: &[Vec<f32>]) -> Self {
        let atoms = templates.iter().flat_map(|template| grid.cut_all(template)).collect();
        let dictionary = Dictionary::new(grid.dim(), grid.locations(), atoms);
        let mut scale = Self { grid, dictionary, shared: Vec::new() };
        scale.set_buffer(buffer);
        scale
    }

    /// Replaces the dictionary by that of these templates.
    pub fn set_templates(&mut self, templates: &[Vec<f32>]) {
        let atoms = templates.iter().flat_map(|template| self.grid.cut_all(template)).collect();
        self.dictionary = Dictionary::new(self.grid.dim(), self.grid.locations(), atoms);
    }

    /// Replaces the buffer.
    pub fn set_buffer(&mut self, buffer: &[Vec<f32>]) {
        let dim = self.grid.dim();
        self.shared.resize(self.grid.locations() * buffer.len() * dim, 0.0);
        let locations = self.shared.chunks_mut((buffer.len() * dim).max(1));
        for (location, patches) in locations.enumerate() {
            for (template, patch) in buffer.iter().zip(patches.chunks_exact_mut(dim)) {
                self.grid.cut(template, location, patch);
            }
        }
    }

    /// The grid of patches.
    pub fn grid(&self) -> &PatchGrid {
        &self.grid
    }

    /// The dictionary.
    pub fn dictionary(&self) -> &Dictionary {
        &self.dictionary
    }

    /// The buffer's patches at a location, one after the other.
    pub fn shared(&self, location: usize) -> &[f32] {
        let length = self.shared.len() / self.grid.locations();
        &self.shared[location * length..][..length]
    }

    /// Codes the patches of the candidates `which` at the locations that are `wanted`; `candidates` are templates of `template_len`
    /// samples, one after the other. Locations are independent, so the result is the same on any number of threads.
    pub fn weigh(
        &self,
        (candidates, template_len): (&[f32], usize),
        which: &[u32],
        wanted: impl Fn(usize) -> bool + Sync,
        rules: &ScaleRules,
        workers: &mut Workers,
        findings: &mut Findings,
    ) {
        if which.is_empty() {
            return;
        }
        let count = findings.candidates;
        // One for each thread of the pool, and one for a caller that is in none.
        workers.0.resize_with(rayon::current_num_threads() + 1, Mutex::default);
        let rows =
            findings.codes.par_chunks_mut(count).zip(findings.features.par_chunks_mut(count));
        let rows = rows.enumerate().filter(|(location, _)| wanted(*location));
        rows.for_each(|(location, (codes, features))| {
            let thread = rayon::current_thread_index().map_or(0, |k| k + 1);
            let worker = &workers.0[thread % workers.0.len()];
            let mut worker = worker.lock().unwrap_or_else(PoisonError::into_inner);
            let template = |k: u32| &candidates[k as usize * template_len..][..template_len];
            let templates = which.iter().map(|&k| template(k));
            self.code_location(location, templates, rules, &mut worker);
            let coded = worker.patches.chunks_exact(self.grid.dim()).zip(&worker.codes);
            for (&k, (patch, &code)) in which.iter().zip(coded) {
                codes[k as usize] = code;
                features[k as usize] = Feature {
                    share: own_share(&code, location, self.dictionary.locations(), rules.pool),
                    error: masked_error(&self.dictionary, patch, &code, location),
                };
            }
        });
    }

    fn code_location<'a>(
        &self,
        location: usize,
        templates: impl ExactSizeIterator<Item = &'a [f32]>,
        rules: &ScaleRules,
        worker: &mut Worker,
    ) {
        let Worker { patches, codes, solver } = worker;
        let dim = self.grid.dim();
        patches.resize(templates.len() * dim, 0.0);
        codes.resize(templates.len(), Code::default());
        for (template, patch) in templates.zip(patches.chunks_exact_mut(dim)) {
            self.grid.cut(template, location, patch);
        }
        let shared = self.shared(location);
        batched::solve(&self.dictionary, shared, patches, &rules.codes, solver, codes);
    }
}

impl Findings {
    /// Makes room for this many candidates and locations.
    pub fn begin(&mut self, candidates: usize, locations: usize) {
        self.candidates = candidates;
        self.codes.resize(candidates * locations, Code::default());
        self.features.resize(candidates * locations, Feature::default());
    }

    /// One candidate's feature at one location.
    pub fn feature(&self, candidate: usize, location: usize) -> Feature {
        self.features[location * self.candidates + candidate]
    }

    /// The features of one candidate, location after location.
    pub fn features(&self, candidate: usize) -> impl Iterator<Item = Feature> + Clone {
        self.features.iter().skip(candidate).step_by(self.candidates.max(1)).copied()
    }

    /// The codes of one candidate, location after location.
    pub fn codes(&self, candidate: usize) -> impl Iterator<Item = &Code> {
        self.codes.iter().skip(candidate).step_by(self.candidates.max(1))
    }
}
