//! Where a tracker starts: once, at many frames, or on many boxes. These are the protocols of Wu,
//! Lim and Yang (CVPR 2013) as their toolkit implements them.
//!
//! - **OPE**, one-pass evaluation: starts at the first frame with ground truth, on its true box.
//! - **TRE**, temporal robustness evaluation: 20 starts. A frame is eligible if its true box has a
//!   positive position and size (in the numbers of the file) and at least 19 frames follow it; E is
//!   the number of eligible frames. The starts are the eligible frames number `1 + floor(k E / 19)`
//!   for `k = 0 .. 18`, and number E. Each run continues to the end of the sequence. In a short
//!   sequence, starts that coincide are run once. The toolkit also excludes frames by lists of its
//!   authors (target hidden or out of view); these are not used here.
//! - **SRE**, spatial robustness evaluation: 12 boxes on the first frame. For a true box of size w
//!   x h, in this order: moved left, right, up and down by `ceil(0.1 w)` or `ceil(0.1 h)` pixels;
//!   each of the four corners pulled outwards by 10 % of w and h, rounded, with the opposite corner
//!   fixed; scaled by 0.8, 0.9, 1.1 and 1.2 around the centre, rounded to whole pixels. Boxes are
//!   clipped to the frame.
//!
//! All runs are scored against the unmodified ground truth.

use std::convert::Infallible;
use std::str::FromStr;

use patchlock::BoundingBox;
use serde::{Deserialize, Serialize};

use crate::dataset::Sequence;

/// Number of starts in TRE.
const TRE_STARTS: usize = 20;
/// Smallest number of frames of a run in TRE, its first frame included.
const TRE_MIN_FRAMES: usize = 20;
/// Shift of a box in SRE, relative to its size.
const SHIFT: f64 = 0.1;
/// Scale factors of SRE.
const SCALES: [f64; 4] = [0.8, 0.9, 1.1, 1.2];

/// A protocol, which defines where a tracker starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Scheme {
    /// One-pass evaluation.
    Ope,
    /// Temporal robustness evaluation.
    Tre,
    /// Spatial robustness evaluation.
    Sre,
}

impl Scheme {
    /// All protocols.
    pub const ALL: [Self; 3] = [Self::Ope, Self::Tre, Self::Sre];

    /// The name in lower case, as in names of folders.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ope => "ope",
            Self::Tre => "tre",
            Self::Sre => "sre",
        }
    }

    /// The name in upper case, as in texts.
    pub fn title(self) -> String {
        self.name().to_uppercase()
    }
}

impl FromStr for Scheme {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let known = Self::ALL.into_iter().find(|scheme| scheme.name().eq_ignore_ascii_case(text));
        known.ok_or_else(|| {
            format!("there is no protocol {text}; the protocols are ope, tre and sre")
        })
    }
}

/// A start of a run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Start {
    /// Index of the start, from 0.
    pub variant: usize,
    /// Index of the frame to start at, in the sequence.
    pub first: usize,
    /// The box given to the tracker, in pixels counted from 0.
    pub bbox: BoundingBox,
}

/// The number of starts on a target.
pub fn count(scheme: Scheme, sequence: &Sequence, origin: f64) -> usize {
    // The frame size clips the boxes of SRE but does not change their number.
    let starts = starts(scheme, sequence, origin, || Ok::<_, Infallible>((1, 1)));
    starts.map_or(0, |starts| starts.len())
}

/// All starts on a target. `origin` is the coordinate of the first pixel in the file of ground
/// truth, 0 or 1. `size` returns width and height of the first frame; only SRE calls it.
///
/// # Errors
/// The error of `size`.
pub fn starts<E>(
    scheme: Scheme,
    sequence: &Sequence,
    origin: f64,
    size: impl FnOnce() -> Result<(usize, usize), E>,
) -> Result<Vec<Start>, E> {
    let known = |k: &usize| sequence.truth[*k].is_some();
    let Some(first) = (0..sequence.truth.len()).find(known) else { return Ok(Vec::new()) };
    let at =
        |variant, first: usize| sequence.truth[first].map(|bbox| Start { variant, first, bbox });
    Ok(match scheme {
        Scheme::Ope => at(0, first).into_iter().collect(),
        Scheme::Tre => {
            let frames = tre_frames(&sequence.truth, origin);
            let frames = if frames.is_empty() { vec![first] } else { frames };
            frames.into_iter().enumerate().filter_map(|(k, frame)| at(k, frame)).collect()
        }
        Scheme::Sre => {
            let Some(truth) = sequence.truth[first] else { return Ok(Vec::new()) };
            let boxes = sre_boxes(&truth, size()?).into_iter().enumerate();
            boxes.map(|(variant, bbox)| Start { variant, first, bbox }).collect()
        }
    })
}

/// The start frames of TRE, without duplicates.
fn tre_frames(truth: &[Option<BoundingBox>], origin: f64) -> Vec<usize> {
    let usable = |k: &usize| {
        let positive = |b: BoundingBox| b.x + origin > 0.0 && b.y + origin > 0.0;
        truth.len() - k >= TRE_MIN_FRAMES && truth[*k].is_some_and(positive)
    };
    let frames: Vec<usize> = (0..truth.len()).filter(usable).collect();
    let count = frames.len();
    // The formula counts from 1, so the last number is `count`.
    let numbers = (0..TRE_STARTS - 1).map(|k| 1 + k * count / (TRE_STARTS - 1)).chain([count]);
    let mut starts: Vec<usize> =
        numbers.filter_map(|n| frames.get(n.checked_sub(1)?)).copied().collect();
    starts.dedup();
    starts
}

