//! The box to begin on, checked against the frame that it is in.

use patchlock::BoundingBox;

use crate::Error;

/// What a box is.
pub const SYNTAX: &str = "a box is X,Y,W,H: left and upper side counted from 0, width and height, in pixels, \
                          as 120,80,64,48";
/// From here on a coordinate is written with an exponent: nobody wants to read three hundred digits.
const LONG: f64 = 1e9;

/// Checks a box against frame `index` with this size.
///
/// # Errors
/// [`Error::StartBoxShape`], [`Error::StartBoxOutside`].
pub fn check(bbox: &BoundingBox, index: usize, width: usize, height: usize) -> Result<(), Error> {
    let Err(error) = bbox.check_in(width, height) else { return Ok(()) };
    let shown = [bbox.x, bbox.y, bbox.w, bbox.h].map(coordinate).join(",");
    if let patchlock::Error::BoxShape { max, .. } = error {
        return Err(Error::StartBoxShape { shown, max });
    }
    Err(Error::StartBoxOutside { shown, index, width, height })
}

fn coordinate(value: f64) -> String {
    if value.abs() < LONG { format!("{value}") } else { format!("{value:e}") }
}
