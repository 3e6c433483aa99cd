//! One step of all candidates at a node: the screen finds in `f32` which atoms could win, and `f64` decides where it can't tell.

use super::exact::{Choice, Exact};
use super::rows::{SharedTile, Tiles};
use super::vectors::{
    TILE, Tile, U, add, add_squares, mul_add, panel_index, subtract_scaled, tile_index, tiles_mut,
};
use pulp::{Simd, bytemuck};
use std::iter::successors;

/// More than all relative roundings of a screened score.
const ROUNDING: f64 = 64.0 * U;

/// Less than any score that is not zero but for rounding; more than nothing, so that an atom that can't be chosen stays below it.
const MIN_SCORE: f32 = 1e-30;

/// A little less than 1, and a little more.
const ROUND_DOWN: f32 = 1.0 - 8.0 * U as f32;
const ROUND_UP: f32 = 1.0 + 8.0 * U as f32;

/// What the screened sum of squares `x` of an atom says of its score: with `l` and `l + gap` around its `||d_res||^2`, the score is at most
/// `(widen x + added) / l` and at least `(narrow x - taken) / (l + gap)`.
#[derive(Debug, Clone, Copy, Default)]
struct Bounds {
    upper_factor: f32,
    upper_term: f32,
    lower_factor: f32,
    lower_term: f32,
}

impl Bounds {
    /// The bounds where the squared errors of all columns add to `squared_errors`. They are closest for scores near this one.
    #[inline(always)]
    fn new(score: f64, squared_errors: f64) -> Self {
        // Any slack is right. This one adds about as much as the errors do where a quarter of an atom is left.
        let slack = (2.0 * (squared_errors / score.max(MIN_SCORE.into())).sqrt()).clamp(1e-9, 1.0);
        let inverse = 1.0 / slack;
        Self {
            upper_factor: ((1.0 + slack) * (1.0 + ROUNDING)) as f32,
            upper_term: ((1.0 + inverse) * squared_errors * (1.0 + ROUNDING)) as f32,
            lower_factor: ((1.0 - slack) * (1.0 - ROUNDING)) as f32,
            lower_term: ((inverse - 1.0) * squared_errors * (1.0 + ROUNDING)) as f32,
        }
    }
}

/// A candidate in a step.
#[derive(Debug, Clone, Default)]
pub struct StepCandidate {
    row: usize,
    /// `p` along the node's direction.
    projection: f32,
    /// What makes good that the correlations are less 1: at the root all of it, at a first node what `p` leaves, further below nothing.
    offset: f32,
    bounds: Bounds,
    /// A score that some atom is known to have at least.
    lower_bound: f32,
    /// The best of the atoms that had to be computed.
    best: Option<Choice>,
    /// The newest of its contenders.
    newest: Option<u32>,
}

/// An atom that could win a runner's step, and the most that its score can be.
#[derive(Debug, Clone, Copy)]
struct PossibleAtom {
    atom: u32,
    upper_bound: f32,
    /// The runner's contender before.
    previous: Option<u32>,
}

/// A step of all candidates at a node.
#[derive(Debug, Default)]
pub struct Screen {
    candidates: Vec<StepCandidate>,
    possible_atoms: Vec<PossibleAtom>,
}

/// What is left of the candidates.
#[derive(Debug, Clone, Copy)]
pub struct Residuals<'a> {
    /// One after the other.
    pub all: &'a [f64],
    /// Samples of each.
    pub dim: usize,
}

impl Residuals<'_> {
    /// That of one candidate.
    #[inline(always)]
    pub fn row(&self, row: usize) -> &[f64] {
        &self.all[row * self.dim..][..self.dim]
    }
}

impl Screen {
    /// Makes room for as many runners and atoms as there can be: how many atoms contend differs from frame to frame, and after days more may do than ever before.
    #[inline(always)]
    pub fn reserve(&mut self, candidates: usize, atoms: usize) {
        self.candidates.clear();
        self.candidates.reserve_exact(candidates);
        self.possible_atoms.clear();
        self.possible_atoms.reserve_exact(candidates * atoms);
    }

