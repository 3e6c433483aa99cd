//! The fast solver: all candidates of a location together, the same atoms as [`definition`](super::definition).
//!
//! # How it is fast
//! - Candidates are correlated as their difference to a *reference*, the newest shared column; the correlations of these with all
//!   atoms are one matrix product, of which each part is screened as soon as it is made.
//! - Chosen atoms form a tree: candidates that chose the same atoms so far are at the same *node*, and what follows from these atoms alone
//!   (what is left of each atom and of the shared columns) is computed once for a node. The root of a location, where nothing is chosen,
//!   stays from frame to frame, as long as dictionary and buffer do.
//! - No step touches the samples of all atoms again: with the orthonormal basis `q_1 .. q_t` of the chosen atoms, `w_t = D^T q_t` follows
//!   from a row of the Gram matrix and the earlier `w`, and each correlation of what is left from that before: `y <- y - p w_t`,
//!   `p = q_t^T r`.
//! - A step goes over the atoms once, a tile of some 64 at a time: the node's part of the tile is made, and while it is in registers
//!   all candidates at the node use it. Each asks which atoms could beat what it is sure to reach, and begins with a guess: what the
//!   candidates before took.
//!
//! # Why it is exact
//! All of this only *screens*, in `f32`. Where the bounds below leave one atom that can win, it has won; otherwise those
//! that are left are computed in `f64` from their samples, and eligibility and ties are decided there. So an atom can only differ from the
//! definition's where two scores agree to the last digits of `f64`. Write `u = 2^-24`,
//! a hat for what the screen has, and let atoms and signals have norm 1 at most (up to rounding).
//! For an atom with true residual correlations `x_c`, `|x_c - ^x_c| <= e_c`, and `l <= ||d_res||^2 <= l + g`, any `0 < s <= 1` gives
//!
//! ```text
//! score = sum x_c^2 / ||d_res||^2  <=  ((1 + s) sum ^x_c^2 + (1/s + 1) sum e_c^2) / l
//!                                  >=  ((1 - s) sum ^x_c^2 - (1/s - 1) sum e_c^2) / (l + g)
//! ```
//!
//! from `2 |^x| e <= s ^x^2 + e^2 / s`. What the first leaves below the second of another atom can't win, and `l <= 0` leaves nothing below.
//! An atom is eligible for sure if `l` is at least what has to be left, and not if `l + g` is less; another one is computed. One that repeats an
//! earlier one bit for bit never wins. Relative roundings of the sums, less than `64 u`, are added to `s`.
//!
//! Patches with little texture differ little: their inner products are all near 1, and what tells them apart would drown in roundings.
//! So the screen has what numbers near 1 differ from it by: `G' = G - 1` of the Gram matrix, at the root `y' = y - 1` and `l' = ||d||^2 - 1`, and at a first node
//! `w' = w_1 - 1`. With `n = ||d_t,res||` and `a_s = q_s^T d_t`
//!
//! ```text
//! w'  = G' / n + (1 / n - 1)
//! w_t = (G' + (1 - a_1) - a_1 w' - sum_1<s<t a_s w_s) / n
//! y   = y' - p w' + (1 - p)    at a first node, y <- y - p w_t further below
//! l   = l' - w' (2 + w')       at a first node, l <- l - w_t^2 further below
//! ```
//!
//! where `1 / n - 1`, `1 - a_1` and `1 - p` come from `f64`. Let `k` be no less than any `|G'|` of atoms that are not zero, `c` than any `|y'|` (of a
//! candidate more by `||r - b||`), `m_1 = k / n + |1 / n - 1|`, `M^2` no less than any `||d_res||^2` that the first node leaves, `m_t = M + o_t`, and
//! `S = k + |1 - a_1| + sum_s<t |a_s| m_s`. The errors:
//!
//! ```text
//! w'                 o_1 = 5u m_1
//! w_t                o_t = (u k + u |1 - a_1| + sum_s<t |a_s| (o_s + 2u m_s) + t u S) / n + 3u M
//! shared column      u c at the root, which is computed in f64, and 2u more where 1 is added to score there
//!                    e <- e + |p| (o_1 + 2u m_1) + 2u (c + |p| m_1 + |1 - p|)   at a first node
//!                    e <- e + |p| (o_t + 2u m_t) + u m_t                        further below, as |y| <= ||d_res||
//! candidate          as a shared column; at the root (dim + 2) u ||r - b|| for the difference and the matrix product, in any order,
//!                    and 2u (c + ||r - b||) for the reference and for adding it
//! l                  l' - w' (2 + w') - R at a first node, with R = o_1 (2 + 2 m_1) + 4u m_1 (2 + m_1) + 2u k
//!                    l <- l - |w| (|w| + 2 o_t) - o_t^2 - 5u m_t^2              further below, since w_t^2 <= (|w| + o_t)^2
//! g                  2R, and g <- g + 4 o_t m_t + 10u m_t^2                     since (|w| + o_t)^2 - w_t^2 <= 4 o_t max(|w|, o_t)
//! ```
//!
//! with `w` as the screen has it in the last two lines; 8u for `g` at the root, where `l` is `l' + 1 - 4u`. Each has a hundredth more for products of errors. Every line
//! counts one rounding for each operation, fused or not, so that they hold for any processor. So the bounds are the closer, the less the patches differ.

