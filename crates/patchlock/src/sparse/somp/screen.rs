//! One step of all candidates at a node: the screen finds in `f32` which atoms could win, and `f64` decides where it can't tell.

use super::exact::{Choice, Exact};
use super::rows::{Shared, Tiles};
use super::vectors::{
    TILE, Tile, U, add, add_squares, mul_add, place, take_off, tile_place, tiles_mut,
};
use pulp::{Simd, bytemuck};
use std::iter::successors;

/// More than all relative roundings of a screened score.
const ROUNDING: f64 = 64.0 * U;

/// Less than any score that is not zero but for rounding; more than nothing, so that an atom that can't be chosen stays below it.
const NOTHING: f32 = 1e-30;

/// A little less than 1, and a little more.
const DOWN: f32 = 1.0 - 8.0 * U as f32;
const UP: f32 = 1.0 + 8.0 * U as f32;

/// What the screened sum of squares `x` of an atom says of its score: with `l` and `l + gap` around its `||d_res||^2`, the score is at most
/// `(widen x + added) / l` and at least `(narrow x - taken) / (l + gap)`.
#[derive(Debug, Clone, Copy, Default)]
struct Bounds {
    widen: f32,
    added: f32,
    narrow: f32,
    taken: f32,
}

impl Bounds {
    /// The bounds where the squared errors of all columns add to `squared_errors`. They are closest for scores near this one.
    #[inline(always)]
    fn new(score: f64, squared_errors: f64) -> Self {
        // Any slack is right. This one adds about as much as the errors do where a quarter of an atom is left.
        let slack = (2.0 * (squared_errors / score.max(NOTHING.into())).sqrt()).clamp(1e-9, 1.0);
        let inverse = 1.0 / slack;
        Self {
            widen: ((1.0 + slack) * (1.0 + ROUNDING)) as f32,
            added: ((1.0 + inverse) * squared_errors * (1.0 + ROUNDING)) as f32,
            narrow: ((1.0 - slack) * (1.0 - ROUNDING)) as f32,
            taken: ((inverse - 1.0) * squared_errors * (1.0 + ROUNDING)) as f32,
        }
    }
}

/// A candidate in a step.
#[derive(Debug, Clone, Default)]
pub struct Runner {
    row: usize,
    /// `p` along the node's direction.
    along: f32,
    /// What makes good that the correlations are less 1: at the root all of it, at a first node what `p` leaves, further below nothing.
    lift: f32,
    bounds: Bounds,
    /// A score that some atom is known to have at least.
    least: f32,
    /// The best of the atoms that had to be computed.
    leader: Option<Choice>,
    /// The newest of its contenders.
    newest: Option<u32>,
}

/// An atom that could win a runner's step, and the most that its score can be.
#[derive(Debug, Clone, Copy)]
struct Contender {
    atom: u32,
    most: f32,
    /// The runner's contender before.
    before: Option<u32>,
}

/// A step of all candidates at a node.
#[derive(Debug, Default)]
pub struct Screen {
    runners: Vec<Runner>,
    contenders: Vec<Contender>,
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
    pub fn reserve(&mut self, runners: usize, atoms: usize) {
        self.runners.clear();
        self.runners.reserve_exact(runners);
        self.contenders.clear();
        self.contenders.reserve_exact(runners * atoms);
    }

