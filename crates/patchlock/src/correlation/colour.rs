//! Colour channels: a soft assignment of each colour to four lightness levels of grey and eight hues.
//!
//! The shares of a colour add to 1, and each channel is what it differs from the mean share by, so that a
//! patch without colour has little energy. It plays the part of the learnt colour names of van de Weijer et
//! al. (2009) without a table.

use crate::correlation::fhog::CELL;
use crate::vision::crop::Planes;
use std::f32::consts::TAU;
use std::sync::LazyLock;

/// Number of channels.
pub const CHANNELS: usize = LIGHTNESS + HUES;

const LIGHTNESS: usize = 4;
const HUES: usize = 8;

/// The chroma (Lab) from which on a colour counts as fully coloured.
const FULL_CHROMA: f32 = 40.0;

/// Levels of each of red, green and blue in the table.
const LEVELS: usize = 32;

/// The channels of every colour, rounded to the table's levels.
static TABLE: LazyLock<Vec<[f32; CHANNELS]>> = LazyLock::new(|| {
    let level = |k: usize| (k as f32 + 0.5) * 255.0 / LEVELS as f32;
    let colour =
        |k: usize| [level(k % LEVELS), level(k / LEVELS % LEVELS), level(k / LEVELS.pow(2))];
    (0..LEVELS.pow(3)).map(|k| channels(colour(k))).collect()
});

/// Writes the mean over each cell of the colour channels of a patch with three planes: `CHANNELS` planes of
/// cells, row by row.
pub fn colour(patch: &Planes, out: &mut [f32]) {
    let table = &*TABLE;
    let (columns, rows) = (patch.width / CELL, patch.height / CELL);
    let [red, green, blue] = [0, 1, 2].map(|channel| patch.plane(channel));
    for (y, x) in (0..rows).flat_map(|y| (0..columns).map(move |x| (y, x))) {
        let mut sum = [0.0; CHANNELS];
        for dy in 0..CELL {
            let start = (y * CELL + dy) * patch.width + x * CELL;
            let of = |plane: &[f32]| -> [f32; CELL] { std::array::from_fn(|k| plane[start + k]) };
            let (red, green, blue) = (of(red), of(green), of(blue));
            for k in 0..CELL {
                let entry = &table[index([red[k], green[k], blue[k]])];
                sum.iter_mut().zip(entry).for_each(|(sum, v)| *sum += v);
            }
        }
        for (channel, sum) in sum.into_iter().enumerate() {
            out[channel * columns * rows + y * columns + x] = sum / (CELL * CELL) as f32;
        }
    }
}

/// The mean luma of each cell, from -0.5 to 0.5.
pub fn luma(patch: &Planes, out: &mut [f32]) {
    let columns = patch.width / CELL;
    let weights: &[f32] = if patch.channels == 1 { &[1.0] } else { &[0.2989, 0.5870, 0.1140] };
    for (k, out) in out.iter_mut().enumerate() {
        let mut sum = 0.0;
        for (channel, weight) in weights.iter().enumerate() {
            let plane = patch.plane(channel);
            for dy in 0..CELL {
                let start = (k / columns * CELL + dy) * patch.width + k % columns * CELL;
                sum += weight * plane[start..start + CELL].iter().sum::<f32>();
            }
        }
        *out = sum / (255 * CELL * CELL) as f32 - 0.5;
    }
}

/// The place of a colour in the table.
fn index(rgb: [f32; 3]) -> usize {
    let [r, g, b] =
        rgb.map(|v| ((v * (LEVELS as f32 / 256.0)) as i32).clamp(0, LEVELS as i32 - 1) as usize);
    r + LEVELS * (g + LEVELS * b)
}

