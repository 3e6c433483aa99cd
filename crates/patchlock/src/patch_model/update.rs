//! The new template (Eq. 15-17, 20-21): the tracked candidate where it is visible, and its
//! reconstruction where it is hidden.

use super::mask::OcclusionMask;
use super::subspace::Subspace;
use crate::patch_model::sparse::lasso::Reconstruction;
use crate::vision::patches::{PatchGrid, normalise};

/// How a new template is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TemplateParams {
    /// Weight of the L1 norms in the reconstruction of the tracked candidate.
    pub lambda: f64,
    /// Radius of the guided filter that smooths the occlusion mask, in samples; 0 turns it off.
    pub guided_radius: usize,
    /// Regularisation of the guided filter.
    pub guided_epsilon: f64,
}

/// A new template and its occlusion mask. Reuse a value to avoid allocations.
#[derive(Debug, Clone, Default)]
pub struct NewTemplate {
    template: Vec<f32>,
    mask: OcclusionMask,
    /// The candidate minus the subspace's mean, and the reconstruction of this difference.
    signal: Vec<f64>,
    code: Reconstruction,
}

impl NewTemplate {
    /// `T = C K + H (1 - K)`, L2-normalised.
    pub fn template(&self) -> &[f32] {
        &self.template
    }

    /// `K`, one value per sample, 1 where the candidate is visible.
    pub fn mask(&self) -> &[f64] {
        self.mask.values()
    }

    /// Makes the new template from a tracked candidate `C` and the visibility of its large patches.
    pub fn make(
        &mut self,
        candidate: &[f32],
        (grid, visible): (&PatchGrid, &[bool]),
        subspace: &Subspace,
        params: &TemplateParams,
    ) {
        let filter = (params.guided_radius, params.guided_epsilon);
        self.mask.make(candidate, (grid, visible), filter);
        // H = mean + U q, where the trivial templates make q robust against occlusion.
        let mean = subspace.mean();
        self.signal.clear();
        self.signal.extend(candidate.iter().zip(mean).map(|(&c, mean)| f64::from(c) - mean));
        self.code.solve(subspace.basis(), &self.signal, params.lambda);
        let hidden = mean.iter().zip(self.code.fit()).map(|(mean, fit)| mean + fit);
        let seen = candidate.iter().zip(self.mask.values());
        let blend = seen.zip(hidden).map(|((&c, k), h)| f64::from(c) * k + h * (1.0 - k));
        self.template.clear();
        self.template.extend(blend.map(|v| v as f32));
        normalise(&mut self.template);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::patch_model::subspace::{SubspaceParams, SubspaceScratch};

    #[test]
    fn hidden_samples_come_from_the_subspace() {
        let params = TemplateParams { lambda: 0.01, guided_radius: 0, guided_epsilon: 0.01 };
        let grid = PatchGrid::new(32, 16, 8, false);
        let face = |k: usize, t: usize| 1.0 + ((k / 32 + t) % 7) as f32 * 0.1;
        let views: Vec<Vec<f32>> = (0..10)
            .map(|t| {
                let mut view: Vec<f32> = (0..1024).map(|k| face(k, t % 2)).collect();
                normalise(&mut view);
                view
            })
            .collect();
        let mut subspace = Subspace::default();
        let keep_all = SubspaceParams { forgetting: 1.0, keep: 1e-6, vectors: 20 };
        subspace.add(&views, &keep_all, &mut SubspaceScratch::default());
        // Something bright covers the upper left patch.
        let mut covered = views[0].clone();
        (0..8).for_each(|row| covered[row * 32..row * 32 + 8].fill(0.2));
        let mut visible = [true; 9];
        visible[0] = false;
        let mut new = NewTemplate::default();
        new.make(&covered, (&grid, &visible), &subspace, &params);
        let error =
            |a: &[f32], b: &[f32]| -> f32 { a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum() };
        assert!(error(new.template(), &views[0]) < 0.01 * error(&covered, &views[0]));
        assert_eq!(new.mask()[0], 0.0);
        assert!((new.mask()[1023] - 1.0).abs() < 1e-9);
        let norm: f32 = new.template().iter().map(|v| v * v).sum();
        assert!((norm - 1.0).abs() < 1e-5);
        // If all patches are visible, the template is the candidate itself.
        new.make(&covered, (&grid, &[true; 9]), &subspace, &params);
        let mut same = covered.clone();
        normalise(&mut same);
        assert!(error(new.template(), &same) < 1e-10);
    }
}