    /// Begins a step with these runners.
    #[inline(always)]
    pub fn begin(&mut self, runners: impl Iterator<Item = Runner>) {
        self.runners.clear();
        self.runners.extend(runners);
        self.contenders.clear();
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
        (own, correlations): (Residuals<'_>, &mut [f32]),
        exact: &mut Exact<'_>,
    ) {
        let stride = exact.dictionary.stride();
        let (width, rows) = (TILE * S::F32_LANES, correlations.len() / stride);
        tiles.correlate(simd, guess / width, tiles_mut::<S>(correlations));
        self.try_first(simd, tiles, (guess, gap), (own, correlations), exact);
        let (correlations, kept) = (tiles_mut::<S>(correlations), tiles.kept());
        for t in 0..stride / width {
            if t != guess / width {
                tiles.correlate(simd, t, correlations);
            }
            let shared = tiles.tile(simd, t);
            // Those that found something come later: what they do with it would take the tile out of the registers.
            let mut found = 0u64;
            for (number, runner) in self.runners.iter().enumerate() {
                let place = tile_place::<S>(t, runner.row, rows);
                let mut y = correlations[place];
                if T::DEEP {
                    take_off(simd, &mut y, &shared.weights, runner.along);
                }
                if T::LIFTED {
                    add(simd, &mut y, runner.lift);
                }
                if kept {
                    correlations[place] = y;
                }
                found |= u64::from(runner.reaches(simd, &y, &shared)) << number;
            }
            while found != 0 {
                let number = found.trailing_zeros() as usize;
                found &= found - 1;
                let runner = &self.runners[number];
                let mut y = correlations[tile_place::<S>(t, runner.row, rows)];
                if T::DEEP && !kept {
                    take_off(simd, &mut y, &shared.weights, runner.along);
                }
                if T::LIFTED && !kept {
                    add(simd, &mut y, runner.lift);
                }
                self.enter_tile(simd, (number, t), (&y, &shared), gap, own, exact);
            }
        }
    }

    /// Raises the bar by what the guess can do.
    #[inline(always)]
    fn try_first<S: Simd>(
        &mut self,
        simd: S,
        tiles: &impl Tiles<S>,
        (guess, gap): (usize, f32),
        (own, correlations): (Residuals<'_>, &[f32]),
        exact: &mut Exact<'_>,
    ) {
        let rows = correlations.len() / exact.dictionary.stride();
        let [weight, squares, over] = tiles.at(guess);
        for number in 0..self.runners.len() {
            let runner = &self.runners[number];
            let y =
                correlations[place(guess, runner.row, rows)] - weight * runner.along + runner.lift;
            self.enter(simd, (number, guess), (squares + y * y, over), gap, own, exact);
        }
        // The guess is found again in its tile.
        self.contenders.clear();
        self.runners.iter_mut().for_each(|runner| runner.newest = None);
    }

    /// Takes in the atoms of a tile that could win; `y` are the candidate's correlations.
    #[inline(always)]
    fn enter_tile<S: Simd>(
        &mut self,
        simd: S,
        (number, t): (usize, usize),
        (y, shared): (&Tile<S>, &Shared<S>),
        gap: f32,
        own: Residuals<'_>,
        exact: &mut Exact<'_>,
    ) {
        let mut sums = shared.squares;
        add_squares(simd, &mut sums, y);
        let runner = &self.runners[number];
        let mut bits = runner.reaching(simd, &sums, &shared.over);
        let (sums, over) = (lanes::<S>(&sums), lanes::<S>(&shared.over));
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let k = t * TILE * S::F32_LANES + lane;
            self.enter(simd, (number, k), (sums[lane], over[lane]), gap, own, exact);
        }
    }

    /// Takes in an atom with this screened sum of squares and this divisor.
    #[inline(always)]
    fn enter<S: Simd>(
        &mut self,
        simd: S,
        (number, k): (usize, usize),
        (sum, over): (f32, f32),
        gap: f32,
        own: Residuals<'_>,
        exact: &mut Exact<'_>,
    ) {
        let runner = &mut self.runners[number];
        let most = runner.bounds.widen * sum + runner.bounds.added;
        if most < over * runner.least * DOWN {
            return;
        }
        if over >= exact.eligible.0 {
            let surely = runner.bounds.narrow * sum - runner.bounds.taken;
            // The bar waits for a division only where that may raise it.
            if surely > runner.least * (over + gap) {
                runner.raise(surely / (over + gap) * DOWN);
            }
            let before = runner.newest.replace(self.contenders.len() as u32);
            let most = most / over * UP;
            self.contenders.push(Contender { atom: k as u32, most, before });
        } else if over + gap >= exact.eligible.1 {
            runner.compute(simd, k, own.row(runner.row), exact);
        }
    }

    /// Calls `done` with each runner's row and the eligible atom with the largest score, the first of equal ones; none where no score is
    /// positive. Atoms are computed unless only one is left that could win.
    #[inline(always)]
    pub fn finish<S: Simd>(
        &mut self,
        simd: S,
        own: Residuals<'_>,
        exact: &mut Exact<'_>,
        mut done: impl FnMut(usize, Option<usize>),
    ) {
        for runner in &mut self.runners {
            let atom = runner.decide(simd, &self.contenders, own, exact);
            done(runner.row, atom);
        }
    }
}

impl Runner {
    /// The candidate of this row: `along` is `p` along the node's direction, `lift` what its correlations lack, `score` about what the next atom will reach, `squared_errors` the sum
    /// of the squares of how far the correlations of all columns, its own included, may be off.
    #[inline(always)]
    pub fn new(row: usize, (along, lift): (f64, f64), score: f64, squared_errors: f64) -> Self {
        let bounds = Bounds::new(score, squared_errors);
        let (along, lift) = (along as f32, lift as f32);
        Self { row, along, lift, bounds, least: NOTHING, leader: None, newest: None }
    }

