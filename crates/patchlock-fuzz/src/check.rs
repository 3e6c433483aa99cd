//! What must hold of errors, boxes and estimates.

use std::fmt::{Debug, Display};

use patchlock::{BoundingBox, Estimate, Frame};
use patchlock_media::{Picture, Pixels};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// The text of an error, which must have one.
pub fn said(error: impl Display) -> String {
    let text = error.to_string();
    assert!(!text.trim().is_empty(), "an error without a text");
    text
}

/// The value, or `None` for an error, which must have a text.
pub fn accepted<T, E: Display>(result: Result<T, E>) -> Option<T> {
    result.map_err(said).ok()
}

/// A value as JSON, and as it is read again, which must be the same.
pub fn through_text<T>(value: &T) -> (String, T)
where
    T: Serialize + DeserializeOwned + PartialEq + Debug,
{
    let text = serde_json::to_string(value).expect("can be written");
    let read: T = serde_json::from_str(&text).expect("what was written can be read");
    assert_eq!(read, *value);
    (text, read)
}

/// All numbers of a box are finite.
pub fn finite(bbox: BoundingBox) {
    let BoundingBox { x, y, w, h } = bbox;
    assert!([x, y, w, h].iter().all(|v| v.is_finite()), "{bbox:?}");
}

/// An estimate has finite numbers, sides above 0, and a score from 0 to 1.
pub fn estimate(estimate: &Estimate) {
    finite(estimate.bbox);
    assert!(estimate.bbox.w > 0.0 && estimate.bbox.h > 0.0, "{:?}", estimate.bbox);
    assert!(estimate.corners.as_flattened().iter().all(|v| v.is_finite()), "{estimate:?}");
    assert!((0.0..=1.0).contains(&estimate.score), "score {}", estimate.score);
    for share in estimate.visibility.iter().flat_map(|v| [v.large.share(), v.small.share()]) {
        assert!((0.0..=1.0).contains(&share), "visible share {share}");
    }
}

/// A picture has as many samples as its size says, and the tracker takes it.
pub fn picture(picture: &Picture) {
    let samples = match &picture.pixels {
        Pixels::Grey8(grey) => grey.len(),
        Pixels::Grey16(grey) => grey.len(),
        Pixels::Rgb8(rgb) => rgb.len() / 3,
    };
    assert_eq!(samples, picture.width * picture.height);
    assert!(picture.time.is_none_or(f64::is_finite), "{:?}", picture.time);
    let frame: Frame<'_> = picture.frame().expect("the tracker takes every decoded picture");
    assert_eq!((frame.width(), frame.height()), (picture.width, picture.height));
}
