//! What of a target is visible in a frame, compared with a key frame.

use image::imageops::interpolate_bilinear;
use image::{Rgb, RgbImage};
use patchlock::{BoundingBox, Estimate, NetworkUse, Point, Tracker, TrackerConfig};
use patchlock_media::Picture;

/// Compares the target in a box with how it looks in a key frame. The frame is moved and scaled so
/// that the two boxes coincide, and the tracker of the key frame looks at the result; of `robust` its
/// filters alone, as a committee that is sure does not say what is hidden. The corners of the
/// estimate are those in the frame.
///
/// # Errors
/// An error of the tracker, if it does not accept a picture or box.
pub fn compare(
    config: &TrackerConfig,
    key: (&Picture, BoundingBox),
    frame: (&Picture, BoundingBox),
) -> Result<Estimate, patchlock::Error> {
    let mut config = config.clone();
    if config.method.info().network == NetworkUse::Optional {
        config.network = None;
    }
    let mut tracker = Tracker::start(config, &key.0.frame()?, key.1)?;
    let aligned = align(frame, key);
    let mut estimate = tracker.update(&aligned.frame()?)?.clone();
    let back = |[x, y]: Point| there([x, y], key.1, frame.1);
    estimate.corners = estimate.corners.map(back);
    estimate.bbox = frame.1;
    Ok(estimate)
}

/// The point of the second box at the place that a point has in the first.
fn there([x, y]: Point, from: BoundingBox, to: BoundingBox) -> Point {
    let ([fx, fy], [tx, ty]) = (from.centre(), to.centre());
    [tx + (x - fx) * to.w / from.w, ty + (y - fy) * to.h / from.h]
}

/// The frame as a picture of the key frame's size, with its box where that of the key frame is.
/// Samples are bilinear; outside the frame they are those of the nearest pixel.
fn align(frame: (&Picture, BoundingBox), key: (&Picture, BoundingBox)) -> Picture {
    let (picture, key_picture) = (frame.0, key.0);
    let size = [picture.width, picture.height];
    let image = RgbImage::from_raw(size[0] as u32, size[1] as u32, picture.to_rgb().into_owned());
    let image = image.unwrap_or_default();
    let (width, height) = (key_picture.width, key_picture.height);
    let mut aligned = Vec::with_capacity(width * height * 3);
    for y in 0..height {
        for x in 0..width {
            let point = there([x as f64, y as f64], key.1, frame.1);
            let [x, y] = [0, 1].map(|axis| point[axis].clamp(0.0, (size[axis] - 1) as f64) as f32);
            aligned.extend(interpolate_bilinear(&image, x, y).unwrap_or(Rgb([0; 3])).0);
        }
    }
    Picture::rgb(width, height, aligned)
}
