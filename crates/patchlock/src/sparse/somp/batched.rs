//! The fast solver: all candidates of a location together, the same atoms as [`definition`](super::definition).
//!
//! # How it is fast
//! - The correlations of all candidates with all atoms are one matrix product.
//! - What the shared columns need (their correlations and energies) is computed once for the location; what follows from the first
//!   atom (the dictionary, the shared columns and the norms with it projected out) once for each first atom that occurs: a
//!   *prefix*, of which a frame of the paper's has about a dozen a location.
//! - Later steps never touch the samples of the atoms: with the orthonormal basis `q_1 .. q_k` of the chosen atoms, `w_j = D^T q_j`
//!   follows from a row of the Gram matrix, and the residual's correlations from `w_j`.
//!
//! # Why it is exact
//! All of this only *screens*, in `f32`. Each step takes the atom that looks best, computes its score in
//! `f64` from the samples, and then computes in `f64` every atom whose score could reach that. Write `u = 2^-24`, `x` for the true
//! correlation of a residual column with an atom, `n` for the true `||d_res||^2`. The screen keeps
//!
//! - `y` with `|y - x| <= e`, up to a relative rounding, for each column, and
//! - `l <= n`, a lower bound,
//!
//! so that with any `t > 0`, from `2 |y| e <= t y^2 + e^2 / t`,
//!
//! ```text
//! sum x^2 <= (1 + t) sum y^2 + (1 + 1/t) sum e^2,        score <= that / l        (l <= 0: no bound, the atom is computed).
//! ```
//!
//! The errors: candidates are correlated as their difference to a shared column `b`, whose own correlations are known in `f64`; the product
//! errs by at most `(dim + 2) u ||r - b||` in any order of summation, and adding `b`'s part rounds by `2u`. The prefix and all `w_k` are
//! computed in `f64` (the Gram matrix is kept in it) and rounded once, so a step
//!
//! ```text
//! y <- y - w_k p        (p = q_k^T r)        adds at most  3u |p|  to e, besides a relative rounding of y,
//! l <- l - w_k^2                             and this is kept below n by taking off 8u of l as well.
//! ```
//!
//! The relative roundings, less than `64 u` in all, are covered by taking `2 t` for `t` where the bound is used. Eligibility
//! and ties are decided in `f64`. So an atom can only differ from the definition's where two scores agree to the last digits of `f64`.

use super::prefix::{Prefix, Shared};
use super::pursuit::Pursuit;
use super::screen::{Bound, Exact, Screened, Step, U, dot};
use crate::sparse::codes::{Code, CodeRules};
use crate::sparse::dictionary::Dictionary;
use pulp::{Arch, Simd, WithSimd};

/// Candidates whose correlations are computed together: their rows, with a prefix or two, fit the second cache.
const BLOCK: usize = 64;

/// Stands for "no atom" and "no prefix yet".
const NONE: u32 = u32::MAX;

/// What [`solve`] needs besides its input; keep it and no call allocates once it has grown.
#[derive(Debug, Default)]
pub struct Scratch {
    /// Of a block's candidates: their differences to the reference, the norms of these, and their correlations with all atoms.
    differences: Vec<f32>,
    distances: Vec<f64>,
    correlations: Vec<f32>,
    shared: Shared,
    prefixes: Vec<Prefix>,
    used_prefixes: usize,
    prefix_of_atom: Vec<u32>,
    /// First atom and row of each candidate of the block.
    order: Vec<(u32, u32)>,
    screened: Screened,
    pursuit: Pursuit,
}

/// Codes every candidate (rows of `dim` samples) jointly with the `shared` signals of the location, one code a candidate.
pub fn solve(
    dictionary: &Dictionary,
    shared: &[f32],
    candidates: &[f32],
    rules: &CodeRules,
    scratch: &mut Scratch,
    codes: &mut [Code],
) {
    let arch = Arch::new();
    let (dim, stride) = (dictionary.dim(), dictionary.stride());
    scratch.used_prefixes = 0;
    scratch.prefix_of_atom.clear();
    scratch.prefix_of_atom.resize(dictionary.len(), NONE);
    scratch.correlations.resize(BLOCK * stride, 0.0);
    arch.dispatch(FillShared { scratch, dictionary, shared, rules });
    for (block, codes) in candidates.chunks(BLOCK * dim).zip(codes.chunks_mut(BLOCK)) {
        scratch.subtract_reference(dim, block);
        for row in scratch.correlations.chunks_exact_mut(stride).take(block.len() / dim) {
            row.copy_from_slice(&scratch.shared.reference_row);
        }
        add_correlations(&scratch.differences, dictionary, &mut scratch.correlations);
        arch.dispatch(SolveBlock { scratch, dictionary, block, rules, codes });
    }
}

/// [`Shared::fill`] for the processor at hand. (A closure would not do: only what is always inlined is compiled for it.)
struct FillShared<'a> {
    scratch: &'a mut Scratch,
    dictionary: &'a Dictionary,
    shared: &'a [f32],
    rules: &'a CodeRules,
}

impl WithSimd for FillShared<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.scratch.shared.fill(self.dictionary, self.shared, self.rules);
    }
}

/// The codes of a block, from its correlations, for the processor at hand.
struct SolveBlock<'a> {
    scratch: &'a mut Scratch,
    dictionary: &'a Dictionary,
    block: &'a [f32],
    rules: &'a CodeRules,
    codes: &'a mut [Code],
}

