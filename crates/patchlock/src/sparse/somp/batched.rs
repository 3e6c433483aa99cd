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
//! All of this runs in `f32` and only *screens*. Each step takes the atom that looks best, computes its score in
//! `f64` from the samples, and then computes in `f64` every atom whose score could reach that. Write `u = 2^-24`, `x` for the true
//! correlation of a residual column with an atom, `n` for the true `||d_res||^2`, `w` for the true entry of `w_k`. The screen keeps
//!
//! - `y` with `|y - x| <= e` (up to a relative rounding) for each column, and
//! - `l <= n`, a lower bound,
//!
//! so that with any `t > 0`, from `2 |y| e <= t y^2 + e^2 / t`,
//!
//! ```text
//! sum x^2 <= (1 + t) sum y^2 + (1 + 1/t) sum e^2,        score <= that / l        (l <= 0: no bound, the atom is computed).
//! ```
//!
//! The errors come from: the product of candidates and atoms, at most `dim u` for vectors of norm 1 in any order of summation; each Gram
//! entry, rounded once, `u`; the prefix, computed in `f64` and rounded once, relative `u`; and at step `k`
//!
//! ```text
//! w_k = (G_s - sum_j w_j w_j(s)) / ||d_s,res||      error e_k <= ((2k + 4) u + sum_j |w_j(s)| e_j) / ||d_s,res||
//! y  <- y - w_k p                                    error e   <- e + |p| (e_k + 4u)            (p = q_k^T r)
//! l  <- l - (1 + t) w_k^2 - (1 + 1/t) e_k^2
//! ```
//!
//! The relative roundings, less than `64 u` in all, are covered by taking `2 t` for `t` where the bounds are used. Eligibility
//! and ties are decided in `f64`. So an atom can only differ from the definition's where two scores agree to the last digits of `f64`.

use super::prefix::{Prefix, Shared};
use super::pursuit::Pursuit;
use super::screen::{Bound, U, best_exactly, dot, screen};
use crate::sparse::codes::{Code, CodeRules};
use crate::sparse::dictionary::Dictionary;
use pulp::Arch;

/// Candidates whose correlations are computed together: their rows, with a prefix or two, fit the second cache.
const BLOCK: usize = 64;

/// Stands for "no atom" and "no prefix yet".
const NONE: u32 = u32::MAX;

/// What [`solve`] needs besides its input; keep it and no call allocates once it has grown.
#[derive(Debug, Default)]
pub struct Scratch {
    /// Correlations of a block's candidates with all atoms.
    correlations: Vec<f32>,
    shared: Shared,
    prefixes: Vec<Prefix>,
    used_prefixes: usize,
    prefix_of_atom: Vec<u32>,
    /// First atom and row of each candidate of the block.
    order: Vec<(u32, u32)>,
    squares: Vec<f32>,
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
    arch.dispatch(|| scratch.shared.fill(dictionary, shared, rules));
    for (block, codes) in candidates.chunks(BLOCK * dim).zip(codes.chunks_mut(BLOCK)) {
        correlate(block, dictionary, &mut scratch.correlations);
        arch.dispatch(|| scratch.first_atoms(dictionary, block, rules));
        for k in 0..scratch.order.len() {
            let (first, row) = scratch.order[k];
            let candidate = &block[row as usize * dim..][..dim];
            codes[row as usize] = match first {
                NONE => Code::default(),
                _ => scratch.finish(
                    dictionary,
                    candidate,
                    (first as usize, row as usize),
                    rules,
                    arch,
                ),
            };
        }
    }
}

impl Scratch {
    /// Finds each candidate's first atom and orders the block by it, so that a prefix is used while it is in the cache.
    #[inline(always)]
    fn first_atoms(&mut self, dictionary: &Dictionary, block: &[f32], rules: &CodeRules) {
        let (dim, stride) = (dictionary.dim(), dictionary.stride());
        let shared = &self.shared;
        let bound = Bound::new((dim as f64 * U).powi(2), rules.selection);
        self.squares.resize(stride, 0.0);
        self.order.clear();
        for (row, candidate) in block.chunks_exact(dim).enumerate() {
            let energy = shared.energy + dot(candidate, candidate);
            let mut first = None;
            if energy > rules.final_energy(shared.count() + 1, energy) {
                let own = &self.correlations[row * stride..][..stride];
                self.squares.copy_from_slice(&shared.squares_rounded);
                let look = screen(&mut self.squares, own, &shared.left, rules.selection);
                first = best_exactly(look, &self.squares, &shared.left, &bound, |k| {
                    let squares = shared.squares[k] + dot(dictionary.atom(k), candidate).powi(2);
                    let left = dictionary.squared_norm(k);
                    (left >= rules.min_residual).then_some((squares, left))
                });
            }
            self.order.push((first.map_or(NONE, |k| k as u32), row as u32));
        }
        self.order.sort_unstable();
    }

    /// Takes the candidate of row `row` from its first atom to its code.
    fn finish(
        &mut self,
        dictionary: &Dictionary,
        candidate: &[f32],
        (first, row): (usize, usize),
        rules: &CodeRules,
        arch: Arch,
    ) -> Code {
        let index = self.prefix(dictionary, first, rules, arch);
        let correlations = &self.correlations[row * dictionary.stride()..][..dictionary.stride()];
        let (prefix, pursuit) = (&self.prefixes[index], &mut self.pursuit);
        arch.dispatch(|| {
            pursuit.begin(dictionary, prefix, candidate);
            pursuit.run(dictionary, prefix, correlations, rules)
        })
    }

    /// The index of this atom's prefix, which is made where it is new.
    fn prefix(
        &mut self,
        dictionary: &Dictionary,
        atom: usize,
        rules: &CodeRules,
        arch: Arch,
    ) -> usize {
        if self.prefix_of_atom[atom] == NONE {
            if self.prefixes.len() == self.used_prefixes {
                self.prefixes.push(Prefix::default());
            }
            let (prefix, shared) = (&mut self.prefixes[self.used_prefixes], &self.shared);
            arch.dispatch(|| prefix.fill(dictionary, shared, atom, rules));
            self.prefix_of_atom[atom] = self.used_prefixes as u32;
            self.used_prefixes += 1;
        }
        self.prefix_of_atom[atom] as usize
    }
}

/// `out` (rows of `stride`) = candidates (rows of `dim`) times atoms.
#[allow(unsafe_code)]
fn correlate(candidates: &[f32], dictionary: &Dictionary, out: &mut [f32]) {
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
            0.0,
            out.as_mut_ptr(),
            stride_step,
            1,
        );
    }
}
