//! Regions of TraX: `left,top,width,height`, or a polygon `x1,y1,x2,y2,..`.
//!
//! Pixel `k` covers `k` to `k + 1`, so the polygon of a box goes from `x` to `x + w`. The library has pixel centres at whole numbers; its corners are therefore half a
//! pixel less.

use std::fmt;

use patchlock::BoundingBox;

use crate::text;

/// What the protocol calls boxes, in its lists of formats.
pub const RECTANGLE: &str = "rectangle";
/// What the protocol calls polygons.
pub const POLYGON: &str = "polygon";

/// A region.
#[derive(Debug, Clone, PartialEq)]
pub enum Region {
    /// An upright box.
    Rectangle(BoundingBox),
    /// Three corners or more, in order.
    Polygon(Vec<[f64; 2]>),
    /// One number, a code, or a region with NaN in it: there is no target to be seen.
    Nothing,
}

impl Region {
    /// The region of a text such as `10,20,30,40`; a name before it, as in `rect:10,20,30,40`, is allowed.
    ///
    /// # Errors
    /// What is wrong with it. Masks are not read.
    pub fn parse(text: &str) -> Result<Self, String> {
        // libtrax writes a mask as m0,0,4,4,..
        let (name, rest) = match text.strip_prefix(['m', 'M']) {
            Some(mask) if mask.starts_with(|c: char| c.is_ascii_digit() || c == '-') => {
                ("mask", "")
            }
            _ => text.split_once(':').unwrap_or(("", text)),
        };
        if !matches!(name, "" | "rect" | "poly" | "special") {
            return Err(format!(
                "regions are {RECTANGLE} or {POLYGON}, numbers with commas between them, not {name}"
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

    /// The box, or the upright box around the polygon.
    pub fn bbox(&self) -> Option<BoundingBox> {
        match self {
            Self::Rectangle(bbox) => Some(*bbox),
            Self::Polygon(points) => Some(text::around(points.as_flattened(), 0.0)),
            Self::Nothing => None,
        }
    }

    /// The corners of a box: top left, top right, bottom right, bottom left.
    pub fn corners_of(bbox: &BoundingBox) -> Self {
        let (right, bottom) = (bbox.x + bbox.w, bbox.y + bbox.h);
        Self::Polygon(vec![[bbox.x, bbox.y], [right, bbox.y], [right, bottom], [bbox.x, bottom]])
    }

    /// The outline that an [`Estimate`](patchlock::Estimate) has as its corners.
    pub fn outline(corners: &[[f64; 2]; 4]) -> Self {
        Self::Polygon(corners.iter().map(|[x, y]| [x + 0.5, y + 0.5]).collect())
    }
}

/// The text, with every digit.
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
    fn regions_go_there_and_back() {
        let turned = Region::Polygon(vec![[0.1, 0.25], [5.0, 1e-7], [3.0, 3.0]]);
        for region in [Region::Rectangle(BBOX), Region::corners_of(&BBOX), turned, Region::Nothing]
        {
            assert_eq!(Region::parse(&region.to_string()), Ok(region));
        }
        assert_eq!(Region::corners_of(&BBOX).bbox(), Some(BBOX));
    }

    #[test]
    fn an_outline_that_is_upright_is_the_box() {
        let bbox = BoundingBox { x: 3.0, y: 5.0, w: 32.0, h: 28.0 };
        // Pixel 3 begins at 2.5 where its centre is 3.
        let corners = [[2.5, 4.5], [34.5, 4.5], [34.5, 32.5], [2.5, 32.5]];
        assert_eq!(Region::outline(&corners), Region::corners_of(&bbox));
    }

    #[test]
    fn names_codes_and_nothing() {
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
