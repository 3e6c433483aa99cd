//! The picture on the target: a boat on a lake in front of mountains at sunset.
//!
//! Its corners, halves and colours all differ, so a tracker that confuses parts
//! of it, or its mirror image, is detected.

use crate::canvas::{Colour, dimmed, mixed, ramp};
use crate::noise::{cloud, value_noise};

type Point = [f64; 2];

const FRAME: Colour = [252.0, 244.0, 224.0];
const FRAME_LINE: Colour = [38.0, 40.0, 66.0];
const SUN: [f64; 2] = [0.72, 0.29];
const GRAIN_SEED: u64 = 0xba_d9e;

/// Colour at a point of the card, `[0, 0]` top left to `[1, 1]` bottom right.
pub(crate) fn badge(point: Point) -> Colour {
    let edge = point.map(|p| p.min(1.0 - p));
    let edge = edge[0].min(edge[1] * 0.8);
    if edge < 0.015 {
        return FRAME_LINE;
    }
    if edge < 0.05 {
        return FRAME;
    }
    if edge < 0.066 {
        return FRAME_LINE;
    }
    let grain = 0.92 + 0.16 * value_noise(GRAIN_SEED, point[0] * 34.0, point[1] * 28.0);
    dimmed(picture(point), grain)
}

/// The picture inside the frame, nearest objects first.
fn picture(point: Point) -> Colour {
    boat(point).or_else(|| lake(point)).or_else(|| mountains(point)).unwrap_or_else(|| sky(point))
}

fn sky([u, v]: Point) -> Colour {
    let (dx, dy) = (u - SUN[0], (v - SUN[1]) * 0.8);
    let distance = dx.hypot(dy);
    if distance < 0.105 {
        return [255.0, 238.0, 150.0];
    }
    let high = mixed([36.0, 62.0, 128.0], [208.0, 96.0, 110.0], 0.3 + 0.7 * u);
    let base = mixed(high, [255.0, 178.0, 104.0], ramp(v, 0.1, 0.6));
    // Rays of slightly different widths keep the sky from being smooth.
    let angle = dy.atan2(dx);
    let rays = (angle * 9.0).sin() + 0.6 * (angle * 5.0 + 1.0).sin();
    let glow = ramp(rays, -0.2, 0.5) * ramp(0.6 - distance, 0.0, 0.5);
    mixed(base, [255.0, 222.0, 140.0], 0.75 * glow)
}

fn mountains([u, v]: Point) -> Option<Colour> {
    let rough = 0.03 * (cloud(GRAIN_SEED ^ 1, u * 14.0, 0.5, 2) - 0.5);
    let near = peak(u, 0.27, 0.2, 1.25).min(peak(u, 0.02, 0.44, 0.9)) + rough;
    if v > near {
        let lit = u > 0.27 + 0.12 * (v - 0.2) + 0.05 * (v * 42.0).sin() * (v - 0.2);
        let snow_line = 0.33 + 0.05 * (u * 46.0).sin();
        return Some(match (v < snow_line, lit) {
            (true, true) => [255.0, 236.0, 226.0],
            (true, false) => [150.0, 164.0, 206.0],
            (false, true) => [126.0, 82.0, 112.0],
            (false, false) => [52.0, 48.0, 88.0],
        });
    }
    let far = peak(u, 0.98, 0.4, 0.6).min(peak(u, 0.6, 0.5, 0.5)) + rough;
    (v > far).then(|| mixed([150.0, 84.0, 128.0], [214.0, 128.0, 122.0], ramp(v, 0.4, 0.66)))
}

/// Height of a mountain's outline over `u`.
fn peak(u: f64, summit: f64, top: f64, steepness: f64) -> f64 {
    top + steepness * (u - summit).abs()
}

fn lake([u, v]: Point) -> Option<Colour> {
    if v < 0.66 {
        return None;
    }
    let depth = ramp(v, 0.64, 0.98);
    let water = mixed([40.0, 132.0, 150.0], [12.0, 52.0, 96.0], depth);
    let wave = (v * 74.0 + 1.6 * (u * 17.0).sin() + u * 5.0).sin();
    let crest =
        ramp(wave, 0.45, 0.8) * ramp(value_noise(GRAIN_SEED ^ 2, u * 9.0, v * 20.0), 0.35, 0.6);
    let water = mixed(water, [170.0, 226.0, 220.0], 0.8 * crest);
    let path = ramp(0.1 - (u - SUN[0] - 0.06 * wave).abs(), 0.0, 0.05);
    Some(mixed(water, [255.0, 208.0, 120.0], 0.8 * path))
}

fn boat(point: Point) -> Option<Colour> {
    let [u, v] = point;
    let hull_half = 0.2 - 0.9 * (v - 0.74);
    if (0.74..0.85).contains(&v) && (u - 0.5).abs() < hull_half {
        let stripe = (0.765..0.785).contains(&v);
        return Some(if stripe { FRAME } else { [196.0, 44.0, 48.0] });
    }
    if (u - 0.5).abs() < 0.011 && (0.22..0.75).contains(&v) {
        return Some([60.0, 38.0, 34.0]);
    }
    if inside([[0.52, 0.3], [0.72, 0.7], [0.52, 0.7]], point) {
        let band = (0.52..0.6).contains(&v);
        return Some(if band { [226.0, 70.0, 52.0] } else { [255.0, 252.0, 240.0] });
    }
    if inside([[0.48, 0.36], [0.48, 0.7], [0.34, 0.7]], point) {
        return Some([250.0, 190.0, 60.0]);
    }
    inside([[0.5, 0.17], [0.5, 0.25], [0.4, 0.21]], point).then_some([40.0, 150.0, 110.0])
}

/// Whether a point is inside a triangle given clockwise on the screen.
fn inside(corners: [Point; 3], [u, v]: Point) -> bool {
    (0..3).all(|i| {
        let ([ax, ay], [bx, by]) = (corners[i], corners[(i + 1) % 3]);
        (bx - ax) * (v - ay) - (by - ay) * (u - ax) >= 0.0
    })
}