    /// Begins a step with these runners.
    #[inline(always)]
    pub fn begin(&mut self, candidates: impl Iterator<Item = StepCandidate>) {
        self.candidates.clear();
        self.candidates.extend(candidates);
        self.possible_atoms.clear();
    }

    /// Screens all atoms for all runners, tile by tile. `guess` is tried first: a good one saves work. A divisor may be less than the
    /// truth by `gap`. `correlations` are those of the candidates, in panels, as the parent left them; they are brought up to the
    /// node where there are nodes further below.
    #[inline(always)]
    pub fn run<S: Simd, T: Tiles<S>>(
        &mut self,
        simd: S,
        tiles: &mut T,
        (guess, gap): (usize, f32),
        (residuals, correlations): (Residuals<'_>, &mut [f32]),
        exact: &mut Exact<'_>,
    ) {
        let stride = exact.dictionary.stride();
        let (width, rows) = (TILE * S::F32_LANES, correlations.len() / stride);
        tiles.correlate(simd, guess / width, tiles_mut::<S>(correlations));
        self.bound_by_guess(simd, tiles, (guess, gap), (residuals, correlations), exact);
        let (correlations, stored) = (tiles_mut::<S>(correlations), tiles.stores_rows());
        for t in 0..stride / width {
            if t != guess / width {
                tiles.correlate(simd, t, correlations);
            }
            let shared = tiles.tile(simd, t);
            // Those that found something come later: what they do with it would take the tile out of the registers.
            let mut found = 0u64;
            for (number, candidate) in self.candidates.iter().enumerate() {
                let index = tile_index::<S>(t, candidate.row, rows);
                let mut y = correlations[index];
                if T::BELOW_ROOT {
                    subtract_scaled(simd, &mut y, &shared.weights, candidate.projection);
                }
                if T::HAS_OFFSET {
                    add(simd, &mut y, candidate.offset);
                }
                if stored {
                    correlations[index] = y;
                }
                found |= u64::from(candidate.has_possible(simd, &y, &shared)) << number;
            }
            while found != 0 {
                let number = found.trailing_zeros() as usize;
                found &= found - 1;
                let candidate = &self.candidates[number];
                let mut y = correlations[tile_index::<S>(t, candidate.row, rows)];
                if T::BELOW_ROOT && !stored {
                    subtract_scaled(simd, &mut y, &shared.weights, candidate.projection);
                }
                if T::HAS_OFFSET && !stored {
                    add(simd, &mut y, candidate.offset);
                }
                self.add_tile(simd, (number, t), (&y, &shared), gap, residuals, exact);
            }
        }
    }

    /// Raises the bar by what the guess can do.
    #[inline(always)]
    fn bound_by_guess<S: Simd>(
        &mut self,
        simd: S,
        tiles: &impl Tiles<S>,
        (guess, gap): (usize, f32),
        (residuals, correlations): (Residuals<'_>, &[f32]),
        exact: &mut Exact<'_>,
    ) {
        let rows = correlations.len() / exact.dictionary.stride();
        let [weight, squares, divisor] = tiles.at(guess);
        for number in 0..self.candidates.len() {
            let candidate = &self.candidates[number];
            let y = correlations[panel_index(guess, candidate.row, rows)]
                - weight * candidate.projection
                + candidate.offset;
            self.add_atom(simd, (number, guess), (squares + y * y, divisor), gap, residuals, exact);
        }
        // The guess is found again in its tile.
        self.possible_atoms.clear();
        self.candidates.iter_mut().for_each(|candidate| candidate.newest = None);
    }

    /// Takes in the atoms of a tile that could win; `y` are the candidate's correlations.
    #[inline(always)]
    fn add_tile<S: Simd>(
        &mut self,
        simd: S,
        (number, t): (usize, usize),
        (y, shared): (&Tile<S>, &SharedTile<S>),
        gap: f32,
        residuals: Residuals<'_>,
        exact: &mut Exact<'_>,
    ) {
        let mut sums = shared.squares;
        add_squares(simd, &mut sums, y);
        let candidate = &self.candidates[number];
        let mut bits = candidate.possible_lanes(simd, &sums, &shared.divisors);
        let (sums, divisors) = (lanes::<S>(&sums), lanes::<S>(&shared.divisors));
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let k = t * TILE * S::F32_LANES + lane;
            self.add_atom(simd, (number, k), (sums[lane], divisors[lane]), gap, residuals, exact);
        }
    }

    /// Takes in an atom with this screened sum of squares and this divisor.
    #[inline(always)]
    fn add_atom<S: Simd>(
        &mut self,
        simd: S,
        (number, k): (usize, usize),
        (sum, divisor): (f32, f32),
        gap: f32,
        residuals: Residuals<'_>,
        exact: &mut Exact<'_>,
    ) {
        let candidate = &mut self.candidates[number];
        let upper_bound = candidate.bounds.upper_factor * sum + candidate.bounds.upper_term;
        if upper_bound < divisor * candidate.lower_bound * ROUND_DOWN {
            return;
        }
        if divisor >= exact.eligible.0 {
            let lower = candidate.bounds.lower_factor * sum - candidate.bounds.lower_term;
            // The bar waits for a division only where that may raise it.
            if lower > candidate.lower_bound * (divisor + gap) {
                candidate.raise_lower_bound(lower / (divisor + gap) * ROUND_DOWN);
            }
            let previous = candidate.newest.replace(self.possible_atoms.len() as u32);
            let upper_bound = upper_bound / divisor * ROUND_UP;
            self.possible_atoms.push(PossibleAtom { atom: k as u32, upper_bound, previous });
        } else if divisor + gap >= exact.eligible.1 {
            candidate.compute(simd, k, residuals.row(candidate.row), exact);
        }
    }

    /// Calls `done` with each runner's row and the eligible atom with the largest score, the first of equal ones; none where no score is
    /// positive. Atoms are computed unless only one is left that could win.
    #[inline(always)]
    pub fn finish<S: Simd>(
        &mut self,
        simd: S,
        residuals: Residuals<'_>,
        exact: &mut Exact<'_>,
        mut done: impl FnMut(usize, Option<usize>),
    ) {
        for candidate in &mut self.candidates {
            let atom = candidate.decide(simd, &self.possible_atoms, residuals, exact);
            done(candidate.row, atom);
        }
    }
}

impl StepCandidate {
    /// The candidate of this row: `along` is `p` along the node's direction, `lift` what its correlations lack, `score` about what the next atom will reach, `squared_errors` the sum
    /// of the squares of how far the correlations of all columns, its own included, may be off.
    #[inline(always)]
    pub fn new(
        row: usize,
        (projection, offset): (f64, f64),
        score: f64,
        squared_errors: f64,
    ) -> Self {
        let bounds = Bounds::new(score, squared_errors);
        let (projection, offset) = (projection as f32, offset as f32);
        Self { row, projection, offset, bounds, lower_bound: MIN_SCORE, best: None, newest: None }
    }

