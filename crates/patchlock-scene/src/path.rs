//! Smooth curves through key frames.

use crate::config::{KeyLight, KeyPose};

/// Position, size and rotation of the target at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pose {
    pub(crate) centre: [f64; 2],
    pub(crate) scale: f64,
    /// Clockwise on the screen, in radians.
    pub(crate) rotation: f64,
}

/// The pose at a frame.
pub(crate) fn pose_at(path: &[KeyPose], frame: f64) -> Pose {
    let value = |of: fn(&KeyPose) -> f64| {
        let keys: Vec<[f64; 2]> = path.iter().map(|key| [key.frame, of(key)]).collect();
        interpolate(&keys, frame)
    };
    Pose {
        centre: [value(|key| key.centre[0]), value(|key| key.centre[1])],
        scale: value(|key| key.scale),
        rotation: value(|key| key.degrees).to_radians(),
    }
}

/// Gain and offset at a frame.
pub(crate) fn light_at(light: &[KeyLight], frame: f64) -> (f64, f64) {
    if light.is_empty() {
        return (1.0, 0.0);
    }
    let value = |of: fn(&KeyLight) -> f64| {
        let keys: Vec<[f64; 2]> = light.iter().map(|key| [key.frame, of(key)]).collect();
        interpolate(&keys, frame)
    };
    (value(|key| key.gain), value(|key| key.offset))
}

/// Value at `t` of a curve through `[time, value]` keys with increasing times.
///
/// A cubic whose slopes are chosen so that it stays within the range of the
/// two neighbouring keys.
fn interpolate(keys: &[[f64; 2]], t: f64) -> f64 {
    let after = keys.partition_point(|key| key[0] <= t);
    if after == 0 {
        return keys[0][1];
    }
    if after == keys.len() {
        return keys[after - 1][1];
    }
    let ([t0, from], [t1, to]) = (keys[after - 1], keys[after]);
    let span = t1 - t0;
    let s = (t - t0) / span;
    let rest = 1.0 - s;
    let (slope0, slope1) = (slope(keys, after - 1) * span, slope(keys, after) * span);
    from * (1.0 + 2.0 * s) * rest * rest
        + slope0 * s * rest * rest
        + to * s * s * (3.0 - 2.0 * s)
        + slope1 * s * s * (s - 1.0)
}

/// Slope of the curve at one key: the harmonic mean of the slopes on either
/// side, and zero at a turning point, at the start and at the end.
fn slope(keys: &[[f64; 2]], at: usize) -> f64 {
    if at == 0 || at + 1 == keys.len() {
        return 0.0;
    }
    let rise = |i: usize| (keys[i + 1][1] - keys[i][1]) / (keys[i + 1][0] - keys[i][0]);
    let (before, after) = (rise(at - 1), rise(at));
    if before * after <= 0.0 {
        return 0.0;
    }
    2.0 * before * after / (before + after)
}

#[cfg(test)]
mod tests {
    use super::*;

    const KEYS: [[f64; 2]; 4] = [[0.0, 1.0], [10.0, 4.0], [14.0, 9.0], [30.0, 2.0]];

    #[test]
    fn curve_passes_through_its_keys_and_is_constant_beyond_them() {
        for [t, value] in KEYS {
            assert!((interpolate(&KEYS, t) - value).abs() < 1e-12);
        }
        assert_eq!(interpolate(&KEYS, -5.0), 1.0);
        assert_eq!(interpolate(&KEYS, 99.0), 2.0);
    }

    #[test]
    fn curve_stays_between_neighbouring_keys_and_is_smooth() {
        let at = |i: i32| interpolate(&KEYS, f64::from(i) * 0.01);
        for i in 0..3000 {
            let after = KEYS.partition_point(|key| key[0] <= f64::from(i) * 0.01);
            let (a, b) = (KEYS[after - 1][1], KEYS[after][1]);
            assert!(at(i) >= a.min(b) - 1e-9 && at(i) <= a.max(b) + 1e-9);
            let bend = at(i + 2) - 2.0 * at(i + 1) + at(i);
            assert!(bend.abs() < 1e-3, "kink at {i}: {bend}");
        }
    }
}
