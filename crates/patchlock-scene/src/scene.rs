//! Scenes: frames and their truth.

use crate::backdrop::backdrop;
use crate::canvas::Canvas;
use crate::config::SceneConfig;
use crate::noise::{bell, hash};
use crate::path::{light_at, pose_at};
use crate::post::trunk;
use crate::target::{Placed, Truth};

/// A short film of a moving target, of which everything is known.
#[derive(Debug, Clone)]
pub struct Scene {
    config: SceneConfig,
    /// What stands still is painted once.
    behind: Canvas,
    in_front: Option<Canvas>,
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
    /// A scene made to measure.
    ///
    /// # Panics
    ///
    /// If the path has no pose, or the frames of the path or of the light do
    /// not rise.
    pub fn new(config: SceneConfig) -> Self {
        assert!(!config.path.is_empty(), "a scene needs at least one pose");
        let rises = config.path.is_sorted_by(|a, b| a.frame < b.frame)
            && config.light.is_sorted_by(|a, b| a.frame < b.frame);
        assert!(rises, "poses and lights must be in rising order of frame");
        let (width, height, seed) = (config.width, config.height, config.seed);
        Scene {
            behind: backdrop(width, height, seed),
            in_front: config.post.map(|post| trunk(width, height, post, seed)),
            config,
        }
    }

    /// The scene of [`SceneConfig::demo`]: every difficulty, one after another.
    pub fn demo() -> Self {
        Self::new(SceneConfig::demo())
    }

    /// The scene of [`SceneConfig::simple`]: small, short and easy.
    pub fn simple() -> Self {
        Self::new(SceneConfig::simple())
    }

    /// The scene of [`SceneConfig::occluded`]: small, with a tree in the way.
    pub fn occluded() -> Self {
        Self::new(SceneConfig::occluded())
    }

    /// What this scene was made from.
    pub fn config(&self) -> &SceneConfig {
        &self.config
    }

    /// Number of frames.
    pub fn len(&self) -> usize {
        self.config.frames
    }

    /// Whether there are no frames at all.
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
        self.target(k)
            .paint_on(&mut canvas, self.config.target_look);
        if let Some(in_front) = &self.in_front {
            canvas.lay_over(in_front);
        }
        SceneFrame {
            width: canvas.width,
            height: canvas.height,
            rgb: self.exposed(&canvas, k),
        }
    }

    /// What is true of the target in frame `k`, counted from 0.
    ///
    /// # Panics
    ///
    /// If there is no such frame.
    pub fn truth(&self, k: usize) -> Truth {
        let post = self.config.post.map(|post| (post, self.config.seed));
        self.target(k).truth(post)
    }

    /// Gain and offset (in grey levels of 255) of the light in frame `k`.
    pub fn light(&self, k: usize) -> (f64, f64) {
        light_at(&self.config.light, k as f64)
    }

    pub(crate) fn target(&self, k: usize) -> Placed {
        assert!(k < self.len(), "frame {k} of a scene of {}", self.len());
        let pose = pose_at(&self.config.path, k as f64);
        Placed::new(self.config.target_size, pose)
    }

    /// The picture a sensor takes: the light, then the noise, then whole levels.
    fn exposed(&self, canvas: &Canvas, k: usize) -> Vec<u8> {
        let (gain, offset) = self.light(k);
        let noise_seed = hash(self.config.seed ^ 0x5e, k as i64, 0);
        let spread = self.config.sensor_noise;
        let mut rgb = Vec::with_capacity(canvas.pixels.len() * 3);
        for (i, pixel) in canvas.pixels.iter().enumerate() {
            for (channel, &colour) in pixel[..3].iter().enumerate() {
                let noise = spread * bell(noise_seed, i as i64, channel as i64);
                let level = gain * f64::from(colour) + offset + noise;
                rgb.push(level.round().clamp(0.0, 255.0) as u8);
            }
        }
        rgb
    }
}
