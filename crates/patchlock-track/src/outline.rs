//! Outlines that a person draws around a target: polygons and rotated boxes.

use std::fmt;
use std::str::FromStr;

use patchlock::BoundingBox;
use serde::{Deserialize, Serialize};

use crate::text;

/// A point, in pixels. Pixel `k` is from `k` to `k + 1`, as with the sides of a box.
pub type Point = [f64; 2];

/// Most points of an outline.
pub const MOST_POINTS: usize = 1000;
/// By how many pixels points may be off that were rounded to hundredths.
const ROUNDING: f64 = 0.05;

/// A polygon around a target. A rotated box is one of four corners.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Outline(pub Vec<Point>);

impl Outline {
    /// A box that is turned clockwise around its centre, with its corners in that order.
    pub fn of_box(bbox: BoundingBox, degrees: f64) -> Self {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let (w, h) = (bbox.w / 2.0, bbox.h / 2.0);
        let (x, y) = (bbox.x + w, bbox.y + h);
        let corners = [[-w, -h], [w, -h], [w, h], [-w, h]];
        let turned = corners.map(|[u, v]| [x + u * cos - v * sin, y + u * sin + v * cos]);
        Self(turned.to_vec())
    }

    /// The upright box around it.
    pub fn bounds(&self) -> BoundingBox {
        text::bounding_box(self.0.as_flattened(), 0.0)
    }

    /// Its area, by the shoelace formula.
    pub fn area(&self) -> f64 {
        let next = |k: usize| self.0[(k + 1) % self.0.len()];
        let cross = |(k, [x, y]): (usize, &Point)| x * next(k)[1] - next(k)[0] * y;
        self.0.iter().enumerate().map(cross).sum::<f64>().abs() / 2.0
    }

    /// Checks that it has an area, and not too many points.
    ///
    /// # Errors
    /// A sentence that says what is wrong.
    pub fn check(&self) -> Result<(), String> {
        let count = self.0.len();
        if !(3..=MOST_POINTS).contains(&count) {
            return Err(format!("the outline has {count} points; allowed: 3 to {MOST_POINTS}"));
        }
        self.0.iter().flatten().try_for_each(|&value| text::coordinate(value))?;
        match self.area() {
            area if area >= 1.0 => Ok(()),
            area => Err(format!("the outline has an area of {area} pixels; allowed: 1 or more")),
        }
    }

    /// Whether it is a rectangle, turned or not: its diagonals are equal and halve each other.
    pub fn is_rectangle(&self) -> bool {
        let [a, b, c, d] = self.0[..] else { return false };
        let middles = [0, 1].map(|k| (a[k] + c[k] - b[k] - d[k]).abs() / 2.0);
        let length = |[p, q]: [Point; 2]| (p[0] - q[0]).hypot(p[1] - q[1]);
        let lengths = (length([a, c]) - length([b, d])).abs();
        [middles[0], middles[1], lengths].into_iter().all(|off| off <= ROUNDING)
    }

    /// Whether it is the upright box around it, and says no more.
    pub fn is_upright(&self) -> bool {
        let bounds = self.bounds();
        self.is_rectangle() && (self.area() - bounds.w * bounds.h).abs() <= ROUNDING
    }

    /// The box before it was turned clockwise around its centre, and by how many degrees, 0 to 360. Of
    /// a polygon, those of the smallest rectangle around it, turned by less than 45 degrees either way.
    pub fn rotated_box(&self) -> (BoundingBox, f64) {
        let [a, b, c, d] = match self.0[..] {
            [a, b, c, d] if self.is_rectangle() && turn([a, b, c]) > 0.0 => [a, b, c, d],
            _ => self.smallest_rectangle(),
        };
        let [x, y] = [0, 1].map(|k| (a[k] + b[k] + c[k] + d[k]) / 4.0);
        // The mean of the upper and the lower side.
        let [u, v] = [0, 1].map(|k| (b[k] - a[k] + c[k] - d[k]) / 2.0);
        let (w, h) = (u.hypot(v), (d[0] - a[0]).hypot(d[1] - a[1]));
        let degrees = v.atan2(u).to_degrees().rem_euclid(360.0);
        (BoundingBox { x: x - w / 2.0, y: y - h / 2.0, w, h }, degrees)
    }

