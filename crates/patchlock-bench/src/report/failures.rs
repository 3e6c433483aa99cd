//! Finds the failures of a tracker and draws thumbnails of them.

use std::io::Cursor;
use std::ops::Range;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use image::RgbImage;
use image::codecs::jpeg::JpegEncoder;
use image::imageops::{self, FilterType};
use patchlock::BoundingBox;
use patchlock_media::image_file;

use super::svg::escape;
use crate::compare::ascending;
use crate::dataset::Sequence;
use crate::protocol::LOST_OVERLAP;

/// Smallest number of lost frames in a failure.
pub const MIN_FRAMES: usize = 3;
/// Largest width and height of a thumbnail, in pixels.
const SIZE: [f64; 2] = [232.0, 174.0];
const JPEG_QUALITY: u8 = 72;

/// The ranges of frames in which the target is lost. Frames without ground truth neither end nor
/// count towards a failure.
pub fn failures(overlaps: &[Option<f64>]) -> Vec<Range<usize>> {
    let mut all: Vec<(Range<usize>, usize)> = Vec::new();
    let mut open = false;
    for (frame, overlap) in overlaps.iter().enumerate() {
        match overlap {
            Some(overlap) if *overlap < LOST_OVERLAP => match all.last_mut() {
                Some((range, count)) if open => {
                    range.end = frame + 1;
                    *count += 1;
                }
                _ => {
                    all.push((frame..frame + 1, 1));
                    open = true;
                }
            },
            Some(_) => open = false,
            None => {}
        }
    }
    all.into_iter().filter(|(_, count)| *count >= MIN_FRAMES).map(|(range, _)| range).collect()
}

/// The first frames of the `limit` longest failures, in order of time; or, without failures, the
/// frame with the smallest overlap. Each with its caption.
pub fn captioned_frames(
    overlaps: &[Option<f64>],
    failures: &[Range<usize>],
    limit: usize,
) -> Vec<(usize, String)> {
    let lengths: Vec<f64> = failures.iter().map(|failure| -(failure.len() as f64)).collect();
    let mut longest = ascending(&lengths);
    longest.truncate(limit);
    longest.sort_unstable();
    if !longest.is_empty() || limit == 0 {
        let lost =
            |failure: &Range<usize>| (failure.start, format!("lost for {} frames", failure.len()));
        return longest.into_iter().map(|k| lost(&failures[k])).collect();
    }
    let given =
        overlaps.iter().enumerate().filter_map(|(frame, overlap)| Some((frame, (*overlap)?)));
    let smallest = given.min_by(|a, b| a.1.total_cmp(&b.1));
    let captioned = |(frame, overlap)| (frame, format!("smallest overlap, {overlap:.2}"));
    smallest.map(captioned).into_iter().collect()
}

/// A crop of the frame with the true and the tracked boxes, as an SVG element that contains a JPEG.
///
/// # Errors
/// Why the frame cannot be read.
pub fn thumbnail(
    sequence: &Sequence,
    frame: usize,
    tracked: &[BoundingBox],
) -> Result<String, String> {
    let file = sequence.frames.get(frame).ok_or("the sequence has no such frame")?;
    let cannot = |reason: String| format!("{}: {reason}", file.display());
    let picture = image_file::load(file).map_err(|e| cannot(e.to_string()))?;
    let picture = RgbImage::from_raw(
        picture.width as u32,
        picture.height as u32,
        picture.to_rgb().into_owned(),
    )
    .ok_or_else(|| cannot("its number of pixels does not match its size".to_string()))?;
    let frame_size = [f64::from(picture.width()), f64::from(picture.height())];
    let truth = sequence.truth.get(frame).copied().flatten();
    let boxes: Vec<BoundingBox> = truth.iter().chain(tracked).copied().collect();
    let view = view(&boxes, frame_size);
    let [x, y, w, h] = view.map(|value| value as u32);
    let scale = (SIZE[0] / view[2]).min(SIZE[1] / view[3]);
    let pixels = |length: f64| ((length * scale).round() as u32).max(1);
    let (width, height) = (pixels(view[2]), pixels(view[3]));
    let crop = imageops::crop_imm(&picture, x, y, w.max(1), h.max(1)).to_image();
    let crop = imageops::resize(&crop, width, height, FilterType::Triangle);
    let mut jpeg = Cursor::new(Vec::new());
    JpegEncoder::new_with_quality(&mut jpeg, JPEG_QUALITY)
        .encode_image(&crop)
        .map_err(|e| cannot(e.to_string()))?;
    let mut svg = format!(
        "<svg viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" role=\"img\" \
         aria-label=\"{}, frame {frame}\">\
         <image width=\"{width}\" height=\"{height}\" href=\"data:image/jpeg;base64,{}\"/>",
        escape(&sequence.name),
        BASE64_STANDARD.encode(jpeg.into_inner())
    );
    for (class, bbox) in truth.iter().map(|b| ("tb", b)).chain(tracked.iter().map(|b| ("ob", b))) {
        svg += &outline(class, bbox, [view[0], view[1]], scale);
    }
    svg += "</svg>";
    Ok(svg)
}

