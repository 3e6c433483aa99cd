//! One of the two patch scales: its grid, dictionary and buffer, and the scoring of patches with
//! them.
//!
//! Code that the solver runs in is compiled for the instructions in use; the head of
//! `somp::vectors` says what that saves.

use super::likelihood::Feature;
use super::pooling::own_share;
use super::weights::{masked_error, position_weights};
use crate::numeric::instructions::{Instructions, dispatch};
use crate::numeric::parallel::*;
use crate::patch_model::sparse::codes::{Code, CodeParams};
use crate::patch_model::sparse::dictionary::{Dictionary, DictionaryScratch};
use crate::patch_model::sparse::somp::batched;
use crate::vision::patches::PatchGrid;

/// Grid, dictionary and buffer of a scale.
#[derive(Debug, Clone)]
pub struct Scale {
    grid: PatchGrid,
    params: ScaleParams,
    /// The position part of each location's weight.
    positions: Vec<f64>,
    dictionary: Dictionary,
    /// The buffer's patches, location by location: `locations * buffer length` patches.
    shared: Vec<f32>,
    /// For each location, what follows from the dictionary and the buffer; none if that is not
    /// kept.
    locations: Vec<batched::Location>,
}

/// How patches are coded and pooled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScaleParams {
    /// How codes are made.
    pub codes: CodeParams,
    /// How fast the position weight falls with the distance from the centre.
    pub beta: f64,
    /// Whether position weights are used.
    pub position_weights: bool,
    /// Whether what follows from dictionary and buffer is kept, as [`Scale::code_block`] needs it. That
    /// is several times as much memory, and worth it where many candidates are coded between two
    /// learning steps. The codes are the same.
    pub keeps_products: bool,
}

/// The codes and features of all candidates, location by location: the index is
/// `location * candidates + candidate`.
#[derive(Debug, Default)]
pub struct PatchScores {
    candidates: usize,
    codes: Vec<Code>,
    features: Vec<Feature>,
}

/// The buffers of a thread that codes candidates.
#[derive(Debug, Default)]
pub struct CodingScratch {
    patches: Vec<f32>,
    codes: Vec<Code>,
    solver: batched::SolverScratch,
}

impl Scale {
    /// A scale with the dictionary of these templates and this buffer.
    pub fn new(
        grid: PatchGrid,
        params: ScaleParams,
        templates: &[Vec<f32>],
        buffer: &[Vec<f32>],
    ) -> Self {
        let mut scale = Self {
            grid,
            params,
            positions: position_weights(grid.per_side(), params.beta, params.position_weights),
            dictionary: Dictionary::empty(params.keeps_products),
            shared: Vec::new(),
            locations: Vec::new(),
        };
        scale.learn(Some(templates), Some(buffer), &mut DictionaryScratch::default());
        scale
    }

    /// Replaces the dictionary by that of these templates, the buffer by this one, or both.
    pub fn learn(
        &mut self,
        templates: Option<&[Vec<f32>]>,
        buffer: Option<&[Vec<f32>]>,
        scratch: &mut DictionaryScratch,
    ) {
        if let Some(templates) = templates {
            self.set_dictionary(templates, scratch);
        }
        if let Some(buffer) = buffer {
            self.set_buffer(buffer);
        }
        let Self { dictionary, params, shared, grid, locations, .. } = self;
        let Some(products) = dictionary.products() else { return };
        if templates.is_none() && buffer.is_none() {
            return;
        }
        let panels = scratch.wide_panels(products);
        let length = shared.len() / grid.locations();
        locations.resize_with(grid.locations(), Default::default);
        locations.par_iter_mut().enumerate().for_each(|(location, out)| {
            let shared = &shared[location * length..][..length];
            out.fill((dictionary, panels), (location, shared), &params.codes);
        });
    }

    fn set_dictionary(&mut self, templates: &[Vec<f32>], scratch: &mut DictionaryScratch) {
        let grid = self.grid;
        let cut = |atoms: &mut Vec<f32>| {
            atoms.resize(templates.len() * grid.locations() * grid.dim(), 0.0);
            let patches = atoms.chunks_exact_mut(grid.dim());
            let places = templates.iter().flat_map(|t| (0..grid.locations()).map(move |i| (t, i)));
            for ((template, location), patch) in places.zip(patches) {
                grid.cut(template, location, patch);
            }
        };
        self.dictionary.fill(grid.dim(), grid.locations(), cut, scratch);
    }

    fn set_buffer(&mut self, buffer: &[Vec<f32>]) {
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
    #[cfg(feature = "internals")]
    pub fn dictionary(&self) -> &Dictionary {
        &self.dictionary
    }

    /// The position part of each location's weight, `exp(-beta (|row - centre| + |column -
    /// centre|))`.
    pub fn positions(&self) -> &[f64] {
        &self.positions
    }

    /// Codes the patches of some templates, at most a block of them, at one location, with the
    /// products that were kept. Blocks are independent, so the results are the same on any number of
    /// threads.
    pub fn code_block<'a>(
        &self,
        location: usize,
        templates: impl ExactSizeIterator<Item = &'a [f32]>,
        scratch: &mut CodingScratch,
        out: &mut [(Code, Feature)],
    ) {
        let CodingScratch { patches, codes, solver } = scratch;
        let dim = self.grid.dim();
        patches.resize(templates.len() * dim, 0.0);
        codes.resize(templates.len(), Code::default());
        self.grid.cut_each(templates, location, patches);
        let (dictionary, params) = (&self.dictionary, &self.params.codes);
        batched::solve(dictionary, &self.locations[location], patches, params, solver, codes);
        self.score(location, patches, codes, out);
    }

