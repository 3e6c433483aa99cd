//! One decoded frame, in the depth and colours of its source.

use patchlock::Frame;

/// The pixels of a [`Picture`], rows from the top, no padding.
#[derive(Debug, Clone, PartialEq)]
pub enum Pixels {
    /// 8-bit grey, one byte a pixel.
    Grey8(Vec<u8>),
    /// 16-bit grey: the depth is kept, the tracker sees all of it.
    Grey16(Vec<u16>),
    /// 8-bit red, green, blue.
    Rgb8(Vec<u8>),
}

/// One decoded frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// The pixels.
    pub pixels: Pixels,
}

impl Picture {
    /// A picture of RGB bytes; `rgb` holds `width * height * 3` of them.
    pub fn rgb(width: usize, height: usize, rgb: Vec<u8>) -> Self {
        Self { width, height, pixels: Pixels::Rgb8(rgb) }
    }

    /// The frame as the tracker takes it.
    ///
    /// # Errors
    /// What the tracker says against its size.
    pub fn frame(&self) -> Result<Frame<'_>, patchlock::Error> {
        match &self.pixels {
            Pixels::Grey8(grey) => Frame::grey8(grey, self.width, self.height),
            Pixels::Grey16(grey) => Frame::grey16(grey, self.width, self.height),
            Pixels::Rgb8(rgb) => Frame::rgb8(rgb, self.width, self.height),
        }
    }

    /// The same picture as RGB bytes, for drawing on it.
    pub fn to_rgb(&self) -> Vec<u8> {
        match &self.pixels {
            Pixels::Grey8(grey) => grey.iter().flat_map(|&v| [v; 3]).collect(),
            Pixels::Grey16(grey) => stretch(grey),
            Pixels::Rgb8(rgb) => rgb.clone(),
        }
    }
}

/// Brings 16-bit grey to 8 bits for the eye. Sensors often use a small part of the 16 bits, so the picture's
/// own range is stretched; only the drawing sees this, never the tracker.
fn stretch(grey: &[u16]) -> Vec<u8> {
    let low = f64::from(grey.iter().copied().min().unwrap_or(0));
    let high = f64::from(grey.iter().copied().max().unwrap_or(0));
    let scale = if high > low { 255.0 / (high - low) } else { 0.0 };
    grey.iter().flat_map(|&v| [((f64::from(v) - low) * scale).round() as u8; 3]).collect()
}