    /// The corners of the smallest rectangle around it. One of its sides lies on one of the hull's.
    fn smallest_rectangle(&self) -> [Point; 4] {
        let hull = self.hull();
        let around = |k: usize| {
            let (from, to) = (hull[k], hull[(k + 1) % hull.len()]);
            // The same rectangle has four names; this is the one that is turned least.
            let quarter = std::f64::consts::FRAC_PI_2;
            let angle = (to[1] - from[1]).atan2(to[0] - from[0]);
            let angle = angle - (angle / quarter).round() * quarter;
            let (sin, cos) = angle.sin_cos();
            let level = hull.iter().map(|[x, y]| [x * cos + y * sin, y * cos - x * sin]);
            let BoundingBox { x, y, w, h } = Self(level.collect()).bounds();
            let corners = [[x, y], [x + w, y], [x + w, y + h], [x, y + h]];
            (w * h, corners.map(|[u, v]| [u * cos - v * sin, u * sin + v * cos]))
        };
        let all = (0..hull.len()).map(around);
        let smallest = all.reduce(|best, next| if next.0 < best.0 { next } else { best });
        smallest.map_or([[0.0; 2]; 4], |(_, corners)| corners)
    }

    /// The corners of the convex hull in order (Andrew's monotone chain).
    fn hull(&self) -> Vec<Point> {
        let mut points = self.0.clone();
        points.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
        let half = |points: &mut dyn Iterator<Item = Point>| {
            let mut chain: Vec<Point> = Vec::new();
            for point in points {
                while let [.., a, b] = chain[..]
                    && turn([a, b, point]) <= 0.0
                {
                    chain.pop();
                }
                chain.push(point);
            }
            chain.pop(); // it begins the other half
            chain
        };
        let lower = half(&mut points.iter().copied());
        [lower, half(&mut points.iter().rev().copied())].concat()
    }

    /// The outline of a target whose box was `from` and is `to`: moved, and as much larger.
    #[must_use]
    pub fn carried(&self, from: BoundingBox, to: BoundingBox) -> Self {
        let by = (to.w * to.h / (from.w * from.h)).sqrt();
        let ([x, y], [u, v]) = (from.centre(), to.centre());
        // Centres of boxes are those of pixels, half a pixel off; that is the same for both.
        let place = |[a, b]: &Point| [u + 0.5 + by * (a - x - 0.5), v + 0.5 + by * (b - y - 0.5)];
        Self(self.0.iter().map(place).collect())
    }

    /// A rotated box between two, at this share of the way; the angle takes the shorter way.
    #[must_use]
    pub fn between(&self, other: &Self, share: f64) -> Self {
        let (a, b) = (self.rotated_box(), other.rotated_box());
        let (bbox, degrees) = mean(a, b, share);
        Self::of_box(bbox, degrees)
    }
}

/// The box and the angle at a share of the way between two; the angle takes the shorter way.
pub(crate) fn mean(
    (a, from): (BoundingBox, f64),
    (b, to): (BoundingBox, f64),
    share: f64,
) -> (BoundingBox, f64) {
    let side = |a: f64, b: f64| a + share * (b - a);
    let by = (to - from + 180.0).rem_euclid(360.0) - 180.0;
    let bbox =
        BoundingBox { x: side(a.x, b.x), y: side(a.y, b.y), w: side(a.w, b.w), h: side(a.h, b.h) };
    (bbox, from + share * by)
}

/// Above 0 if the way through three points turns clockwise on the screen.
fn turn([a, b, c]: [Point; 3]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// `x,y;x,y;x,y`, as CVAT writes points.
impl fmt::Display for Outline {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (k, [x, y]) in self.0.iter().enumerate() {
            let before = if k == 0 { "" } else { ";" };
            write!(f, "{before}{x},{y}")?;
        }
        Ok(())
    }
}

