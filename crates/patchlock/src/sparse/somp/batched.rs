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
//! An atom is eligible for sure if `l` is at least what has to be left; another one is computed. Relative roundings of the sums, less
//! than `64 u`, are added to `s`. The errors:
//!
//! ```text
//! Gram matrix        u                                              computed in f64, rounded once
//! w_t                o_t = ((3t - 2) u + sum_s<t |q_s^T d_t| o_s) / ||d_t,res|| + 3u
//! shared column      e <- e + |p| (o_t + 2u) + u                    u at the root, which is computed in f64
//! candidate          as a shared column                             (dim + 2) u ||r - b|| for the matrix product, in any order, and 2u
//!                                                                   for the reference and for adding it
//! l                  l <- l - |^w| (|^w| + 2 o_t) - o_t^2 - 5u m^2  since w^2 <= (|^w| + o_t)^2
//! g                  g <- g + 4 o_t m + 10u m^2                     since (|^w| + o_t)^2 - w^2 <= 4 o_t |^w| or 4 o_t^2
//! ```
//!
//! Here `m = M + o_t`, and `M` is no less than any `|w|` or root of an `l`: 1 at the first node, and further below the root of the largest `l + g` that
//! the first node left, as `|w| <= ||d_res||` and what is left only becomes less. So patches that hardly differ, whose atoms leave little of each other, have
//! bounds as close as others.
//!
//! each with a hundredth more for products of errors. Every line counts one rounding for each operation, fused or not, so that
//! they hold for any processor.

use super::exact::{Choice, Exact, eligible_from};
use super::node::{Node, Path};
use super::product::PAIR;
use super::rows::{Margins, Rows};
use super::screen::{Residuals, Runner, Screen};
use super::vectors::{U, project_out, widen};
use crate::config::MAX_ATOMS;
use crate::simd::dot_wide;
use crate::simd::instructions::Instructions;
use crate::sparse::aligned::Aligned;
use crate::sparse::codes::{Code, CodeRules};
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
    columns: usize,
    /// Its number.
    place: usize,
    /// Room for an atom.
    wide: Vec<f64>,
}

impl Location {
    /// Becomes the location of this number with these shared columns (rows of `dim`).
    pub fn fill(
        &mut self,
        dictionary: &Dictionary,
        (place, shared): (usize, &[f32]),
        rules: &CodeRules,
    ) {
        let dim = dictionary.dim();
        self.place = place;
        self.columns = shared.len() / dim;
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
}

/// A candidate on its way to its code.
#[derive(Debug, Default, Clone)]
struct Candidate {
    /// How far its correlations may be off.
    error: f64,
    /// What is left of its energy, and the energy at which the code is complete.
    energy: f64,
    final_energy: f64,
    /// `p` along each chosen atom.
    along: [f64; MAX_ATOMS],
    /// The atom that completes the code.
    last: Choice,
}

impl Candidate {
    /// Takes in what the newest node, of this depth, adds to how far the correlations may be off.
    #[inline(always)]
    fn advance(&mut self, depth: usize, margins: &Margins) {
        let along = self.along[depth - 1].abs();
        self.error += 1.01 * (along * (margins.weights + 2.0 * U) + U);
    }

