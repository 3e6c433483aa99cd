//! Frames: borrowed views of the caller's pixels, and the grey image that the tracker works on.
//!
//! Grey is `0.2989 R + 0.5870 G + 0.1140 B`, scaled to `[0, 1]` (Sec. 1 of the paper's tracker).

use crate::Error;

/// The largest magnitude of a `f32` sample: squares and sums of such samples stay finite.
const MAX_SAMPLE: f32 = 1e6;

/// The samples of a frame.
#[derive(Debug, Clone, Copy)]
enum Samples<'a> {
    Grey8(&'a [u8]),
    Rgb8(&'a [u8]),
    Grey16(&'a [u16]),
    Grey32f(&'a [f32]),
}

/// A borrowed view of one frame: row-major samples, `stride` samples from one row to the next.
#[derive(Debug, Clone, Copy)]
pub struct Frame<'a> {
    samples: Samples<'a>,
    width: usize,
    height: usize,
    stride: usize,
}

impl<'a> Frame<'a> {
    /// Grey, 8 bits a sample; `width * height` samples without gaps.
    ///
    /// # Errors
    /// [`Error::Frame`] where a side is 0 or there are too few samples; so for all kinds of frames.
    pub fn grey8(samples: &'a [u8], width: usize, height: usize) -> Result<Self, Error> {
        Self::new(Samples::Grey8(samples), width, height, width)
    }

    /// Red, green, blue, 8 bits each, interleaved; `3 * width * height` samples without gaps.
    ///
    /// # Errors
    /// As [`Frame::grey8`].
    pub fn rgb8(samples: &'a [u8], width: usize, height: usize) -> Result<Self, Error> {
        let stride = width.saturating_mul(3);
        Self::new(Samples::Rgb8(samples), width, height, stride)
    }

    /// Grey, 16 bits a sample (0 to 65535 is black to white).
    ///
    /// # Errors
    /// As [`Frame::grey8`].
    pub fn grey16(samples: &'a [u16], width: usize, height: usize) -> Result<Self, Error> {
        Self::new(Samples::Grey16(samples), width, height, width)
    }

    /// Grey floats, meant to be in `[0, 1]`; other ranges do as well, since candidates are normalised.
    /// All must be finite and at most 1e6 in magnitude, which is checked when the frame is used.
    ///
    /// # Errors
    /// As [`Frame::grey8`].
    pub fn grey32f(samples: &'a [f32], width: usize, height: usize) -> Result<Self, Error> {
        Self::new(Samples::Grey32f(samples), width, height, width)
    }

    /// The same samples with `stride` samples (for RGB: bytes) from the start of a row to the start of the next.
    ///
    /// # Errors
    /// [`Error::Frame`] where rows would overlap or there are too few samples.
    pub fn with_stride(self, stride: usize) -> Result<Self, Error> {
        Self::new(self.samples, self.width, self.height, stride)
    }

    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    fn new(
        samples: Samples<'a>,
        width: usize,
        height: usize,
        stride: usize,
    ) -> Result<Self, Error> {
        let (length, channels) = match samples {
            Samples::Grey8(s) => (s.len(), 1),
            Samples::Rgb8(s) => (s.len(), 3),
            Samples::Grey16(s) => (s.len(), 1),
            Samples::Grey32f(s) => (s.len(), 1),
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
            (Some(_), Some(needed)) if length >= needed => {
                Ok(Self { samples, width, height, stride })
            }
            _ => Err(Error::Frame(format!(
                "{width}x{height} pixels with {channels} samples each and stride {stride} do not fit in the {length} samples that were given"
            ))),
        }
    }
}

/// A grey image of `f32` in `[0, 1]`, rows without gaps.
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

    /// The row `y`; empty below the image.
    pub fn row(&self, y: usize) -> &[f32] {
        let start = (y * self.width).min(self.samples.len());
        &self.samples[start..(start + self.width).min(self.samples.len())]
    }

    /// The sample at `column`, `row` and its neighbour to the right, and the two below them; zeros where one is outside.
    #[inline(always)]
    pub fn neighbours(&self, column: usize, row: usize) -> ([f32; 2], [f32; 2]) {
        let place = row * self.width + column;
        // Two at once, with one check for both.
        let pair =
            |place: usize| self.samples.get(place..).and_then(|all| all.first_chunk().copied());
        (pair(place).unwrap_or_default(), pair(place + self.width).unwrap_or_default())
    }

    /// Takes over the frame's pixels as grey; the buffer is used again.
    ///
    /// # Errors
    /// [`Error::Frame`] where a `f32` sample is not finite or too large.
    pub fn fill(&mut self, frame: &Frame<'_>) -> Result<(), Error> {
        self.width = frame.width;
        self.height = frame.height;
        self.samples.clear();
        self.samples.reserve(frame.width * frame.height);
        let (width, height, stride) = (frame.width, frame.height, frame.stride);
        match frame.samples {
            Samples::Grey8(s) => {
                for y in 0..height {
                    let row = &s[y * stride..][..width];
                    self.samples.extend(row.iter().map(|&v| f32::from(v) / 255.0));
                }
            }
            Samples::Grey16(s) => {
                for y in 0..height {
                    let row = &s[y * stride..][..width];
                    self.samples.extend(row.iter().map(|&v| f32::from(v) / 65535.0));
                }
            }
            Samples::Rgb8(s) => {
                for y in 0..height {
                    let row = &s[y * stride..][..3 * width];
                    self.samples.extend(row.as_chunks().0.iter().map(grey_of));
                }
            }
            Samples::Grey32f(s) => {
                for y in 0..height {
                    let row = &s[y * stride..][..width];
                    if let Some(x) = row.iter().position(|v| v.is_nan() || v.abs() > MAX_SAMPLE) {
                        return Err(Error::Frame(format!(
                            "the sample at x {x}, y {y} is {}; all must be finite and at most {MAX_SAMPLE:e} in magnitude",
                            row[x]
                        )));
                    }
                    self.samples.extend_from_slice(row);
                }
            }
        }
        Ok(())
    }
}

fn grey_of(&[r, g, b]: &[u8; 3]) -> f32 {
    (0.2989 * f32::from(r) + 0.5870 * f32::from(g) + 0.1140 * f32::from(b)) / 255.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(frame: Frame<'_>) -> Vec<f32> {
        let mut image = GreyImage::default();
        image.fill(&frame).unwrap();
        image.samples
    }

    #[test]
    fn every_kind_of_frame_becomes_the_same_grey() {
        let expected = [0.0, 1.0, 0.2, 0.4];
        assert_eq!(grey(Frame::grey8(&[0, 255, 51, 102], 2, 2).unwrap()), expected);
        assert_eq!(grey(Frame::grey16(&[0, 65535, 13107, 26214], 2, 2).unwrap()), expected);
        assert_eq!(grey(Frame::grey32f(&expected, 2, 2).unwrap()), expected);
    }

    #[test]
    fn colour_is_weighed_as_the_paper_does() {
        let rgb = [255, 0, 0, 0, 255, 0, 0, 0, 255];
        let got = grey(Frame::rgb8(&rgb, 3, 1).unwrap());
        for (got, want) in got.iter().zip([0.2989, 0.5870, 0.1140]) {
            assert!((got - want).abs() < 1e-6);
        }
    }

    #[test]
    fn gaps_between_rows_are_passed_over() {
        let samples = [0, 51, 9, 102, 255];
        let frame = Frame::grey8(&samples, 2, 2).and_then(|f| f.with_stride(3)).unwrap();
        assert_eq!(grey(frame), [0.0, 0.2, 0.4, 1.0]);
        let rgb = [255, 255, 255, 7, 0, 0, 0];
        let frame = Frame::rgb8(&rgb[..6], 1, 2).unwrap();
        assert_eq!(frame.width(), 1);
        let frame = Frame::rgb8(&rgb, 1, 2).and_then(|f| f.with_stride(4)).unwrap();
        assert_eq!(grey(frame)[1], 0.0);
    }

    #[test]
    fn what_is_no_frame_is_refused_by_name() {
        let said = |r: Result<Frame<'_>, Error>| r.unwrap_err().to_string();
        assert!(said(Frame::grey8(&[], 0, 3)).contains("0x3"));
        assert!(said(Frame::grey8(&[0; 5], 2, 3)).contains("5 samples"));
        assert!(said(Frame::rgb8(&[0; 17], 2, 3)).contains("17 samples"));
        assert!(said(Frame::grey8(&[0; 9], usize::MAX, 3)).contains("do not fit"));
        assert!(said(Frame::rgb8(&[0; 9], usize::MAX, 1)).contains("do not fit"));
        let narrow = Frame::grey8(&[0; 6], 3, 2).and_then(|f| f.with_stride(2));
        assert!(said(narrow).contains("stride is 2"));
        let bad = [0.0, f32::NAN];
        let error = GreyImage::default().fill(&Frame::grey32f(&bad, 1, 2).unwrap()).unwrap_err();
        assert!(error.to_string().contains("x 0, y 1 is NaN"), "{error}");
    }
}