use super::exact::{AtomCache, Choice, Exact, eligible};
use super::node::{Node, Path};
use super::rows::{ADD_ONE_ERROR, Margins, Rows};
use super::screen::{Residuals, Screen, StepCandidate};
use super::vectors::{project_out, widen};
use crate::numeric::aligned::Aligned;
use crate::numeric::dot_wide;
use crate::numeric::instructions::Instructions;
use crate::sparse::codes::{Code, CodeRules, MAX_ATOMS, final_energy};
use crate::sparse::dictionary::Dictionary;
use pulp::{Simd, WithSimd};
use std::ops::Range;

/// Candidates that are solved together: their rows stay in the second cache. A multiple of six, and at most the bits of a word.
pub const BLOCK: usize = 60;

/// Stands for "no atom": greater than all.
const NONE: u32 = u32::MAX;

/// A location: its shared columns, and everything that follows from them and the dictionary alone. To be filled again when one
/// of the two changes.
#[derive(Debug, Clone, Default)]
pub struct Location {
    root: Node,
    rows: Rows,
    /// The newest shared column, or zeros.
    reference: Vec<f32>,
    /// Its number.
    number: usize,
    /// Room for an atom.
    wide: Vec<f64>,
}

impl Location {
    /// Becomes the location of this number with these shared columns (rows of `dim`).
    pub fn fill(
        &mut self,
        dictionary: &Dictionary,
        (number, shared): (usize, &[f32]),
        rules: &CodeRules,
    ) {
        let dim = dictionary.dim();
        self.number = number;
        self.reference.clear();
        self.reference.extend_from_slice(&shared[shared.len().saturating_sub(dim)..]);
        self.reference.resize(dim, 0.0);
        Instructions::default().dispatch(FillRoot { location: self, dictionary, shared, rules });
    }
}

/// Fills a location's root for the processor at hand. (A closure would not do: only what is always inlined is compiled for it.)
struct FillRoot<'a> {
    location: &'a mut Location,
    dictionary: &'a Dictionary,
    shared: &'a [f32],
    rules: &'a CodeRules,
}

impl WithSimd for FillRoot<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Location { root, rows, wide, .. } = self.location;
        root.fill_root(simd, self.shared);
        rows.fill_root(simd, wide, self.dictionary, root, self.rules);
    }
}

/// What [`solve`] needs besides its input; keep it and no call allocates once it has grown.
#[derive(Debug, Default)]
pub struct Scratch {
    instructions: Instructions,
    /// Of a block's candidates: their differences to the reference, and their own correlations with all atoms.
    differences: Vec<f32>,
    correlations: Aligned,
    /// What is left of each candidate.
    residuals: Vec<f64>,
    candidates: Vec<Candidate>,
    /// The candidates in the order of the tree, with the atom that each chose last.
    order: Vec<(u32, u32)>,
    /// The nodes on the way to the one that is worked on.
    nodes: Vec<Node>,
    rows: Vec<Rows>,
    branches: Vec<Branch>,
    screen: Screen,
    /// For each depth the atom that was chosen last, less its location's number: at the next location it is likely the one
    /// next to it.
    guesses: [usize; MAX_ATOMS],
    wide: Vec<f64>,
    cache: AtomCache,
}

