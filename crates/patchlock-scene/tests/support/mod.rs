//! What tests of the truth measure.

use patchlock_scene::{Scene, SceneConfig, TargetTexture, Truth};

/// How much of each pixel the target covers, measured from two renderings
/// that differ only in the red of the target.
pub fn coverage(config: &SceneConfig, k: usize) -> Vec<f64> {
    let with = |red| {
        let config = SceneConfig {
            target_texture: TargetTexture::Flat([red, 90, 90]),
            light: Vec::new(),
            sensor_noise: 0.0,
            ..config.clone()
        };
        Scene::new(config).frame(k)
    };
    let (bright, dark) = (with(255), with(0));
    let reds = bright.rgb.iter().zip(&dark.rgb).step_by(3);
    reds.map(|(&a, &b)| (f64::from(a) - f64::from(b)) / 255.0).collect()
}

pub fn box_centre(truth: &Truth) -> [f64; 2] {
    let [x, y, w, h] = truth.bbox;
    [x + (w - 1.0) / 2.0, y + (h - 1.0) / 2.0]
}

pub fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// The area that is missing because of the rounded corners.
pub fn rounding(truth: &Truth) -> f64 {
    let [_, _, w, h] = truth.bbox;
    let radius = 0.13 * w.min(h);
    (4.0 - std::f64::consts::PI) * radius * radius
}
