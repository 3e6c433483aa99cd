//! The fast solver: it codes all candidates of a location together and chooses the same atoms as
//! the definition in `tests/solvers/definition.rs`.
//!
//! # How it is fast
//! - Candidates are correlated with the atoms as differences from a *reference*, the newest shared
//!   column. The correlations of these differences with all atoms are one matrix product, and each
//!   part of it is screened as soon as it has been computed.
//! - Chosen atoms form a tree. Candidates with the same atoms so far are at the same *node*.
//!   Everything that follows from these atoms alone (the residuals of the atoms and of the shared
//!   columns) is computed once per node. The root of a location, where no atom has been chosen yet,
//!   is kept from frame to frame until the dictionary or the buffer changes.
//! - No step reads the samples of all atoms again. With the orthonormal basis `q_1 .. q_t` of the
//!   chosen atoms, `w_t = D^T q_t` follows from a row of the Gram matrix and the earlier `w`. Each
//!   residual correlation follows from the previous one: `y <- y - p w_t`, `p = q_t^T r`.
//! - A step passes over the atoms once, in tiles of about 64. The node's part of a tile is
//!   computed, and all candidates at the node use it while it is in registers. For each candidate,
//!   a tile is searched for atoms whose score could exceed the lower bound on the best score. The
//!   first tile is that of a guess: the atom that the previous candidates chose.
//!
//! # Why it is exact
//! All of this only *screens*, in `f32`. If the bounds below leave only one atom that can have the
//! largest score, that atom is chosen. Otherwise the remaining atoms are computed in `f64` from
//! their samples, which decides eligibility and ties. So the chosen atom can differ from that of
//! the definition only where two scores agree to the last digits of `f64`. Write `u = 2^-24`, mark
//! values of the screen with a hat, and let atoms and signals have norm 1 at most (up to rounding).
//! For an atom with true residual correlations `x_c`, `|x_c - ^x_c| <= e_c`, and `l <= ||d_res||^2
//! <= l + g`, any `0 < s <= 1` gives
//!
//! ```text
//! score = sum x_c^2 / ||d_res||^2  <=  ((1 + s) sum ^x_c^2 + (1/s + 1) sum e_c^2) / l
//!                                  >=  ((1 - s) sum ^x_c^2 - (1/s - 1) sum e_c^2) / (l + g)
//! ```
//!
//! from `2 |^x| e <= s ^x^2 + e^2 / s`. An atom whose upper bound is below the lower bound of
//! another atom cannot be chosen; where `l <= 0` there is no upper bound. An atom is certainly
//! eligible if `l` is at least the required residual, and certainly not eligible if `l + g` is
//! less; in between it is computed in `f64`. An atom that repeats an earlier one bit for bit is
//! never chosen. The relative rounding errors of the sums, less than `64 u`, are added to `s`.
//!
//! Patches with little texture differ little: their inner products are all near 1, and rounding
//! errors would hide the differences between them. So the screen stores such numbers minus 1: `G' =
//! G - 1` of the Gram matrix, at the root `y' = y - 1` and `l' = ||d||^2 - 1`, and at a first node
//! `w' = w_1 - 1`. With `n = ||d_t,res||` and `a_s = q_s^T d_t`
//!
//! ```text
//! w'  = G' / n + (1 / n - 1)
//! w_t = (G' + (1 - a_1) - a_1 w' - sum_1<s<t a_s w_s) / n
//! y   = y' - p w' + (1 - p)    at a first node, y <- y - p w_t further below
//! l   = l' - w' (2 + w')       at a first node, l <- l - w_t^2 further below
//! ```
//!
//! where `1 / n - 1`, `1 - a_1` and `1 - p` are computed in `f64`. Let `k` be an upper bound of
//! `|G'|` over all nonzero atoms and `c` one of `|y'|` (larger by `||r - b||` for a candidate). Let
//! `m_1 = k / n + |1 / n - 1|`, let `M^2` be an upper bound of `||d_res||^2` after the first node,
//! `m_t = M + o_t`, and `S = k + |1 - a_1| + sum_s<t |a_s| m_s`. The errors are at most:
//!
//! ```text
//! w'                 o_1 = 5u m_1
//! w_t                o_t = (u k + u |1 - a_1| + sum_s<t |a_s| (o_s + 2u m_s) + t u S) / n + 3u M
//! shared column      u c at the root, which is computed in f64, and 2u more where 1 is added to score there
//!                    e <- e + |p| (o_1 + 2u m_1) + 2u (c + |p| m_1 + |1 - p|)   at a first node
//!                    e <- e + |p| (o_t + 2u m_t) + u m_t   further below, as |y| <= ||d_res||
//! candidate          as a shared column; at the root (dim + 2) u ||r - b|| for the difference and the matrix
//!                    product, in any order, and 2u (c + ||r - b||) for the reference and for adding it
//! l                  l' - w' (2 + w') - R at a first node,
//!                    with R = o_1 (2 + 2 m_1) + 4u m_1 (2 + m_1) + 2u k
//!                    l <- l - |w| (|w| + 2 o_t) - o_t^2 - 5u m_t^2
//!                    further below, since w_t^2 <= (|w| + o_t)^2
//! g                  2R, and g <- g + 4 o_t m_t + 10u m_t^2
//!                    since (|w| + o_t)^2 - w_t^2 <= 4 o_t max(|w|, o_t)
//! ```
//!
//! where `w` is the screen's value in the bounds of `l` and `g` further below. At the root, `g` is
//! 8u, and `l` is `l' + 1 - 4u`. Each bound is increased by one hundredth for products of errors.
//! Every line counts one rounding for each operation, fused or not, so the bounds hold on any
//! processor. The less the patches differ, the tighter the bounds.

