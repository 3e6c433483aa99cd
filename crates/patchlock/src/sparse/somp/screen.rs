//! The screen: finds in `f32` which atoms could win a step, and lets `f64` decide among them.
//! Its bounds are derived in [`batched`](super::batched).

use crate::config::{MAX_ATOMS, Selection};
use pulp::{Simd, bytemuck};
use std::slice;

/// The unit roundoff of `f32`.
pub const U: f64 = 1.0 / 16_777_216.0;

/// `t` of the bounds.
const SLACK: f64 = 1.0 / 2048.0;

/// `1 + 2 t`: covers the slack and all relative roundings.
const WIDEN: f32 = 1.0 + 2.0 * SLACK as f32;

/// Marks atoms that can no longer be chosen, in a row of lower bounds of `||d_res||^2`: no score is left over it.
pub const DEAD: f32 = f32::INFINITY;

/// `||d_res||^2` as the screen keeps it.
pub fn alive(left: f64, min_residual: f64) -> f32 {
    if left < min_residual { DEAD } else { left as f32 }
}

/// What is known of a candidate and of its shared columns before a step; all rows run over all atoms.
#[derive(Debug)]
pub struct Step<'a> {
    /// The candidate's correlations before any atom was chosen.
    pub own: &'a [f32],
    /// `w_1` with the candidate's `p`, if an atom was chosen.
    pub first: Option<(&'a [f32], f32)>,
    /// `w_2, w_3, ..`: rows one after the other.
    pub weights: &'a [f32],
    /// The candidate's `p` along each of them.
    pub along: &'a [f32],
    /// The shared columns' correlations after the first atom, rows one after the other, and their `p` along `w_2, w_3, ..`.
    pub columns: &'a [f32],
    /// As `along`, for each column.
    pub columns_along: &'a [[f32; MAX_ATOMS]],
    /// For each atom the sum of squares of `columns`.
    pub columns_squared: &'a [f32],
    /// `||d_res||^2` after the first atom, or [`DEAD`].
    pub left: &'a [f32],
}

/// What the screen finds in a step.
#[derive(Debug, Default)]
pub struct Screened {
    /// For each atom the sum of the squared correlations of all columns.
    squares: Vec<f32>,
    /// For each atom the lower bound of `||d_res||^2`, or [`DEAD`].
    left: Vec<f32>,
    /// The atom that looks best, if any does, and those that could be better.
    best: Option<usize>,
    contenders: Vec<usize>,
}

/// How scores are formed and how far above the screened one the true one may be.
#[derive(Debug, Clone, Copy)]
pub struct Bound {
    added: f32,
    divided: bool,
}

impl Bound {
    /// The bound for columns whose squared errors add to `squared_errors`.
    pub fn new(squared_errors: f64, selection: Selection) -> Self {
        Self {
            added: ((1.0 + 1.0 / SLACK) * squared_errors) as f32,
            divided: selection == Selection::OrderRecursive,
        }
    }

    /// What the squares are divided by: nothing in the textbook's form, but [`DEAD`] stays.
    #[inline(always)]
    fn divisor<S: Simd>(&self, simd: S, left: S::f32s) -> S::f32s {
        if self.divided {
            return left;
        }
        let dead = simd.greater_than_f32s(left, simd.splat_f32s(f32::MAX));
        simd.select_f32s(dead, left, simd.splat_f32s(1.0))
    }
}