    /// The candidate in a step at a node with this energy.
    #[inline(always)]
    fn runner(&self, (row, depth): (usize, usize), node_energy: f64, margins: &Margins) -> Runner {
        let along = if depth == 0 { 0.0 } else { self.along[depth - 1] };
        // The next atom takes some part of what is left. The bounds ask for no more than its magnitude.
        let score = 0.3 * (node_energy + self.energy);
        Runner::new(row, along, score, margins.squared + self.error * self.error)
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
    // Also where the atoms are empty: there is nothing to divide into blocks then.
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
                _ => scratch.enter(simd, problem, branch, codes),
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
        let Problem { dictionary, location, rules } = problem;
        let (dim, count) = (dictionary.dim(), block.len() / dictionary.dim());
        self.clear(dictionary);
        widen(&mut self.residuals, block);
        for (row, candidate) in block.chunks_exact(dim).enumerate() {
            self.differences.extend(candidate.iter().zip(&location.reference).map(|(r, b)| r - b));
            widen(&mut self.wide, &self.differences[row * dim..]);
            let distance = dot_wide(simd, &self.wide, &self.wide).sqrt();
            let wide = &self.residuals[row * dim..][..dim];
            let energy = dot_wide(simd, wide, wide);
            let all = location.root.energy + energy;
            let final_energy = rules.final_energy(location.columns + 1, all);
            self.candidates.push(Candidate {
                error: 1.01 * U * ((dim + 2) as f64 * distance + 2.0),
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
        let padded = count.next_multiple_of(PAIR);
        self.differences.resize(padded * dim, 0.0);
        self.correlations.resize(padded * dictionary.stride());
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
    fn enter<S: Simd>(
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
        for place in branch.members.clone() {
            let row = self.order[place].1 as usize;
            let candidate = &mut self.candidates[row];
            let along = project_out(simd, &mut self.residuals[row * dim..][..dim], &node.direction);
            candidate.along[depth - 1] = along;
            candidate.energy -= along * along;
            if node.energy + candidate.energy > candidate.final_energy {
                self.order.swap(kept, place);
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
        let eligible_from = eligible_from(rules);
        let mut exact = Exact { dictionary, path, rules, eligible_from, wide: &mut self.wide };
        let own = Residuals { all: &self.residuals, dim: dictionary.dim() };
        let fields = (own, &mut *self.correlations);
        let energy = path.end().energy;
        let count = dictionary.len();
        let last = &mut guesses[branch.depth];
        let guess = (*last + location.place) % count;
        let members = branch.members.clone().map(|place| order[place].1 as usize);
        if branch.depth == 0 {
            let margins = location.rows.errors.margins();
            screen.begin(
                members.map(|row| candidates[row].runner((row, branch.depth), energy, &margins)),
            );
            let mut tiles = location.rows.tiles::<S>(dictionary, differences);
            screen.run(simd, &mut tiles, (guess, margins.gap), fields, &mut exact);
        } else {
            let (above, newest) = rows.split_at_mut(branch.depth - 1);
            let rows = (&location.rows, &*above);
            let (mut tiles, margins) = newest[0].grow::<S>(dictionary, path, rows, rules);
            screen.begin(members.map(|row| {
                candidates[row].advance(branch.depth, &margins);
                candidates[row].runner((row, branch.depth), energy, &margins)
            }));
            screen.run(simd, &mut tiles, (guess, margins.gap), fields, &mut exact);
            // Where patches have little texture, the first atom leaves little of the others.
            if branch.depth == 1 && rules.atoms > 2 {
                newest[0].measure(simd);
            }
        }
        let mut place = branch.members.start;
        screen.finish(simd, own, &mut exact, |row, atom| {
            order[place] = (atom.map_or(NONE, |atom| atom as u32), row as u32);
            *last = atom.map_or(*last, |atom| (atom + count - location.place % count) % count);
            place += 1;
        });
        if branch.depth + 1 == rules.atoms {
            for &(atom, row) in &order[branch.members.clone()] {
                let last = if atom == NONE {
                    None
                } else {
                    exact.place(simd, atom as usize, own.row(row as usize))
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

/// The candidate's refitted coefficients on the atoms of the nodes and of the last choice: back substitution in the triangle.
fn code(nodes: &[Node], candidate: &Candidate, last: Option<&Choice>) -> Code {
    let mut support = [0; MAX_ATOMS];
    let mut triangle = [[0.0; MAX_ATOMS]; MAX_ATOMS];
    let mut along = candidate.along;
    let mut length = nodes.len();
    for (k, node) in nodes.iter().enumerate() {
        (support[k], triangle[k]) = (node.atom, node.triangle);
    }
    if let Some(choice) = last {
        (support[length], triangle[length], along[length]) =
            (choice.atom, choice.triangle, choice.along);
        length += 1;
    }
    let mut coefficients = [0.0; MAX_ATOMS];
    for j in (0..length).rev() {
        let known: f64 = (j + 1..length).map(|s| triangle[s][j] * coefficients[s]).sum();
        coefficients[j] = (along[j] - known) / triangle[j][j];
    }
    Code::new(&support[..length], &coefficients[..length])
}