impl WithSimd for SolveBlock<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { scratch, dictionary, block, rules, codes } = self;
        let dim = dictionary.dim();
        scratch.first_atoms(simd, dictionary, block, rules);
        for k in 0..scratch.order.len() {
            let (first, row) = (scratch.order[k].0, scratch.order[k].1 as usize);
            let candidate = &block[row * dim..][..dim];
            codes[row] = match first {
                NONE => Code::default(),
                _ => scratch.finish(simd, dictionary, candidate, (first as usize, row), rules),
            };
        }
    }
}

impl Scratch {
    /// The candidates' differences to the reference, and their norms.
    fn subtract_reference(&mut self, dim: usize, block: &[f32]) {
        let reference = &self.shared.reference;
        self.differences.clear();
        self.distances.clear();
        for candidate in block.chunks_exact(dim) {
            self.differences.extend(candidate.iter().zip(reference).map(|(r, b)| r - b));
            let difference = &self.differences[self.differences.len() - dim..];
            self.distances.push(dot(difference, difference).sqrt());
        }
    }

    /// The error bound of the correlations of a row.
    fn error(&self, dim: usize, row: usize) -> f64 {
        (dim + 2) as f64 * U * self.distances[row] + 2.0 * U
    }

    /// Finds each candidate's first atom and orders the block by it, so that a prefix is used while it is in the cache.
    #[inline(always)]
    fn first_atoms<S: Simd>(
        &mut self,
        simd: S,
        dictionary: &Dictionary,
        block: &[f32],
        rules: &CodeRules,
    ) {
        let (dim, stride) = (dictionary.dim(), dictionary.stride());
        self.order.clear();
        for (row, candidate) in block.chunks_exact(dim).enumerate() {
            let shared = &self.shared;
            let energy = shared.energy + dot(candidate, candidate);
            let mut first = None;
            if energy > rules.final_energy(shared.count() + 1, energy) {
                let bound = Bound::new(self.error(dim, row).powi(2), rules.selection);
                let step = Step {
                    own: &self.correlations[row * stride..][..stride],
                    first: None,
                    weights: &[],
                    along: &[],
                    columns: &[],
                    columns_along: &[],
                    columns_squared: &shared.squares_rounded,
                    left: &shared.left,
                };
                step.screen(simd, &bound, &mut self.screened);
                let exact =
                    First { dictionary, shared, candidate, min_residual: rules.min_residual };
                first = self.screened.best_exactly(simd, &bound, &exact);
            }
            self.order.push((first.map_or(NONE, |k| k as u32), row as u32));
        }
        self.order.sort_unstable();
    }

    /// Takes the candidate of row `row` from its first atom to its code.
    #[inline(always)]
    fn finish<S: Simd>(
        &mut self,
        simd: S,
        dictionary: &Dictionary,
        candidate: &[f32],
        (first, row): (usize, usize),
        rules: &CodeRules,
    ) -> Code {
        let index = self.prefix(dictionary, first, rules);
        let error = self.error(dictionary.dim(), row);
        let correlations = &self.correlations[row * dictionary.stride()..][..dictionary.stride()];
        let (prefix, pursuit) = (&self.prefixes[index], &mut self.pursuit);
        pursuit.begin(dictionary, prefix, candidate, error);
        pursuit.run(simd, dictionary, prefix, correlations, rules)
    }

    /// The index of this atom's prefix, which is made where it is new.
    #[inline(always)]
    fn prefix(&mut self, dictionary: &Dictionary, atom: usize, rules: &CodeRules) -> usize {
        if self.prefix_of_atom[atom] == NONE {
            if self.prefixes.len() == self.used_prefixes {
                self.prefixes.push(Prefix::default());
            }
            self.prefixes[self.used_prefixes].fill(dictionary, &self.shared, atom, rules);
            self.prefix_of_atom[atom] = self.used_prefixes as u32;
            self.used_prefixes += 1;
        }
        self.prefix_of_atom[atom] as usize
    }
}

/// The first step in `f64`: nothing is projected out yet.
struct First<'a> {
    dictionary: &'a Dictionary,
    shared: &'a Shared,
    candidate: &'a [f32],
    min_residual: f64,
}

impl Exact for First<'_> {
    #[inline(always)]
    fn squares_and_left(&self, k: usize) -> Option<(f64, f64)> {
        let left = self.dictionary.squared_norm(k);
        let squares = self.shared.squares[k] + dot(self.dictionary.atom(k), self.candidate).powi(2);
        (left >= self.min_residual).then_some((squares, left))
    }
}

/// Adds candidates (rows of `dim`) times atoms to `out` (rows of `stride`).
#[allow(unsafe_code)]
fn add_correlations(candidates: &[f32], dictionary: &Dictionary, out: &mut [f32]) {
    let (dim, stride) = (dictionary.dim(), dictionary.stride());
    let (rows, atoms) = (candidates.len() / dim, dictionary.transposed());
    assert!(out.len() >= rows * stride && atoms.len() == dim * stride);
    let (dim_step, stride_step) = (dim as isize, stride as isize);
    // SAFETY: `candidates` holds rows x dim, `atoms` dim x stride and `out` at least rows x stride values (the last two checked
    // above), all contiguous and row-major, which is what the strides say; `out` is borrowed mutably, so it overlaps neither.
    // Benefit: the library's only entry is a raw one; this product is most of the tracker's arithmetic.
    unsafe {
        matrixmultiply::sgemm(
            rows,
            dim,
            stride,
            1.0,
            candidates.as_ptr(),
            dim_step,
            1,
            atoms.as_ptr(),
            stride_step,
            1,
            1.0,
            out.as_mut_ptr(),
            stride_step,
            1,
        );
    }
}
