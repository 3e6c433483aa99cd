//! The new template (Eq. 15-17, 20-21): the tracked candidate where it is visible, its reconstruction where it is hidden.

use super::mask::occlusion_mask;
use super::subspace::Subspace;
use crate::config::TrackerConfig;
use crate::sparse::lasso;
use crate::vision::patches::{PatchGrid, normalise};
use nalgebra::DVector;

/// A new template and the occlusion mask it was made with.
#[derive(Debug, Clone, PartialEq)]
pub struct NewTemplate {
    /// `T = C K + H (1 - K)`, L2-normalised.
    pub template: Vec<f32>,
    /// `K`, one value a sample, 1 where the candidate is visible.
    pub mask: Vec<f64>,
}

/// Makes the new template of a tracked candidate `C` whose large patches are visible or not.
pub fn new_template(
    candidate: &[f32],
    grid: &PatchGrid,
    visible: &[bool],
    subspace: &Subspace,
    config: &TrackerConfig,
) -> NewTemplate {
    let (radius, epsilon) = (config.guided_radius, config.guided_epsilon);
    let mask = occlusion_mask(candidate, config.template_side, grid, visible, radius, epsilon);
    let reconstruction = reconstruction(candidate, subspace, config.lambda);
    let blend = |k: usize| f64::from(candidate[k]) * mask[k] + reconstruction[k] * (1.0 - mask[k]);
    let mut template: Vec<f32> = (0..candidate.len()).map(|k| blend(k) as f32).collect();
    normalise(&mut template);
    NewTemplate { template, mask }
}

/// `H = mean + U q`, with `q` robust against what the trivial templates explain.
fn reconstruction(candidate: &[f32], subspace: &Subspace, lambda: f64) -> DVector<f64> {
    let (mean, basis) = (subspace.mean(), subspace.basis());
    let candidate =
        DVector::from_iterator(candidate.len(), candidate.iter().map(|&v| f64::from(v)));
    let code = lasso::reconstruct(&basis, &(candidate - &mean), lambda);
    mean + basis * code.coefficients
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::appearance::subspace::SubspaceRules;

    #[test]
    fn what_is_hidden_comes_from_the_subspace() {
        let config = TrackerConfig { guided_radius: 0, ..TrackerConfig::default() };
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
        subspace.add(&views, &SubspaceRules { forgetting: 1.0, keep: 1e-6, vectors: 20 });
        // The upper left patch is covered by something bright.
        let mut covered = views[0].clone();
        (0..8).for_each(|row| covered[row * 32..row * 32 + 8].fill(0.2));
        let mut visible = [true; 9];
        visible[0] = false;
        let new = new_template(&covered, &grid, &visible, &subspace, &config);
        let error =
            |a: &[f32], b: &[f32]| -> f32 { a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum() };
        assert!(error(&new.template, &views[0]) < 0.01 * error(&covered, &views[0]));
        assert_eq!(new.mask[0], 0.0);
        assert!((new.mask[1023] - 1.0).abs() < 1e-9);
        let norm: f32 = new.template.iter().map(|v| v * v).sum();
        assert!((norm - 1.0).abs() < 1e-5);
        // All visible: the candidate itself.
        let open = new_template(&covered, &grid, &[true; 9], &subspace, &config);
        let mut same = covered.clone();
        normalise(&mut same);
        assert!(error(&open.template, &same) < 1e-10);
    }
}
