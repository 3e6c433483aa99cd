//! The occlusion mask (Eq. 17): the visibility of the large patches, spread to samples and smoothed.

use crate::vision::guided_filter::guided_filter;
use crate::vision::patches::PatchGrid;

/// The mask `K` of a candidate in `[0, 1]`, 1 where it is visible: the mean over the patches that cover a sample (0 where none does),
/// smoothed with the candidate as the guide (rescaled to `[0, 1]`), and clamped.
pub fn occlusion_mask(
    candidate: &[f32],
    side: usize,
    grid: &PatchGrid,
    visible: &[bool],
    radius: usize,
    epsilon: f64,
) -> Vec<f64> {
    let spread = spread(side, grid, visible);
    let smooth = guided_filter(&rescale(candidate), &spread, side, radius, epsilon);
    smooth.into_iter().map(|v| v.clamp(0.0, 1.0)).collect()
}

/// The mean visibility of the patches that cover each sample.
fn spread(side: usize, grid: &PatchGrid, visible: &[bool]) -> Vec<f64> {
    let (mut sum, mut count) = (vec![0.0; side * side], vec![0.0f64; side * side]);
    for (location, &visible) in visible.iter().enumerate() {
        let (top, left) = grid.origin(location);
        for row in top..top + grid.patch() {
            for k in row * side + left..row * side + left + grid.patch() {
                sum[k] += f64::from(u8::from(visible));
                count[k] += 1.0;
            }
        }
    }
    sum.iter().zip(&count).map(|(s, c)| s / c.max(1.0)).collect()
}

/// Smallest to 0, largest to 1; a constant becomes 0.
fn rescale(samples: &[f32]) -> Vec<f64> {
    let (low, high) = samples
        .iter()
        .fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), &v| (low.min(v), high.max(v)));
    let range = if high > low { f64::from(high) - f64::from(low) } else { 1.0 };
    samples.iter().map(|&v| (f64::from(v) - f64::from(low)) / range).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: fn() -> PatchGrid = || PatchGrid::new(32, 16, 8, false);

    #[test]
    fn all_visible_or_all_hidden_is_a_flat_mask() {
        let candidate: Vec<f32> = (0..1024).map(|k| (k % 13) as f32).collect();
        for visible in [true, false] {
            let mask = occlusion_mask(&candidate, 32, &GRID(), &[visible; 9], 2, 0.01);
            assert!(mask.iter().all(|v| (v - f64::from(u8::from(visible))).abs() < 1e-9));
        }
    }

    #[test]
    fn a_sample_takes_the_mean_of_the_patches_that_cover_it() {
        let mut visible = [true; 9];
        visible[0] = false;
        let spread = spread(32, &GRID(), &visible);
        assert_eq!(spread[0], 0.0);
        // Rows 8 to 15 belong to two rows of patches, so the middle of the upper left quarter to four patches.
        assert_eq!(spread[8 * 32 + 8], 0.75);
        assert_eq!(spread[8], 0.5);
        assert_eq!(spread[1023], 1.0);
        let mask = occlusion_mask(&[0.5; 1024], 32, &GRID(), &visible, 0, 0.01);
        assert!(mask.iter().zip(&spread).all(|(m, s)| (m - s).abs() < 1e-9));
    }
}
