//! The woodland behind the target: haze, far trunks, leaves and stones.

use crate::canvas::{Area, Canvas, Colour, dimmed, mixed, ramp};
use crate::noise::{cloud, uniform, value_noise};

const LEAF_COLOURS: [Colour; 6] = [
    [206.0, 128.0, 44.0],
    [184.0, 74.0, 40.0],
    [222.0, 178.0, 74.0],
    [122.0, 140.0, 60.0],
    [84.0, 118.0, 58.0],
    [150.0, 96.0, 52.0],
];

/// Paints the whole backdrop.
pub(crate) fn backdrop(width: usize, height: usize, seed: u64) -> Canvas {
    let mut canvas = Canvas::filled(width, height, |point| wood(seed, height as f64, point));
    for i in 0..(width / 60) as i64 {
        far_trunk(&mut canvas, seed, i);
    }
    for i in 0..(width * height / 4200) as i64 {
        stone(&mut canvas, seed, i);
    }
    for i in 0..(width * height / 850) as i64 {
        leaf(&mut canvas, seed, i);
    }
    canvas
}

/// Where the ground starts, relative to the height.
fn horizon(seed: u64, x: f64) -> f64 {
    0.5 + 0.12 * (cloud(seed ^ 0x11, x / 90.0, 0.5, 3) - 0.5)
}

fn wood(seed: u64, height: f64, [x, y]: [f64; 2]) -> Colour {
    let down = y / height;
    let clumps = cloud(seed ^ 0x12, x / 52.0, y / 40.0, 5);
    let fine = ramp(cloud(seed ^ 0x13, x / 7.0, y / 5.0, 3), 0.2, 0.8);
    let haze = mixed([204.0, 220.0, 200.0], [136.0, 170.0, 136.0], down * 1.6);
    let behind = cloud(seed ^ 0x19, x / 36.0, y / 50.0, 5);
    let pale = mixed([128.0, 164.0, 138.0], [166.0, 192.0, 150.0], fine);
    let haze = mixed(haze, pale, 0.85 * ramp(behind, 0.42, 0.56));
    let foliage = mixed([46.0, 84.0, 62.0], [112.0, 146.0, 84.0], fine);
    let far = mixed(haze, foliage, ramp(clumps, 0.42, 0.62));
    let moss = mixed([48.0, 62.0, 36.0], [118.0, 126.0, 62.0], ramp(clumps, 0.25, 0.75));
    let ground = dimmed(moss, 0.8 + 0.4 * fine);
    let edge = horizon(seed, x);
    mixed(far, ground, ramp(down, edge - 0.02, edge + 0.03))
}

/// A thin hazy trunk that ends at the ground.
fn far_trunk(canvas: &mut Canvas, seed: u64, i: i64) {
    let pick = |what| uniform(seed ^ 0x14, i, what);
    let height = canvas.height as f64;
    let (x0, half) = (pick(0) * canvas.width as f64, 3.0 + 6.0 * pick(1));
    let foot = height * (horizon(seed, x0) + 0.02 + 0.16 * pick(2));
    let tone = mixed([104.0, 112.0, 98.0], [58.0, 54.0, 46.0], pick(2));
    let lean = 0.06 * (pick(3) - 0.5);
    let area = Area { min: [x0 - half - 14.0, 0.0], max: [x0 + half + 14.0, foot] };
    canvas.paint(area, |[x, y]| {
        let side = (x - x0 - lean * (foot - y)) / half;
        let bark = cloud(seed ^ 0x15, x / 3.0, y / 17.0, 2);
        // Grass of uneven height covers the foot.
        let grass = 9.0 * value_noise(seed ^ 0x1a, x / 1.7, 0.5);
        let seen = side.abs() < 1.0 && y < foot - grass;
        seen.then(|| dimmed(tone, 1.0 - 0.3 * side + 0.5 * (bark - 0.5)))
    });
}

fn stone(canvas: &mut Canvas, seed: u64, i: i64) {
    let pick = |what| uniform(seed ^ 0x16, i, what);
    let height = canvas.height as f64;
    let near = pick(1);
    let centre = [pick(0) * canvas.width as f64, height * (0.58 + 0.42 * near)];
    let (wide, high) = ((4.0 + 8.0 * pick(2)) * (0.6 + near), 0.55 + 0.25 * pick(3));
    let tone = mixed([112.0, 116.0, 122.0], [176.0, 168.0, 154.0], pick(4));
    canvas.paint(Area::around(centre, wide), |[x, y]| {
        let (a, b) = ((x - centre[0]) / wide, (y - centre[1]) / (wide * high));
        let speckle = value_noise(seed ^ 0x17, x / 2.0, y / 2.0) - 0.5;
        // Lit from above, with the shadow underneath.
        (a * a + b * b < 1.0).then(|| dimmed(tone, 0.78 - 0.34 * b - 0.12 * a + 0.3 * speckle))
    });
}

fn leaf(canvas: &mut Canvas, seed: u64, i: i64) {
    let pick = |what| uniform(seed ^ 0x18, i, what);
    // More leaves are on the ground than in the air.
    let down = pick(1).sqrt();
    let centre = [pick(0) * canvas.width as f64, down * canvas.height as f64];
    let long = (3.5 + 5.0 * pick(2)) * (0.6 + 0.6 * down);
    let (sin, cos) = (pick(3) * std::f64::consts::TAU).sin_cos();
    let colour = LEAF_COLOURS[(pick(4) * LEAF_COLOURS.len() as f64) as usize];
    let tone = dimmed(colour, 0.7 + 0.45 * pick(5));
    canvas.paint(Area::around(centre, long), |[x, y]| {
        let (dx, dy) = (x - centre[0], y - centre[1]);
        let (along, off) = ((cos * dx + sin * dy) / long, (cos * dy - sin * dx) / long);
        // Two arcs that meet in a point at both ends.
        (off.abs() < 0.45 * (1.0 - along * along)).then(|| {
            let rib = ramp(off.abs(), 0.03, 0.09);
            dimmed(tone, 0.7 + 0.3 * rib + 0.5 * off)
        })
    });
}
