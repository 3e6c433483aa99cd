//! A picture layer that can be painted on and laid over another.

use crate::noise::ease;

/// Red, green and blue in grey levels, `0..=255`.
pub(crate) type Colour = [f32; 3];

/// Samples per pixel along each axis.
const SAMPLES: i32 = 3;

/// A layer of pixels: red, green and blue premultiplied by the coverage, and
/// the coverage in `0..=1`.
#[derive(Debug, Clone)]
pub(crate) struct Canvas {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) pixels: Vec<[f32; 4]>,
}

/// The bounding box of a shape: minimum and maximum of x and y.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Area {
    pub(crate) min: [f64; 2],
    pub(crate) max: [f64; 2],
}

impl Area {
    /// A square around a centre.
    pub(crate) fn around(centre: [f64; 2], reach: f64) -> Self {
        Area { min: centre.map(|c| c - reach), max: centre.map(|c| c + reach) }
    }
}

impl Canvas {
    /// An empty layer.
    pub(crate) fn clear(width: usize, height: usize) -> Self {
        Canvas { width, height, pixels: vec![[0.0; 4]; width * height] }
    }

    /// A full layer that is smooth enough for one sample per pixel.
    pub(crate) fn filled(width: usize, height: usize, shade: impl Fn([f64; 2]) -> Colour) -> Self {
        let mut canvas = Canvas::clear(width, height);
        for (i, pixel) in canvas.pixels.iter_mut().enumerate() {
            let [r, g, b] = shade([(i % width) as f64, (i / width) as f64]);
            *pixel = [r, g, b, 1.0];
        }
        canvas
    }

    /// Paints a shape over the existing pixels: `shade` returns the colour at a
    /// point, or `None` outside the shape. Only `area` is visited.
    pub(crate) fn paint(&mut self, area: Area, shade: impl Fn([f64; 2]) -> Option<Colour>) {
        for y in pixel_range(area.min[1], area.max[1], self.height) {
            for x in pixel_range(area.min[0], area.max[0], self.width) {
                let above = sampled([x as f64, y as f64], &shade);
                lay_over(&mut self.pixels[y * self.width + x], above);
            }
        }
    }

    /// Lays another canvas of the same size over this one.
    pub(crate) fn lay_over(&mut self, above: &Canvas) {
        for (pixel, &top) in self.pixels.iter_mut().zip(&above.pixels) {
            lay_over(pixel, top);
        }
    }
}

/// The pixels whose squares touch `min..max`, inside `0..size`.
fn pixel_range(min: f64, max: f64, size: usize) -> std::ops::Range<usize> {
    // Casts from float saturate, so coordinates left of the frame become 0.
    let first = (min - 0.5).ceil() as usize;
    let end = (max + 0.5).floor() as usize + 1;
    first..end.min(size)
}

/// Colour and coverage of the square of one pixel.
///
/// The samples form a skewed grid in which no two share a row or a column, so
/// that upright edges are accurate to a ninth of a pixel instead of a third.
fn sampled(centre: [f64; 2], shade: &impl Fn([f64; 2]) -> Option<Colour>) -> [f32; 4] {
    let mut sum = [0.0; 4];
    let offset = |coarse: i32, fine: i32| {
        let step = f64::from(coarse * SAMPLES + fine) + 0.5;
        step / f64::from(SAMPLES * SAMPLES) - 0.5
    };
    for j in 0..SAMPLES {
        for i in 0..SAMPLES {
            let (dx, dy) = (offset(i, j), offset(j, SAMPLES - 1 - i));
            if let Some([r, g, b]) = shade([centre[0] + dx, centre[1] + dy]) {
                sum = [sum[0] + r, sum[1] + g, sum[2] + b, sum[3] + 1.0];
            }
        }
    }
    sum.map(|s| s / (SAMPLES * SAMPLES) as f32)
}

fn lay_over(below: &mut [f32; 4], above: [f32; 4]) {
    let through = 1.0 - above[3];
    for (b, a) in below.iter_mut().zip(above) {
        *b = *b * through + a;
    }
}

/// Interpolates between two colours, with `t` in `0..=1`.
pub(crate) fn mixed(from: Colour, to: Colour, t: f64) -> Colour {
    let t = t.clamp(0.0, 1.0) as f32;
    std::array::from_fn(|c| from[c] + (to[c] - from[c]) * t)
}

/// Scales a colour by a factor.
pub(crate) fn dimmed(colour: Colour, factor: f64) -> Colour {
    colour.map(|c| (c * factor as f32).clamp(0.0, 255.0))
}

/// 0 below `low`, 1 above `high`, smooth between.
pub(crate) fn ramp(value: f64, low: f64, high: f64) -> f64 {
    ease((value - low) / (high - low))
}
