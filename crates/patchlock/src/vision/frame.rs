//! Frames: borrowed views of the caller's pixels, and their conversion to grey images.
//!
//! Grey is `0.2989 R + 0.5870 G + 0.1140 B`, scaled to `[0, 1]` (Sec. 2 of the paper).

use super::bilinear::Tap;
use crate::Error;
use serde::{Deserialize, Serialize};

/// The allowed `f32` samples: black is 0 and white is 1, and resampled pictures exceed that a little.
/// Samples from 0 to 255 would be tracked to nonsense.
const FLOATS: std::ops::RangeInclusive<f32> = -0.5..=1.5;

/// The weights of red, green and blue in grey.
const LUMA: [f32; 3] = [0.2989, 0.5870, 0.1140];

/// The type of one channel of a pixel.
trait Sample: Copy + std::fmt::Debug {
    /// The value of white.
    const WHITE: f32;

    fn value(self) -> f32;

    /// The value with white at 255; the same for samples of every type that stand for the same 8
    /// bits.
    fn level(self) -> f32;

    /// Whether the sample is allowed.
    fn is_usable(self) -> bool {
        true
    }
}

impl Sample for u8 {
    const WHITE: f32 = 255.0;

    fn value(self) -> f32 {
        f32::from(self)
    }

    fn level(self) -> f32 {
        f32::from(self)
    }
}

impl Sample for u16 {
    const WHITE: f32 = 65535.0;

    fn value(self) -> f32 {
        f32::from(self)
    }

    fn level(self) -> f32 {
        f32::from(self) / 257.0
    }
}

impl Sample for f32 {
    const WHITE: f32 = 1.0;

    fn value(self) -> f32 {
        self
    }

    fn level(self) -> f32 {
        self * 255.0
    }

    fn is_usable(self) -> bool {
        FLOATS.contains(&self)
    }
}

/// Width and height of the frames in which a target is tracked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct FrameSize {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
}

impl FrameSize {
    /// Checks that a frame has this size.
    ///
    /// # Errors
    /// [`Error::FrameSize`], with both sizes, if the sizes differ.
    pub fn expect(self, given: Self) -> Result<(), Error> {
        if given == self {
            return Ok(());
        }
        Err(Error::FrameSize {
            width: given.width,
            height: given.height,
            expected_width: self.width,
            expected_height: self.height,
        })
    }

    /// Checks that both sides are positive.
    ///
    /// # Errors
    /// [`Error::Snapshot`] if a side is 0.
    pub fn checked(self) -> Result<Self, Error> {
        let valid = self.width > 0 && self.height > 0;
        valid.then_some(self).ok_or_else(|| crate::error::snapshot("the frame size is 0"))
    }
}

/// Which pixels of a row are read, and their weight.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RowTaps {
    /// The first column.
    pub from: usize,
    /// From one column to the next.
    pub step: usize,
    /// What each pixel is multiplied with.
    pub weight: f32,
}

/// The samples of a frame.
#[derive(Debug, Clone, Copy)]
enum Samples<'a> {
    U8(&'a [u8]),
    U16(&'a [u16]),
    F32(&'a [f32]),
}

/// The channels of a pixel, in order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Colours {
    Grey,
    Rgb,
    Bgr,
}

impl Colours {
    fn channels(self) -> usize {
        if self == Self::Grey { 1 } else { 3 }
    }
}

/// A borrowed view of one frame: row-major samples, with `stride` samples from the start of one row
/// to the next.
#[derive(Debug, Clone, Copy)]
pub struct Frame<'a> {
    samples: Samples<'a>,
    colours: Colours,
    width: usize,
    height: usize,
    stride: usize,
}

impl<'a> Frame<'a> {
    /// Grey, 8 bits per sample; `width * height` samples without gaps.
    ///
    /// # Errors
    /// [`Error::Frame`] if a side is 0 or there are too few samples. This holds for all kinds of
    /// frames.
    pub fn grey8(samples: &'a [u8], width: usize, height: usize) -> Result<Self, Error> {
        Self::contiguous(Samples::U8(samples), Colours::Grey, width, height)
    }

