//! By how much the camera has turned between two frames: a corner (Shi and Tomasi, "Good features to
//! track", 1994) of each cell of a grid, followed from one reduced
//! frame to the other with the pyramidal method of Lucas and Kanade (Bouguet, "Pyramidal
//! implementation of the Lucas Kanade feature tracker", 2001), and the similarity that most of them
//! agree with (RANSAC over all pairs of points).

use super::frame::{Frame, RowTaps};
use super::geometry::Point;
use serde::{Deserialize, Serialize};

/// The most pixels on a side of a reduced frame.
const SIDE: usize = 256;

/// Reduced frames with shorter sides have no room for points.
const LEAST_SIDE: usize = 48;

/// Cells along the width and the height; each has a point.
const GRID: [usize; 2] = [10, 6];

/// The width of the border of a reduced frame that has no points, in pixels.
const MARGIN: usize = 8;

/// The distance between pixels that may become a point.
const STEP: usize = 3;

/// Levels of a pyramid; each has half of the side of the one before.
const LEVELS: usize = 3;

/// Half of the side of the window around a point, in pixels.
const RADIUS: i32 = 4;

/// Samples of the window around a point.
const WINDOW: usize = (2 * RADIUS as usize + 1).pow(2);

/// Iterations of a level.
const ITERATIONS: usize = 6;

/// The smallest eigenvalue of the mean structure tensor of a point that can be followed, in squared
/// grey levels.
const LEAST_TEXTURE: f32 = 4.0;

/// The largest distance between a point and where it comes back to, and between a point and where
/// the similarity puts it, in pixels of the reduced frame.
const TOLERANCE: f64 = 1.0;

/// The fewest points that must agree with the similarity.
const LEAST_POINTS: usize = 8;

/// The share of followed points that must agree with it.
const LEAST_SHARE: f64 = 0.5;

/// The largest rotation between two frames, in radians.
const MOST: f64 = 0.35;

/// A frame in grey, reduced by a whole number.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct ReducedFrame {
    width: usize,
    height: usize,
    samples: Vec<u8>,
}

/// A level of a pyramid.
#[derive(Debug, Default)]
struct Level {
    width: usize,
    height: usize,
    samples: Vec<f32>,
}

/// Buffers.
#[derive(Debug, Default)]
pub(crate) struct CameraScratch {
    row: Vec<f32>,
    pyramids: [[Level; LEVELS]; 2],
    pairs: Vec<[Point; 2]>,
}

impl ReducedFrame {
    /// Reduces a frame: a pixel is the mean of up to four of the pixels that it stands for.
    pub fn fill(&mut self, frame: &Frame<'_>, scratch: &mut CameraScratch) {
        let step = frame.width().max(frame.height()).div_ceil(SIDE);
        (self.width, self.height) = (frame.width() / step, frame.height() / step);
        let offsets = if step == 1 { [0, 0] } else { [step / 4, step / 4 + step / 2] };
        self.samples.clear();
        for y in 0..self.height {
            scratch.row.clear();
            scratch.row.resize(self.width, 0.0);
            for dy in offsets {
                for from in offsets {
                    let taps = RowTaps { from, step, weight: 0.25 };
                    frame.add_row(y * step + dy, taps, 1, &mut scratch.row);
                }
            }
            self.samples.extend(scratch.row.iter().map(|&level| level.round() as u8));
        }
    }

    /// Whether the number of samples is right.
    pub fn is_sound(&self) -> bool {
        self.width.checked_mul(self.height) == Some(self.samples.len())
    }

    /// By how much the picture has turned from this frame to another one, in radians, clockwise on
    /// screen; `None` if that cannot be told.
    pub fn rotation_to(&self, other: &Self, scratch: &mut CameraScratch) -> Option<f64> {
        let same = (self.width, self.height) == (other.width, other.height);
        if !same || self.width.min(self.height) < LEAST_SIDE {
            return None;
        }
        let CameraScratch { pyramids: [from, to], pairs, .. } = scratch;
        self.build(from);
        other.build(to);
        pairs.clear();
        pairs.reserve(GRID[0] * GRID[1]);
        let size = [self.width, self.height];
        let cell = [0, 1].map(|axis| (size[axis] - 2 * MARGIN) / GRID[axis]);
        for number in 0..GRID[0] * GRID[1] {
            let [column, row] = [number % GRID[0], number / GRID[0]];
            let first = [MARGIN + column * cell[0], MARGIN + row * cell[1]];
            let point = from[0].corner(first, cell);
            let Some(there) = follow(from, to, point) else { continue };
            let Some(back) = follow(to, from, there) else { continue };
            if distance(point, back) <= TOLERANCE {
                pairs.push([point, there]);
            }
        }
        rotation(pairs, cell[0] as f64)
    }

