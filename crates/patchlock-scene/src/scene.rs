//! Scenes: frames and their truth.

use std::sync::OnceLock;

use crate::backdrop::backdrop;
use crate::canvas::Canvas;
use crate::config::SceneConfig;
use crate::noise::{bell, hash};
use crate::path::{light_at, pose_at};
use crate::post::trunk;
use crate::target::{PosedTarget, Truth};

/// A short video of a moving target with exact truth.
#[derive(Debug, Clone)]
pub struct Scene {
    config: SceneConfig,
    /// Static layers are painted once.
    behind: Canvas,
    in_front: Option<Canvas>,
    /// Computed when they are first asked for.
    truths: Vec<OnceLock<Truth>>,
}

/// One rendered picture.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SceneFrame {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Red, green and blue of every pixel, row by row from the top left.
    pub rgb: Vec<u8>,
}

impl Scene {
    /// A scene with this configuration.
    ///
    /// # Panics
    ///
    /// If the path has no pose, or the frames of the path or of the light are
    /// not in increasing order.
    pub fn new(config: SceneConfig) -> Self {
        assert!(!config.path.is_empty(), "a scene needs at least one pose");
        let sorted = config.path.is_sorted_by(|a, b| a.frame < b.frame)
            && config.light.is_sorted_by(|a, b| a.frame < b.frame);
        assert!(sorted, "poses and lights must be in increasing order of frame");
        let (width, height, seed) = (config.width, config.height, config.seed);
        Scene {
            behind: backdrop(width, height, seed),
            in_front: config.post.map(|post| trunk(width, height, post, seed)),
            truths: vec![OnceLock::new(); config.frames],
            config,
        }
    }

    /// The scene of [`SceneConfig::demo`]: all difficulties, one after another.
    pub fn demo() -> Self {
        Self::new(SceneConfig::demo())
    }

    /// The scene of [`SceneConfig::simple`]: small, short and easy.
    pub fn simple() -> Self {
        Self::new(SceneConfig::simple())
    }

    /// The scene of [`SceneConfig::occluded`]: small, with occlusion by a tree.
    pub fn occluded() -> Self {
        Self::new(SceneConfig::occluded())
    }

    /// The configuration of this scene.
    pub fn config(&self) -> &SceneConfig {
        &self.config
    }

    /// Number of frames.
    pub fn len(&self) -> usize {
        self.config.frames
    }

    /// Whether the scene has no frames.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Renders frame `k`, counted from 0.
    ///
    /// # Panics
    ///
    /// If there is no such frame.
    pub fn frame(&self, k: usize) -> SceneFrame {
        let mut canvas = self.behind.clone();
        self.target(k).paint_on(&mut canvas, self.config.target_texture);
        if let Some(in_front) = &self.in_front {
            canvas.lay_over(in_front);
        }
        SceneFrame { width: canvas.width, height: canvas.height, rgb: self.exposed(&canvas, k) }
    }

    /// The truth of the target in frame `k`, counted from 0.
    ///
    /// # Panics
    ///
    /// If there is no such frame.
    pub fn truth(&self, k: usize) -> Truth {
        let target = self.target(k);
        *self.truths[k].get_or_init(|| {
            let post = self.config.post.map(|post| (post, self.config.seed));
            target.truth([self.config.width, self.config.height], post)
        })
    }

    /// Gain and offset (in grey levels, 0 to 255) of the light in frame `k`.
    pub fn light(&self, k: usize) -> (f64, f64) {
        light_at(&self.config.light, k as f64)
    }

    fn target(&self, k: usize) -> PosedTarget {
        assert!(k < self.len(), "frame {k} of a scene of {} frames", self.len());
        let pose = pose_at(&self.config.path, k as f64);
        PosedTarget::new(self.config.target_size, pose)
    }

    /// Applies light and noise, then rounds to whole grey levels, like a sensor.
    fn exposed(&self, canvas: &Canvas, k: usize) -> Vec<u8> {
        let (gain, offset) = self.light(k);
        let noise_seed = hash(self.config.seed ^ 0x5e, k as i64, 0);
        let spread = self.config.sensor_noise;
        let mut rgb = Vec::with_capacity(canvas.pixels.len() * 3);
        for (i, pixel) in canvas.pixels.iter().enumerate() {
            for (channel, &colour) in pixel[..3].iter().enumerate() {
                let noise = spread * bell(noise_seed, i as i64, channel as i64);
                let level = gain * f64::from(colour) + offset + noise;
                // `round` would be a call of a function for each sample.
                rgb.push((level.clamp(0.0, 255.0) + 0.5) as u8);
            }
        }
        rgb
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::badge::badge;
    use crate::config::KeyPose;

    /// Mean colour of the badge over the square of a pixel, computed only from
    /// the corners; `None` near the border, where the backdrop contributes.
    fn badge_over_pixel(truth: &Truth, [x, y]: [f64; 2]) -> Option<[f64; 3]> {
        let [tl, tr, _, bl] = truth.corners;
        let along = |end: [f64; 2], [px, py]: [f64; 2]| {
            let (ex, ey) = (end[0] - tl[0], end[1] - tl[1]);
            ((px - tl[0]) * ex + (py - tl[1]) * ey) / (ex * ex + ey * ey)
        };
        let mut sum = [0.0; 3];
        for i in 0..64 {
            let offset = [i % 8, i / 8].map(|n| (f64::from(n) - 3.5) / 8.0);
            let point = [x + offset[0], y + offset[1]];
            let place = [along(tr, point), along(bl, point)];
            if place.iter().any(|p| !(0.06..0.94).contains(p)) {
                return None;
            }
            let colour = badge(place);
            sum = std::array::from_fn(|c| sum[c] + f64::from(colour[c]) / 64.0);
        }
        Some(sum)
    }

    /// Fails for a mirrored, shifted or incorrectly rotated badge.
    #[test]
    fn rendered_pixels_show_the_badge_where_the_corners_say() {
        let scene = Scene::new(SceneConfig {
            path: vec![KeyPose { frame: 0.0, centre: [117.3, 88.8], scale: 1.7, degrees: 21.0 }],
            sensor_noise: 0.0,
            ..SceneConfig::simple()
        });
        let (frame, truth) = (scene.frame(0), scene.truth(0));
        let mean_error = |shift: f64| {
            let mut errors = Vec::new();
            for (i, rgb) in frame.rgb.chunks(3).enumerate() {
                let (x, y) = ((i % frame.width) as f64, (i / frame.width) as f64);
                if let Some(colour) = badge_over_pixel(&truth, [x + shift, y]) {
                    errors.extend((0..3).map(|c| (f64::from(rgb[c]) - colour[c]).abs()));
                }
            }
            assert!(errors.len() > 5000, "{}", errors.len());
            errors.iter().sum::<f64>() / errors.len() as f64
        };
        // The remaining error is due to the renderer's small number of samples.
        let error = mean_error(0.0);
        assert!(error < 2.0, "{error}");
        assert!(mean_error(0.5) > 3.0 * error && mean_error(-0.5) > 3.0 * error);
    }
}