    /// Red, green, blue, 8 bits each, interleaved; `3 * width * height` samples without gaps.
    ///
    /// # Errors
    /// As [`Frame::grey8`].
    pub fn rgb8(samples: &'a [u8], width: usize, height: usize) -> Result<Self, Error> {
        Self::contiguous(Samples::U8(samples), Colours::Rgb, width, height)
    }

    /// Grey, 16 bits per sample (0 is black, 65535 white).
    ///
    /// # Errors
    /// As [`Frame::grey8`].
    pub fn grey16(samples: &'a [u16], width: usize, height: usize) -> Result<Self, Error> {
        Self::contiguous(Samples::U16(samples), Colours::Grey, width, height)
    }

    /// Red, green, blue, 16 bits each, interleaved.
    ///
    /// # Errors
    /// As [`Frame::grey8`].
    pub fn rgb16(samples: &'a [u16], width: usize, height: usize) -> Result<Self, Error> {
        Self::contiguous(Samples::U16(samples), Colours::Rgb, width, height)
    }

    /// Grey floats, black at 0 and white at 1. Samples from -0.5 to 1.5 are allowed, which is checked
    /// when the frame is used.
    ///
    /// # Errors
    /// As [`Frame::grey8`].
    pub fn grey32f(samples: &'a [f32], width: usize, height: usize) -> Result<Self, Error> {
        Self::contiguous(Samples::F32(samples), Colours::Grey, width, height)
    }

    /// Red, green, blue as interleaved floats; see [`Frame::grey32f`] for their range.
    ///
    /// # Errors
    /// As [`Frame::grey8`].
    pub fn rgb32f(samples: &'a [f32], width: usize, height: usize) -> Result<Self, Error> {
        Self::contiguous(Samples::F32(samples), Colours::Rgb, width, height)
    }

    /// The same samples with the channels in the order blue, green, red, as in OpenCV. A grey frame
    /// is unchanged.
    #[must_use]
    pub fn bgr(self) -> Self {
        let colours = if self.colours == Colours::Rgb { Colours::Bgr } else { self.colours };
        Self { colours, ..self }
    }

    /// The same samples with `stride` samples (not pixels) from the start of one row to the start
    /// of the next.
    ///
    /// # Errors
    /// [`Error::Frame`] if rows would overlap or there are too few samples.
    pub fn with_stride(self, stride: usize) -> Result<Self, Error> {
        Self { stride, ..self }.checked()
    }

    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Width and height.
    pub fn size(&self) -> FrameSize {
        FrameSize { width: self.width, height: self.height }
    }

    /// Whether the frame has colour channels.
    pub(crate) fn has_colour(&self) -> bool {
        self.colours != Colours::Grey
    }

    /// Samples row `y` between its columns, linearly. A pixel is the frame's three colours in its
    /// own order, with white at 255; a grey pixel counts as three equal colours. Columns outside
    /// the frame have the colour `border`, in the same order.
    pub(crate) fn sample_row(
        &self,
        y: usize,
        taps: &[Tap],
        border: [f32; 3],
        out: &mut [[f32; 3]],
    ) {
        match self.samples {
            Samples::U8(samples) => self.sample_row_of(samples, y, taps, border, out),
            Samples::U16(samples) => self.sample_row_of(samples, y, taps, border, out),
            Samples::F32(samples) => self.sample_row_of(samples, y, taps, border, out),
        }
    }

    fn sample_row_of<S: Sample>(
        &self,
        samples: &[S],
        y: usize,
        taps: &[Tap],
        border: [f32; 3],
        out: &mut [[f32; 3]],
    ) {
        let channels = self.colours.channels();
        let row = &samples[y * self.stride..][..channels * self.width];
        let colours = |pixel: &[S]| match pixel {
            [a, b, c, ..] => [a.level(), b.level(), c.level()],
            _ => [pixel[0].level(); 3],
        };
        let outside = |column: i64| match usize::try_from(column) {
            Ok(column) if column < self.width => colours(&row[column * channels..][..channels]),
            _ => border,
        };
        for (out, tap) in out.iter_mut().zip(taps) {
            let inside = usize::try_from(tap.before).ok().filter(|&x| x + 1 < self.width);
            let (left, right) = match inside {
                Some(column) => {
                    let pair = &row[column * channels..][..2 * channels];
                    (colours(&pair[..channels]), colours(&pair[channels..]))
                }
                None => (outside(tap.before), outside(tap.before + 1)),
            };
            *out = std::array::from_fn(|k| left[k] + (right[k] - left[k]) * tap.fraction);
        }
    }

