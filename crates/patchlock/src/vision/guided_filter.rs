//! The guided filter (He, Sun, Tang, "Guided image filtering", 2013): smooths a mask along the
//! edges of an image.
//!
//! In each window `w_k` of radius `r` the output is linear in the guide, `q_i = a_k I_i + b_k`,
//! with `a_k = cov_k(I, p) / (var_k(I) + eps)` and `b_k = mean_k(p) - a_k mean_k(I)`. Each sample
//! uses the mean of `a` and `b` over the windows that cover it. Windows are clipped at the border,
//! and their means count only samples inside.

/// The filter with its buffers. Reuse a value to avoid allocations.
#[derive(Debug, Clone, Default)]
pub struct GuidedFilter {
    mean_i: Vec<f64>,
    mean_p: Vec<f64>,
    /// `mean(I I)`, then `a`, then the output.
    a: Vec<f64>,
    /// `mean(I p)`, then `b`.
    b: Vec<f64>,
    rows: Vec<f64>,
}

impl GuidedFilter {
    /// Filters `input` with `guide`; both are row-major and `width` samples wide. `radius` is in
    /// samples.
    pub fn filter(
        &mut self,
        guide: &[f64],
        input: &[f64],
        width: usize,
        radius: usize,
        epsilon: f64,
    ) -> &[f64] {
        let Self { mean_i, mean_p, a, b, rows } = self;
        set(mean_i, guide.iter().copied());
        set(mean_p, input.iter().copied());
        set(a, guide.iter().map(|i| i * i));
        set(b, guide.iter().zip(input).map(|(i, p)| i * p));
        for plane in [&mut *mean_i, &mut *mean_p, &mut *a, &mut *b] {
            box_mean(plane, width, radius, rows);
        }
        for k in 0..guide.len() {
            let covariance = b[k] - mean_i[k] * mean_p[k];
            let slope = covariance / (a[k] - mean_i[k] * mean_i[k] + epsilon);
            (a[k], b[k]) = (slope, mean_p[k] - slope * mean_i[k]);
        }
        box_mean(a, width, radius, rows);
        box_mean(b, width, radius, rows);
        a.iter_mut().zip(b).zip(guide).for_each(|((a, b), i)| *a = *a * i + *b);
        a
    }
}

fn set(plane: &mut Vec<f64>, values: impl Iterator<Item = f64>) {
    plane.clear();
    plane.extend(values);
}

/// Replaces each sample by the mean of the window of this radius around it, rows first, then
/// columns.
fn box_mean(values: &mut [f64], width: usize, radius: usize, rows: &mut Vec<f64>) {
    let height = values.len() / width.max(1);
    rows.resize(values.len(), 0.0);
    for y in 0..height {
        for x in 0..width {
            let (first, last) = (x.saturating_sub(radius), (x + radius).min(width - 1));
            let window = &values[y * width + first..=y * width + last];
            rows[y * width + x] = window.iter().sum::<f64>() / window.len() as f64;
        }
    }
    for y in 0..height {
        let (first, last) = (y.saturating_sub(radius), (y + radius).min(height - 1));
        for x in 0..width {
            let sum: f64 = (first..=last).map(|row| rows[row * width + x]).sum();
            values[y * width + x] = sum / (last - first + 1) as f64;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The filter computed window by window, without shared sums.
    fn brute_force(
        guide: &[f64],
        input: &[f64],
        width: usize,
        radius: usize,
        epsilon: f64,
    ) -> Vec<f64> {
        let height = guide.len() / width;
        let window = |k: usize| -> Vec<usize> {
            let (x, y) = ((k % width) as isize, (k / width) as isize);
            (0..guide.len())
                .filter(|&j| {
                    let (dx, dy) = ((j % width) as isize - x, (j / width) as isize - y);
                    dx.abs() <= radius as isize && dy.abs() <= radius as isize
                })
                .collect()
        };
        let line = |k: usize| {
            let w = window(k);
            let n = w.len() as f64;
            let mean_i = w.iter().map(|&j| guide[j]).sum::<f64>() / n;
            let mean_p = w.iter().map(|&j| input[j]).sum::<f64>() / n;
            let cov = w.iter().map(|&j| (guide[j] - mean_i) * (input[j] - mean_p)).sum::<f64>() / n;
            let var = w.iter().map(|&j| (guide[j] - mean_i).powi(2)).sum::<f64>() / n;
            let a = cov / (var + epsilon);
            (a, mean_p - a * mean_i)
        };
        (0..width * height)
            .map(|k| {
                let w = window(k);
                let sum: f64 = w
                    .iter()
                    .map(|&j| {
                        let (a, b) = line(j);
                        a * guide[k] + b
                    })
                    .sum();
                sum / w.len() as f64
            })
            .collect()
    }

    proptest! {
        #[test]
        fn equals_brute_force(
            values in prop::collection::vec((0.0..1.0f64, 0.0..1.0f64), 35),
            radius in 0usize..4,
            epsilon in 1e-4..0.1f64,
        ) {
            let (guide, input): (Vec<_>, Vec<_>) = values.into_iter().unzip();
            let mut filter = GuidedFilter::default();
            filter.filter(&input, &guide, 5, 2, 0.5);
            let fast = filter.filter(&guide, &input, 7, radius, epsilon);
            let brute = brute_force(&guide, &input, 7, radius, epsilon);
            for (f, b) in fast.iter().zip(&brute) {
                prop_assert!((f - b).abs() < 1e-9, "{f} {b}");
            }
        }
    }

    #[test]
    fn radius_zero_changes_nothing() {
        let guide = [0.0, 0.5, 1.0, 0.25];
        let input = [1.0, 0.0, 0.5, 0.75];
        let mut filter = GuidedFilter::default();
        for (got, want) in filter.filter(&guide, &input, 2, 0, 0.01).iter().zip(input) {
            assert!((got - want).abs() < 1e-12);
        }
    }
}
