//! Upright crops of a frame, resampled to any size: bilinear where they are enlarged, area averages
//! where they shrink. Pixels outside the frame repeat those at its border.
//!
//! The cost follows the size of the result, not that of the crop: beyond four source pixels per
//! result pixel, only every so many rows and columns of the frame are read.
//!
//! Plain loops over rows. With AVX2 they take 74 % of the plain instructions
//! (`benchmarks/record/speed.md`).

use super::frame::{Frame, RowTaps};
use super::geometry::Point;
use crate::numeric::instructions::{Instructions, dispatch_eight};

/// The maximum number of source pixels, along each axis, that a pixel of the result is averaged
/// from.
const MAX_SHRINK: f64 = 4.0;
/// The most taps of a pixel of the result along one axis: `MAX_SHRINK` and a part of a pixel at
/// both ends.
const MAX_TAPS: usize = MAX_SHRINK as usize + 1;

/// Samples behind a row of pixels: a pixel with three samples is read with a fourth.
const PADDING: usize = 1;

/// An image in planes: one of luma, or three of red, green and blue. White is 255.
#[derive(Debug, Clone, Default)]
pub struct Planes {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Number of planes: 1 or 3.
    pub channels: usize,
    /// `channels * height * width` samples.
    pub samples: Vec<f32>,
}

impl Planes {
    /// The samples of one plane, row by row.
    pub fn plane(&self, channel: usize) -> &[f32] {
        &self.samples[channel * self.width * self.height..][..self.width * self.height]
    }

    /// The planes of red, green and blue, which are all the same if there is only one plane.
    pub fn rgb(&self) -> [&[f32]; 3] {
        [0, 1, 2].map(|channel| self.plane(channel % self.channels))
    }

    /// The shape, without caring for the samples.
    pub fn reshape(&mut self, [width, height]: [usize; 2], channels: usize) {
        (self.width, self.height, self.channels) = (width, height, channels);
        self.samples.resize(width * height * channels, 0.0);
    }
}

/// A part of the frame and what it is resampled to.
#[derive(Debug, Clone, Copy)]
pub struct Crop {
    /// The centre in the frame.
    pub centre: Point,
    /// Frame pixels per result pixel, along x and y.
    pub scale: [f64; 2],
    /// Width and height of the result in pixels.
    pub size: [usize; 2],
    /// By how much the crop is turned in the frame, in radians: from x towards y, so clockwise as
    /// seen.
    pub rotation: f64,
}

/// A rectangle of the frame, which may be turned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Region {
    /// The centre in the frame.
    pub centre: Point,
    /// Width and height in frame pixels.
    pub size: [f64; 2],
    /// The rotation, as in [`Crop`].
    pub rotation: f64,
}

impl Region {
    /// The crop of this region, resampled to this many pixels.
    pub fn crop(self, size: [usize; 2]) -> Crop {
        let Self { centre, rotation, .. } = self;
        let scale = [0, 1].map(|axis| self.size[axis] / size[axis] as f64);
        Crop { centre, scale, size, rotation }
    }

    /// The region with both sides multiplied by a factor.
    pub fn scaled(self, factor: f64) -> Self {
        Self { size: self.size.map(|side| side * factor), ..self }
    }
}

/// Buffers of [`Crop::cut`].
#[derive(Debug, Default)]
pub struct CropScratch {
    columns: Axis,
    rows: Axis,
    /// Pixels of the frame, averaged along y, and `PADDING`.
    row: Vec<f32>,
    pixels: Vec<f32>,
    /// The upright crop around a turned one.
    around: Planes,
}

/// Where the pixels of the result come from along one axis of the frame. Only every `step`-th frame
/// pixel counts; tap `t` of result pixel `i` is number `first[i] + t` of those, counted from `low`.
#[derive(Debug, Default)]
struct Axis {
    step: usize,
    low: i64,
    count: usize,
    taps: usize,
    first: Vec<u32>,
    weights: Vec<f32>,
    /// The largest that a number plus `low` may be.
    last: i64,
    /// The first and last numbers that lie inside the frame; both 0 if none do.
    inside: (usize, usize),
}