use super::errors::{ADD_ONE_ERROR, Margins};
use super::exact::{AtomCache, Choice, ExactAtoms, code, eligible};
use super::location::DictionaryPanels;
pub use super::location::Location;
use super::node::{Node, Path};
use super::product::correlate;
use super::rows::{Atoms, Gram, Rows};
use super::screen::{Residuals, Screen, StepCandidate};
use super::vectors::{TILE, project_out, tile_index, tiles, tiles_mut, widen};
use crate::numeric::aligned::AlignedVec;
use crate::numeric::dot_wide;
use crate::numeric::instructions::{Instructions, dispatch, vectorise};
use crate::patch_model::sparse::codes::{Code, CodeParams, MAX_ATOMS, final_energy};
use crate::patch_model::sparse::dictionary::Dictionary;
use pulp::Simd;
use std::mem;
use std::ops::Range;

/// Candidates that are solved together, so that their rows stay in the second-level cache. A
/// multiple of six, and at most the number of bits in a `u64`.
pub const BLOCK: usize = 60;

/// Locations of a candidate that share a matrix product. A multiple of six; their rows stay in the
/// second-level cache.
const GROUP: usize = 24;

/// Stands for "no atom"; greater than any index of an atom.
const NONE: u32 = u32::MAX;

/// The working memory of [`solve`]. Reuse it: once its buffers have grown, no call allocates.
#[derive(Debug, Default)]
pub struct SolverScratch {
    instructions: Instructions,
    made: DictionaryPanels,
    location: Location,
    /// For the candidates of a block: their differences from the reference, and their own
    /// correlations with all atoms.
    differences: Vec<f32>,
    correlations: AlignedVec,
    /// For the candidates of a group: the correlations of their differences with all atoms.
    products: AlignedVec,
    /// The residual of each candidate.
    residuals: Vec<f64>,
    candidates: Vec<Candidate>,
    /// The candidates in the order of the tree: the atom that each chose last, and the candidate's
    /// row.
    order: Vec<(u32, u32)>,
    /// The nodes from the root's child down to the current one.
    nodes: Vec<Node>,
    rows: Vec<Rows>,
    branches: Vec<Branch>,
    screen: Screen,
    /// For each depth, the atom chosen last minus the index of its location. At the next location
    /// the atom next to it is the likely choice.
    guesses: [usize; MAX_ATOMS],
    wide: Vec<f64>,
    cache: AtomCache,
}