    /// Knows of an atom whose score is at least this.
    #[inline(always)]
    fn raise(&mut self, least: f32) {
        self.least = self.least.max(least);
    }

    /// Not negative where an atom of the tile could win.
    #[inline(always)]
    fn reach<S: Simd>(&self, simd: S, sums: &Tile<S>, over: &Tile<S>) -> Tile<S> {
        let (widen, added) =
            (simd.splat_f32s(self.bounds.widen), simd.splat_f32s(self.bounds.added));
        let least = simd.splat_f32s(-self.least);
        let mut reach = *sums;
        for i in 0..TILE {
            let most = mul_add(simd, sums[i], widen, added);
            reach[i] = mul_add(simd, least, over[i], most);
        }
        reach
    }

    /// A bit for each atom of the tile that could win, the first one's the lowest.
    #[inline(always)]
    fn reaching<S: Simd>(&self, simd: S, sums: &Tile<S>, over: &Tile<S>) -> u64 {
        let mut bits = 0;
        for (i, &reach) in self.reach(simd, sums, over).iter().enumerate() {
            bits |= u64::from(reaching::<S>(simd, reach)) << (i * S::F32_LANES);
        }
        bits
    }

    /// Whether an atom of the tile could win; `y` are the candidate's correlations.
    #[inline(always)]
    fn reaches<S: Simd>(&self, simd: S, y: &Tile<S>, shared: &Shared<S>) -> bool {
        let mut sums = shared.squares;
        add_squares(simd, &mut sums, y);
        let [a, b, c, d] = self.reach(simd, &sums, &shared.over);
        let highest = simd.max_f32s(simd.max_f32s(a, b), simd.max_f32s(c, d));
        reaching::<S>(simd, highest) != 0
    }

    /// Computes an atom, and keeps the better one.
    #[inline(always)]
    fn compute<S: Simd>(&mut self, simd: S, k: usize, residual: &[f64], exact: &mut Exact<'_>) {
        let Some(choice) = exact.weigh(simd, k, residual) else { return };
        let ahead = match &self.leader {
            Some(leader) => {
                choice.score > leader.score || (choice.score == leader.score && k < leader.atom)
            }
            None => true,
        };
        if ahead {
            self.raise(choice.score as f32 * DOWN);
            self.leader = Some(choice);
        }
    }

    #[inline(always)]
    fn decide<S: Simd>(
        &mut self,
        simd: S,
        contenders: &[Contender],
        own: Residuals<'_>,
        exact: &mut Exact<'_>,
    ) -> Option<usize> {
        let at = |place: Option<u32>| place.map(|k| &contenders[k as usize]);
        let all = || successors(at(self.newest), move |contender| at(contender.before));
        let least = self.least;
        let mut alive = all().filter(|contender| contender.most >= least);
        let mut furthest = alive.next();
        if let (None, Some(only), None) = (&self.leader, furthest, alive.next())
            && least > NOTHING
        {
            return Some(only.atom as usize);
        }
        // The one that can reach furthest comes first: behind it, few others are left.
        for contender in all() {
            furthest = furthest.filter(|other| other.most >= contender.most).or(Some(contender));
        }
        let residual = own.row(self.row);
        let first = furthest.map(|contender| contender.atom);
        let others = all().filter(|contender| Some(contender.atom) != first);
        for contender in furthest.into_iter().chain(others) {
            if contender.most >= self.least {
                self.compute(simd, contender.atom as usize, residual, exact);
            }
        }
        self.leader.as_ref().map(|leader| leader.atom)
    }
}

/// A bit for each lane that is not negative, the first lane's the lowest.
#[inline(always)]
fn reaching<S: Simd>(simd: S, reach: S::f32s) -> u32 {
    let mask = simd.greater_than_or_equal_f32s(reach, simd.splat_f32s(0.0));
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
