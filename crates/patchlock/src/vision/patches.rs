//! The patches of a template (Eq. 1): overlapping squares on a regular grid, each normalised. The
//! bits are the same with all instructions.
//!
//! Plain loops. A template is normalised in 62 % of the time of plain instructions with AVX2 and in
//! 41 % with AVX-512; patches of 16 x 16 are cut in 72 % and 55 %, those of 8 x 8 in 101 % and 81 %
//! (`benchmarks/record/speed.md`).

use crate::numeric::dot;
use crate::numeric::instructions::{Instructions, dispatch};

/// The grid of patches in a square template: `per_side * per_side` squares of side `patch`, `step`
/// samples apart. Location `i` is row `i / per_side`, column `i % per_side`. A patch is a row-major
/// vector of `patch * patch` samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PatchGrid {
    template_side: usize,
    patch: usize,
    step: usize,
    per_side: usize,
    subtract_mean: bool,
}

impl PatchGrid {
    /// A grid. `patch` must not exceed `template_side`, and none of the three sizes may be 0.
    pub fn new(template_side: usize, patch: usize, step: usize, subtract_mean: bool) -> Self {
        let per_side = template_side.saturating_sub(patch) / step.max(1) + 1;
        Self { template_side, patch, step, per_side, subtract_mean }
    }

    /// Number of locations: 9 large and 169 small ones in the paper.
    pub fn locations(&self) -> usize {
        self.per_side * self.per_side
    }

    /// Number of locations along one side.
    pub fn per_side(&self) -> usize {
        self.per_side
    }

    /// Side of the templates, in samples.
    pub fn template_side(&self) -> usize {
        self.template_side
    }

    /// Side of a patch, in samples.
    pub fn patch(&self) -> usize {
        self.patch
    }

    /// Number of samples of a patch.
    pub fn dim(&self) -> usize {
        self.patch * self.patch
    }

    /// Row and column, in samples, of a location's first sample.
    pub fn origin(&self, location: usize) -> (usize, usize) {
        (location / self.per_side * self.step, location % self.per_side * self.step)
    }

    /// Cuts the patch at `location` out of a template and normalises it.
    pub fn cut(&self, template: &[f32], location: usize, out: &mut [f32]) {
        self.cut_each(std::iter::once(template), location, out);
    }

    /// Cuts the patch at `location` out of each template and normalises it. The patches are written
    /// one after the other, [`Self::dim`] samples each.
    pub fn cut_each<'a>(
        &self,
        templates: impl Iterator<Item = &'a [f32]>,
        location: usize,
        out: &mut [f32],
    ) {
        dispatch!(Instructions::default(), |_| {
            // Copying all patches first lets their loads from memory overlap.
            for (template, patch) in templates.zip(out.chunks_exact_mut(self.dim())) {
                self.copy_patch(template, location, patch);
            }
            for patch in out.chunks_exact_mut(self.dim()) {
                if self.subtract_mean {
                    subtract_mean(patch);
                }
                normalise_inline(patch);
            }
        });
    }

    #[inline(always)]
    fn copy_patch(&self, template: &[f32], location: usize, out: &mut [f32]) {
        match self.patch {
            // The paper's two sizes: a row of constant length is one or two vectors.
            8 => self.copy_rows::<8>(template, location, out),
            16 => self.copy_rows::<16>(template, location, out),
            _ => {
                let lines = out.chunks_exact_mut(self.patch);
                lines.zip(self.rows(template, location)).for_each(|(l, r)| l.copy_from_slice(r));
            }
        }
    }

    #[inline(always)]
    fn copy_rows<const N: usize>(&self, template: &[f32], location: usize, out: &mut [f32]) {
        let lines = out.as_chunks_mut::<N>().0;
        for (line, row) in lines.iter_mut().zip(self.rows(template, location)) {
            if let Some(row) = row.first_chunk() {
                *line = *row;
            }
        }
    }

    /// The rows of the patch at `location` in a template.
    #[inline(always)]
    fn rows<'a>(&self, template: &'a [f32], location: usize) -> impl Iterator<Item = &'a [f32]> {
        let ((top, left), patch) = (self.origin(location), self.patch);
        let lines = template.chunks_exact(self.template_side).skip(top).take(patch);
        lines.map(move |line| &line[left..left + patch])
    }

    /// All patches of a template, in the order of locations.
    pub fn cut_all(&self, template: &[f32]) -> Vec<f32> {
        let mut all = vec![0.0; self.locations() * self.dim()];
        for (location, out) in all.chunks_exact_mut(self.dim()).enumerate() {
            self.cut(template, location, out);
        }
        all
    }
}

/// Divides a vector by its L2 norm. A vector of zeros, or one whose norm is not finite, becomes
/// zero.
pub fn normalise(vector: &mut [f32]) {
    dispatch!(Instructions::default(), |_| normalise_inline(vector));
}

#[inline(always)]
fn normalise_inline(vector: &mut [f32]) {
    let norm = dot(vector, vector).sqrt();
    if norm > 0.0 && norm.is_finite() {
        vector.iter_mut().for_each(|v| *v = (f64::from(*v) / norm) as f32);
    } else {
        vector.fill(0.0);
    }
}

/// The inner product of two templates. Compiled for wider vectors it takes as long.
pub fn similarity(a: &[f32], b: &[f32]) -> f64 {
    dot(a, b)
}

/// Subtracts the mean. A constant vector becomes zero, without rounding noise.
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