    /// Fills a pyramid.
    fn build(&self, pyramid: &mut [Level; LEVELS]) {
        let [first, rest @ ..] = pyramid;
        (first.width, first.height) = (self.width, self.height);
        first.samples.clear();
        first.samples.extend(self.samples.iter().map(|&level| f32::from(level)));
        let mut above = first;
        for level in rest {
            level.halve(above);
            above = level;
        }
    }
}

impl Level {
    /// The point with the most texture in a cell.
    fn corner(&self, [left, top]: [usize; 2], [width, height]: [usize; 2]) -> Point {
        let mut best = (f32::NEG_INFINITY, [left, top]);
        for y in (top..top + height).step_by(STEP) {
            for x in (left..left + width).step_by(STEP) {
                let texture = self.texture(x, y);
                if texture > best.0 {
                    best = (texture, [x, y]);
                }
            }
        }
        best.1.map(|v| v as f64)
    }

    /// The smaller eigenvalue of the structure tensor of a pixel.
    fn texture(&self, x: usize, y: usize) -> f32 {
        let reach = RADIUS as usize - 1;
        let (mut xx, mut xy, mut yy) = (0.0_f32, 0.0_f32, 0.0_f32);
        for row in y - reach..=y + reach {
            let [above, line, below] = [row - 1, row, row + 1]
                .map(|row| &self.samples[row * self.width + x - reach - 1..]);
            for k in 1..2 * reach + 2 {
                let (dx, dy) = (line[k + 1] - line[k - 1], below[k] - above[k]);
                xx += dx * dx;
                xy += dx * dy;
                yy += dy * dy;
            }
        }
        smaller_eigenvalue(xx, xy, yy)
    }

    /// Fills it with the means of four pixels each.
    fn halve(&mut self, from: &Self) {
        (self.width, self.height) = (from.width / 2, from.height / 2);
        self.samples.clear();
        for y in 0..self.height {
            let [upper, lower] = [0, 1].map(|k| &from.samples[(2 * y + k) * from.width..]);
            let pairs = upper.as_chunks::<2>().0.iter().zip(lower.as_chunks::<2>().0);
            let means = pairs.map(|([a, b], [c, d])| 0.25 * (a + b + c + d));
            self.samples.extend(means.take(self.width));
        }
    }

    /// The samples of the window around a point, between pixels; `None` if it leaves the level.
    fn window(&self, [x, y]: Point, out: &mut [f32; WINDOW]) -> Option<()> {
        let [column, row] = [x.floor(), y.floor()];
        let reach = f64::from(RADIUS);
        let inside = column >= reach
            && row >= reach
            && column + reach + 1.0 < self.width as f64
            && row + reach + 1.0 < self.height as f64;
        if !inside {
            return None;
        }
        let [fx, fy] = [(x - column) as f32, (y - row) as f32];
        let side = 2 * RADIUS as usize + 1;
        let first =
            (row as usize - RADIUS as usize) * self.width + column as usize - RADIUS as usize;
        for (k, out) in out.chunks_exact_mut(side).enumerate() {
            let upper = &self.samples[first + k * self.width..][..side + 1];
            let lower = &self.samples[first + (k + 1) * self.width..][..side + 1];
            for (i, out) in out.iter_mut().enumerate() {
                let above = upper[i] + fx * (upper[i + 1] - upper[i]);
                let below = lower[i] + fx * (lower[i + 1] - lower[i]);
                *out = above + fy * (below - above);
            }
        }
        Some(())
    }
}

/// Where a point of one pyramid is in another one.
fn follow(from: &[Level; LEVELS], to: &[Level; LEVELS], point: Point) -> Option<Point> {
    let mut shift = [0.0; 2];
    for level in (0..LEVELS).rev() {
        let scale = f64::from(1 << level);
        // The centre of a pixel of a level is that of the pixels that it stands for.
        let here = point.map(|v| (v + 0.5) / scale - 0.5);
        shift = step(&from[level], &to[level], here, shift.map(|v: f64| 2.0 * v))?;
    }
    Some([point[0] + shift[0], point[1] + shift[1]])
}

