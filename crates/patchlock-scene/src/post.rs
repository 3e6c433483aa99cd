//! The birch trunk behind which the target passes.

use crate::canvas::{Area, Canvas, Colour, dimmed, mixed, ramp};
use crate::config::Post;
use crate::noise::{cloud, value_noise};

const BARK: Colour = [226.0, 218.0, 204.0];
const SHADED_BARK: Colour = [122.0, 112.0, 108.0];
const SCAR: Colour = [42.0, 36.0, 34.0];

impl Post {
    /// The edges wave by at most this share of half the width.
    pub(crate) const WAVER: f64 = 0.08;
}

/// Position of a point across the trunk: -1 at the left edge, 1 at the right.
fn across(post: Post, seed: u64, [x, y]: [f64; 2]) -> f64 {
    let half = post.width / 2.0;
    let waver = 2.0 * Post::WAVER * (value_noise(seed ^ 0xb1, y / 46.0, 0.5) - 0.5);
    (x - post.centre_x) / half - waver
}

/// Whether the trunk is in front of a point.
pub(crate) fn covers(post: Post, seed: u64, point: [f64; 2]) -> bool {
    across(post, seed, point).abs() <= 1.0
}

/// A layer with only the trunk.
pub(crate) fn trunk(width: usize, height: usize, post: Post, seed: u64) -> Canvas {
    let mut canvas = Canvas::clear(width, height);
    let area = Area {
        min: [post.centre_x - 0.6 * post.width, 0.0],
        max: [post.centre_x + 0.6 * post.width, height as f64],
    };
    canvas.paint(area, |point| {
        let side = across(post, seed, point);
        (side.abs() <= 1.0).then(|| bark(seed, side, point))
    });
    canvas
}

fn bark(seed: u64, side: f64, [x, y]: [f64; 2]) -> Colour {
    // Light comes from the upper left, so the shading is off centre.
    let round = ramp((side + 0.25).abs(), 0.2, 1.3);
    let peeling = cloud(seed ^ 0xb2, x / 30.0, y / 5.0, 3);
    let base = mixed(BARK, SHADED_BARK, round);
    let base = dimmed(base, 0.86 + 0.26 * peeling);
    // Birch scars are short dark dashes: noise much longer across than down.
    let bent = y + 3.0 * side * side;
    let dashes = ramp(cloud(seed ^ 0xb3, x / 15.0, bent / 3.6, 2), 0.66, 0.74);
    let knots = ramp(cloud(seed ^ 0xb4, x / 18.0, bent / 15.0, 3), 0.64, 0.7);
    mixed(base, SCAR, (0.85 * dashes).max(0.92 * knots))
}