impl Axis {
    /// Plans `size` result pixels from a frame of this length.
    #[inline(always)]
    fn fill(&mut self, length: usize, centre: f64, scale: f64, size: usize) {
        self.step = if scale > MAX_SHRINK { (scale * 2.0 / MAX_SHRINK) as usize } else { 1 };
        let step = self.step as f64;
        let offset = ((self.step - 1) / 2) as f64;
        let (centre, scale) = ((centre - offset) / step, scale / step);
        let reach = if scale > 1.0 { scale / 2.0 + 0.5 } else { 1.0 };
        let position = |i: usize| centre + (i as f64 - (size as f64 - 1.0) / 2.0) * scale;
        let start = |i: usize| (position(i) - reach).floor() as i64 + 1;
        self.taps = if scale > 1.0 { (2.0 * reach).ceil() as usize } else { 2 };
        self.low = start(0);
        self.count = (start(size - 1) - self.low) as usize + self.taps;
        self.first.clear();
        self.weights.clear();
        // Room for any scale, so that a target that grows takes no memory later.
        self.weights.reserve(size * MAX_TAPS);
        for i in 0..size {
            let (position, start) = (position(i), start(i));
            self.first.push((start - self.low) as u32);
            for t in 0..self.taps {
                let distance = ((start + t as i64) as f64 - position).abs();
                let weight = if scale > 1.0 {
                    (reach - distance).clamp(0.0, 1.0) / scale
                } else {
                    (1.0 - distance).max(0.0)
                };
                self.weights.push(weight as f32);
            }
        }
        let (length, step) = (length as i64, self.step as i64);
        self.last = (length - 1).div_euclid(step);
        let first = (-self.low).max(0);
        let last = (length - 1 - (step - 1) / 2).div_euclid(step) - self.low;
        let last = last.min(self.count as i64 - 1);
        self.inside = if first <= last { (first as usize, last as usize) } else { (0, 0) };
    }

    /// The frame pixel with this number, or the nearest that the frame has.
    #[inline(always)]
    fn pixel(&self, number: usize, length: usize) -> usize {
        let step = self.step as i64;
        let pixel = (self.low + number as i64).clamp(0, self.last) * step + (step - 1) / 2;
        (pixel as usize).min(length - 1)
    }
}

impl Crop {
    /// Cuts the crop out of the frame, with 1 (luma) or 3 channels.
    pub fn cut(
        &self,
        frame: &Frame<'_>,
        channels: usize,
        scratch: &mut CropScratch,
        out: &mut Planes,
    ) {
        if self.rotation == 0.0 {
            return self.cut_upright(frame, channels, scratch, out);
        }
        let mut around = std::mem::take(&mut scratch.around);
        let side = (self.size[0] as f64).hypot(self.size[1] as f64).ceil() as usize + 2;
        let upright = Self { size: [side; 2], rotation: 0.0, ..*self };
        upright.cut_upright(frame, channels, scratch, &mut around);
        out.reshape(self.size, channels);
        self.turn(&around, out);
        scratch.around = around;
    }

    /// Samples the crop from the upright one around it, bilinearly.
    fn turn(&self, around: &Planes, out: &mut Planes) {
        let [width, height] = self.size;
        let (sin, cos) = self.rotation.sin_cos();
        // Scales along x and y differ little, so that turning in the pixels of the result does.
        let ratio = (self.scale[1] / self.scale[0]) as f32;
        let (sin, cos) = (sin as f32, cos as f32);
        let middle = |length: usize| (length as f32 - 1.0) / 2.0;
        let limit = (around.width - 2) as f32;
        for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
            let (dx, dy) = (x as f32 - middle(width), (y as f32 - middle(height)) * ratio);
            let u = (middle(around.width) + cos * dx - sin * dy).clamp(0.0, limit);
            let v = (middle(around.height) + (sin * dx + cos * dy) / ratio).clamp(0.0, limit);
            let (column, row) = (u as usize, v as usize);
            let (fx, fy) = (u - column as f32, v - row as f32);
            let first = row * around.width + column;
            for channel in 0..out.channels {
                let plane = around.plane(channel);
                let pair = |at: usize| plane[at] + fx * (plane[at + 1] - plane[at]);
                let (above, below) = (pair(first), pair(first + around.width));
                out.samples[(channel * height + y) * width + x] = above + fy * (below - above);
            }
        }
    }

    fn cut_upright(
        &self,
        frame: &Frame<'_>,
        channels: usize,
        scratch: &mut CropScratch,
        out: &mut Planes,
    ) {
        out.reshape(self.size, channels);
        dispatch_eight!(Instructions::default(), |_| {
            scratch.columns.fill(frame.width(), self.centre[0], self.scale[0], self.size[0]);
            scratch.rows.fill(frame.height(), self.centre[1], self.scale[1], self.size[1]);
            for j in 0..out.height {
                average_rows(frame, j, out.channels, scratch);
                let CropScratch { columns, row, pixels, .. } = &mut *scratch;
                match out.channels {
                    1 => average_columns::<1, 1>(columns, row, pixels),
                    _ => average_columns::<3, 4>(columns, row, pixels),
                }
                for channel in 0..out.channels {
                    let first = (channel * out.height + j) * out.width;
                    let plane = &mut out.samples[first..][..out.width];
                    match out.channels {
                        1 => plane.copy_from_slice(pixels),
                        _ => part::<4>(pixels, frame.place_of(channel), plane),
                    }
                }
            }
        });
    }
}

