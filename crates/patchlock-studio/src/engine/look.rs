//! What of a target is visible in a frame, compared with a key frame.

use patchlock::{BoundingBox, Estimate, Point, Tracker, TrackerConfig};
use patchlock_media::Picture;

/// Compares the target in a box with how it looks in a key frame. The frame is moved and scaled so
/// that the two boxes coincide, and the tracker of the key frame looks at the result. The corners
/// of the estimate are those in the frame.
///
/// # Errors
/// An error of the tracker, if it does not accept a picture or box.
pub fn compare(
    config: &TrackerConfig,
    key: (&Picture, BoundingBox),
    frame: (&Picture, BoundingBox),
) -> Result<Estimate, patchlock::Error> {
    let mut tracker = Tracker::start(config.clone(), &key.0.frame()?, key.1)?;
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
fn align(frame: (&Picture, BoundingBox), key: (&Picture, BoundingBox)) -> Picture {
    let (picture, rgb) = (frame.0, frame.0.to_rgb());
    let (width, height) = (key.0.width, key.0.height);
    let mut aligned = Vec::with_capacity(width * height * 3);
    for y in 0..height {
        for x in 0..width {
            let point = there([x as f64, y as f64], key.1, frame.1);
            aligned.extend(sample(&rgb, picture.width, picture.height, point));
        }
    }
    Picture::rgb(width, height, aligned)
}

/// The colour at a point, bilinear; outside the picture, that of the nearest pixel.
fn sample(rgb: &[u8], width: usize, height: usize, [x, y]: Point) -> [u8; 3] {
    let (x, y) = (x.clamp(0.0, (width - 1) as f64), y.clamp(0.0, (height - 1) as f64));
    let (left, top) = (x as usize, y as usize);
    let (right, bottom) = ((left + 1).min(width - 1), (top + 1).min(height - 1));
    let (dx, dy) = (x - left as f64, y - top as f64);
    std::array::from_fn(|channel| {
        let at = |x: usize, y: usize| f64::from(rgb[(y * width + x) * 3 + channel]);
        let upper = at(left, top) * (1.0 - dx) + at(right, top) * dx;
        let lower = at(left, bottom) * (1.0 - dx) + at(right, bottom) * dx;
        (upper * (1.0 - dy) + lower * dy).round() as u8
    })
}