/// A candidate on its way to its code.
#[derive(Debug, Default, Clone)]
struct Candidate {
    /// How far its correlations may be off, and how much they are at most at the root, less 1.
    error: f64,
    spread: f64,
    /// What is left of its energy, and the energy at which the code is complete.
    energy: f64,
    final_energy: f64,
    /// `p` along each chosen atom.
    projections: [f64; MAX_ATOMS],
    /// The atom that completes the code.
    last: Choice,
}

impl Candidate {
    /// Takes in what the newest node, of this depth, adds to how far the correlations may be off.
    #[inline(always)]
    fn add_error(&mut self, depth: usize, margins: &Margins) {
        self.error += margins.projection_error(self.projections[depth - 1], self.spread);
    }

    /// The candidate in a step at a node with this energy.
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
        // The next atom takes some part of what is left. The bounds ask for no more than its magnitude.
        let score = 0.3 * (node_energy + self.energy);
        StepCandidate::new(row, (projection, offset), score, margins.squared + error * error)
    }
}

/// Candidates that took the same atom at the same node, as a range of [`Scratch::order`].
#[derive(Debug)]
struct Branch {
    /// Atoms chosen so far, this one included.
    depth: usize,
    atom: usize,
    members: Range<usize>,
}

/// Codes every candidate (rows of `dim` samples) jointly with the location's shared columns, one code a candidate.
/// The location must have been filled for this dictionary and these rules.
pub fn solve(
    dictionary: &Dictionary,
    location: &Location,
    candidates: &[f32],
    rules: &CodeRules,
    scratch: &mut Scratch,
    codes: &mut [Code],
) {
    // Without atoms every code is empty, and there is no root to begin from.
    if dictionary.is_empty() {
        codes.fill(Code::default());
        return;
    }
    let blocks = candidates.chunks(BLOCK * dictionary.dim()).zip(codes.chunks_mut(BLOCK));
    for (block, codes) in blocks {
        let problem = Problem { dictionary, location, rules };
        scratch.instructions.dispatch(SolveBlock { problem, scratch, block, codes });
    }
}

impl Scratch {
    /// Room for a solver that uses these instructions, whatever the environment says.
    pub fn with(instructions: Instructions) -> Self {
        Self { instructions, ..Self::default() }
    }
}

/// What all candidates of a block have in common.
#[derive(Debug, Clone, Copy)]
struct Problem<'a> {
    dictionary: &'a Dictionary,
    location: &'a Location,
    rules: &'a CodeRules,
}

/// The codes of a block, for the processor at hand.
struct SolveBlock<'a> {
    problem: Problem<'a>,
    scratch: &'a mut Scratch,
    block: &'a [f32],
    codes: &'a mut [Code],
}

impl WithSimd for SolveBlock<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { problem, scratch, block, codes } = self;
        scratch.begin(simd, problem, block, codes);
        while let Some(branch) = scratch.branches.pop() {
            let branch = match branch.depth {
                0 => branch,
                _ => scratch.make_node(simd, problem, branch, codes),
            };
            scratch.choose(simd, problem, &branch);
            scratch.split(problem, &branch, codes);
        }
    }
}

