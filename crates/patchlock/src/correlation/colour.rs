//! Colour channels: a soft assignment of each colour to four lightness levels of grey and eight
//! hues.
//!
//! The shares of a colour add to 1, and each channel is what it differs from the mean share by, so
//! that a patch without colour has little energy. It plays the part of the learnt colour names of
//! van de Weijer et al. (2009) without a table.
//!
//! Plain loops over the cells of a row. With AVX2 they take 12 % of the plain instructions, for
//! luma alone 52 % (`benchmarks/record/speed.md`).

use crate::correlation::fhog::CELL;
use crate::numeric::instructions::{Instructions, dispatch_eight};
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

/// Buffers of [`colour`] and [`luma`].
#[derive(Debug, Default)]
pub struct ColourScratch {
    /// The places in the table of one row of cells.
    places: Vec<u32>,
    luma: Vec<f32>,
}

/// Writes the mean over each cell of the colour channels of a patch with three planes, or with one
/// of grey: cell by cell, `CHANNELS` values every `stride`.
pub fn colour(patch: &Planes, scratch: &mut ColourScratch, out: &mut [f32], stride: usize) {
    let places = &mut scratch.places;
    dispatch_eight!(Instructions::default(), |_| {
        let Some(table) = TABLE.first_chunk::<{ LEVELS.pow(3) }>() else { return };
        let (width, columns) = (patch.width, patch.width / CELL);
        let length = width * CELL;
        places.resize(length, 0);
        for (row, out) in out.chunks_mut(columns * stride).take(patch.height / CELL).enumerate() {
            let [red, green, blue] = patch.rgb().map(|plane| &plane[row * length..][..length]);
            for (k, place) in places[..length].iter_mut().enumerate() {
                *place = index([red[k], green[k], blue[k]]);
            }
            for (x, out) in out.chunks_mut(stride).enumerate() {
                let (mut eight, mut four) = ([0.0; 8], [0.0; 4]);
                for row in places.chunks_exact(width) {
                    let Some(places) = row[x * CELL..].first_chunk::<CELL>() else { continue };
                    for &place in places {
                        let entry = &table[place as usize % table.len()];
                        (0..8).for_each(|k| eight[k] += entry[k]);
                        (0..4).for_each(|k| four[k] += entry[8 + k]);
                    }
                }
                let mean = |sum: f32| sum / (CELL * CELL) as f32;
                out[..8].copy_from_slice(&eight.map(mean));
                out[8..CHANNELS].copy_from_slice(&four.map(mean));
            }
        }
    });
}

/// Writes the mean luma of each cell, from -0.5 to 0.5, one value every `stride`.
pub fn luma(patch: &Planes, scratch: &mut ColourScratch, out: &mut [f32], stride: usize) {
    let luma = &mut scratch.luma;
    dispatch_eight!(Instructions::default(), |_| {
        let (width, columns) = (patch.width, patch.width / CELL);
        let weights: &[f32] = if patch.channels == 1 { &[1.0] } else { &[0.2989, 0.5870, 0.1140] };
        for (row, out) in out.chunks_mut(columns * stride).take(patch.height / CELL).enumerate() {
            luma.clear();
            luma.resize(width, 0.0);
            for (channel, weight) in weights.iter().enumerate() {
                let rows = &patch.plane(channel)[row * CELL * width..][..CELL * width];
                for row in rows.chunks_exact(width) {
                    luma.iter_mut().zip(row).for_each(|(sum, v)| *sum += weight * v);
                }
            }
            let cells = luma.as_chunks::<CELL>().0;
            for (out, [a, b, c, d]) in out.iter_mut().step_by(stride).zip(cells) {
                *out = (a + b + c + d) / (255 * CELL * CELL) as f32 - 0.5;
            }
        }
    });
}

/// The place of a colour in the table.
#[inline(always)]
fn index(rgb: [f32; 3]) -> u32 {
    let [r, g, b] = rgb.map(|v| {
        let level = (v * (LEVELS as f32 / 256.0)).floor().clamp(0.0, (LEVELS - 1) as f32);
        // As an integer: with 2^23 added, whole numbers are the last bits. Unlike a conversion,
        // that is done to a vector at a time.
        (level + 8_388_608.0).to_bits() % LEVELS as u32
    });
    r + LEVELS as u32 * (g + LEVELS as u32 * b)
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
        // From CIE 1976 for sRGB primaries (Bruce Lindbloom's calculator gives 53.24, 80.09, 67.20
        // for red).
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
        let stride = CHANNELS + 3;
        let mut out = vec![0.0; stride * 4];
        colour(&patch, &mut ColourScratch::default(), &mut out, stride);
        let (white, black) = (TABLE[index([255.0; 3]) as usize], TABLE[0]);
        for (cell, expected) in out.chunks(stride).zip([white, black, white, black]) {
            for (value, expected) in cell.iter().zip(expected) {
                assert!((value - expected).abs() < 1e-6);
            }
            assert_eq!(cell[CHANNELS..], [0.0; 3]);
        }
        let one = Planes { channels: 1, samples: patch.plane(0).to_vec(), ..patch };
        let mut of_grey = vec![0.0; out.len()];
        colour(&one, &mut ColourScratch::default(), &mut of_grey, stride);
        assert_eq!(of_grey, out);
        let mut grey = [0.0; 8];
        luma(&patch, &mut ColourScratch::default(), &mut grey, 2);
        assert!((grey[0] - 0.4999).abs() < 1e-3 && (grey[2] + 0.5).abs() < 1e-6);
    }
}
