//! The patches of a template (Eq. 1): overlapping squares on a regular grid, each normalised.

/// The grid of patches in a square template: `per_side * per_side` squares of side `patch`, `step` samples apart.
/// Location `i` is row `i / per_side`, column `i % per_side`. A patch is a row-major vector of `patch * patch` samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PatchGrid {
    template_side: usize,
    patch: usize,
    step: usize,
    per_side: usize,
    subtract_mean: bool,
}

impl PatchGrid {
    /// A grid; `patch` must not exceed `template_side`, and none may be 0.
    pub fn new(template_side: usize, patch: usize, step: usize, subtract_mean: bool) -> Self {
        let per_side = template_side.saturating_sub(patch) / step.max(1) + 1;
        Self { template_side, patch, step, per_side, subtract_mean }
    }

    /// Number of locations: 169 small, 9 large ones in the paper.
    pub fn locations(&self) -> usize {
        self.per_side * self.per_side
    }

    /// Locations along one side.
    pub fn per_side(&self) -> usize {
        self.per_side
    }

    /// Side of a patch, in samples.
    pub fn patch(&self) -> usize {
        self.patch
    }

    /// Samples of a patch.
    pub fn dim(&self) -> usize {
        self.patch * self.patch
    }

    /// Row and column, in samples, of a location's first sample.
    pub fn origin(&self, location: usize) -> (usize, usize) {
        (location / self.per_side * self.step, location % self.per_side * self.step)
    }

    /// Cuts the patch at `location` out of a template and normalises it.
    pub fn cut(&self, template: &[f32], location: usize, out: &mut [f32]) {
        let (top, left) = self.origin(location);
        for (row, line) in out.chunks_exact_mut(self.patch).enumerate() {
            let start = (top + row) * self.template_side + left;
            line.copy_from_slice(&template[start..start + self.patch]);
        }
        if self.subtract_mean {
            subtract_mean(out);
        }
        normalise(out);
    }

    /// All patches of a template, location after location.
    pub fn cut_all(&self, template: &[f32]) -> Vec<f32> {
        let mut all = vec![0.0; self.locations() * self.dim()];
        for (location, out) in all.chunks_exact_mut(self.dim()).enumerate() {
            self.cut(template, location, out);
        }
        all
    }
}

/// Divides by the L2 norm. A vector without one (all zero) becomes zero.
pub fn normalise(vector: &mut [f32]) {
    let norm = vector.iter().map(|&v| f64::from(v) * f64::from(v)).sum::<f64>().sqrt();
    if norm > 0.0 && norm.is_finite() {
        vector.iter_mut().for_each(|v| *v = (f64::from(*v) / norm) as f32);
    } else {
        vector.fill(0.0);
    }
}

/// Subtracts the mean; what remains of a constant vector is rounding noise, and becomes zero.
fn subtract_mean(vector: &mut [f32]) {
    let mean = vector.iter().map(|&v| f64::from(v)).sum::<f64>() / vector.len() as f64;
    let largest = vector.iter().fold(0.0f32, |m, v| m.max(v.abs()));
    vector.iter_mut().for_each(|v| *v = (f64::from(*v) - mean) as f32);
    if vector.iter().all(|v| v.abs() <= 4.0 * f32::EPSILON * largest) {
        vector.fill(0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn norm(v: &[f32]) -> f64 {
        v.iter().map(|&x| f64::from(x).powi(2)).sum::<f64>().sqrt()
    }

    #[test]
    fn the_papers_grids() {
        let (large, small) = (PatchGrid::new(32, 16, 8, false), PatchGrid::new(32, 8, 2, false));
        assert_eq!((large.locations(), large.dim()), (9, 256));
        assert_eq!((small.locations(), small.dim()), (169, 64));
        assert_eq!(small.origin(168), (24, 24));
        assert_eq!(large.origin(5), (8, 16));
    }

    #[test]
    fn patches_are_the_templates_samples_over_their_norm() {
        let template: Vec<f32> = (0..1024).map(|k| (k % 37) as f32 + 1.0).collect();
        let grid = PatchGrid::new(32, 8, 2, false);
        let mut patch = vec![0.0; 64];
        grid.cut(&template, 14, &mut patch);
        assert!((norm(&patch) - 1.0).abs() < 1e-6);
        let ratio = template[2 * 32 + 2] / patch[0];
        for (k, p) in patch.iter().enumerate() {
            assert!((p * ratio - template[(2 + k / 8) * 32 + 2 + k % 8]).abs() < 1e-4);
        }
        assert_eq!(grid.cut_all(&template)[14 * 64..15 * 64], patch);
    }

    #[test]
    fn zero_stays_zero_and_a_constant_without_its_mean_is_zero() {
        let mut zero = vec![0.0; 4];
        normalise(&mut zero);
        assert_eq!(zero, [0.0; 4]);
        let mut out = vec![1.0; 64];
        PatchGrid::new(32, 8, 2, true).cut(&[0.3; 1024], 5, &mut out);
        assert_eq!(out, [0.0; 64]);
    }
}