    /// The mean red, green and blue, with white at 255.
    pub(crate) fn mean_colour(&self) -> [f32; 3] {
        let mut row = vec![0.0; self.width * 3];
        let mut sums = [0.0_f64; 3];
        for y in 0..self.height {
            row.fill(0.0);
            self.add_row(y, RowTaps { from: 0, step: 1, weight: 1.0 }, 3, &mut row);
            for pixel in row.as_chunks::<3>().0 {
                (0..3).for_each(|k| sums[k] += f64::from(pixel[k]));
            }
        }
        let count = (self.width * self.height) as f64;
        [0, 1, 2].map(|colour| (sums[self.place_of(colour)] / count) as f32)
    }

    /// Checks all samples of an `f32` frame.
    ///
    /// # Errors
    /// [`Error::Frame`] if a sample is not allowed.
    pub(crate) fn check_samples(&self) -> Result<(), Error> {
        let Samples::F32(samples) = self.samples else { return Ok(()) };
        let row = self.colours.channels() * self.width;
        (0..self.height).try_for_each(|y| self.check_row(&samples[y * self.stride..][..row], y))
    }

    /// Adds pixels of row `y`, times `weight`, to `out`: those in columns `from`, `from + step` and
    /// so on. A pixel is one luma (`out.len()` pixels) or the frame's three colours in its own
    /// order, with white at 255; a grey pixel counts as three equal colours.
    #[inline(always)]
    pub(crate) fn add_row(&self, y: usize, taps: RowTaps, channels: usize, out: &mut [f32]) {
        match self.samples {
            Samples::U8(samples) => self.add_row_of(samples, y, taps, channels, out),
            Samples::U16(samples) => self.add_row_of(samples, y, taps, channels, out),
            Samples::F32(samples) => self.add_row_of(samples, y, taps, channels, out),
        }
    }

    /// The place of red (0), green or blue (2) in a pixel of [`Frame::add_row`].
    pub(crate) fn place_of(&self, colour: usize) -> usize {
        if self.colours == Colours::Bgr { 2 - colour } else { colour }
    }

    #[inline(always)]
    fn add_row_of<S: Sample>(
        &self,
        samples: &[S],
        y: usize,
        taps: RowTaps,
        channels: usize,
        out: &mut [f32],
    ) {
        let own = self.colours.channels();
        let row = &samples[y * self.stride..][..own * self.width][own * taps.from..];
        let weight = taps.weight;
        if own == channels && taps.step == 1 {
            out.iter_mut().zip(row).for_each(|(out, sample)| *out += weight * sample.level());
            return;
        }
        let pixels = row.chunks(own * taps.step);
        match (own, channels) {
            (3, 3) => {
                for (out, pixel) in out.as_chunks_mut::<3>().0.iter_mut().zip(pixels) {
                    (0..3).for_each(|k| out[k] += weight * pixel[k].level());
                }
            }
            (3, _) => {
                let weights = LUMA.map(|share| weight * share);
                // One order of the sum for both orders of the colours: the same bits.
                let [red, blue] = [self.place_of(0), self.place_of(2)];
                for (out, pixel) in out.iter_mut().zip(pixels) {
                    let rgb = [pixel[red].level(), pixel[1].level(), pixel[blue].level()];
                    *out += (0..3).map(|k| weights[k] * rgb[k]).sum::<f32>();
                }
            }
            _ => {
                for (out, pixel) in out.chunks_exact_mut(channels).zip(pixels) {
                    out.iter_mut().for_each(|out| *out += weight * pixel[0].level());
                }
            }
        }
    }

