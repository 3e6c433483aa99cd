//! Deterministic noise that depends only on its arguments.

/// A 64-bit hash of a seed and a lattice point (splitmix64 steps).
pub(crate) fn hash(seed: u64, x: i64, y: i64) -> u64 {
    let mixed = mix(seed ^ mix(x as u64));
    mix(mixed ^ (y as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15))
}

fn mix(value: u64) -> u64 {
    let mut z = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Uniform in `0..1`.
pub(crate) fn uniform(seed: u64, x: i64, y: i64) -> f64 {
    (hash(seed, x, y) >> 11) as f64 / (1u64 << 53) as f64
}

/// Nearly normal with mean 0 and standard deviation 1: a scaled sum of four
/// uniforms. It stays within 3.5, so there are no extreme pixels.
pub(crate) fn bell(seed: u64, x: i64, y: i64) -> f64 {
    let bits = hash(seed, x, y);
    let sum: u64 = (0..4).map(|part| (bits >> (16 * part)) & 0xffff).sum();
    // A uniform on 0..1 has variance 1/12, so four of them have 1/3.
    (sum as f64 / 65535.0 - 2.0) * 3f64.sqrt()
}

/// Smooth noise in `0..1` that varies over a distance of about 1.
pub(crate) fn value_noise(seed: u64, x: f64, y: f64) -> f64 {
    let (left, top) = (x.floor(), y.floor());
    let (across, down) = (ease(x - left), ease(y - top));
    let (i, j) = (left as i64, top as i64);
    let row = |j| blend(uniform(seed, i, j), uniform(seed, i + 1, j), across);
    blend(row(j), row(j + 1), down)
}

/// Smooth noise in `0..1` with increasingly fine detail, one layer per octave.
pub(crate) fn cloud(seed: u64, x: f64, y: f64, octaves: u32) -> f64 {
    let (mut sum, mut weights, mut weight, mut frequency) = (0.0, 0.0, 1.0, 1.0);
    for octave in 0..octaves {
        let layer = seed.wrapping_add(u64::from(octave));
        sum += weight * value_noise(layer, x * frequency, y * frequency);
        weights += weight;
        weight *= 0.55;
        frequency *= 2.03;
    }
    sum / weights
}

/// Rises from 0 to 1 with zero slope at both ends, for `t` in `0..=1`.
pub(crate) fn ease(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

fn blend(from: f64, to: f64, t: f64) -> f64 {
    from + (to - from) * t
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bell_has_the_promised_mean_and_spread() {
        let values: Vec<f64> = (0..20_000).map(|i| bell(3, i, 7)).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let square = values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64;
        assert!(mean.abs() < 0.03, "{mean}");
        assert!((square - 1.0).abs() < 0.05, "{square}");
    }

    #[test]
    fn value_noise_is_continuous_and_not_constant() {
        for i in 0..50 {
            let x = f64::from(i) * 0.37 - 9.0;
            let step = value_noise(1, x + 1e-6, 2.0) - value_noise(1, x, 2.0);
            assert!(step.abs() < 1e-5);
        }
        assert!((value_noise(1, 0.0, 0.0) - value_noise(1, 5.0, 0.0)).abs() > 1e-3);
        assert_ne!(value_noise(1, 0.3, 0.3), value_noise(2, 0.3, 0.3));
    }
}