/// The first boxes of SRE, in the order given in the module documentation.
fn sre_boxes(truth: &BoundingBox, (width, height): (usize, usize)) -> Vec<BoundingBox> {
    let BoundingBox { x, y, w, h } = *truth;
    let (dx, dy) = (SHIFT * w, SHIFT * h);
    let (right, bottom) = (x + w, y + h);
    let corners = |left: f64, top: f64, right: f64, bottom: f64| BoundingBox {
        x: left,
        y: top,
        w: right - left,
        h: bottom - top,
    };
    let mut boxes = vec![
        BoundingBox { x: x - dx.ceil(), ..*truth },
        BoundingBox { x: x + dx.ceil(), ..*truth },
        BoundingBox { y: y - dy.ceil(), ..*truth },
        BoundingBox { y: y + dy.ceil(), ..*truth },
        corners((x - dx).round(), (y - dy).round(), right, bottom),
        corners(x, (y - dy).round(), (right + dx).round(), bottom),
        corners((x - dx).round(), y, right, (bottom + dy).round()),
        corners(x, y, (right + dx).round(), (bottom + dy).round()),
    ];
    boxes.extend(SCALES.map(|scale| {
        let (w_new, h_new) = (scale * w, scale * h);
        BoundingBox {
            x: (x + (w - w_new) / 2.0).round(),
            y: (y + (h - h_new) / 2.0).round(),
            w: w_new.round(),
            h: h_new.round(),
        }
    }));
    boxes.into_iter().map(|bbox| clipped(&bbox, width as f64, height as f64)).collect()
}

/// Clips a box to the frame; at least one pixel remains.
fn clipped(bbox: &BoundingBox, width: f64, height: f64) -> BoundingBox {
    // As in the toolkit: the position is moved into the frame, and only the far sides are cut.
    let (x, y) = (bbox.x.clamp(0.0, width - 1.0), bbox.y.clamp(0.0, height - 1.0));
    BoundingBox { x, y, w: bbox.w.min(width - x).max(1.0), h: bbox.h.min(height - y).max(1.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sequence(truth: Vec<Option<BoundingBox>>) -> Sequence {
        Sequence { name: "a".into(), frames: Vec::new(), truth, attributes: Vec::new() }
    }

    const BOX: BoundingBox = BoundingBox { x: 40.0, y: 30.0, w: 20.0, h: 50.0 };

    fn start_frames(scheme: Scheme, truth: Vec<Option<BoundingBox>>) -> Vec<usize> {
        let size = || Ok::<_, ()>((100, 100));
        starts(scheme, &sequence(truth), 1.0, size).unwrap().iter().map(|s| s.first).collect()
    }

    #[test]
    fn ope_starts_where_the_ground_truth_starts() {
        assert_eq!(start_frames(Scheme::Ope, vec![None, Some(BOX), Some(BOX)]), [1]);
        assert!(start_frames(Scheme::Ope, vec![None]).is_empty());
    }

    #[test]
    fn tre_has_twenty_starts_on_a_long_sequence() {
        let starts = start_frames(Scheme::Tre, vec![Some(BOX); 209]);
        // 190 frames are followed by at least 19 others: every tenth of these, and the last.
        let expected: Vec<usize> = (0..19).map(|k| 10 * k).chain([189]).collect();
        assert_eq!(starts, expected);
    }

    #[test]
    fn tre_skips_frames_without_a_usable_box() {
        let outside = BoundingBox { x: -1.5, ..BOX };
        let mut truth = vec![Some(BOX); 39];
        truth[0] = None;
        truth[1] = Some(outside);
        let starts = start_frames(Scheme::Tre, truth);
        assert_eq!(starts, (2..20).collect::<Vec<_>>(), "each of the 18 eligible frames once");
        assert_eq!(
            start_frames(Scheme::Tre, vec![Some(BOX); 5]),
            [0],
            "too short for any eligible frame"
        );
    }

    #[test]
    fn sre_has_twelve_first_boxes() {
        let size = || Ok::<_, ()>((100, 100));
        let starts = starts(Scheme::Sre, &sequence(vec![Some(BOX)]), 1.0, size).unwrap();
        let boxes: Vec<_> =
            starts.iter().map(|s| [s.bbox.x, s.bbox.y, s.bbox.w, s.bbox.h]).collect();
        let expected = [
            [38.0, 30.0, 20.0, 50.0],
            [42.0, 30.0, 20.0, 50.0],
            [40.0, 25.0, 20.0, 50.0],
            [40.0, 35.0, 20.0, 50.0],
            [38.0, 25.0, 22.0, 55.0],
            [40.0, 25.0, 22.0, 55.0],
            [38.0, 30.0, 22.0, 55.0],
            [40.0, 30.0, 22.0, 55.0],
            [42.0, 35.0, 16.0, 40.0],
            [41.0, 33.0, 18.0, 45.0],
            [39.0, 27.0, 22.0, 55.0], // 1.1 * 50 is a little more than 55
            [38.0, 25.0, 24.0, 60.0],
        ];
        assert_eq!(boxes, expected);
    }

    #[test]
    fn sre_boxes_stay_in_the_frame() {
        let corner = BoundingBox { x: 0.0, y: 60.0, w: 20.0, h: 40.0 };
        for bbox in sre_boxes(&corner, (100, 100)) {
            bbox.check_in(100, 100).unwrap();
            assert!(bbox.x >= 0.0 && bbox.y + bbox.h <= 100.0, "{bbox:?}");
        }
    }
}
