//! The reconstruction with trivial templates (Eq. 15-16): a code in an orthonormal basis and a
//! sparse error.
//!
//! ```text
//! min_{q, e}  ||y - U q - e||^2 / 2 + lambda (||q||_1 + ||e||_1)
//! ```
//!
//! `U` (`dim x k`) has orthonormal columns. So the best `q` for a given `e` is the soft threshold
//! of `U^T (y - e)`, and the best `e` for a given `q` is the soft threshold of `y - U q`.
//! Alternating between them is a proximal gradient method with step length 1 on the problem with
//! `e` eliminated, and converges to the exact solution. With many outliers it converges slowly.
//! Nesterov's momentum, restarted whenever it points uphill (O'Donoghue, Candes, 2015), reduces it
//! to about a hundred iterations.
//!
//! Plain loops and `dot_wide`. With AVX2 they take 44 % of the plain instructions
//! (`benchmarks/record/speed.md`).

use crate::numeric::dot_wide;
use crate::numeric::instructions::{Instructions, dispatch};
use pulp::Simd;

/// Maximum number of iterations.
const MAX_ITERATIONS: usize = 10_000;

/// Converged when no coefficient moved by more than this times lambda.
const TOLERANCE: f64 = 1e-9;

/// Coefficients in the basis and the sparse error, with their buffers. Reuse a value to avoid
/// allocations.
#[derive(Debug, Clone, Default)]
pub struct Reconstruction {
    coefficients: Vec<f64>,
    error: Vec<f64>,
    fit: Vec<f64>,
    /// The coefficients extrapolated by momentum, and the result of a step from there.
    extrapolated: Vec<f64>,
    next: Vec<f64>,
}

impl Reconstruction {
    /// `q`, one coefficient per column of the basis.
    #[cfg(feature = "internals")]
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients
    }

    /// `e`, one value per sample.
    #[cfg(feature = "internals")]
    pub fn error(&self) -> &[f64] {
        &self.error
    }

    /// `U q`, one value per sample.
    pub fn fit(&self) -> &[f64] {
        &self.fit
    }

    /// Solves the problem for `signal` (`y`) in `basis` (`U`). The columns of the basis are stored
    /// one after the other and have the signal's length.
    pub fn solve(&mut self, basis: &[f64], signal: &[f64], lambda: f64) {
        let problem = Problem { basis, signal, lambda };
        dispatch!(Instructions::default(), |simd| {
            let Reconstruction { coefficients, error, fit, extrapolated, next } = self;
            for part in [&mut *coefficients, &mut *extrapolated, &mut *next] {
                part.clear();
                part.resize(problem.columns().len(), 0.0);
            }
            let mut momentum = 1.0f64;
            for _ in 0..MAX_ITERATIONS {
                problem.step(simd, extrapolated, (fit, error), next);
                let (mut moved, mut uphill) = (0.0f64, 0.0);
                let each = next.iter().zip(&*coefficients).zip(&*extrapolated);
                for ((next, last), extrapolated) in each {
                    let (step, correction) = (next - last, extrapolated - next);
                    moved = moved.max(step.abs()).max(correction.abs());
                    uphill += correction * step;
                }
                if moved <= TOLERANCE * problem.lambda.max(TOLERANCE) {
                    break;
                }
                if uphill > 0.0 {
                    momentum = 1.0;
                }
                let next_momentum = (1.0 + (1.0 + 4.0 * momentum * momentum).sqrt()) / 2.0;
                let extrapolation = (momentum - 1.0) / next_momentum;
                let each = extrapolated.iter_mut().zip(&*next).zip(&*coefficients);
                for ((extrapolated, next), last) in each {
                    *extrapolated = next + (next - last) * extrapolation;
                }
                std::mem::swap(coefficients, next);
                momentum = next_momentum;
            }
            problem.explain(coefficients, fit, error);
        });
    }
}

/// The input of the problem.
#[derive(Clone, Copy)]
struct Problem<'a> {
    basis: &'a [f64],
    signal: &'a [f64],
    lambda: f64,
}

