//! The reconstruction with trivial templates (Eq. 15-16): a code in an orthonormal basis and a sparse error.
//!
//! ```text
//! min_{q, e}  ||y - U q - e||^2 / 2 + lambda (||q||_1 + ||e||_1)
//! ```
//!
//! `U` (`dim x k`) has orthonormal columns, so for a given `e` the best `q` is the soft threshold of `U^T (y - e)`, and for a given `q`
//! the best `e` is that of `y - U q`. Taking turns is a proximal gradient step of length 1 on what remains of the problem when `e` is
//! eliminated, and converges to the exact solution. Where many samples are outliers it does so slowly; Nesterov's momentum, started
//! again whenever it points uphill (O'Donoghue, Candes, 2015), makes that some hundred turns.

use nalgebra::{DMatrix, DVector};

/// Turns taken at most.
const MAX_TURNS: usize = 10_000;

/// It has converged when no coefficient moved by more than this times lambda.
const TOLERANCE: f64 = 1e-9;

/// Coefficients in the basis, and the sparse error.
#[derive(Debug, Clone, PartialEq)]
pub struct Reconstruction {
    /// `q`, one a column of the basis.
    pub coefficients: DVector<f64>,
    /// `e`, one a sample.
    pub error: DVector<f64>,
}

/// Solves the problem for `signal` (`y`) in `basis` (`U`).
pub fn reconstruct(basis: &DMatrix<f64>, signal: &DVector<f64>, lambda: f64) -> Reconstruction {
    let error_of = |q: &DVector<f64>| (signal - basis * q).map(|v| soft_threshold(v, lambda));
    let turn =
        |q: &DVector<f64>| basis.tr_mul(&(signal - error_of(q))).map(|v| soft_threshold(v, lambda));
    let mut q = DVector::zeros(basis.ncols());
    let (mut ahead, mut momentum) = (q.clone(), 1.0f64);
    for _ in 0..MAX_TURNS {
        let next = turn(&ahead);
        let (step, correction) = (&next - &q, &ahead - &next);
        if step.amax().max(correction.amax()) <= TOLERANCE * lambda.max(TOLERANCE) {
            break;
        }
        if correction.dot(&step) > 0.0 {
            momentum = 1.0;
        }
        let following = (1.0 + (1.0 + 4.0 * momentum * momentum).sqrt()) / 2.0;
        ahead = &next + step * ((momentum - 1.0) / following);
        (q, momentum) = (next, following);
    }
    Reconstruction { error: error_of(&q), coefficients: q }
}

/// `v` moved towards 0 by `lambda`, but not past it.
fn soft_threshold(v: f64, lambda: f64) -> f64 {
    (v.abs() - lambda).max(0.0).copysign(v)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// At the minimum the gradient of the smooth part is `-lambda sign(x)` where `x` is not 0, and within `lambda` where it is.
    fn violation(gradient: &DVector<f64>, x: &DVector<f64>, lambda: f64) -> f64 {
        let each = gradient.iter().zip(x.iter()).map(|(&g, &x)| {
            if x == 0.0 { (g.abs() - lambda).max(0.0) } else { (g + lambda * x.signum()).abs() }
        });
        each.fold(0.0, f64::max)
    }

    proptest! {
        #[test]
        fn meets_the_conditions_of_optimality(
            samples in prop::collection::vec(-1.0..1.0f64, 40 * 6),
            signal in prop::collection::vec(-0.3..0.3f64, 40),
            lambda in 0.001..0.1f64,
        ) {
            let basis = DMatrix::from_vec(40, 6, samples).qr().q();
            let signal = DVector::from_vec(signal);
            let r = reconstruct(&basis, &signal, lambda);
            let residual = &signal - &basis * &r.coefficients - &r.error;
            prop_assert!(violation(&(-basis.tr_mul(&residual)), &r.coefficients, lambda) < 1e-7 * lambda.max(0.01));
            prop_assert!(violation(&(-&residual), &r.error, lambda) < 1e-9);
        }
    }

    #[test]
    fn without_penalty_the_signal_is_explained_whole() {
        let basis = DMatrix::identity(4, 2);
        let signal = DVector::from_vec(vec![1.0, 2.0, 3.0, 4.0]);
        let r = reconstruct(&basis, &signal, 0.0);
        assert!((&signal - &basis * &r.coefficients - &r.error).amax() < 1e-12);
    }
}