/// The columns of the frame that count, averaged along y for one row of the result.
#[inline(always)]
fn average_rows(frame: &Frame<'_>, j: usize, channels: usize, scratch: &mut CropScratch) {
    let CropScratch { columns, rows, row, .. } = scratch;
    row.clear();
    row.reserve((columns.first.len() * MAX_SHRINK as usize + MAX_TAPS) * channels + PADDING);
    row.resize(columns.count * channels + PADDING, 0.0);
    for t in 0..rows.taps {
        let weight = rows.weights[j * rows.taps + t];
        if weight != 0.0 {
            let y = rows.pixel(rows.first[j] as usize + t, frame.height());
            add_row(frame, y, weight, columns, channels, row);
        }
    }
    repeat_border(columns, channels, row);
}

/// Adds a row of the frame to that part of the buffer that lies inside it.
#[inline(always)]
fn add_row(
    frame: &Frame<'_>,
    y: usize,
    weight: f32,
    columns: &Axis,
    channels: usize,
    row: &mut [f32],
) {
    let (first, last) = columns.inside;
    let from = columns.pixel(first, frame.width());
    let taps = RowTaps { from, step: columns.step, weight };
    frame.add_row(y, taps, channels, &mut row[first * channels..(last + 1) * channels]);
}

/// Repeats the outermost pixels inside the frame over those outside.
#[inline(always)]
fn repeat_border(columns: &Axis, channels: usize, row: &mut [f32]) {
    let (first, last) = columns.inside;
    for channel in 0..channels {
        let (left, right) = (row[first * channels + channel], row[last * channels + channel]);
        (0..first).for_each(|k| row[k * channels + channel] = left);
        (last + 1..columns.count).for_each(|k| row[k * channels + channel] = right);
    }
}

/// One row of the result: pixels of `LANES` samples, of which the first `CHANNELS` count.
#[inline(always)]
fn average_columns<const CHANNELS: usize, const LANES: usize>(
    columns: &Axis,
    row: &[f32],
    out: &mut Vec<f32>,
) {
    out.resize(columns.first.len() * LANES, 0.0);
    let (out, _) = out.as_chunks_mut::<LANES>();
    match columns.taps {
        2 => average_taps::<2, CHANNELS, LANES>(columns, row, out),
        3 => average_taps::<3, CHANNELS, LANES>(columns, row, out),
        4 => average_taps::<4, CHANNELS, LANES>(columns, row, out),
        _ => average_taps::<5, CHANNELS, LANES>(columns, row, out),
    }
}

#[inline(always)]
fn average_taps<const TAPS: usize, const CHANNELS: usize, const LANES: usize>(
    columns: &Axis,
    row: &[f32],
    out: &mut [[f32; LANES]],
) {
    let (weights, _) = columns.weights.as_chunks::<TAPS>();
    for ((out, &first), weights) in out.iter_mut().zip(&columns.first).zip(weights) {
        let pixels = &row[first as usize * CHANNELS..][..(TAPS - 1) * CHANNELS + LANES];
        let mut sum = [0.0; LANES];
        for (t, weight) in weights.iter().enumerate() {
            let pixel = &pixels[t * CHANNELS..][..LANES];
            (0..LANES).for_each(|k| sum[k] += weight * pixel[k]);
        }
        *out = sum;
    }
}

