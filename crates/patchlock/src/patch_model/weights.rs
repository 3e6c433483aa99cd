//! Masked reconstruction errors and position weights (Eq. 12-14, 18-19).

use crate::patch_model::sparse::codes::{Code, MAX_ATOMS};
use crate::patch_model::sparse::dictionary::Dictionary;

/// Samples that are processed together.
const LANES: usize = 16;

/// `||r - D a_own||^2`, where `a_own` keeps the code's coefficients for atoms of the patch's own
/// location, without a refit (Eq. 12, 18). The error of a patch of zero norm is infinite, so that
/// it counts as hidden. The order of the sums does not depend on the vector width.
#[inline(always)]
pub fn masked_error(dictionary: &Dictionary, patch: &[f32], code: &Code, location: usize) -> f64 {
    if patch.iter().all(|&v| v == 0.0) {
        return f64::INFINITY;
    }
    let mut own: [(&[f32], f64); MAX_ATOMS] = Default::default();
    let mut count = 0;
    for (atom, x) in code.entries().filter(|&(atom, _)| dictionary.location(atom) == location) {
        own[count] = (dictionary.atom(atom), x);
        count += 1;
    }
    let own = &own[..count];
    let (mut sums, mut rest) = ([0.0; LANES], 0.0);
    let (wide, narrow) = patch.as_chunks::<LANES>();
    for (k, samples) in wide.iter().enumerate() {
        let mut explained = [0.0; LANES];
        for (atom, x) in own {
            let atom = &atom.as_chunks::<LANES>().0[k];
            for lane in 0..LANES {
                explained[lane] += f64::from(atom[lane]) * x;
            }
        }
        for lane in 0..LANES {
            let left = f64::from(samples[lane]) - explained[lane];
            sums[lane] += left * left;
        }
    }
    for (k, &sample) in narrow.iter().enumerate() {
        let index = wide.len() * LANES + k;
        let explained: f64 = own.iter().map(|(atom, x)| f64::from(atom[index]) * x).sum();
        rest += (f64::from(sample) - explained).powi(2);
    }
    sums.iter().sum::<f64>() + rest
}

/// The position part of each location's weight, `exp(-beta (|row - centre| + |column - centre|))`.
/// Rows and columns are counted `1..=per_side`, and the centre is `(1 + per_side) / 2`. All 1 if
/// not `enabled`.
pub fn position_weights(per_side: usize, beta: f64, enabled: bool) -> Vec<f64> {
    let centre = (1.0 + per_side as f64) / 2.0;
    let away = |k: usize| (k as f64 + 1.0 - centre).abs();
    let weight = |i: usize| (-beta * (away(i / per_side) + away(i % per_side))).exp();
    (0..per_side * per_side).map(|i| if enabled { weight(i) } else { 1.0 }).collect()
}

/// `omega = 1 + kappa * position weight` (Eq. 13, 19).
pub fn patch_weight(visible: bool, position_weight: f64) -> f64 {
    if visible { 1.0 + position_weight } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_eq_13() {
        let w = position_weights(3, 0.8, true);
        assert_eq!(w[4], 1.0);
        assert!((w[1] - (-0.8f64).exp()).abs() < 1e-15);
        assert!((w[8] - (-1.6f64).exp()).abs() < 1e-15);
        let small = position_weights(13, 0.8, true);
        assert!((small[0] - (-0.8 * 12.0f64).exp()).abs() < 1e-18);
        assert_eq!((patch_weight(true, w[4]), patch_weight(false, w[4])), (2.0, 1.0));
        assert_eq!(position_weights(3, 0.8, false), [1.0; 9]);
    }

    #[test]
    fn only_atoms_of_the_patchs_own_location_count() {
        // Two locations and two templates; the atoms are the unit vectors of a space of four
        // dimensions.
        let axes: Vec<f32> = (0..16).map(|k| if k % 5 == 0 { 1.0 } else { 0.0 }).collect();
        let dictionary = Dictionary::new(4, 2, axes);
        let patch = [0.5, 0.5, 0.5, 0.5];
        let code = Code::new(&[0, 1, 2], &[0.5, 0.5, 0.5]);
        assert!((masked_error(&dictionary, &patch, &code, 0) - 0.5).abs() < 1e-12);
        assert!((masked_error(&dictionary, &patch, &code, 1) - 0.75).abs() < 1e-12);
        assert!((masked_error(&dictionary, &patch, &Code::default(), 1) - 1.0).abs() < 1e-12);
        assert_eq!(masked_error(&dictionary, &[0.0; 4], &code, 0), f64::INFINITY);
    }
}