    /// Knows of an atom whose score is at least this.
    #[inline(always)]
    fn raise_lower_bound(&mut self, lower_bound: f32) {
        self.lower_bound = self.lower_bound.max(lower_bound);
    }

    /// Not negative where an atom of the tile could win.
    #[inline(always)]
    fn excess<S: Simd>(&self, simd: S, sums: &Tile<S>, divisors: &Tile<S>) -> Tile<S> {
        let (upper_factor, upper_term) =
            (simd.splat_f32s(self.bounds.upper_factor), simd.splat_f32s(self.bounds.upper_term));
        let lower_bound = simd.splat_f32s(-self.lower_bound);
        let mut excess = *sums;
        for i in 0..TILE {
            let upper_bound = mul_add(simd, sums[i], upper_factor, upper_term);
            excess[i] = mul_add(simd, lower_bound, divisors[i], upper_bound);
        }
        excess
    }

    /// A bit for each atom of the tile that could win, the first one's the lowest.
    #[inline(always)]
    fn possible_lanes<S: Simd>(&self, simd: S, sums: &Tile<S>, divisors: &Tile<S>) -> u64 {
        let mut bits = 0;
        for (i, &excess) in self.excess(simd, sums, divisors).iter().enumerate() {
            bits |= u64::from(non_negative_lanes::<S>(simd, excess)) << (i * S::F32_LANES);
        }
        bits
    }

