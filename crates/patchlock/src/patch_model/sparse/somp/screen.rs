//! One step of all candidates at a node: the screen finds in `f32` which atoms can have the largest
//! score. Where several can, `f64` decides.

use super::exact::{Choice, ExactAtoms};
use super::rows::{SharedTile, Tiles};
use super::vectors::{
    TILE, Tile, U, add, add_squares, mul_add, subtract_scaled, tile_index, tiles_mut,
};
use pulp::{Simd, bytemuck};
use std::iter::{once, successors};

/// Exceeds all relative rounding errors of a screened score.
const ROUNDING: f64 = 64.0 * U;

/// Below any score that is not just rounding error. Above 0, so that the score of an excluded atom
/// stays below it.
const MIN_SCORE: f32 = 1e-30;

/// The most possible atoms of a tile that are added one by one. With more, most of them are ruled
/// out once the best of the tile is known.
const FEW: u32 = 3;

/// Factors slightly below and above 1 that absorb the rounding of a bound.
const ROUND_DOWN: f32 = 1.0 - 8.0 * U as f32;
const ROUND_UP: f32 = 1.0 + 8.0 * U as f32;

/// Bounds on an atom's score, given its screened sum of squares `x`. With `l <= ||d_res||^2 <= l +
/// gap`, the score is at most `(upper_factor x + upper_term) / l` and at least `(lower_factor x -
/// lower_term) / (l + gap)`.
#[derive(Debug, Clone, Copy, Default)]
struct Bounds {
    upper_factor: f32,
    upper_term: f32,
    lower_factor: f32,
    lower_term: f32,
}

impl Bounds {
    /// The bounds for columns whose squared errors sum to `squared_errors`; tightest for scores
    /// near `score`.
    #[inline(always)]
    fn new(score: f64, squared_errors: f64) -> Self {
        // Any slack in this range is valid. This one widens the bounds about as much as the errors
        // do at a residual energy of a quarter.
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

/// The state of a candidate in one step.
#[derive(Debug, Clone, Default)]
pub struct StepCandidate {
    row: usize,
    /// `p` along the node's direction.
    projection: f32,
    /// Added to the correlations, which are stored minus 1: 1 at the root, `1 - p` at a first node,
    /// 0 further below.
    offset: f32,
    bounds: Bounds,
    /// A lower bound on the largest score.
    lower_bound: f32,
    /// The best of the atoms computed in `f64` so far.
    best: Option<Choice>,
    /// Index of the newest of its possible atoms.
    newest: Option<u32>,
}

/// An atom that may have the largest score for a candidate, and an upper bound on that score.
#[derive(Debug, Clone, Copy)]
struct PossibleAtom {
    atom: u32,
    upper_bound: f32,
    /// Index of the candidate's previous possible atom.
    previous: Option<u32>,
}

/// The state of a step of all candidates at a node.
#[derive(Debug, Default)]
pub struct Screen {
    candidates: Vec<StepCandidate>,
    possible_atoms: Vec<PossibleAtom>,
}

/// The residuals of all candidates.
#[derive(Debug, Clone, Copy)]
pub struct Residuals<'a> {
    /// Row by row.
    pub all: &'a [f64],
    /// Number of samples in a row.
    pub dim: usize,
}

impl Residuals<'_> {
    /// The residual of one candidate.
    #[inline(always)]
    pub fn row(&self, row: usize) -> &[f64] {
        &self.all[row * self.dim..][..self.dim]
    }
}

impl Screen {
    /// Reserves space for this many candidates and for every atom of each. How many atoms remain
    /// possible varies from frame to frame, and a new maximum may occur after any number of frames.
    #[inline(always)]
    pub fn reserve(&mut self, candidates: usize, atoms: usize) {
        self.candidates.clear();
        self.candidates.reserve_exact(candidates);
        self.possible_atoms.clear();
        self.possible_atoms.reserve_exact(candidates * atoms);
    }