/// A candidate while its atoms are being chosen.
#[derive(Debug, Default, Clone)]
struct Candidate {
    /// Error bound of its correlations, and an upper bound of `|y'|` at the root.
    error: f64,
    spread: f64,
    /// The energy of its residual, and the energy at which the code is complete.
    energy: f64,
    final_energy: f64,
    /// `p` for each chosen atom.
    projections: [f64; MAX_ATOMS],
    /// The last atom of a code of full length.
    last: Choice,
}

impl Candidate {
    /// Adds the error that the newest node, at this depth, contributes to the correlations.
    #[inline(always)]
    fn add_error(&mut self, depth: usize, margins: &Margins) {
        self.error += margins.projection_error(self.projections[depth - 1], self.spread);
    }

    /// The state of this candidate for a step at a node with this energy.
    #[inline(always)]
    fn in_step(
        &self,
        (row, depth): (usize, usize),
        node_energy: f64,
        margins: &Margins,
    ) -> StepCandidate {
        let (projection, offset, error) = match depth {
            0 => (0.0, 1.0, self.error + ADD_ONE_ERROR),
            1 => (self.projections[0], 1.0 - self.projections[0], self.error),
            _ => (self.projections[depth - 1], 0.0, self.error),
        };
        // The next atom explains some share of the residual energy. The bounds need only the
        // score's order of magnitude.
        let score = 0.3 * (node_energy + self.energy);
        StepCandidate::new(row, (projection, offset), score, margins.squared + error * error)
    }
}

/// Candidates that chose the same atom at the same node, as a range of [`SolverScratch::order`].
#[derive(Debug)]
struct Branch {
    /// Number of atoms chosen so far, including this one.
    depth: usize,
    atom: usize,
    members: Range<usize>,
}

/// Codes every candidate (rows of `dim` samples) jointly with the location's shared columns, one
/// code per candidate. The location must have been filled for this dictionary, which keeps its
/// products, and these parameters.
pub fn solve(
    dictionary: &Dictionary,
    location: &Location,
    candidates: &[f32],
    params: &CodeParams,
    scratch: &mut SolverScratch,
    codes: &mut [Code],
) {
    // Without atoms every code is empty, and the root cannot be filled.
    let Some(kept) = dictionary.products().filter(|_| !dictionary.is_empty()) else {
        codes.fill(Code::default());
        return;
    };
    let atoms = Atoms { dictionary, panels: &kept.panels, gram: Gram::Kept(&kept.gram) };
    let problem = Problem { atoms, location, params };
    let blocks = candidates.chunks(BLOCK * dictionary.dim()).zip(codes.chunks_mut(BLOCK));
    for (block, codes) in blocks {
        scratch.solve_block(problem, block, codes);
    }
}

/// Codes one candidate at each location (rows of `dim` samples, one for each location), jointly
/// with the location's shared columns: `shared` has as many rows for each location, one location
/// after the other. The codes are those of [`solve`] for each location, but some locations share
/// one matrix product, which reads the dictionary once for all of them.
pub fn solve_each(
    dictionary: &Dictionary,
    shared: &[f32],
    candidates: &[f32],
    params: &CodeParams,
    scratch: &mut SolverScratch,
    codes: &mut [Code],
) {
    if dictionary.is_empty() || codes.is_empty() {
        codes.fill(Code::default());
        return;
    }
    let mut made = mem::take(&mut scratch.made);
    made.fill(dictionary);
    let atoms =
        Atoms { dictionary, panels: &made.panels, gram: Gram::DictionaryPanels(&made.wide) };
    let columns = shared.len() / codes.len();
    let groups = candidates.chunks(GROUP * dictionary.dim()).zip(codes.chunks_mut(GROUP));
    for (number, (candidates, codes)) in groups.enumerate() {
        let first = number * GROUP;
        let shared = &shared[first * columns..][..codes.len() * columns];
        scratch.solve_group((atoms, &made.wide), (first, shared), params, candidates, codes);
    }
    scratch.made = made;
}

impl SolverScratch {
    /// Working memory of a solver that uses these instructions, whatever the environment variable
    /// says.
    #[cfg(feature = "internals")]
    pub fn with(instructions: Instructions) -> Self {
        Self { instructions, ..Self::default() }
    }
}

/// The input shared by all candidates of a block.
#[derive(Debug, Clone, Copy)]
struct Problem<'a> {
    atoms: Atoms<'a>,
    location: &'a Location,
    params: &'a CodeParams,
}