/// The channels of one colour, with white at 255.
fn channels(rgb: [f32; 3]) -> [f32; CHANNELS] {
    let [lightness, a, b] = lab(rgb);
    let chroma = (a.hypot(b) / FULL_CHROMA).min(1.0);
    let hue = b.atan2(a).rem_euclid(TAU) / TAU * HUES as f32;
    let mut out = [0.0; CHANNELS];
    for (k, out) in out.iter_mut().enumerate() {
        *out = if k < LIGHTNESS {
            // Splines at -0.5, 0.5, 1.5, 2.5 of twice the lightness: they add to 1 from 0 to 2.
            (1.0 - chroma) * spline(2.0 * lightness / 100.0 - (k as f32 - 0.5))
        } else {
            let distance = (hue - (k - LIGHTNESS) as f32).rem_euclid(HUES as f32);
            chroma * spline(distance.min(HUES as f32 - distance))
        };
        *out -= 1.0 / CHANNELS as f32;
    }
    out
}

/// The quadratic B-spline.
fn spline(t: f32) -> f32 {
    let t = t.abs();
    match t {
        _ if t <= 0.5 => 0.75 - t * t,
        _ if t <= 1.5 => (1.5 - t).powi(2) / 2.0,
        _ => 0.0,
    }
}

/// CIE L*a*b* of an sRGB colour, with the white point D65.
fn lab(rgb: [f32; 3]) -> [f32; 3] {
    let [r, g, b] = rgb.map(|v| {
        let v = v / 255.0;
        if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
    });
    let f = |t: f32| if t > 0.008_856 { t.cbrt() } else { 7.787 * t + 16.0 / 116.0 };
    let x = f((0.4124 * r + 0.3576 * g + 0.1805 * b) / 0.9505);
    let y = f(0.2126 * r + 0.7152 * g + 0.0722 * b);
    let z = f((0.0193 * r + 0.1192 * g + 0.9505 * b) / 1.0891);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shares(rgb: [f32; 3]) -> [f32; CHANNELS] {
        channels(rgb).map(|v| v + 1.0 / CHANNELS as f32)
    }

    #[test]
    fn shares_of_every_colour_add_to_1() {
        for entry in TABLE.iter() {
            assert!(entry.iter().sum::<f32>().abs() < 1e-5);
        }
    }

    #[test]
    fn greys_have_lightness_and_colours_have_hues() {
        let (black, white) = (shares([0.0; 3]), shares([255.0; 3]));
        assert!(black[0] + black[1] > 0.99 && white[2] + white[3] > 0.99);
        let red = shares([255.0, 0.0, 0.0]);
        assert!(red[..LIGHTNESS].iter().all(|&v| v < 1e-6));
        // Red has a hue of 40 degrees in Lab, nearest to the second hue at 45.
        assert!(red[LIGHTNESS + 1] > 0.7, "{red:?}");
    }

    #[test]
    fn lab_of_known_colours() {
        // From CIE 1976 for sRGB primaries (Bruce Lindbloom's calculator gives 53.24, 80.09, 67.20 for red).
        for (rgb, expected) in [
            ([255.0, 0.0, 0.0], [53.24, 80.09, 67.20]),
            ([0.0, 0.0, 255.0], [32.30, 79.20, -107.86]),
            ([255.0, 255.0, 255.0], [100.0, 0.0, 0.0]),
        ] {
            for (a, b) in lab(rgb).into_iter().zip(expected) {
                assert!((a - b).abs() < 0.1, "{rgb:?}: {a} {b}");
            }
        }
    }

    #[test]
    fn cells_are_means() {
        let samples = (0..3 * 64).map(|k| if k % 8 < 4 { 255.0 } else { 0.0 }).collect();
        let patch = Planes { width: 8, height: 8, channels: 3, samples };
        let mut out = vec![0.0; CHANNELS * 4];
        colour(&patch, &mut out);
        for (channel, cells) in out.chunks(4).enumerate() {
            let (white, black) = (TABLE[index([255.0; 3])][channel], TABLE[0][channel]);
            for (value, expected) in cells.iter().zip([white, black, white, black]) {
                assert!((value - expected).abs() < 1e-6);
            }
        }
        let mut grey = [0.0; 4];
        luma(&patch, &mut grey);
        assert!((grey[0] - 0.4999).abs() < 1e-3 && (grey[1] + 0.5).abs() < 1e-6);
    }
}
