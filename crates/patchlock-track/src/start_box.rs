//! Checks the box that tracking starts on.

use patchlock::BoundingBox;

use crate::Error;

/// Coordinates from this magnitude on are shown with an exponent, to keep messages short.
const EXPONENT_FROM: f64 = 1e9;

/// Checks a box against frame `index` of this width and height in pixels.
///
/// # Errors
/// [`Error::StartBoxShape`] for an invalid width or height; [`Error::StartBoxOutside`] if no part
/// of the box is in the frame.
pub fn check(bbox: &BoundingBox, index: usize, width: usize, height: usize) -> Result<(), Error> {
    let Err(error) = bbox.check_in(width, height) else { return Ok(()) };
    let shown = [bbox.x, bbox.y, bbox.w, bbox.h].map(coordinate).join(",");
    if let patchlock::Error::BoxShape { max, .. } = error {
        return Err(Error::StartBoxShape(shown, max));
    }
    Err(Error::StartBoxOutside(shown, index, [width, height]))
}

fn coordinate(value: f64) -> String {
    if value.abs() < EXPONENT_FROM { format!("{value}") } else { format!("{value:e}") }
}