/// A box with a dark border behind it, so that it is visible on any picture.
fn outline(class: &str, bbox: &BoundingBox, [left, top]: [f64; 2], scale: f64) -> String {
    // In the thumbnail, pixel k covers k to k + 1, like the pixels of a box: no shift by half a
    // pixel.
    let (x, y) = ((bbox.x - left) * scale, (bbox.y - top) * scale);
    let geometry = format!(
        "x=\"{x:.1}\" y=\"{y:.1}\" width=\"{:.1}\" height=\"{:.1}\"",
        bbox.w * scale,
        bbox.h * scale
    );
    format!("<rect class=\"halo\" {geometry}/><rect class=\"{class}\" {geometry}/>")
}

/// Left, top, width and height of the crop in whole pixels: the boxes with a margin, clipped to the
/// frame, in the aspect ratio of a thumbnail if the frame is large enough.
fn view(boxes: &[BoundingBox], [frame_w, frame_h]: [f64; 2]) -> [f64; 4] {
    let inside =
        boxes.iter().filter(|b| [b.x, b.y, b.w, b.h].iter().all(|value| value.is_finite()));
    let ends = inside.map(|b| {
        [
            b.x.clamp(0.0, frame_w),
            b.y.clamp(0.0, frame_h),
            (b.x + b.w).clamp(0.0, frame_w),
            (b.y + b.h).clamp(0.0, frame_h),
        ]
    });
    let hull = ends.reduce(|a, b| [a[0].min(b[0]), a[1].min(b[1]), a[2].max(b[2]), a[3].max(b[3])]);
    let [x1, y1, x2, y2] = hull.unwrap_or([0.0, 0.0, frame_w, frame_h]);
    let (width, height) = ((x2 - x1) * 1.5 + 40.0, (y2 - y1) * 1.5 + 40.0);
    let ratio = SIZE[0] / SIZE[1];
    let (width, height) =
        (width.max(height * ratio).min(frame_w), height.max(width / ratio).min(frame_h));
    let left = ((x1 + x2 - width) / 2.0).clamp(0.0, frame_w - width);
    let top = ((y1 + y2 - height) / 2.0).clamp(0.0, frame_h - height);
    [left.floor(), top.floor(), width.floor(), height.floor()]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn overlaps(values: &[f64]) -> Vec<Option<f64>> {
        values.iter().map(|&value| (value >= 0.0).then_some(value)).collect()
    }

    #[test]
    fn failures_have_a_minimum_length_and_may_contain_gaps() {
        let values = overlaps(&[0.9, 0.0, 0.0, 0.9, 0.0, -1.0, 0.0, 0.09, 0.1, 0.0]);
        let ends = |values: &[Option<f64>]| -> Vec<_> {
            failures(values).iter().map(|failure| (failure.start, failure.end)).collect()
        };
        assert_eq!(ends(&values), [(4, 8)]);
        assert_eq!(ends(&overlaps(&[0.0, 0.0, 0.0, 0.9, 0.0, 0.0, 0.0])), [(0, 3), (4, 7)]);
        assert!(failures(&overlaps(&[-1.0, -1.0, -1.0, -1.0])).is_empty());
    }

    #[test]
    fn the_longest_failures_are_shown_in_order_of_time() {
        let what = |limit| captioned_frames(&[], &[5..8, 10..40, 50..60], limit);
        assert_eq!(what(2).iter().map(|shown| shown.0).collect::<Vec<_>>(), [10, 50]);
        assert_eq!(what(0), []);
        let fine = overlaps(&[1.0, 0.7, -1.0, 0.6, 0.8]);
        assert_eq!(captioned_frames(&fine, &[], 2), [(3, "smallest overlap, 0.60".into())]);
    }

    #[test]
    fn the_view_contains_the_boxes_and_stays_in_the_frame() {
        let frame = [320.0, 240.0];
        let a = BoundingBox { x: 300.0, y: 10.0, w: 40.0, h: 30.0 };
        let [x, y, w, h] = view(&[a], frame);
        assert!(x <= 300.0 && x + w <= 320.0 && x + w >= 319.0 && y <= 10.0 && h >= 30.0);
        let far = BoundingBox { x: -900.0, y: 5000.0, w: 10.0, h: 10.0 };
        let [x, y, w, h] = view(&[a, far], frame);
        assert!(x >= 0.0 && y >= 0.0 && x + w <= 320.0 && y + h <= 240.0 && w >= 1.0 && h >= 1.0);
        let broken = BoundingBox { x: f64::NAN, y: 0.0, w: 1.0, h: 1.0 };
        assert_eq!(view(&[broken], frame), [0.0, 0.0, 320.0, 240.0]);
        assert!(view(&[a], [3.0, 2.0]).iter().all(|value| value.is_finite()));
    }
}