impl Scratch {
    /// Puts all candidates of the block at the root, but for those that leave nothing to explain.
    #[inline(always)]
    fn begin<S: Simd>(&mut self, simd: S, problem: Problem<'_>, block: &[f32], codes: &mut [Code]) {
        let Problem { dictionary, location, .. } = problem;
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

    /// Forgets the block before, and makes room for a full one: many frames may pass before there is one.
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

    /// Makes the branch's node and projects its atom out of the members; those whose code is then complete leave the branch.
    #[inline(always)]
    fn make_node<S: Simd>(
        &mut self,
        simd: S,
        problem: Problem<'_>,
        branch: Branch,
        codes: &mut [Code],
    ) -> Branch {
        let Problem { dictionary, location, .. } = problem;
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
                codes[row] = code(&self.nodes[..depth], candidate, None);
            }
        }
        Branch { members: branch.members.start..kept, ..branch }
    }

    /// Finds each member's next atom and orders the members by it.
    #[inline(always)]
    fn choose<S: Simd>(&mut self, simd: S, problem: Problem<'_>, branch: &Branch) {
        let Problem { dictionary, location, rules } = problem;
        let Self { candidates, order, rows, screen, guesses, differences, .. } = self;
        let path = Path { root: &location.root, nodes: &self.nodes[..branch.depth] };
        let eligible = eligible(rules);
        self.cache.begin(dictionary.len());
        let (wide, cache) = (&mut self.wide, &mut self.cache);
        let mut exact = Exact { dictionary, path, rules, eligible, wide, cache };
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
            let mut tiles = location.rows.root_tiles::<S>(dictionary, differences);
            screen.run(simd, &mut tiles, (guess, margins.gap), inputs, &mut exact);
        } else {
            let (above, newest) = rows.split_at_mut(branch.depth - 1);
            let (newest, above) = (&mut newest[0], (&location.rows, &*above));
            if branch.depth == 1 {
                let (mut tiles, margins) =
                    newest.child_tiles::<S, true>(dictionary, path, above, rules);
                screen.begin(step_candidates(candidates, members, at, &margins));
                screen.run(simd, &mut tiles, (guess, margins.gap), inputs, &mut exact);
            } else {
                let (mut tiles, margins) =
                    newest.child_tiles::<S, false>(dictionary, path, above, rules);
                screen.begin(step_candidates(candidates, members, at, &margins));
                screen.run(simd, &mut tiles, (guess, margins.gap), inputs, &mut exact);
            }
            // Where patches have little texture, the first atom leaves little of the others.
            if branch.depth == 1 && rules.atoms > 2 {
                newest.measure_residuals(simd);
            }
        }
        let mut position = branch.members.start;
        screen.finish(simd, residuals, &mut exact, |row, atom| {
            order[position] = (atom.map_or(NONE, |atom| atom as u32), row as u32);
            *last = atom.map_or(*last, |atom| (atom + count - location.number % count) % count);
            position += 1;
        });
        if branch.depth + 1 == rules.atoms {
            for &(atom, row) in &order[branch.members.clone()] {
                let last = if atom == NONE {
                    None
                } else {
                    exact.choice_without_score(simd, atom as usize, residuals.row(row as usize))
                };
                candidates[row as usize].last = last.unwrap_or_default();
            }
        }
        order[branch.members.clone()].sort_unstable();
    }

    /// Makes a branch of the members with the same next atom. Those that found none, or now have all, are complete.
    #[inline(always)]
    fn split(&mut self, problem: Problem<'_>, branch: &Branch, codes: &mut [Code]) {
        let (depth, end) = (branch.depth + 1, branch.members.end);
        let mut start = branch.members.start;
        while start < end {
            let atom = self.order[start].0;
            let same = self.order[start..end].iter().take_while(|member| member.0 == atom).count();
            let members = start..start + same;
            start = members.end;
            if atom != NONE && depth < problem.rules.atoms {
                self.branches.push(Branch { depth, atom: atom as usize, members });
                continue;
            }
            for &(_, row) in &self.order[members] {
                let candidate = &self.candidates[row as usize];
                let last = (atom != NONE).then_some(&candidate.last);
                codes[row as usize] = code(&self.nodes[..branch.depth], candidate, last);
            }
        }
    }
}

/// These candidates in a step at a node of this depth and energy.
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

/// The candidate's refitted coefficients on the atoms of the nodes and of the last choice: back substitution in the triangle.
fn code(nodes: &[Node], candidate: &Candidate, last: Option<&Choice>) -> Code {
    let mut support = [0; MAX_ATOMS];
    let mut triangle = [[0.0; MAX_ATOMS]; MAX_ATOMS];
    let mut projections = candidate.projections;
    let mut length = nodes.len();
    for (k, node) in nodes.iter().enumerate() {
        (support[k], triangle[k]) = (node.atom, node.triangle);
    }
    if let Some(choice) = last {
        (support[length], triangle[length], projections[length]) =
            (choice.atom, choice.triangle, choice.projection);
        length += 1;
    }
    let mut coefficients = [0.0; MAX_ATOMS];
    for j in (0..length).rev() {
        let known: f64 = (j + 1..length).map(|s| triangle[s][j] * coefficients[s]).sum();
        coefficients[j] = (projections[j] - known) / triangle[j][j];
    }
    Code::new(&support[..length], &coefficients[..length])
}