    /// Begins a step with these candidates.
    #[inline(always)]
    pub fn begin(&mut self, candidates: impl Iterator<Item = StepCandidate>) {
        self.candidates.clear();
        self.candidates.extend(candidates);
        self.possible_atoms.clear();
    }

    /// Screens all atoms for all candidates, tile by tile. The tile of the atom `guess` comes first: a
    /// good guess raises the lower bounds early. A divisor may be too small by at most `gap`.
    /// `correlations` are the candidates' own, in panels, as the parent left them. They are updated
    /// to this node if it can have children.
    #[inline(always)]
    pub fn run<S: Simd, T: Tiles<S>>(
        &mut self,
        simd: S,
        tiles: &mut T,
        (guess, gap): (usize, f32),
        (residuals, correlations): (Residuals<'_>, &mut [f32]),
        exact: &mut ExactAtoms<'_>,
    ) {
        let stride = exact.dictionary.stride();
        let (width, rows) = (TILE * S::F32_LANES, correlations.len() / stride);
        let (correlations, stored) = (tiles_mut::<S>(correlations), tiles.stores_rows());
        let first = guess / width;
        for t in once(first).chain((0..stride / width).filter(|&t| t != first)) {
            tiles.correlate(simd, t, correlations);
            let shared = tiles.tile(simd, t);
            // These candidates are handled after the loop: doing it here would move the tile out of
            // the registers.
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

    /// Adds the possible atoms of a tile; `y` are the candidate's correlations.
    #[inline(always)]
    fn add_tile<S: Simd>(
        &mut self,
        simd: S,
        (number, t): (usize, usize),
        (y, shared): (&Tile<S>, &SharedTile<S>),
        gap: f32,
        residuals: Residuals<'_>,
        exact: &mut ExactAtoms<'_>,
    ) {
        let mut sums = shared.squares;
        add_squares(simd, &mut sums, y);
        let candidate = &mut self.candidates[number];
        let mut bits = candidate.possible_lanes(simd, &sums, &shared.divisors);
        if bits.count_ones() > FEW {
            candidate.raise_by_tile(simd, (&sums, &shared.divisors), gap, exact.eligible.0);
            bits = candidate.possible_lanes(simd, &sums, &shared.divisors);
        }
        let (sums, divisors) = (lanes::<S>(&sums), lanes::<S>(&shared.divisors));
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let k = t * TILE * S::F32_LANES + lane;
            self.add_atom(simd, (number, k), (sums[lane], divisors[lane]), gap, residuals, exact);
        }
    }

    /// Adds an atom with this screened sum of squares and this divisor, if it is possible.
    #[inline(always)]
    fn add_atom<S: Simd>(
        &mut self,
        simd: S,
        (number, k): (usize, usize),
        (sum, divisor): (f32, f32),
        gap: f32,
        residuals: Residuals<'_>,
        exact: &mut ExactAtoms<'_>,
    ) {
        let candidate = &mut self.candidates[number];
        let upper_bound = candidate.bounds.upper_factor * sum + candidate.bounds.upper_term;
        if upper_bound < divisor * candidate.lower_bound * ROUND_DOWN {
            return;
        }
        if divisor >= exact.eligible.0 {
            let lower = candidate.bounds.lower_factor * sum - candidate.bounds.lower_term;
            // Divides only if that raises the lower bound.
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

    /// Calls `done` with each candidate's row and its eligible atom with the largest score, or
    /// `None` if no score is positive. Of equal scores the first atom is chosen. If more than one
    /// atom is possible, they are computed in `f64`.
    #[inline(always)]
    pub fn finish<S: Simd>(
        &mut self,
        simd: S,
        residuals: Residuals<'_>,
        exact: &mut ExactAtoms<'_>,
        mut done: impl FnMut(usize, Option<usize>),
    ) {
        for candidate in &mut self.candidates {
            let atom = candidate.decide(simd, &self.possible_atoms, residuals, exact);
            done(candidate.row, atom);
        }
    }
}

impl StepCandidate {
    /// The state of the candidate in this row: `projection` is `p` along the node's direction,
    /// `offset` is added to its correlations, `score` estimates the score of the next atom, and
    /// `squared_errors` is the sum of the squared error bounds of the correlations of all columns,
    /// including its own.
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

    /// Records that some atom has at least this score.
    #[inline(always)]
    fn raise_lower_bound(&mut self, lower_bound: f32) {
        self.lower_bound = self.lower_bound.max(lower_bound);
    }

    /// Raises the lower bound to what the eligible atoms of a tile reach at least.
    #[inline(always)]
    fn raise_by_tile<S: Simd>(
        &mut self,
        simd: S,
        (sums, divisors): (&Tile<S>, &Tile<S>),
        gap: f32,
        eligible_from: f32,
    ) {
        let factor = simd.splat_f32s(self.bounds.lower_factor);
        let term = simd.splat_f32s(self.bounds.lower_term);
        let (gap, from) = (simd.splat_f32s(gap), simd.splat_f32s(eligible_from));
        let mut highest = simd.splat_f32s(0.0);
        for (&sum, &divisor) in sums.iter().zip(divisors) {
            let surely = simd.sub_f32s(simd.mul_f32s(factor, sum), term);
            let least = simd.div_f32s(surely, simd.add_f32s(divisor, gap));
            let eligible = simd.greater_than_or_equal_f32s(divisor, from);
            highest = simd.max_f32s(highest, simd.select_f32s(eligible, least, highest));
        }
        self.raise_lower_bound(simd.reduce_max_f32s(highest) * ROUND_DOWN);
    }

    /// For each atom, the excess of its upper bound over the lower bound, times its divisor. If it
    /// is negative, the atom cannot be chosen.
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

    /// A bit mask of the possible atoms of the tile; the first atom is the lowest bit.
    #[inline(always)]
    fn possible_lanes<S: Simd>(&self, simd: S, sums: &Tile<S>, divisors: &Tile<S>) -> u64 {
        let mut bits = 0;
        for (i, &excess) in self.excess(simd, sums, divisors).iter().enumerate() {
            bits |= u64::from(non_negative_lanes::<S>(simd, excess)) << (i * S::F32_LANES);
        }
        bits
    }

    /// Whether any atom of the tile is possible; `y` are the candidate's correlations.
    #[inline(always)]
    fn has_possible<S: Simd>(&self, simd: S, y: &Tile<S>, shared: &SharedTile<S>) -> bool {
        let mut sums = shared.squares;
        add_squares(simd, &mut sums, y);
        let [a, b, c, d] = self.excess(simd, &sums, &shared.divisors);
        let highest = simd.max_f32s(simd.max_f32s(a, b), simd.max_f32s(c, d));
        non_negative_lanes::<S>(simd, highest) != 0
    }

    /// Computes an atom in `f64` and keeps it if it is the best so far.
    #[inline(always)]
    fn compute<S: Simd>(
        &mut self,
        simd: S,
        k: usize,
        residual: &[f64],
        exact: &mut ExactAtoms<'_>,
    ) {
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
        exact: &mut ExactAtoms<'_>,
    ) -> Option<usize> {
        let at = |index: Option<u32>| index.map(|k| &possible_atoms[k as usize]);
        let all = || successors(at(self.newest), move |possible| at(possible.previous));
        let lower_bound = self.lower_bound;
        let mut still_possible = all().filter(|possible| possible.upper_bound >= lower_bound);
        let mut highest = still_possible.next();
        if let (None, Some(only), None) = (&self.best, highest, still_possible.next())
            && lower_bound > MIN_SCORE
        {
            return Some(only.atom as usize);
        }
        // Computing the atom with the highest upper bound first often excludes the others.
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

/// A bit mask of the lanes that are not negative; the first lane is the lowest bit.
#[inline(always)]
fn non_negative_lanes<S: Simd>(simd: S, excess: S::f32s) -> u32 {
    let mask = simd.greater_than_or_equal_f32s(excess, simd.splat_f32s(0.0));
    let bytes = bytemuck::bytes_of(&mask);
    // Masks have one bit per lane on some processors and one word per lane on others.
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
