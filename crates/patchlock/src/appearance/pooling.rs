//! Alignment pooling (Eq. 10-11): the share of a patch's code that lies on atoms of its own location.
//!
//! The coefficients of all templates are added for each location and divided by their total; of the resulting vector only the entry
//! of the patch's own location is kept (the diagonal of `diag(Z)`, `F_i` at the large and `G_i` at the small scale).

use crate::config::Coefficients;
use crate::sparse::codes::Code;

/// How codes are pooled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PoolRules {
    /// Which part of the signed coefficients counts.
    pub coefficients: Coefficients,
    /// Whether to divide by the total.
    pub divide: bool,
}

/// The pooled feature of the patch at `location` of `locations`: 0 to 1 when divided, and 0 for an empty code.
pub fn own_share(code: &Code, location: usize, locations: usize, rules: PoolRules) -> f64 {
    let (mut own, mut total) = (0.0, 0.0);
    for (atom, x) in code.entries() {
        let amount = match rules.coefficients {
            Coefficients::Absolute => x.abs(),
            Coefficients::Positive => x.max(0.0),
        };
        total += amount;
        if atom % locations == location {
            own += amount;
        }
    }
    match rules.divide {
        true if total > 0.0 => own / total,
        true => 0.0,
        false => own,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAPER: PoolRules = PoolRules { coefficients: Coefficients::Absolute, divide: true };

    /// Eq. 10 as it stands: all coefficients in one long vector, summed over templates, divided, and the diagonal taken.
    fn as_written(code: &Code, location: usize, locations: usize) -> f64 {
        let mut alpha = vec![0.0; 10 * locations];
        code.entries().for_each(|(atom, x)| alpha[atom] = x.abs());
        let pooled: Vec<f64> =
            (0..locations).map(|l| (0..10).map(|j| alpha[j * locations + l]).sum()).collect();
        pooled[location] / pooled.iter().sum::<f64>()
    }

    #[test]
    fn it_is_the_diagonal_of_eq_10() {
        let code = Code::new(&[4, 13, 31, 85], &[0.5, -0.25, 0.3, -0.1]);
        for location in 0..9 {
            let got = own_share(&code, location, 9, PAPER);
            assert!((got - as_written(&code, location, 9)).abs() < 1e-15);
        }
        let shares: f64 = (0..9).map(|l| own_share(&code, l, 9, PAPER)).sum();
        assert!((shares - 1.0).abs() < 1e-12);
    }

    #[test]
    fn options_and_empty_codes() {
        let code = Code::new(&[4, 13], &[0.5, -0.25]);
        let positive = PoolRules { coefficients: Coefficients::Positive, ..PAPER };
        assert_eq!(own_share(&code, 4, 9, positive), 1.0);
        assert_eq!(own_share(&code, 4, 9, PoolRules { divide: false, ..PAPER }), 0.75);
        assert_eq!(own_share(&Code::default(), 4, 9, PAPER), 0.0);
    }
}