impl Step<'_> {
    /// Scores all atoms.
    #[inline(always)]
    pub fn screen<S: Simd>(&self, simd: S, bound: &Bound, out: &mut Screened) {
        let stride = self.own.len();
        out.squares.resize(stride, 0.0);
        out.left.resize(stride, 0.0);
        let mut best = BestLanes::new(simd);
        let outputs =
            tiles_mut::<S>(&mut out.squares).iter_mut().zip(tiles_mut::<S>(&mut out.left));
        for (t, (squares, left)) in outputs.enumerate() {
            let mut own = tiles::<S>(self.own)[t];
            if let Some((weights, along)) = self.first {
                take_off(simd, &mut own, &tiles::<S>(weights)[t], along);
            }
            (*squares, *left) = if self.along.is_empty() {
                (tiles::<S>(self.columns_squared)[t], tiles::<S>(self.left)[t])
            } else {
                self.deep_tile(simd, t, &mut own)
            };
            add_squares(simd, squares, &own);
            best.follow(simd, t, squares, left, bound);
        }
        out.best = best.atom();
    }

    /// Behind the second atom and later: takes the weights off `own`, and returns the columns' sums of squares and the bounds of
    /// `||d_res||^2`.
    #[inline(always)]
    fn deep_tile<S: Simd>(&self, simd: S, t: usize, own: &mut Tile<S>) -> (Tile<S>, Tile<S>) {
        let stride = self.own.len();
        // Takes the rounding of the subtractions below off, so that what remains is a lower bound.
        let keep = simd.splat_f32s(1.0 - 8.0 * U as f32 * self.along.len() as f32);
        let mut left = tiles::<S>(self.left)[t].map(|l| simd.mul_f32s(l, keep));
        let weights = |j: usize| &tiles::<S>(&self.weights[j * stride..][..stride])[t];
        for (j, &along) in self.along.iter().enumerate() {
            take_off(simd, own, weights(j), along);
            for (left, &w) in left.iter_mut().zip(weights(j)) {
                *left = simd.mul_add_e_f32s(simd.neg_f32s(w), w, *left);
            }
        }
        let mut squares = [simd.splat_f32s(0.0); TILE];
        for (column, along) in self.columns.chunks_exact(stride).zip(self.columns_along) {
            let mut y = tiles::<S>(column)[t];
            for (j, &along) in along[..self.along.len()].iter().enumerate() {
                take_off(simd, &mut y, weights(j), along);
            }
            add_squares(simd, &mut squares, &y);
        }
        (squares, left)
    }
}

/// Vectors that are worked on together: enough to hide the latency of one.
const TILE: usize = 4;

type Tile<S> = [<S as Simd>::f32s; TILE];

#[inline(always)]
fn tiles<S: Simd>(row: &[f32]) -> &[Tile<S>] {
    S::as_simd_f32s(row).0.as_chunks().0
}

#[inline(always)]
fn tiles_mut<S: Simd>(row: &mut [f32]) -> &mut [Tile<S>] {
    S::as_mut_simd_f32s(row).0.as_chunks_mut().0
}

/// `y -= weights * along`.
#[inline(always)]
fn take_off<S: Simd>(simd: S, y: &mut Tile<S>, weights: &Tile<S>, along: f32) {
    let along = simd.splat_f32s(-along);
    for i in 0..TILE {
        y[i] = simd.mul_add_e_f32s(weights[i], along, y[i]);
    }
}

/// `squares += y^2`.
#[inline(always)]
fn add_squares<S: Simd>(simd: S, squares: &mut Tile<S>, y: &Tile<S>) {
    for i in 0..TILE {
        squares[i] = simd.mul_add_e_f32s(y[i], y[i], squares[i]);
    }
}

/// The best score of each lane so far.
struct BestLanes<S: Simd> {
    square: S::f32s,
    over: S::f32s,
    vector: S::u32s,
}

impl<S: Simd> BestLanes<S> {
    #[inline(always)]
    fn new(simd: S) -> Self {
        Self {
            square: simd.splat_f32s(0.0),
            over: simd.splat_f32s(1.0),
            vector: simd.splat_u32s(u32::MAX),
        }
    }

    #[inline(always)]
    fn follow(&mut self, simd: S, t: usize, squares: &Tile<S>, left: &Tile<S>, bound: &Bound) {
        for i in 0..TILE {
            let over = bound.divisor(simd, left[i]);
            // a / b > c / d without the division, for positive b and d.
            let ahead = simd.greater_than_f32s(
                simd.mul_f32s(squares[i], self.over),
                simd.mul_f32s(self.square, over),
            );
            let positive = simd.greater_than_f32s(left[i], simd.splat_f32s(0.0));
            let ahead = simd.and_m32s(ahead, positive);
            self.square = simd.select_f32s(ahead, squares[i], self.square);
            self.over = simd.select_f32s(ahead, over, self.over);
            let vector = simd.splat_u32s((t * TILE + i) as u32);
            self.vector = simd.select_u32s(ahead, vector, self.vector);
        }
    }