    fn check_row<S: Sample>(&self, row: &[S], y: usize) -> Result<(), Error> {
        let Some(k) = row.iter().position(|sample| !sample.is_usable()) else { return Ok(()) };
        Err(Error::Frame(format!(
            "the sample at x {}, y {y} is {:?}; \
             floats have black at 0 and white at 1; allowed: {:?} to {:?}",
            k / self.colours.channels(),
            row[k],
            FLOATS.start(),
            FLOATS.end()
        )))
    }

    fn contiguous(
        samples: Samples<'a>,
        colours: Colours,
        width: usize,
        height: usize,
    ) -> Result<Self, Error> {
        let stride = width.saturating_mul(colours.channels());
        Self { samples, colours, width, height, stride }.checked()
    }

    fn checked(self) -> Result<Self, Error> {
        let Self { width, height, stride, .. } = self;
        let channels = self.colours.channels();
        let length = match self.samples {
            Samples::U8(s) => s.len(),
            Samples::U16(s) => s.len(),
            Samples::F32(s) => s.len(),
        };
        if width == 0 || height == 0 {
            return Err(Error::Frame(format!(
                "it is {width}x{height} pixels; both sides must be at least 1"
            )));
        }
        let row = width.checked_mul(channels);
        let needed = row.and_then(|row| stride.checked_mul(height - 1)?.checked_add(row));
        match (row, needed) {
            (Some(row), _) if stride < row => Err(Error::Frame(format!(
                "the stride is {stride} samples, but a row of {width} pixels has {row}"
            ))),
            (Some(_), Some(needed)) if length >= needed => Ok(self),
            _ => Err(Error::Frame(format!(
                "{width}x{height} pixels with {channels} samples each and stride {stride} \
                 do not fit in the {length} samples that were given"
            ))),
        }
    }
}

/// A grey image of `f32` samples in `[0, 1]`, rows without gaps.
#[derive(Debug, Clone, Default)]
pub struct GreyImage {
    width: usize,
    height: usize,
    samples: Vec<f32>,
}

impl GreyImage {
    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Row `y`; empty below the image.
    pub fn row(&self, y: usize) -> &[f32] {
        let start = (y * self.width).min(self.samples.len());
        &self.samples[start..(start + self.width).min(self.samples.len())]
    }

    /// The sample at `column` and `row` and its right neighbour, and the two below them; `None` if
    /// one is outside.
    #[inline(always)]
    pub fn neighbours(&self, column: usize, row: usize) -> Option<([f32; 2], [f32; 2])> {
        let index = row * self.width + column;
        // Loads two samples with one bounds check.
        let pair =
            |index: usize| self.samples.get(index..).and_then(|all| all.first_chunk().copied());
        Some((pair(index)?, pair(index + self.width)?))
    }

    /// Converts the frame to grey, reusing the buffer.
    ///
    /// # Errors
    /// [`Error::Frame`] if an `f32` sample is not allowed.
    pub fn fill(&mut self, frame: &Frame<'_>) -> Result<(), Error> {
        self.width = frame.width;
        self.height = frame.height;
        self.samples.clear();
        self.samples.reserve(frame.width * frame.height);
        match frame.samples {
            Samples::U8(samples) => self.fill_from(samples, frame),
            Samples::U16(samples) => self.fill_from(samples, frame),
            Samples::F32(samples) => self.fill_from(samples, frame),
        }
    }

    fn fill_from<S: Sample>(&mut self, samples: &[S], frame: &Frame<'_>) -> Result<(), Error> {
        let channels = frame.colours.channels();
        for y in 0..frame.height {
            let row = &samples[y * frame.stride..][..channels * frame.width];
            frame.check_row(row, y)?;
            match frame.colours {
                Colours::Grey => self.samples.extend(row.iter().map(|v| v.value() / S::WHITE)),
                Colours::Rgb => {
                    self.samples.extend(row.as_chunks().0.iter().map(|&[r, g, b]| grey(r, g, b)));
                }
                Colours::Bgr => {
                    self.samples.extend(row.as_chunks().0.iter().map(|&[b, g, r]| grey(r, g, b)));
                }
            }
        }
        Ok(())
    }
}

fn grey<S: Sample>(r: S, g: S, b: S) -> f32 {
    (LUMA[0] * r.value() + LUMA[1] * g.value() + LUMA[2] * b.value()) / S::WHITE
}

