//! The occlusion mask (Eq. 17): the visibility of the large patches, spread over their samples and
//! smoothed.

use crate::vision::guided_filter::GuidedFilter;
use crate::vision::patches::PatchGrid;

/// The mask with its buffers. Reuse a value to avoid allocations.
#[derive(Debug, Clone, Default)]
pub struct OcclusionMask {
    mask: Vec<f64>,
    guide: Vec<f64>,
    /// For each sample, the mean visibility of the patches that cover it, and their number.
    spread: Vec<f64>,
    cover: Vec<f64>,
    filter: GuidedFilter,
}

impl OcclusionMask {
    /// The mask `K` in `[0, 1]`, one value per sample, 1 where the candidate is visible.
    pub fn values(&self) -> &[f64] {
        &self.mask
    }

    /// Makes the mask of a candidate: for each sample the mean visibility of the patches that cover
    /// it (0 if there are none), smoothed with the candidate as the guide (rescaled to `[0, 1]`),
    /// and clamped.
    pub fn make(
        &mut self,
        candidate: &[f32],
        (grid, visible): (&PatchGrid, &[bool]),
        (radius, epsilon): (usize, f64),
    ) {
        let side = grid.template_side();
        self.set_spread(side, grid, visible);
        self.set_guide(candidate);
        let smooth = self.filter.filter(&self.guide, &self.spread, side, radius, epsilon);
        self.mask.clear();
        self.mask.extend(smooth.iter().map(|v| v.clamp(0.0, 1.0)));
    }

    /// Sets each sample to the mean visibility of the patches that cover it.
    fn set_spread(&mut self, side: usize, grid: &PatchGrid, visible: &[bool]) {
        for plane in [&mut self.spread, &mut self.cover] {
            plane.clear();
            plane.resize(side * side, 0.0);
        }
        for (location, &visible) in visible.iter().enumerate() {
            let (top, left) = grid.origin(location);
            for row in top..top + grid.patch() {
                for k in row * side + left..row * side + left + grid.patch() {
                    self.spread[k] += f64::from(u8::from(visible));
                    self.cover[k] += 1.0;
                }
            }
        }
        self.spread.iter_mut().zip(&self.cover).for_each(|(sum, count)| *sum /= count.max(1.0));
    }

    /// Rescales the smallest value to 0 and the largest to 1; a constant becomes 0.
    fn set_guide(&mut self, samples: &[f32]) {
        let (low, high) = samples
            .iter()
            .fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), &v| (low.min(v), high.max(v)));
        let range = if high > low { f64::from(high) - f64::from(low) } else { 1.0 };
        self.guide.clear();
        self.guide.extend(samples.iter().map(|&v| (f64::from(v) - f64::from(low)) / range));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: fn() -> PatchGrid = || PatchGrid::new(32, 16, 8, false);

    #[test]
    fn all_visible_or_all_hidden_is_a_flat_mask() {
        let candidate: Vec<f32> = (0..1024).map(|k| (k % 13) as f32).collect();
        for visible in [true, false] {
            let mut mask = OcclusionMask::default();
            mask.make(&candidate, (&GRID(), &[visible; 9]), (2, 0.01));
            assert!(mask.values().iter().all(|v| (v - f64::from(u8::from(visible))).abs() < 1e-9));
        }
    }

    #[test]
    fn a_sample_takes_the_mean_of_the_patches_that_cover_it() {
        let mut visible = [true; 9];
        visible[0] = false;
        let mut mask = OcclusionMask::default();
        mask.make(&[0.5; 1024], (&GRID(), &visible), (0, 0.01));
        let spread = &mask.spread;
        assert_eq!(spread[0], 0.0);
        // Rows 8 to 15 lie in two rows of patches, so the centre of the upper left quarter lies in
        // four patches.
        assert_eq!(spread[8 * 32 + 8], 0.75);
        assert_eq!(spread[8], 0.5);
        assert_eq!(spread[1023], 1.0);
        assert!(mask.values().iter().zip(spread).all(|(m, s)| (m - s).abs() < 1e-9));
    }
}