impl FromStr for Outline {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let point = |word: &str| {
            let (x, y) = word.split_once(',')?;
            Some([x.trim().parse().ok()?, y.trim().parse().ok()?])
        };
        let points = text.split(';').map(|word| {
            point(word).ok_or_else(|| format!("{word:?} is not a point x,y of an outline"))
        });
        Ok(Self(points.collect::<Result<_, String>>()?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOX: BoundingBox = BoundingBox { x: 10.0, y: 20.0, w: 40.0, h: 10.0 };

    #[track_caller]
    fn near((found, degrees): (BoundingBox, f64), (wanted, angle): (BoundingBox, f64)) {
        let sides = |b: BoundingBox| [b.x, b.y, b.w, b.h];
        let off = sides(found).into_iter().zip(sides(wanted)).map(|(a, b)| (a - b).abs());
        assert!(off.fold(0.0, f64::max) < 1e-6, "{found:?} {wanted:?}");
        assert!((degrees - angle).abs() < 1e-6, "{degrees} {angle}");
    }

    #[test]
    fn a_rotated_box_is_known_again() {
        for degrees in [0.0, 30.0, 90.0, 200.0, 315.0] {
            let outline = Outline::of_box(BOX, degrees);
            assert!(outline.is_rectangle());
            assert_eq!(outline.is_upright(), degrees == 0.0 || degrees == 90.0, "{degrees}");
            near(outline.rotated_box(), (BOX, degrees));
            // Rounded and read again, it still is one.
            let rounded = outline.0.iter().map(|p| p.map(|v| (v * 100.0).round() / 100.0));
            assert!(Outline(rounded.collect()).is_rectangle());
        }
    }

    #[test]
    fn the_smallest_rectangle_around_a_polygon() {
        // A turned box with a dent and a point more on a side.
        let mut points = Outline::of_box(BOX, 30.0).0;
        let middle = [0, 1].map(|k| (points[0][k] + points[1][k]) / 2.0);
        points.insert(1, middle);
        points.push([30.0, 25.0]);
        let polygon = Outline(points);
        assert!(!polygon.is_rectangle());
        near(polygon.rotated_box(), (BOX, 30.0));
        // Against the clock it is the same.
        let back: Vec<Point> = polygon.0.iter().rev().copied().collect();
        near(Outline(back).rotated_box(), (BOX, 30.0));
        let triangle = Outline(vec![[0.0, 0.0], [8.0, 0.0], [8.0, 6.0]]);
        near(triangle.rotated_box(), (BoundingBox { x: 0.0, y: 0.0, w: 8.0, h: 6.0 }, 0.0));
        assert_eq!(triangle.area(), 24.0);
    }

    #[test]
    fn an_outline_moves_and_grows_with_the_box() {
        let from = Outline::of_box(BOX, 30.0);
        let bounds = from.bounds();
        let to = BoundingBox { x: 100.0, y: 50.0, w: 2.0 * bounds.w, h: 2.0 * bounds.h };
        let carried = from.carried(bounds, to);
        let found = carried.bounds();
        near((found, 30.0), (to, 30.0));
        near(
            carried.rotated_box(),
            (
                BoundingBox {
                    x: to.x + to.w / 2.0 - 40.0,
                    y: to.y + to.h / 2.0 - 10.0,
                    w: 80.0,
                    h: 20.0,
                },
                30.0,
            ),
        );
        // The angle takes the shorter way.
        let half = Outline::of_box(BOX, 350.0).between(&Outline::of_box(BOX, 20.0), 0.5);
        near(half.rotated_box(), (BOX, 5.0));
    }

    #[test]
    fn what_is_no_outline_is_refused() {
        let check = |text: &str| text.parse::<Outline>().and_then(|outline| outline.check());
        assert_eq!(check("0,0;4,0;4,4"), Ok(()));
        let refused = |text: &str, wanted: &str| {
            let error = check(text).unwrap_err();
            assert!(error.contains(wanted), "{error}");
        };
        refused("0,0;4,0", "the outline has 2 points; allowed: 3 to 1000");
        refused("0,0;4,0;8,0", "an area of 0 pixels; allowed: 1 or more");
        refused("0,0;4,0;NaN,4", "NaN is not a coordinate");
        refused("0,0;4", "\"4\" is not a point x,y of an outline");
        assert_eq!(Outline(vec![[0.5, 1.0], [4.0, 2.0]]).to_string(), "0.5,1;4,2");
    }
}