/// One sample of each pixel.
#[inline(always)]
fn part<const LANES: usize>(pixels: &[f32], sample: usize, out: &mut [f32]) {
    let (pixels, _) = pixels.as_chunks::<LANES>();
    out.iter_mut().zip(pixels).for_each(|(out, pixel)| *out = pixel[sample % LANES]);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut(frame: &Frame<'_>, channels: usize, crop: Crop) -> Planes {
        let mut out = Planes::default();
        crop.cut(frame, channels, &mut CropScratch::default(), &mut out);
        out
    }

    proptest::proptest! {
        #[test]
        fn neither_the_order_of_colours_nor_the_stride_changes_a_bit(
            rgb in proptest::collection::vec(proptest::num::u8::ANY, 3 * 9 * 7),
            scale in 0.3f64..6.0,
            centre in [-2.0f64..11.0, -2.0f64..9.0],
            rotation in 0.0f64..1.0,
        ) {
            let crop = Crop { centre, scale: [scale; 2], size: [6, 5], rotation };
            let swapped: Vec<u8> =
                rgb.as_chunks().0.iter().flat_map(|&[r, g, b]: &[u8; 3]| [b, g, r]).collect();
            let padded: Vec<u8> =
                swapped.chunks(3 * 9).flat_map(|row| [row, &[255; 4]].concat()).collect();
            let frame = Frame::rgb8(&rgb, 9, 7).unwrap();
            let bgr = Frame::rgb8(&swapped, 9, 7).unwrap().bgr();
            let wide = Frame::rgb8(&padded, 9, 7).unwrap().bgr().with_stride(3 * 9 + 4).unwrap();
            for channels in [1, 3] {
                let expected = cut(&frame, channels, crop).samples;
                for other in [bgr, wide] {
                    let samples = cut(&other, channels, crop).samples;
                    let same = samples.iter().zip(&expected).all(|(a, b)| a.to_bits() == b.to_bits());
                    proptest::prop_assert!(same, "{channels} channels");
                }
            }
        }
    }

    #[test]
    fn at_scale_1_pixels_are_copied_and_borders_repeated() {
        let pixels: Vec<u8> = (0..12).map(|k| k * 20).collect();
        let frame = Frame::grey8(&pixels, 4, 3).unwrap();
        let crop = Crop { centre: [0.0, 1.0], scale: [1.0; 2], size: [5, 3], rotation: 0.0 };
        let out = cut(&frame, 1, crop);
        assert_eq!(out.samples[..5], [0.0, 0.0, 0.0, 20.0, 40.0]);
        assert_eq!(out.samples[10..], [160.0, 160.0, 160.0, 180.0, 200.0]);
        let far = Crop { centre: [900.0, -700.0], ..crop };
        assert_eq!(cut(&frame, 1, far).samples, [60.0; 15]);
        let far = Crop { centre: [-900.0, 700.0], ..crop };
        assert_eq!(cut(&frame, 1, far).samples, [160.0; 15]);
    }

    #[test]
    fn a_linear_ramp_stays_one_at_any_scale() {
        let (w, h) = (400, 300);
        let at = |x: usize, y: usize| (x as f32) * 0.5 + (y as f32) * 0.25;
        let pixels: Vec<f32> = (0..w * h).flat_map(|k| [at(k % w, k / w) / 255.0; 3]).collect();
        let frame = Frame::rgb32f(&pixels, w, h).unwrap();
        for scale in [0.3, 0.75, 1.0, 1.3, 2.0, 3.7, 5.5, 9.0] {
            let centre = [200.3, 149.6];
            let out = cut(
                &frame,
                3,
                Crop { centre, scale: [scale, scale * 1.1], size: [20, 16], rotation: 0.0 },
            );
            for channel in 0..3 {
                for (k, &value) in out.plane(channel).iter().enumerate() {
                    let x = centre[0] + ((k % 20) as f64 - 9.5) * scale;
                    let y = centre[1] + ((k / 20) as f64 - 7.5) * scale * 1.1;
                    let expected = x * 0.5 + y * 0.25;
                    assert!(
                        (f64::from(value) - expected).abs() < 0.3,
                        "{scale} {k} {value} {expected}"
                    );
                }
            }
        }
    }

    #[test]
    fn any_scale_fits_into_the_buffers_of_the_first() {
        let frame = vec![7u8; 300 * 200 * 3];
        let frame = Frame::rgb8(&frame, 300, 200).unwrap();
        let (mut scratch, mut out) = (CropScratch::default(), Planes::default());
        let mut cut = |scale: f64| {
            let crop =
                Crop { centre: [150.0, 90.0], scale: [scale; 2], size: [22, 17], rotation: 0.0 };
            crop.cut(&frame, 3, &mut scratch, &mut out);
            let CropScratch { columns, rows, row, pixels, .. } = &scratch;
            let axes = [columns, rows].map(|axis| [axis.first.capacity(), axis.weights.capacity()]);
            (axes, row.capacity(), pixels.capacity())
        };
        let first = cut(0.5);
        for scale in (1..2000).map(|k| f64::from(k) * 0.01) {
            assert_eq!(cut(scale), first, "{scale}");
        }
    }

    #[test]
    fn a_turned_crop_of_a_ramp_is_a_turned_ramp() {
        let pixels: Vec<f32> = (0..300 * 300)
            .map(|k| ((k % 300) as f32 * 0.5 + (k / 300) as f32 * 0.25) / 255.0)
            .collect();
        let frame = Frame::grey32f(&pixels, 300, 300).unwrap();
        for (rotation, ratio) in [(0.4f64, 1.0), (-2.0, 1.0), (1.1, 1.05)] {
            let (centre, scale) = ([150.2, 149.7], [1.7, 1.7 * ratio]);
            let crop = Crop { centre, scale, size: [24, 20], rotation };
            for (k, value) in cut(&frame, 1, crop).samples.into_iter().enumerate() {
                let [dx, dy] = [(k % 24) as f64 - 11.5, (k / 24) as f64 - 9.5];
                let (dx, dy) = (dx * scale[0], dy * scale[1]);
                let x = centre[0] + rotation.cos() * dx - rotation.sin() * dy;
                let y = centre[1] + rotation.sin() * dx + rotation.cos() * dy;
                let expected = x * 0.5 + y * 0.25;
                assert!((f64::from(value) - expected).abs() < 0.1, "{k}: {value} {expected}");
            }
        }
    }

    #[test]
    fn halving_averages_each_pair() {
        let frame = Frame::grey8(&[0, 100, 40, 60, 20, 80, 8, 12], 4, 2).unwrap();
        let crop = Crop { centre: [1.5, 0.5], scale: [2.0; 2], size: [2, 1], rotation: 0.0 };
        assert_eq!(cut(&frame, 1, crop).samples, [50.0, 30.0]);
    }

    #[test]
    fn colours_are_those_of_the_frame() {
        let rgb = [10, 20, 30, 40, 50, 60];
        let crop = Crop { centre: [0.5, 0.0], scale: [1.0; 2], size: [2, 1], rotation: 0.0 };
        let frame = Frame::rgb8(&rgb, 2, 1).unwrap();
        assert_eq!(cut(&frame, 3, crop).samples, [10.0, 40.0, 20.0, 50.0, 30.0, 60.0]);
        assert_eq!(cut(&frame.bgr(), 3, crop).samples, [30.0, 60.0, 20.0, 50.0, 10.0, 40.0]);
        let luma = cut(&frame, 1, crop).samples[0];
        assert!((luma - (2.989 + 11.74 + 3.42)).abs() < 1e-3, "{luma}");
        let wide: Vec<u16> = rgb.iter().map(|&v| u16::from(v) * 257).collect();
        let wide = cut(&Frame::rgb16(&wide, 2, 1).unwrap(), 3, crop).samples;
        assert!(
            wide.iter().zip([10.0, 40.0, 20.0]).all(|(a, b): (&f32, f32)| (a - b).abs() < 1e-3)
        );
        let grey = Frame::grey8(&[7, 9], 2, 1).unwrap();
        assert_eq!(cut(&grey, 3, crop).samples, [7.0, 9.0, 7.0, 9.0, 7.0, 9.0]);
    }
}
