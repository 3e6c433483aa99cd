//! Frames of red, green, blue and alpha, as canvases give them.

use patchlock::{Error, Frame};

/// Bytes of a pixel with alpha, and without.
const RGBA: usize = 4;
const RGB: usize = 3;

/// The pixels of a frame, without alpha. The buffers are used again for the next frame.
#[derive(Debug, Default)]
pub struct Pixels {
    rgba: Vec<u8>,
    rgb: Vec<u8>,
}

impl Pixels {
    /// The frame of this width and height whose `length` bytes `copy` writes.
    ///
    /// # Errors
    /// The size is not a whole number of pixels, or the bytes are not those of so many pixels.
    pub fn frame(
        &mut self,
        [width, height]: [f64; 2],
        length: usize,
        copy: impl FnOnce(&mut [u8]),
    ) -> Result<Frame<'_>, Error> {
        let [width, height] = whole([width, height])?;
        // A size has at most 32 bits, so the product is exact.
        let needed = (width as u64) * (height as u64) * RGBA as u64;
        if needed != length as u64 {
            return Err(Error::Frame(format!(
                "{width}x{height} pixels of red, green, blue and alpha are {needed} bytes; given: \
                 {length}"
            )));
        }
        self.rgba.resize(length, 0);
        copy(&mut self.rgba);
        self.rgb.resize(length / RGBA * RGB, 0);
        for (out, pixel) in self.rgb.chunks_exact_mut(RGB).zip(self.rgba.chunks_exact(RGBA)) {
            out.copy_from_slice(&pixel[..RGB]);
        }
        Frame::rgb8(&self.rgb, width, height)
    }
}

/// A size as whole numbers.
fn whole(size: [f64; 2]) -> Result<[usize; 2], Error> {
    let is_whole = |side: f64| side.fract() == 0.0 && (1.0..=f64::from(u16::MAX)).contains(&side);
    let [width, height] = size;
    if size.into_iter().all(is_whole) {
        return Ok(size.map(|side| side as usize));
    }
    Err(Error::Frame(format!(
        "width {width} and height {height}; both must be whole numbers from 1 to {}",
        u16::MAX
    )))
}