impl Problem<'_> {
    #[inline(always)]
    fn columns(&self) -> std::slice::ChunksExact<'_, f64> {
        self.basis.chunks_exact(self.signal.len().max(1))
    }

    /// `U q`, and the best `e` for it.
    #[inline(always)]
    fn explain(&self, q: &[f64], fit: &mut Vec<f64>, error: &mut Vec<f64>) {
        fit.clear();
        fit.resize(self.signal.len(), 0.0);
        for (column, q) in self.columns().zip(q) {
            fit.iter_mut().zip(column).for_each(|(fit, u)| *fit += u * q);
        }
        let residual = self.signal.iter().zip(fit).map(|(y, fit)| y - *fit);
        error.clear();
        error.extend(residual.map(|v| soft_threshold(v, self.lambda)));
    }

    /// The best `q` for the best `e` of `from`. `fit` and `error` are overwritten.
    #[inline(always)]
    fn step<S: Simd>(
        &self,
        simd: S,
        from: &[f64],
        (fit, error): (&mut Vec<f64>, &mut Vec<f64>),
        next: &mut [f64],
    ) {
        self.explain(from, fit, error);
        // From here on, `error` holds the signal that the basis has to explain.
        error.iter_mut().zip(self.signal).for_each(|(e, y)| *e = y - *e);
        for (next, column) in next.iter_mut().zip(self.columns()) {
            *next = soft_threshold(dot_wide(simd, column, error), self.lambda);
        }
    }
}

/// `v` moved towards 0 by `lambda`, but not beyond 0.
#[inline(always)]
fn soft_threshold(v: f64, lambda: f64) -> f64 {
    (v.abs() - lambda).max(0.0).copysign(v)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    fn solve(basis: &DMatrix<f64>, signal: &DVector<f64>, lambda: f64) -> [DVector<f64>; 2] {
        let mut found = Reconstruction::default();
        found.solve(basis.as_slice(), signal.as_slice(), lambda);
        let [q, e] = [found.coefficients(), found.error()].map(DVector::from_column_slice);
        assert!((basis * &q - DVector::from_column_slice(found.fit())).amax() < 1e-12);
        [q, e]
    }

    /// At the minimum, the gradient of the smooth part is `-lambda sign(x)` where `x` is not 0, and
    /// within `lambda` of 0 elsewhere.
    fn violation(gradient: &DVector<f64>, x: &DVector<f64>, lambda: f64) -> f64 {
        let each = gradient.iter().zip(x.iter()).map(|(&g, &x)| {
            if x == 0.0 { (g.abs() - lambda).max(0.0) } else { (g + lambda * x.signum()).abs() }
        });
        each.fold(0.0, f64::max)
    }

    proptest! {
        #[test]
        fn the_solution_meets_the_optimality_conditions(
            samples in prop::collection::vec(-1.0..1.0f64, 40 * 6),
            signal in prop::collection::vec(-0.3..0.3f64, 40),
            lambda in 0.001..0.1f64,
        ) {
            let basis = DMatrix::from_vec(40, 6, samples).qr().q();
            let signal = DVector::from_vec(signal);
            let [q, e] = solve(&basis, &signal, lambda);
            let residual = &signal - &basis * &q - &e;
            prop_assert!(violation(&(-basis.tr_mul(&residual)), &q, lambda) < 1e-7 * lambda.max(0.01));
            prop_assert!(violation(&(-&residual), &e, lambda) < 1e-9);
        }
    }

    #[test]
    fn without_penalty_the_signal_is_explained_completely() {
        let basis = DMatrix::identity(4, 2);
        let signal = DVector::from_vec(vec![1.0, 2.0, 3.0, 4.0]);
        let [q, e] = solve(&basis, &signal, 0.0);
        assert!((&signal - &basis * &q - &e).amax() < 1e-12);
    }

    #[test]
    fn a_value_can_be_reused_for_another_size_and_without_a_basis() {
        let mut found = Reconstruction::default();
        found.solve(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0], &[1.0, 2.0, 3.0], 0.5);
        found.solve(&[], &[1.0, -2.0], 0.5);
        assert_eq!((found.coefficients(), found.fit()), (&[][..], &[0.0, 0.0][..]));
        assert_eq!(found.error(), [0.5, -1.5]);
        found.solve(&[], &[], 0.5);
        assert!(found.error().is_empty());
    }
}
