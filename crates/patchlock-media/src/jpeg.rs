//! Encodes pictures as JPEG.

use image::{RgbImage, imageops};
use jpeg_encoder::{
    Encoder, EncodingError, ImageBuffer, JpegColorType, SamplingFactor, rgb_to_ycbcr,
};

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
        return samples(&small, (width, height), JpegColorType::Ycbcr, quality);
    }
    match &picture.pixels {
        Pixels::Grey8(grey) => samples(grey, (w, h), JpegColorType::Luma, quality),
        Pixels::Rgb8(rgb) => samples(rgb, (w, h), JpegColorType::Ycbcr, quality),
        Pixels::Grey16(_) => samples(&picture.to_rgb(), (w, h), JpegColorType::Ycbcr, quality),
    }
}

fn samples(
    samples: &[u8],
    (width, height): (u32, u32),
    colour: JpegColorType,
    quality: u8,
) -> Result<Vec<u8>, Error> {
    let size = |side| u16::try_from(side).map_err(|_| Error::Size { width, height });
    let channels = if colour == JpegColorType::Luma { 1 } else { 3 };
    let (length, required) = (samples.len(), width as usize * height as usize * channels);
    if length < required {
        return Err(EncodingError::BadImageData { length, required }.into());
    }
    let image = Samples { samples, width: size(width)?, height: size(height)?, colour };
    let mut out = Vec::with_capacity(samples.len() / 8);
    let mut encoder = Encoder::new(&mut out, quality);
    // Colours at half the resolution, as nearly all video has them.
    encoder.set_sampling_factor(SamplingFactor::R_4_2_0);
    encoder.encode_image(image)?;
    Ok(out)
}

/// Grey or RGB bytes. One type for both: [`Encoder::encode`] would compile the encoder for nine
/// layouts.
struct Samples<'a> {
    samples: &'a [u8],
    width: u16,
    height: u16,
    colour: JpegColorType,
}

impl ImageBuffer for Samples<'_> {
    fn get_jpeg_color_type(&self) -> JpegColorType {
        self.colour
    }

    fn width(&self) -> u16 {
        self.width
    }

    fn height(&self) -> u16 {
        self.height
    }

    fn fill_buffers(&self, y: u16, buffers: &mut [Vec<u8>; 4]) {
        let [first, cb, cr, _] = buffers;
        let row = |bytes: usize| {
            let bytes = usize::from(self.width) * bytes;
            &self.samples[usize::from(y) * bytes..][..bytes]
        };
        if self.colour == JpegColorType::Luma {
            return first.extend_from_slice(row(1));
        }
        let (pixels, _) = row(3).as_chunks();
        // In one pass, which takes three quarters of the time of three.
        let begin = first.len();
        let [first, cb, cr] = [first, cb, cr].map(|buffer| {
            buffer.resize(begin + pixels.len(), 0);
            &mut buffer[begin..]
        });
        for (((&[r, g, b], first), cb), cr) in pixels.iter().zip(first).zip(cb).zip(cr) {
            (*first, *cb, *cr) = rgb_to_ycbcr(r, g, b);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Limits, image_file};

    #[test]
    fn decoded_grey_and_colours_are_nearly_those_that_were_encoded() {
        let (width, height) = (37, 21);
        let rgb: Vec<u8> = (0..width * height)
            .flat_map(|i| [40 + i % width * 5, 200 - i / width * 6, 128].map(|value| value as u8))
            .collect();
        let grey = rgb.iter().copied().step_by(3).collect();
        for pixels in [Pixels::Rgb8(rgb), Pixels::Grey8(grey)] {
            let picture = Picture::new(width, height, pixels);
            let decoded =
                image_file::decode(&encode(&picture, 0, 95).unwrap(), Limits::default()).unwrap();
            assert_eq!((decoded.width, decoded.height), (width, height));
            let (before, after) = (picture.to_rgb(), decoded.to_rgb());
            let most = before.iter().zip(after.iter()).map(|(a, b)| a.abs_diff(*b)).max();
            assert!(most < Some(12), "{most:?}");
        }
    }

    #[test]
    fn too_few_bytes_are_an_error() {
        let picture = Picture::rgb(4, 4, vec![0; 47]);
        assert!(matches!(encode(&picture, 0, 85), Err(Error::Encoder(_))));
    }
}
