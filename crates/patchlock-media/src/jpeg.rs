//! Encodes pictures as JPEG.

use image::{RgbImage, imageops};
use jpeg_encoder::{ColorType, Encoder, EncodingError, SamplingFactor};

use crate::{Picture, Pixels};

/// Why a picture cannot be encoded.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A side is 0 or above 65535.
    #[error("JPEG has no {width} x {height} pixels")]
    Size {
        /// Width of the picture in pixels.
        width: u32,
        /// Height of the picture in pixels.
        height: u32,
    },
    /// The encoder failed.
    #[error(transparent)]
    Encoder(#[from] EncodingError),
}

/// The bytes of a JPEG file with this picture; `quality` is 1 to 100. A width narrower than the
/// picture's scales it down; 0 stands for its own.
///
/// # Errors
/// [`Error`] if the picture is too large for a JPEG file.
pub fn encode(picture: &Picture, width: u32, quality: u8) -> Result<Vec<u8>, Error> {
    let (w, h) = (picture.width as u32, picture.height as u32);
    if (1..w).contains(&width) {
        let height = (f64::from(h) * f64::from(width) / f64::from(w)).round().max(1.0) as u32;
        let image = RgbImage::from_raw(w, h, picture.to_rgb().into_owned()).unwrap_or_default();
        let small = imageops::thumbnail(&image, width, height);
        return samples(&small, (width, height), ColorType::Rgb, quality);
    }
    match &picture.pixels {
        Pixels::Grey8(grey) => samples(grey, (w, h), ColorType::Luma, quality),
        Pixels::Rgb8(rgb) => samples(rgb, (w, h), ColorType::Rgb, quality),
        Pixels::Grey16(_) => samples(&picture.to_rgb(), (w, h), ColorType::Rgb, quality),
    }
}

fn samples(
    samples: &[u8],
    (width, height): (u32, u32),
    colour: ColorType,
    quality: u8,
) -> Result<Vec<u8>, Error> {
    let size = |side| u16::try_from(side).map_err(|_| Error::Size { width, height });
    let [width, height] = [size(width)?, size(height)?];
    let mut out = Vec::with_capacity(samples.len() / 8);
    let mut encoder = Encoder::new(&mut out, quality);
    // Colours at half the resolution, as nearly all video has them.
    encoder.set_sampling_factor(SamplingFactor::R_4_2_0);
    encoder.encode(samples, width, height, colour)?;
    Ok(out)
}