impl SolverScratch {
    /// Codes a block.
    fn solve_block(&mut self, problem: Problem<'_>, block: &[f32], codes: &mut [Code]) {
        dispatch!(self.instructions, |simd| {
            self.begin(simd, problem, block, codes);
            self.descend(simd, problem, codes);
        });
    }

    /// Codes one candidate at some locations, the first of which has this index. `wide`: the
    /// dictionary's panels in `f64`.
    fn solve_group(
        &mut self,
        (atoms, wide): (Atoms<'_>, &[f64]),
        (first, shared): (usize, &[f32]),
        params: &CodeParams,
        candidates: &[f32],
        codes: &mut [Code],
    ) {
        dispatch!(self.instructions, |simd| {
            let (dim, count) = (atoms.dictionary.dim(), codes.len());
            let columns = shared.len() / count;
            self.correlate_group(simd, atoms, shared, candidates);
            let mut location = mem::take(&mut self.location);
            let each = candidates.chunks_exact(dim).zip(codes).enumerate();
            for (row, (patch, code)) in each {
                let shared = &shared[row * columns..][..columns];
                location.fill_with(simd, (atoms.dictionary, wide), (first + row, shared), params);
                let problem = Problem { atoms, location: &location, params };
                let code = std::slice::from_mut(code);
                self.begin(simd, problem, patch, code);
                self.take_correlations(simd, problem, (row, count));
                self.descend(simd, problem, code);
            }
            self.location = location;
        });
    }

    /// Puts all candidates of the block at the root, except those without energy to explain.
    #[inline(always)]
    fn begin<S: Simd>(&mut self, simd: S, problem: Problem<'_>, block: &[f32], codes: &mut [Code]) {
        let Problem { atoms: Atoms { dictionary, .. }, location, .. } = problem;
        let (dim, count) = (dictionary.dim(), block.len() / dictionary.dim());
        self.clear(dictionary);
        widen(&mut self.residuals, block);
        for (row, candidate) in block.chunks_exact(dim).enumerate() {
            self.differences.extend(candidate.iter().zip(&location.reference).map(|(r, b)| r - b));
            widen(&mut self.wide, &self.differences[row * dim..]);
            let distance = dot_wide(simd, &self.wide, &self.wide).sqrt();
            let wide = &self.residuals[row * dim..][..dim];
            let energy = dot_wide(simd, wide, wide);
            let (error, spread) = location.rows.candidate_bounds(dim, distance);
            let all = location.root.energy + energy;
            let final_energy = final_energy(all);
            self.candidates.push(Candidate {
                error,
                spread,
                energy,
                final_energy,
                ..Candidate::default()
            });
            if all > final_energy {
                self.order.push((NONE, row as u32));
            } else {
                codes[row] = Code::default();
            }
        }
        self.correlations.resize(count * dictionary.stride());
        self.nodes.resize_with(MAX_ATOMS, Node::default);
        self.rows.resize_with(MAX_ATOMS, Rows::default);
        if !self.order.is_empty() {
            self.branches.push(Branch { depth: 0, atom: 0, members: 0..self.order.len() });
        }
    }

    /// Clears the state of the previous block and reserves space for a full one, which may occur
    /// only after many frames.
    fn clear(&mut self, dictionary: &Dictionary) {
        let Self { differences, correlations, residuals, candidates, order, branches, .. } = self;
        let samples = BLOCK * dictionary.dim();
        differences.clear();
        differences.reserve_exact(samples);
        residuals.clear();
        residuals.reserve_exact(samples);
        correlations.reserve(BLOCK * dictionary.stride());
        candidates.clear();
        candidates.reserve_exact(BLOCK);
        order.clear();
        order.reserve_exact(BLOCK);
        branches.clear();
        branches.reserve_exact(BLOCK);
        self.screen.reserve(BLOCK, dictionary.len());
    }

    /// Correlates the difference of each location's candidate to its newest shared column, or to
    /// zeros if there is none, with all atoms.
    #[inline(always)]
    fn correlate_group<S: Simd>(
        &mut self,
        simd: S,
        Atoms { dictionary, panels, .. }: Atoms<'_>,
        shared: &[f32],
        candidates: &[f32],
    ) {
        let Self { differences, products, .. } = self;
        let dim = dictionary.dim();
        let count = candidates.len() / dim;
        differences.clear();
        differences.extend_from_slice(candidates);
        let columns = shared.chunks_exact((shared.len() / count).max(1));
        for (differences, columns) in differences.chunks_exact_mut(dim).zip(columns) {
            let newest = &columns[columns.len() - dim..];
            differences.iter_mut().zip(newest).for_each(|(r, b)| *r -= b);
        }
        products.resize(count * dictionary.stride());
        let (zero, products) = ([simd.splat_f32s(0.0); TILE], tiles_mut::<S>(products));
        for t in 0..dictionary.stride() / (TILE * S::F32_LANES) {
            correlate(simd, differences, (panels, dim), (t, &zero), products);
        }
    }

    /// Takes the only candidate's correlations from a row of the group's product.
    #[inline(always)]
    fn take_correlations<S: Simd>(
        &mut self,
        simd: S,
        problem: Problem<'_>,
        (row, rows): (usize, usize),
    ) {
        let (products, own) = (tiles::<S>(&self.products), tiles_mut::<S>(&mut self.correlations));
        for (t, own) in own.iter_mut().enumerate() {
            let newest = problem.location.rows.newest_column::<S>(t);
            let product = &products[tile_index::<S>(t, row, rows)];
            for i in 0..TILE {
                own[i] = simd.add_f32s(product[i], newest[i]);
            }
        }
        // Without differences, the root's tiles leave the correlations as they are.
        self.differences.clear();
    }

    /// Processes the branches of the tree until all codes are complete. Compiled once for both of
    /// its callers.
    #[inline(always)]
    fn descend<S: Simd>(&mut self, simd: S, problem: Problem<'_>, codes: &mut [Code]) {
        vectorise(
            simd,
            #[inline(always)]
            move || {
                while let Some(branch) = self.branches.pop() {
                    let branch = match branch.depth {
                        0 => branch,
                        _ => self.make_node(simd, problem, branch, codes),
                    };
                    self.choose(simd, problem, &branch);
                    self.split(problem, &branch, codes);
                }
            },
        );
    }

    /// Fills in the branch's node and projects its atom out of the members. Members whose codes are
    /// then complete leave the branch.
    #[inline(always)]
    fn make_node<S: Simd>(
        &mut self,
        simd: S,
        problem: Problem<'_>,
        branch: Branch,
        codes: &mut [Code],
    ) -> Branch {
        let Problem { atoms: Atoms { dictionary, .. }, location, .. } = problem;
        let (dim, depth) = (dictionary.dim(), branch.depth);
        let (above, node) = self.nodes.split_at_mut(depth - 1);
        let path = Path { root: &location.root, nodes: above };
        node[0].fill(simd, dictionary, path, branch.atom);
        let node = &self.nodes[depth - 1];
        let mut kept = branch.members.start;
        for position in branch.members.clone() {
            let row = self.order[position].1 as usize;
            let candidate = &mut self.candidates[row];
            let projection =
                project_out(simd, &mut self.residuals[row * dim..][..dim], &node.direction);
            candidate.projections[depth - 1] = projection;
            candidate.energy -= projection * projection;
            if node.energy + candidate.energy > candidate.final_energy {
                self.order.swap(kept, position);
                kept += 1;
            } else {
                codes[row] = code(&self.nodes[..depth], candidate.projections, None);
            }
        }
        Branch { members: branch.members.start..kept, ..branch }
    }

    /// Chooses each member's next atom and sorts the members by it.
    #[inline(always)]
    fn choose<S: Simd>(&mut self, simd: S, problem: Problem<'_>, branch: &Branch) {
        let Problem { atoms, location, params } = problem;
        let dictionary = atoms.dictionary;
        let Self { candidates, order, rows, screen, guesses, differences, .. } = self;
        let path = Path { root: &location.root, nodes: &self.nodes[..branch.depth] };
        let eligible = eligible(params);
        self.cache.begin(dictionary.len());
        let (wide, cache) = (&mut self.wide, &mut self.cache);
        let mut exact = ExactAtoms { dictionary, path, params, eligible, wide, cache };
        let residuals = Residuals { all: &self.residuals, dim: dictionary.dim() };
        let inputs = (residuals, &mut *self.correlations);
        let energy = path.end().energy;
        let count = dictionary.len();
        let last = &mut guesses[branch.depth];
        let guess = (*last + location.number) % count;
        let members = branch.members.clone().map(|position| order[position].1 as usize);
        let at = (branch.depth, energy);
        if branch.depth == 0 {
            let margins = location.rows.root_margins();
            screen.begin(step_candidates(candidates, members, at, &margins));
            let mut tiles = location.rows.root_tiles::<S>(atoms, differences);
            screen.run(simd, &mut tiles, (guess, margins.gap), inputs, &mut exact);
        } else {
            let (above, newest) = rows.split_at_mut(branch.depth - 1);
            let (newest, above) = (&mut newest[0], (&location.rows, &*above));
            if branch.depth == 1 {
                let (mut tiles, margins) =
                    newest.child_tiles::<S, true>(simd, atoms, path, above, params);
                screen.begin(step_candidates(candidates, members, at, &margins));
                screen.run(simd, &mut tiles, (guess, margins.gap), inputs, &mut exact);
            } else {
                let (mut tiles, margins) =
                    newest.child_tiles::<S, false>(simd, atoms, path, above, params);
                screen.begin(step_candidates(candidates, members, at, &margins));
                screen.run(simd, &mut tiles, (guess, margins.gap), inputs, &mut exact);
            }
            // If patches have little texture, the first atom leaves small residuals of the others.
            if branch.depth == 1 && params.atoms > 2 {
                newest.tighten_max_residual(simd);
            }
        }
        let mut position = branch.members.start;
        screen.finish(simd, residuals, &mut exact, |row, atom| {
            order[position] = (atom.map_or(NONE, |atom| atom as u32), row as u32);
            *last = atom.map_or(*last, |atom| (atom + count - location.number % count) % count);
            position += 1;
        });
        let members = &mut order[branch.members.clone()];
        if branch.depth + 1 == params.atoms {
            set_last_atoms(simd, candidates, members, residuals, &mut exact);
        }
        members.sort_unstable();
    }

    /// Makes one branch per atom that members chose. Members without a further atom, or with the
    /// last one, are complete.
    #[inline(always)]
    fn split(&mut self, problem: Problem<'_>, branch: &Branch, codes: &mut [Code]) {
        let (depth, end) = (branch.depth + 1, branch.members.end);
        let mut start = branch.members.start;
        while start < end {
            let atom = self.order[start].0;
            let same = self.order[start..end].iter().take_while(|member| member.0 == atom).count();
            let members = start..start + same;
            start = members.end;
            if atom != NONE && depth < problem.params.atoms {
                self.branches.push(Branch { depth, atom: atom as usize, members });
                continue;
            }
            for &(_, row) in &self.order[members] {
                let candidate = &self.candidates[row as usize];
                let last = (atom != NONE).then_some(&candidate.last);
                codes[row as usize] =
                    code(&self.nodes[..branch.depth], candidate.projections, last);
            }
        }
    }
}

/// The states of these candidates for a step at a node of this depth and energy.
#[inline(always)]
fn step_candidates(
    candidates: &mut [Candidate],
    members: impl Iterator<Item = usize>,
    (depth, energy): (usize, f64),
    margins: &Margins,
) -> impl Iterator<Item = StepCandidate> {
    members.map(move |row| {
        let candidate = &mut candidates[row];
        if depth > 0 {
            candidate.add_error(depth, margins);
        }
        candidate.in_step((row, depth), energy, margins)
    })
}

/// Stores the last atom of codes of full length in these members.
#[inline(always)]
fn set_last_atoms<S: Simd>(
    simd: S,
    candidates: &mut [Candidate],
    members: &[(u32, u32)],
    residuals: Residuals<'_>,
    exact: &mut ExactAtoms<'_>,
) {
    for &(atom, row) in members {
        let last = if atom == NONE {
            None
        } else {
            exact.choice_without_score(simd, atom as usize, residuals.row(row as usize))
        };
        candidates[row as usize].last = last.unwrap_or_default();
    }
}
