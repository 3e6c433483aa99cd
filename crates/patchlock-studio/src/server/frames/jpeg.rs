//! Encodes pictures as JPEG.

use image::{RgbImage, imageops};
use jpeg_encoder::{ColorType, Encoder, SamplingFactor};
use patchlock_media::{Picture, Pixels};

use crate::server::answer::Refusal;

/// Quality of the JPEG: artefacts must not hide where a target ends.
const QUALITY: u8 = 88;

/// Encodes a picture. A width narrower than the picture's scales it down; 0 stands for its own.
pub fn jpeg(picture: &Picture, width: u32) -> Result<Vec<u8>, Refusal> {
    let (w, h) = (picture.width as u32, picture.height as u32);
    if (1..w).contains(&width) {
        let height = (f64::from(h) * f64::from(width) / f64::from(w)).round().max(1.0) as u32;
        let image = RgbImage::from_raw(w, h, picture.to_rgb().into_owned())
            .ok_or_else(|| Refusal::failed("cannot encode: the picture is incomplete"))?;
        return encode(
            &imageops::thumbnail(&image, width, height),
            (width, height),
            ColorType::Rgb,
        );
    }
    match &picture.pixels {
        Pixels::Grey8(grey) => encode(grey, (w, h), ColorType::Luma),
        Pixels::Rgb8(rgb) => encode(rgb, (w, h), ColorType::Rgb),
        Pixels::Grey16(_) => encode(&picture.to_rgb(), (w, h), ColorType::Rgb),
    }
}

fn encode(
    samples: &[u8],
    (width, height): (u32, u32),
    colour: ColorType,
) -> Result<Vec<u8>, Refusal> {
    let too_large =
        |_| Refusal::failed(format!("cannot encode: JPEG has no {width} x {height} pixels"));
    let width_16 = u16::try_from(width).map_err(too_large)?;
    let height_16 = u16::try_from(height).map_err(too_large)?;
    let mut out = Vec::with_capacity(samples.len() / 8);
    let mut encoder = Encoder::new(&mut out, QUALITY);
    // Colours at half the resolution, as nearly all video has them.
    encoder.set_sampling_factor(SamplingFactor::R_4_2_0);
    let encoded = encoder.encode(samples, width_16, height_16, colour);
    encoded.map_err(|error| Refusal::failed(format!("cannot encode: {error}")))?;
    Ok(out)
}