    /// Codes the patches of one template at all locations, and calls `each` with the code and the
    /// feature of one after the other: what [`Self::code_block`] gives for a block of one.
    pub fn code_everywhere(
        &self,
        template: &[f32],
        scratch: &mut CodingScratch,
        mut each: impl FnMut(Code, Feature),
    ) {
        let CodingScratch { patches, codes, solver } = scratch;
        let (dim, count) = (self.grid.dim(), self.grid.locations());
        patches.resize(count * dim, 0.0);
        codes.resize(count, Code::default());
        for (location, patch) in patches.chunks_exact_mut(dim).enumerate() {
            self.grid.cut(template, location, patch);
        }
        let (dictionary, params) = (&self.dictionary, &self.params.codes);
        batched::solve_each(dictionary, &self.shared, patches, params, solver, codes);
        for (location, (patch, code)) in patches.chunks_exact(dim).zip(&*codes).enumerate() {
            let (codes, mut scores) = (std::slice::from_ref(code), [Default::default()]);
            self.score(location, patch, codes, &mut scores);
            let [(code, feature)] = scores;
            each(code, feature);
        }
    }

    /// Computes features from codes.
    fn score(&self, location: usize, patches: &[f32], codes: &[Code], out: &mut [(Code, Feature)]) {
        let dictionary = &self.dictionary;
        dispatch!(Instructions::default(), |_| {
            let coded = codes.iter().zip(patches.chunks_exact(dictionary.dim()));
            for (out, (&code, patch)) in out.iter_mut().zip(coded) {
                let share = own_share(&code, location, dictionary.locations());
                let error = masked_error(dictionary, patch, &code, location);
                *out = (code, Feature { share, error });
            }
        });
    }
}

impl PatchScores {
    /// Resizes the buffers for this many candidates and locations.
    pub fn begin(&mut self, candidates: usize, locations: usize) {
        self.candidates = candidates;
        self.codes.resize(candidates * locations, Code::default());
        self.features.resize(candidates * locations, Feature::default());
    }

    /// Stores the codes and features of these candidates at one location.
    pub fn store(&mut self, location: usize, which: &[u32], scores: &[(Code, Feature)]) {
        for (&k, &(code, feature)) in which.iter().zip(scores) {
            let index = location * self.candidates + k as usize;
            (self.codes[index], self.features[index]) = (code, feature);
        }
    }

    /// One candidate's feature at one location.
    pub fn feature(&self, candidate: usize, location: usize) -> Feature {
        self.features[location * self.candidates + candidate]
    }

    /// The features of one candidate, in the order of locations.
    pub fn features(&self, candidate: usize) -> impl Iterator<Item = Feature> + Clone {
        self.features.iter().skip(candidate).step_by(self.candidates.max(1)).copied()
    }

    /// The codes of one candidate, in the order of locations.
    pub fn codes(&self, candidate: usize) -> impl Iterator<Item = &Code> {
        self.codes.iter().skip(candidate).step_by(self.candidates.max(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vision::patches::normalise;

    /// Whether products are kept or made anew decides about time and memory only.
    #[test]
    fn codes_are_the_same_whether_products_are_kept_or_not() {
        let template = |seed: usize| {
            let sample = |k: usize| (k * (7919 + 13 * seed) % 251) as f32 / 500.0 + 1.0;
            let mut template: Vec<f32> = (0..32 * 32).map(sample).collect();
            normalise(&mut template);
            template
        };
        let [templates, buffer] = [0..6, 2..6].map(|seeds| seeds.map(template).collect::<Vec<_>>());
        let (grid, candidate) = (PatchGrid::new(32, 16, 8, false), template(9));
        let [kept, not] = [true, false].map(|keeps_products| {
            let codes = CodeParams { atoms: 4, min_residual: 1e-6 };
            let (beta, position_weights) = (0.8, true);
            let params = ScaleParams { codes, beta, position_weights, keeps_products };
            Scale::new(grid, params, &templates, &buffer)
        });
        let mut scratch = CodingScratch::default();
        for scale in [&kept, &not] {
            let mut everywhere = Vec::new();
            let each = |code, feature| everywhere.push((code, feature));
            scale.code_everywhere(&candidate, &mut scratch, each);
            assert_eq!(everywhere.len(), 9);
            for (location, one) in everywhere.iter().enumerate() {
                let mut out = [Default::default()];
                let candidates = std::iter::once(&*candidate);
                kept.code_block(location, candidates, &mut scratch, &mut out);
                assert_eq!(out[0], *one, "location {location}");
            }
        }
    }
}