/// The shift of the window around a point, from one level to another, beginning with a guess.
fn step(from: &Level, to: &Level, [x, y]: Point, mut shift: Point) -> Option<Point> {
    let (mut own, mut other) = ([0.0; WINDOW], [0.0; WINDOW]);
    let [mut left, mut right, mut above, mut below] = [[0.0; WINDOW]; 4];
    from.window([x, y], &mut own)?;
    from.window([x - 1.0, y], &mut left)?;
    from.window([x + 1.0, y], &mut right)?;
    from.window([x, y - 1.0], &mut above)?;
    from.window([x, y + 1.0], &mut below)?;
    let (mut xx, mut xy, mut yy) = (0.0_f32, 0.0_f32, 0.0_f32);
    for k in 0..WINDOW {
        // The gradient takes the place of the neighbours.
        (left[k], above[k]) = (0.5 * (right[k] - left[k]), 0.5 * (below[k] - above[k]));
        xx += left[k] * left[k];
        xy += left[k] * above[k];
        yy += above[k] * above[k];
    }
    if smaller_eigenvalue(xx, xy, yy) < LEAST_TEXTURE * WINDOW as f32 {
        return None;
    }
    let determinant = xx * yy - xy * xy;
    for _ in 0..ITERATIONS {
        to.window([x + shift[0], y + shift[1]], &mut other)?;
        let (mut dx, mut dy) = (0.0_f32, 0.0_f32);
        for k in 0..WINDOW {
            let difference = own[k] - other[k];
            dx += left[k] * difference;
            dy += above[k] * difference;
        }
        let [sx, sy] = [(yy * dx - xy * dy) / determinant, (xx * dy - xy * dx) / determinant];
        shift = [shift[0] + f64::from(sx), shift[1] + f64::from(sy)];
        if sx.abs().max(sy.abs()) < 0.02 {
            break;
        }
    }
    Some(shift)
}

/// The smaller eigenvalue of a symmetric matrix.
fn smaller_eigenvalue(xx: f32, xy: f32, yy: f32) -> f32 {
    0.5 * (xx + yy - ((xx - yy) * (xx - yy) + 4.0 * xy * xy).sqrt())
}

/// The rotation of the similarity that most pairs of points agree with, if enough do. Two points
/// that propose it are at least `apart` from each other, times two.
fn rotation(pairs: &[[Point; 2]], apart: f64) -> Option<f64> {
    let mut best: (usize, Option<Similarity>) = (0, None);
    for (k, first) in pairs.iter().enumerate() {
        for second in &pairs[k + 1..] {
            if distance(first[0], second[0]) < 2.0 * apart {
                continue;
            }
            let proposed = Similarity::of([first, second].into_iter());
            if proposed.rotation().abs() > MOST {
                continue;
            }
            let agree = pairs.iter().filter(|pair| proposed.maps(pair)).count();
            if agree > best.0 {
                best = (agree, Some(proposed));
            }
        }
    }
    let (agree, Some(similarity)) = best else { return None };
    if agree < LEAST_POINTS || (agree as f64) < LEAST_SHARE * pairs.len() as f64 {
        return None;
    }
    Some(Similarity::of(pairs.iter().filter(|pair| similarity.maps(pair))).rotation())
}

/// A rotation with a scale, about the centre of points.
#[derive(Debug, Clone, Copy)]
struct Similarity {
    from: Point,
    to: Point,
    /// Scale times cosine and sine.
    turn: Point,
}

impl Similarity {
    /// The one with the least squared error.
    fn of<'a>(pairs: impl Iterator<Item = &'a [Point; 2]> + Clone) -> Self {
        let count = pairs.clone().count() as f64;
        let mean = |which: usize, axis: usize| {
            pairs.clone().map(|pair| pair[which][axis]).sum::<f64>() / count
        };
        let [from, to] = [0, 1].map(|which| [mean(which, 0), mean(which, 1)]);
        let (mut cosine, mut sine, mut square) = (0.0, 0.0, 0.0);
        for [a, b] in pairs {
            let [ax, ay] = [a[0] - from[0], a[1] - from[1]];
            let [bx, by] = [b[0] - to[0], b[1] - to[1]];
            cosine += ax * bx + ay * by;
            sine += ax * by - ay * bx;
            square += ax * ax + ay * ay;
        }
        Self { from, to, turn: [cosine / square, sine / square] }
    }

    /// In radians, from x towards y.
    fn rotation(&self) -> f64 {
        self.turn[1].atan2(self.turn[0])
    }

    /// Whether it puts the first point where the second is.
    fn maps(&self, [a, b]: &[Point; 2]) -> bool {
        let ([x, y], [c, s]) = ([a[0] - self.from[0], a[1] - self.from[1]], self.turn);
        let there = [self.to[0] + c * x - s * y, self.to[1] + s * x + c * y];
        distance(there, *b) <= TOLERANCE
    }
}

