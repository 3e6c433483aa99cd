//! The screen: finds in `f32` which atoms could win a step, and lets `f64` decide among them.
//! Its bounds are derived in [`batched`](super::batched).

use crate::config::Selection;
use crate::sparse::dictionary::LANES;

/// The unit roundoff of `f32`.
pub const U: f64 = 1.0 / 16_777_216.0;

/// `t` of the bounds.
pub const SLACK: f64 = 1.0 / 2048.0;

/// `1 + 2 t`: covers the slack and all relative roundings.
pub const WIDEN: f32 = 1.0 + 2.0 * SLACK as f32;

/// Marks atoms that can no longer be chosen, in a row of lower bounds of `||d_res||^2`. Subtracting leaves it as it is.
pub const DEAD: f32 = f32::NEG_INFINITY;

/// Where the bounds say nothing any more; keeps them finite in `f32`.
const NO_BOUND: f64 = 1e30;

/// `||d_res||^2` as the screen keeps it.
pub fn alive(left: f64, min_residual: f64) -> f32 {
    if left < min_residual { DEAD } else { left as f32 }
}

/// `(1 + 1/t) e^2`.
pub fn widened_square(error: f64) -> f32 {
    ((1.0 + 1.0 / SLACK) * error * error).min(NO_BOUND) as f32
}

/// How far above the screened score the true one may be.
#[derive(Debug, Clone, Copy)]
pub struct Bound {
    added: f32,
    divided: bool,
}

impl Bound {
    /// The bound for columns whose squared errors add to `squared_errors`.
    pub fn new(squared_errors: f64, selection: Selection) -> Self {
        Self {
            added: widened_square(squared_errors.sqrt()),
            divided: selection == Selection::OrderRecursive,
        }
    }
}

/// Adds the candidate's squared correlations to the shared columns' (`squares += own^2`) and returns the atom that looks best, if
/// any does.
#[inline(always)]
pub fn screen(
    squares: &mut [f32],
    own: &[f32],
    left: &[f32],
    selection: Selection,
) -> Option<usize> {
    let divided = selection == Selection::OrderRecursive;
    let mut best_square = [0.0f32; LANES];
    let mut best_left = [1.0f32; LANES];
    let mut best_chunk = [u32::MAX; LANES];
    let chunks = own.as_chunks::<LANES>().0.iter().zip(left.as_chunks::<LANES>().0);
    for (chunk, ((own, left), squares)) in
        chunks.zip(squares.as_chunks_mut::<LANES>().0).enumerate()
    {
        for lane in 0..LANES {
            let square = squares[lane] + own[lane] * own[lane];
            squares[lane] = square;
            let over = if divided { left[lane] } else { 1.0 };
            // a / b > c / d without the division, for positive b and d.
            let better = (square * best_left[lane] > best_square[lane] * over) & (left[lane] > 0.0);
            best_square[lane] = if better { square } else { best_square[lane] };
            best_left[lane] = if better { over } else { best_left[lane] };
            best_chunk[lane] = if better { chunk as u32 } else { best_chunk[lane] };
        }
    }
    let found = (0..LANES).filter(|&lane| best_chunk[lane] != u32::MAX);
    let best = found.max_by(|&a, &b| {
        (best_square[a] * best_left[b]).total_cmp(&(best_square[b] * best_left[a]))
    });
    best.map(|lane| best_chunk[lane] as usize * LANES + lane)
}

/// The atom with the largest exact score among all that could have it; the first of equal ones, none where no score is positive.
/// `exact` gives the sum of squared correlations and `||d_res||^2` in `f64`, nothing for an atom that is not eligible.
#[inline(always)]
pub fn best_exactly(
    look: Option<usize>,
    squares: &[f32],
    left: &[f32],
    bound: &Bound,
    exact: impl Fn(usize) -> Option<(f64, f64)>,
) -> Option<usize> {
    let score = |k: usize| {
        let (square, left) = exact(k)?;
        let score = if bound.divided { square / left } else { square };
        (score > 0.0).then_some((score, k))
    };
    let mut best = look.and_then(score);
    let least = best.map_or(0.0, |(score, _)| score as f32);
    let chunks = squares.as_chunks::<LANES>().0.iter().zip(left.as_chunks::<LANES>().0);
    for (chunk, (squares, left)) in chunks.enumerate() {
        let mut reaches = [false; LANES];
        for lane in 0..LANES {
            let over = if bound.divided { left[lane] } else { 1.0 };
            reaches[lane] =
                (squares[lane] * WIDEN + bound.added >= least * over) & (left[lane] > DEAD);
        }
        if !reaches.iter().fold(false, |any, &reach| any | reach) {
            continue;
        }
        for lane in (0..LANES).filter(|&lane| reaches[lane]) {
            let k = chunk * LANES + lane;
            if look == Some(k) {
                continue;
            }
            if let Some(other) = score(k) {
                let wins = best.is_none_or(|b| other.0 > b.0 || (other.0 == b.0 && other.1 < b.1));
                best = if wins { Some(other) } else { best };
            }
        }
    }
    best.map(|(_, k)| k)
}

/// `to -= from * factor`.
#[inline(always)]
pub fn subtract(to: &mut [f32], from: &[f32], factor: f32) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to -= from * factor);
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