#[cfg(test)]
mod tests {
    use super::*;

    fn greys(frame: Frame<'_>) -> Vec<f32> {
        let mut image = GreyImage::default();
        image.fill(&frame).unwrap();
        image.samples
    }

    #[test]
    fn every_kind_of_frame_becomes_the_same_grey() {
        let expected = [0.0, 1.0, 0.2, 0.4];
        assert_eq!(greys(Frame::grey8(&[0, 255, 51, 102], 2, 2).unwrap()), expected);
        assert_eq!(greys(Frame::grey16(&[0, 65535, 13107, 26214], 2, 2).unwrap()), expected);
        assert_eq!(greys(Frame::grey32f(&expected, 2, 2).unwrap()), expected);
    }

    #[test]
    fn colour_is_weighted_as_in_the_paper() {
        let rgb = [255, 0, 0, 0, 255, 0, 0, 0, 255];
        let got = greys(Frame::rgb8(&rgb, 3, 1).unwrap());
        for (got, want) in got.iter().zip([0.2989, 0.5870, 0.1140]) {
            assert!((got - want).abs() < 1e-6);
        }
    }

    #[test]
    fn colour_is_the_same_at_every_depth_and_in_both_orders() {
        let rgb = [51, 102, 204, 0, 255, 153];
        let expected = greys(Frame::rgb8(&rgb, 2, 1).unwrap());
        let near = |got: Vec<f32>| got.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-6);
        let deep = rgb.map(|v| u16::from(v) * 257);
        assert!(near(greys(Frame::rgb16(&deep, 2, 1).unwrap())));
        let floats = rgb.map(|v| f32::from(v) / 255.0);
        assert!(near(greys(Frame::rgb32f(&floats, 2, 1).unwrap())));
        let bgr = [204, 102, 51, 153, 255, 0];
        assert_eq!(greys(Frame::rgb8(&bgr, 2, 1).unwrap().bgr()), expected);
        assert_eq!(greys(Frame::grey8(&[255], 1, 1).unwrap().bgr()), [1.0]);
    }

    #[test]
    fn gaps_between_rows_are_skipped() {
        let samples = [0, 51, 9, 102, 255];
        let frame = Frame::grey8(&samples, 2, 2).and_then(|f| f.with_stride(3)).unwrap();
        assert_eq!(greys(frame), [0.0, 0.2, 0.4, 1.0]);
        let rgb = [255, 255, 255, 7, 0, 0, 0];
        let frame = Frame::rgb8(&rgb[..6], 1, 2).unwrap();
        assert_eq!(frame.width(), 1);
        let frame = Frame::rgb8(&rgb, 1, 2).and_then(|f| f.with_stride(4)).unwrap();
        assert_eq!(greys(frame)[1], 0.0);
    }

    #[test]
    fn buffers_that_are_not_frames_are_refused_with_the_reason() {
        let message = |r: Result<Frame<'_>, Error>| r.unwrap_err().to_string();
        assert!(message(Frame::grey8(&[], 0, 3)).contains("0x3"));
        assert!(message(Frame::grey8(&[0; 5], 2, 3)).contains("5 samples"));
        assert!(message(Frame::rgb8(&[0; 17], 2, 3)).contains("17 samples"));
        assert!(message(Frame::grey8(&[0; 9], usize::MAX, 3)).contains("do not fit"));
        assert!(message(Frame::rgb8(&[0; 9], usize::MAX, 1)).contains("do not fit"));
        let narrow = Frame::grey8(&[0; 6], 3, 2).and_then(|f| f.with_stride(2));
        assert!(message(narrow).contains("stride is 2"));
        let bad = [0.0, f32::NAN];
        let error = GreyImage::default().fill(&Frame::grey32f(&bad, 1, 2).unwrap()).unwrap_err();
        assert!(error.to_string().contains("x 0, y 1 is NaN"), "{error}");
        let bad = [0.0, 0.0, 0.0, 0.0, 200.0, 0.0];
        let error = GreyImage::default().fill(&Frame::rgb32f(&bad, 2, 1).unwrap()).unwrap_err();
        assert!(error.to_string().contains("x 1, y 0 is 200.0"), "{error}");
    }
}