fn distance(a: Point, b: Point) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use patchlock_scene::Scene;

    /// A textured picture, turned by this angle about its middle, scaled and shifted, as a frame of
    /// 240 x 160 pixels.
    fn picture(angle: f64, scale: f64, shift: Point) -> Vec<u8> {
        let scene = Scene::demo();
        let rendered = scene.frame(0);
        let (sin, cos) = angle.sin_cos();
        let mut out = Vec::new();
        for y in 0..160 {
            for x in 0..240 {
                let [dx, dy] = [f64::from(x) - 120.0 - shift[0], f64::from(y) - 80.0 - shift[1]];
                let [u, v] = [cos * dx + sin * dy, cos * dy - sin * dx].map(|v| v / scale);
                let [u, v] = [u + 240.0, v + 180.0];
                let (column, row) = (u.floor() as usize, v.floor() as usize);
                let at = |dx: usize, dy: usize| {
                    f64::from(rendered.rgb[((row + dy) * rendered.width + column + dx) * 3 + 1])
                };
                let [fx, fy] = [u - u.floor(), v - v.floor()];
                let upper = at(0, 0) + fx * (at(1, 0) - at(0, 0));
                let lower = at(0, 1) + fx * (at(1, 1) - at(0, 1));
                out.push((upper + fy * (lower - upper)).round() as u8);
            }
        }
        out
    }

    fn reduced(samples: &[u8], [width, height]: [usize; 2]) -> ReducedFrame {
        let mut reduced = ReducedFrame::default();
        let frame = Frame::grey8(samples, width, height).unwrap();
        reduced.fill(&frame, &mut CameraScratch::default());
        assert!(reduced.is_sound());
        reduced
    }

    fn rotation_between(a: &[u8], b: &[u8]) -> Option<f64> {
        let [a, b] = [a, b].map(|samples| reduced(samples, [240, 160]));
        a.rotation_to(&b, &mut CameraScratch::default())
    }

    #[test]
    fn rotation_is_measured_whatever_the_scale_and_the_shift() {
        let first = picture(0.0, 1.0, [0.0; 2]);
        for (angle, scale, shift) in [
            (0.0, 1.0, [0.0; 2]),
            (0.0, 1.0, [5.0, -3.0]),
            (0.0, 1.04, [0.0; 2]),
            (0.01, 1.0, [0.0; 2]),
            (0.05, 1.0, [0.0; 2]),
            (-0.05, 0.98, [2.0, 4.0]),
            (0.1, 1.02, [-3.0, 0.0]),
        ] {
            let second = picture(angle, scale, shift);
            let found = rotation_between(&first, &second).expect("textured");
            assert!((found - angle).abs() < 0.004, "{angle} {scale} {shift:?}: {found}");
        }
    }

    #[test]
    fn what_moves_in_a_third_of_the_picture_does_not_count() {
        let (first, mut second) = (picture(0.0, 1.0, [0.0; 2]), picture(0.04, 1.0, [0.0; 2]));
        let moved = picture(-0.2, 1.0, [9.0, 7.0]);
        for y in 0..160 {
            let row = y * 240;
            second[row..row + 80].copy_from_slice(&moved[row..row + 80]);
        }
        let found = rotation_between(&first, &second).expect("textured");
        assert!((found - 0.04).abs() < 0.006, "{found}");
    }

    #[test]
    fn without_texture_agreement_or_room_nothing_is_known() {
        let first = picture(0.0, 1.0, [0.0; 2]);
        assert_eq!(rotation_between(&[9; 240 * 160], &[9; 240 * 160]), None);
        assert_eq!(rotation_between(&first, &[9; 240 * 160]), None);
        let scratch = &mut CameraScratch::default();
        let small = reduced(&first[..47 * 47], [47, 47]);
        assert_eq!(small.rotation_to(&small, scratch), None);
        let other = reduced(&first[..120 * 160], [120, 160]);
        assert_eq!(reduced(&first, [240, 160]).rotation_to(&other, scratch), None);
    }

    #[test]
    fn a_frame_is_reduced_by_a_whole_number() {
        for (size, step) in [([256, 64], 1), ([257, 64], 2), ([1920, 1080], 8), ([1, 1], 1)] {
            let [width, height]: [usize; 2] = size;
            let samples: Vec<u8> = (0..width * height).map(|k| (k % 7 * 30) as u8).collect();
            let reduced = reduced(&samples, size);
            assert_eq!((reduced.width, reduced.height), (width / step, height / step), "{size:?}");
            let [near, far] = if step == 1 { [0, 0] } else { [step / 4, step / 4 + step / 2] };
            let at = |x: usize, y: usize| f32::from(samples[y * width + x]);
            let mean = (at(near, near) + at(far, near) + at(near, far) + at(far, far)) / 4.0;
            assert!((f32::from(reduced.samples[0]) - mean).abs() <= 0.5, "{size:?}");
        }
    }
}