    /// Whether an atom of the tile could win; `y` are the candidate's correlations.
    #[inline(always)]
    fn has_possible<S: Simd>(&self, simd: S, y: &Tile<S>, shared: &SharedTile<S>) -> bool {
        let mut sums = shared.squares;
        add_squares(simd, &mut sums, y);
        let [a, b, c, d] = self.excess(simd, &sums, &shared.divisors);
        let highest = simd.max_f32s(simd.max_f32s(a, b), simd.max_f32s(c, d));
        non_negative_lanes::<S>(simd, highest) != 0
    }

    /// Computes an atom, and keeps the better one.
    #[inline(always)]
    fn compute<S: Simd>(&mut self, simd: S, k: usize, residual: &[f64], exact: &mut Exact<'_>) {
        let Some(choice) = exact.choice_with_score(simd, k, residual) else { return };
        let is_better = match &self.best {
            Some(best) => {
                choice.score > best.score || (choice.score == best.score && k < best.atom)
            }
            None => true,
        };
        if is_better {
            self.raise_lower_bound(choice.score as f32 * ROUND_DOWN);
            self.best = Some(choice);
        }
    }

    #[inline(always)]
    fn decide<S: Simd>(
        &mut self,
        simd: S,
        possible_atoms: &[PossibleAtom],
        residuals: Residuals<'_>,
        exact: &mut Exact<'_>,
    ) -> Option<usize> {
        let at = |place: Option<u32>| place.map(|k| &possible_atoms[k as usize]);
        let all = || successors(at(self.newest), move |possible| at(possible.previous));
        let lower_bound = self.lower_bound;
        let mut still_possible = all().filter(|possible| possible.upper_bound >= lower_bound);
        let mut highest = still_possible.next();
        if let (None, Some(only), None) = (&self.best, highest, still_possible.next())
            && lower_bound > MIN_SCORE
        {
            return Some(only.atom as usize);
        }
        // The one that can reach furthest comes first: behind it, few others are left.
        for possible in all() {
            highest = highest
                .filter(|other| other.upper_bound >= possible.upper_bound)
                .or(Some(possible));
        }
        let residual = residuals.row(self.row);
        let first = highest.map(|possible| possible.atom);
        let others = all().filter(|possible| Some(possible.atom) != first);
        for possible in highest.into_iter().chain(others) {
            if possible.upper_bound >= self.lower_bound {
                self.compute(simd, possible.atom as usize, residual, exact);
            }
        }
        self.best.as_ref().map(|best| best.atom)
    }
}

/// A bit for each lane that is not negative, the first lane's the lowest.
#[inline(always)]
fn non_negative_lanes<S: Simd>(simd: S, excess: S::f32s) -> u32 {
    let mask = simd.greater_than_or_equal_f32s(excess, simd.splat_f32s(0.0));
    let bytes = bytemuck::bytes_of(&mask);
    // Some processors have a bit for each lane, others a word.
    if let (&[low, high], 16) = (bytes, S::F32_LANES) {
        return u32::from(u16::from_ne_bytes([low, high]));
    }
    let mut bits = 0;
    for lane in 0..S::F32_LANES {
        bits |= u32::from(bytes[lane * bytes.len() / S::F32_LANES] != 0) << lane;
    }
    bits
}

#[inline(always)]
fn lanes<S: Simd>(tile: &Tile<S>) -> &[f32] {
    bytemuck::cast_slice(tile)
}
