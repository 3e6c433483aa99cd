//! Alignment pooling (Eq. 10-11): the share of a patch's code that lies on atoms of its own
//! location.
//!
//! For each location the absolute coefficients of all templates are summed and divided by the total
//! of all locations. Of the resulting vector, only the entry of the patch's own location is kept
//! (the diagonal of `diag(Z)`; `F_i` for large and `G_i` for small patches).

use crate::patch_model::sparse::codes::Code;

/// The pooled feature of the patch at `location` of `locations`, from 0 to 1; 0 for an empty code.
pub fn own_share(code: &Code, location: usize, locations: usize) -> f64 {
    let (mut own, mut total) = (0.0, 0.0);
    for (atom, x) in code.entries() {
        total += x.abs();
        if atom % locations == location {
            own += x.abs();
        }
    }
    if total > 0.0 { own / total } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Eq. 10 as written: all coefficients in one long vector, summed over templates, normalised,
    /// and the diagonal taken.
    fn as_written(code: &Code, location: usize, locations: usize) -> f64 {
        let mut alpha = vec![0.0; 10 * locations];
        code.entries().for_each(|(atom, x)| alpha[atom] = x.abs());
        let pooled: Vec<f64> =
            (0..locations).map(|l| (0..10).map(|j| alpha[j * locations + l]).sum()).collect();
        pooled[location] / pooled.iter().sum::<f64>()
    }

    #[test]
    fn own_share_is_the_diagonal_of_eq_10() {
        let code = Code::new(&[4, 13, 31, 85], &[0.5, -0.25, 0.3, -0.1]);
        for location in 0..9 {
            let got = own_share(&code, location, 9);
            assert!((got - as_written(&code, location, 9)).abs() < 1e-15);
        }
        let shares: f64 = (0..9).map(|l| own_share(&code, l, 9)).sum();
        assert!((shares - 1.0).abs() < 1e-12);
    }

    #[test]
    fn an_empty_code_has_no_share() {
        assert_eq!(own_share(&Code::default(), 4, 9), 0.0);
    }
}
