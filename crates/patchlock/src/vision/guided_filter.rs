//! The guided filter (He, Sun, Tang, "Guided image filtering", 2013): smooths a mask along the edges of an image.
//!
//! In each window `w_k` of radius `r` the output is linear in the guide, `q_i = a_k I_i + b_k`, with
//! `a_k = cov_k(I, p) / (var_k(I) + eps)` and `b_k = mean_k(p) - a_k mean_k(I)`; each sample takes the mean of `a` and `b` over the
//! windows that cover it. Windows are clipped at the border and divided by the samples that they really hold.

/// Filters `input` with `guide`, both row-major and `width` wide.
pub fn guided_filter(
    guide: &[f64],
    input: &[f64],
    width: usize,
    radius: usize,
    epsilon: f64,
) -> Vec<f64> {
    let mean = |values: &[f64]| box_mean(values, width, radius);
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).collect::<Vec<_>>();
    let (mean_i, mean_p) = (mean(guide), mean(input));
    let (corr_ii, corr_ip) = (mean(&product(guide, guide)), mean(&product(guide, input)));
    let a: Vec<f64> = (0..guide.len())
        .map(|k| {
            (corr_ip[k] - mean_i[k] * mean_p[k]) / (corr_ii[k] - mean_i[k] * mean_i[k] + epsilon)
        })
        .collect();
    let b: Vec<f64> = (0..guide.len()).map(|k| mean_p[k] - a[k] * mean_i[k]).collect();
    let (mean_a, mean_b) = (mean(&a), mean(&b));
    (0..guide.len()).map(|k| mean_a[k] * guide[k] + mean_b[k]).collect()
}

/// The mean over the window of radius `radius` around each sample, rows first, then columns.
fn box_mean(values: &[f64], width: usize, radius: usize) -> Vec<f64> {
    let height = values.len() / width.max(1);
    let mut rows = vec![0.0; values.len()];
    for y in 0..height {
        for x in 0..width {
            let (first, last) = (x.saturating_sub(radius), (x + radius).min(width - 1));
            let window = &values[y * width + first..=y * width + last];
            rows[y * width + x] = window.iter().sum::<f64>() / window.len() as f64;
        }
    }
    let mut means = vec![0.0; values.len()];
    for y in 0..height {
        let (first, last) = (y.saturating_sub(radius), (y + radius).min(height - 1));
        for x in 0..width {
            let sum: f64 = (first..=last).map(|row| rows[row * width + x]).sum();
            means[y * width + x] = sum / (last - first + 1) as f64;
        }
    }
    means
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The filter written out window by window, nothing shared.
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
            let fast = guided_filter(&guide, &input, 7, radius, epsilon);
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
        for (got, want) in guided_filter(&guide, &input, 2, 0, 0.01).iter().zip(input) {
            assert!((got - want).abs() < 1e-12);
        }
    }
}
