//! The templates (Sec. 2.5): how the first ones are collected, and which one is replaced.

use super::buffer;
use rand_distr::{Distribution, StandardUniform};
use rand_pcg::Pcg64;

/// The shifts of the paper's ten first templates, in pixels.
const FIRST_SHIFTS: [(i32, i32); 10] =
    [(0, 0), (2, 0), (1, 0), (0, 1), (-1, 0), (0, -1), (1, 1), (-1, -1), (1, -1), (-1, 1)];

/// Shifts in pixels for `count` first templates: the paper's ten, then the nearest remaining ones;
/// those at equal distance row by row.
pub fn shifts(count: usize) -> Vec<[f64; 2]> {
    let square = (-4..=4i32).flat_map(|y| (-4..=4i32).map(move |x| (x, y)));
    let mut others: Vec<_> = square.filter(|shift| !FIRST_SHIFTS.contains(shift)).collect();
    others.sort_by_key(|(x, y)| (x * x + y * y, *y, *x));
    let all = FIRST_SHIFTS.into_iter().chain(others);
    all.take(count).map(|(x, y)| [f64::from(x), f64::from(y)]).collect()
}

/// Draws the index `k` of the template to replace. The first template is never replaced; from each
/// later one to the next, the probability grows by the factor `growth`. With the paper's `growth =
/// 2` it is proportional to `2^(k-1)`.
pub fn draw_replaced(count: usize, growth: f64, rng: &mut Pcg64) -> usize {
    let uniform: f64 = StandardUniform.sample(rng);
    // Relative to the newest template, so that no power overflows.
    let chance = |k: usize| growth.powi(-((count - 1 - k) as i32));
    let total: f64 = (1..count).map(chance).sum();
    let mut sum = 0.0;
    for k in 1..count {
        sum += chance(k);
        if uniform * total < sum {
            return k;
        }
    }
    count - 1
}

/// Removes template `replaced`, if it exists, and appends the new one.
pub fn replace(templates: &mut Vec<Vec<f32>>, replaced: usize, template: &[f32]) {
    match templates.get_mut(replaced..) {
        Some(younger) if !younger.is_empty() => buffer::push(younger, template),
        _ => templates.push(template.to_vec()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_ten_shifts_are_the_papers_and_all_are_distinct() {
        let all = shifts(40);
        assert_eq!(all[..3], [[0.0, 0.0], [2.0, 0.0], [1.0, 0.0]]);
        assert_eq!(shifts(10).last(), Some(&[-1.0, 1.0]));
        for (k, shift) in all.iter().enumerate() {
            assert!(!all[..k].contains(shift));
        }
    }

    #[test]
    fn younger_templates_are_replaced_twice_as_often() {
        let mut rng = Pcg64::new(5, 1);
        let draws = 200_000;
        let mut counts = [0usize; 10];
        (0..draws).for_each(|_| counts[draw_replaced(10, 2.0, &mut rng)] += 1);
        assert_eq!(counts[0], 0);
        for (k, &count) in counts.iter().enumerate().skip(1) {
            let chance = f64::from(1 << (k - 1)) / 511.0;
            let spread = (draws as f64 * chance * (1.0 - chance)).sqrt();
            assert!((count as f64 - draws as f64 * chance).abs() < 5.0 * spread, "{k}: {count}");
        }
        assert_eq!(draw_replaced(2, 100.0, &mut rng), 1);
    }

    #[test]
    fn the_new_template_goes_to_the_end() {
        let mut templates = vec![vec![0.0], vec![1.0], vec![2.0]];
        replace(&mut templates, 1, &[3.0]);
        assert_eq!(templates, [[0.0], [2.0], [3.0]]);
        replace(&mut templates, 3, &[4.0]);
        assert_eq!(templates, [[0.0], [2.0], [3.0], [4.0]]);
    }
}