    /// The best atom of all lanes, if any had a score.
    #[inline(always)]
    fn atom(&self) -> Option<usize> {
        let square: &[f32] = bytemuck::cast_slice(slice::from_ref(&self.square));
        let over: &[f32] = bytemuck::cast_slice(slice::from_ref(&self.over));
        let vector: &[u32] = bytemuck::cast_slice(slice::from_ref(&self.vector));
        let mut best: Option<usize> = None;
        for lane in 0..S::F32_LANES {
            let ahead = |b: usize| square[lane] * over[b] > square[b] * over[lane];
            if vector[lane] != u32::MAX && best.is_none_or(ahead) {
                best = Some(lane);
            }
        }
        best.map(|lane| vector[lane] as usize * S::F32_LANES + lane)
    }
}

/// Computes atoms in `f64`.
pub trait Exact {
    /// The sum of squared correlations of an atom with the residuals, and its `||d_res||^2`; nothing for one that is not eligible.
    fn squares_and_left(&self, k: usize) -> Option<(f64, f64)>;
}

impl Screened {
    /// The atom with the largest exact score among all that could have it; the first of equal ones, none where no score is positive.
    #[inline(always)]
    pub fn best_exactly<S: Simd>(
        &mut self,
        simd: S,
        bound: &Bound,
        exact: &impl Exact,
    ) -> Option<usize> {
        let mut best = Leader::default();
        if let Some(k) = self.best {
            best.challenge(k, exact.squares_and_left(k), bound);
        }
        self.find_contenders(simd, best.score as f32, bound);
        for &k in &self.contenders {
            best.challenge(k, exact.squares_and_left(k), bound);
        }
        best.atom
    }

    /// All atoms but the best-looking one whose score could reach `least`.
    #[inline(always)]
    fn find_contenders<S: Simd>(&mut self, simd: S, least: f32, bound: &Bound) {
        self.contenders.clear();
        let (squares, left) = (tiles::<S>(&self.squares), tiles::<S>(&self.left));
        for (t, (squares, left)) in squares.iter().zip(left).enumerate() {
            let mut any = simd.splat_f32s(f32::NEG_INFINITY);
            for i in 0..TILE {
                let over = simd.mul_f32s(bound.divisor(simd, left[i]), simd.splat_f32s(least));
                let reach = simd.mul_f32s(squares[i], simd.splat_f32s(WIDEN));
                let reach = simd.add_f32s(reach, simd.splat_f32s(bound.added));
                any = simd.max_f32s(simd.sub_f32s(reach, over), any);
            }
            // Only a dead atom's lane can fail to be a number, and whether it is then passed over does not matter.
            let far = simd.less_than_f32s(any, simd.splat_f32s(0.0));
            if simd.first_true_m32s(simd.not_m32s(far)) == S::F32_LANES {
                continue;
            }
            let first = t * TILE * S::F32_LANES;
            for k in first..first + TILE * S::F32_LANES {
                let divisor = if bound.divided { self.left[k] } else { 1.0 };
                let reaches = divisor * least <= self.squares[k] * WIDEN + bound.added;
                if reaches && self.left[k] != DEAD && self.best != Some(k) {
                    self.contenders.push(k);
                }
            }
        }
    }
}
/// The best exact score so far.
#[derive(Default)]
struct Leader {
    score: f64,
    atom: Option<usize>,
}

impl Leader {
    #[inline(always)]
    fn challenge(&mut self, k: usize, squares_and_left: Option<(f64, f64)>, bound: &Bound) {
        let Some((square, left)) = squares_and_left else { return };
        let score = if bound.divided { square / left } else { square };
        let first = self.atom.is_none_or(|atom| k < atom);
        if score > self.score || (score == self.score && score > 0.0 && first) {
            *self = Self { score, atom: Some(k) };
        }
    }
}

/// The inner product in `f64`, in an order that vector units can follow.
#[inline(always)]
pub fn dot<A: Copy + Into<f64>, B: Copy + Into<f64>>(a: &[A], b: &[B]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<8>(), b.as_chunks::<8>());
    let mut sums = [0.0; 8];
    for (a, b) in a.iter().zip(b) {
        for lane in 0..8 {
            sums[lane] += a[lane].into() * b[lane].into();
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(&a, &b)| a.into() * b.into()).sum();
    sums.iter().sum::<f64>() + rest
}

/// Projects the unit vector `direction` out of `vector` and returns their inner product.
#[inline(always)]
pub fn project_out(vector: &mut [f64], direction: &[f64]) -> f64 {
    let along = dot(vector, direction);
    vector.iter_mut().zip(direction).for_each(|(v, d)| *v -= along * d);
    along
}
