//! A decoded frame, with the bit depth and colours of its source.

use std::borrow::Cow;

use patchlock::Frame;

/// The pixels of a [`Picture`], row by row from the top, without padding.
#[derive(Debug, Clone, PartialEq)]
pub enum Pixels {
    /// 8-bit grey, one byte per pixel.
    Grey8(Vec<u8>),
    /// 16-bit grey. The tracker uses the full depth.
    Grey16(Vec<u16>),
    /// 8-bit RGB, three bytes per pixel.
    Rgb8(Vec<u8>),
}

/// A decoded frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// The pixels.
    pub pixels: Pixels,
    /// When the frame is shown, in seconds from the first frame of its source; `None` if the source
    /// has no times, as a folder of images.
    pub time: Option<f64>,
}

impl Picture {
    /// A picture without a time.
    pub fn new(width: usize, height: usize, pixels: Pixels) -> Self {
        Self { width, height, pixels, time: None }
    }

    /// A picture of RGB bytes without a time; the length of `rgb` is `width * height * 3`.
    pub fn rgb(width: usize, height: usize, rgb: Vec<u8>) -> Self {
        Self::new(width, height, Pixels::Rgb8(rgb))
    }

    /// The picture with this time.
    pub(crate) fn at(self, time: Option<f64>) -> Self {
        Self { time, ..self }
    }

    /// The picture as input of the tracker.
    ///
    /// # Errors
    /// An error of the tracker if it does not accept the size.
    pub fn frame(&self) -> Result<Frame<'_>, patchlock::Error> {
        match &self.pixels {
            Pixels::Grey8(grey) => Frame::grey8(grey, self.width, self.height),
            Pixels::Grey16(grey) => Frame::grey16(grey, self.width, self.height),
            Pixels::Rgb8(rgb) => Frame::rgb8(rgb, self.width, self.height),
        }
    }

    /// The picture as RGB bytes, for drawing on it. 16-bit grey is stretched to 8 bits.
    pub fn to_rgb(&self) -> Cow<'_, [u8]> {
        match &self.pixels {
            Pixels::Grey8(grey) => grey.iter().flat_map(|&v| [v; 3]).collect(),
            Pixels::Grey16(grey) => stretch(grey).into(),
            Pixels::Rgb8(rgb) => rgb.into(),
        }
    }
}

/// Maps 16-bit grey to 8-bit RGB for display. Sensors often use a small part of the 16 bits, so the
/// picture's own range is stretched to 0..=255. The tracker never sees the result.
fn stretch(grey: &[u16]) -> Vec<u8> {
    let low = f64::from(grey.iter().copied().min().unwrap_or(0));
    let high = f64::from(grey.iter().copied().max().unwrap_or(0));
    let scale = if high > low { 255.0 / (high - low) } else { 0.0 };
    grey.iter().flat_map(|&v| [((f64::from(v) - low) * scale).round() as u8; 3]).collect()
}
