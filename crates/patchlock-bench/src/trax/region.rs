//! Regions in TraX: `left,top,width,height`, or a polygon `x1,y1,x2,y2,..`.
//!
//! Pixel `k` covers `k` to `k + 1`, so the polygon of a box extends from `x` to `x + w`. Corners in
//! the `patchlock` crate have pixel centres at integers and are half a pixel smaller.

use std::fmt;

use patchlock::BoundingBox;

use patchlock_track::names::beginning;
use patchlock_track::text;

/// The protocol's name for boxes.
pub const RECTANGLE: &str = "rectangle";
/// The protocol's name for polygons.
pub const POLYGON: &str = "polygon";

/// A region.
#[derive(Debug, Clone, PartialEq)]
pub enum Region {
    /// An upright box.
    Rectangle(BoundingBox),
    /// At least three corners, in order.
    Polygon(Vec<[f64; 2]>),
    /// A single number (a code) or a region with NaN: the target is not visible.
    Nothing,
}

impl Region {
    /// Parses a region such as `10,20,30,40`, optionally preceded by its type, as in
    /// `rect:10,20,30,40`.
    ///
    /// # Errors
    /// What is wrong with the region. Masks are not supported.
    pub fn parse(text: &str) -> Result<Self, String> {
        // libtrax writes masks as m0,0,4,4,..
        let (name, rest) = match text.strip_prefix(['m', 'M']) {
            Some(mask) if mask.starts_with(|c: char| c.is_ascii_digit() || c == '-') => {
                ("mask", "")
            }
            _ => text.split_once(':').unwrap_or(("", text)),
        };
        if !matches!(name, "" | "rect" | "poly" | "special") {
            return Err(format!(
                "a region is a {RECTANGLE} or {POLYGON}, numbers separated by commas, not {}",
                beginning(name)
            ));
        }
        let row = text::numbers(rest)?;
        if row.len() == 1 {
            return Ok(Self::Nothing);
        }
        Ok(match text::region(&row, 0.0)? {
            None => Self::Nothing,
            Some(bbox) if row.len() == 4 => Self::Rectangle(bbox),
            Some(_) => Self::Polygon(row.as_chunks().0.to_vec()),
        })
    }

    /// The box, or the bounding box of the polygon; `None` for [`Region::Nothing`].
    pub fn bbox(&self) -> Option<BoundingBox> {
        match self {
            Self::Rectangle(bbox) => Some(*bbox),
            Self::Polygon(points) => Some(text::bounding_box(points.as_flattened(), 0.0)),
            Self::Nothing => None,
        }
    }

    /// The polygon of a box: top left, top right, bottom right, bottom left.
    pub fn corners_of(bbox: &BoundingBox) -> Self {
        let (right, bottom) = (bbox.x + bbox.w, bbox.y + bbox.h);
        Self::Polygon(vec![[bbox.x, bbox.y], [right, bbox.y], [right, bottom], [bbox.x, bottom]])
    }

    /// The polygon of the corners of an [`Estimate`](patchlock::Estimate).
    pub fn outline(corners: &[[f64; 2]; 4]) -> Self {
        Self::Polygon(corners.iter().map(|[x, y]| [x + 0.5, y + 0.5]).collect())
    }
}

/// Writes the numbers with enough digits to be read back exactly.
impl fmt::Display for Region {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let row: &[f64] = match self {
            Self::Rectangle(b) => &[b.x, b.y, b.w, b.h],
            Self::Polygon(points) => points.as_flattened(),
            Self::Nothing => &[0.0],
        };
        let words: Vec<String> = row.iter().map(f64::to_string).collect();
        f.write_str(&words.join(","))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BBOX: BoundingBox = BoundingBox { x: -1.5, y: 2.25, w: 30.0, h: 4.5 };

    #[test]
    fn regions_survive_a_round_trip() {
        let turned = Region::Polygon(vec![[0.1, 0.25], [5.0, 1e-7], [3.0, 3.0]]);
        for region in [Region::Rectangle(BBOX), Region::corners_of(&BBOX), turned, Region::Nothing]
        {
            assert_eq!(Region::parse(&region.to_string()), Ok(region));
        }
        assert_eq!(Region::corners_of(&BBOX).bbox(), Some(BBOX));
    }

    #[test]
    fn an_upright_outline_equals_the_box() {
        let bbox = BoundingBox { x: 3.0, y: 5.0, w: 32.0, h: 28.0 };
        // Pixel 3 begins at 2.5 where its centre is 3.
        let corners = [[2.5, 4.5], [34.5, 4.5], [34.5, 32.5], [2.5, 32.5]];
        assert_eq!(Region::outline(&corners), Region::corners_of(&bbox));
    }

    #[test]
    fn types_codes_and_missing_targets_are_parsed() {
        assert_eq!(Region::parse("rect:-1.5,2.25,30,4.5"), Ok(Region::Rectangle(BBOX)));
        assert!(matches!(Region::parse("poly:0,0,1,0,1,1"), Ok(Region::Polygon(_))));
        for nothing in ["0", "special:-1", "NaN,NaN,NaN,NaN"] {
            assert_eq!(Region::parse(nothing), Ok(Region::Nothing), "{nothing}");
        }
        for bad in ["", "1,2,3", "1,2,x,4", "1,2,inf,4", "1,2,3,4,5", "mask:0,0,3,3,9", "m0,0,3,3"]
        {
            assert!(Region::parse(bad).is_err(), "{bad}");
        }
        for mask in ["mask:0,0,3,3,9", "m0,0,3,3,9", "m-1,0,3,3,9"] {
            assert!(Region::parse(mask).unwrap_err().contains("not mask"), "{mask}");
        }
    }
}
