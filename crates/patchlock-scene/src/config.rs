//! The configuration of a scene.

/// Everything that determines the frames of a scene.
///
/// Start from one of the presets ([`SceneConfig::demo`],
/// [`SceneConfig::simple`], [`SceneConfig::occluded`], [`SceneConfig::long`])
/// and change fields.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneConfig {
    /// Width of a frame in pixels.
    pub width: usize,
    /// Height of a frame in pixels.
    pub height: usize,
    /// Number of frames.
    pub frames: usize,
    /// Width and height of the target at scale 1, in pixels.
    pub target_size: [f64; 2],
    /// What is drawn on the target.
    pub target_texture: TargetTexture,
    /// Key poses of the target, in increasing order of frame; at least one.
    ///
    /// Between two poses the target moves smoothly without overshooting; before
    /// the first and after the last it stands still.
    pub path: Vec<KeyPose>,
    /// The tree trunk in front of the target, if any.
    pub post: Option<Post>,
    /// Key lights, in increasing order of frame, interpolated like `path`. If
    /// empty, the gain is 1 and the offset 0.
    pub light: Vec<KeyLight>,
    /// Standard deviation of the sensor noise, in grey levels (0 to 255).
    pub sensor_noise: f64,
    /// Seed of the backdrop, the bark and the sensor noise.
    pub seed: u64,
}

/// What is drawn on the target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TargetTexture {
    /// A picture card: a boat in front of mountains, with no symmetry.
    Badge,
    /// A single colour (red, green, blue), for exact measurements.
    Flat([u8; 3]),
}

/// The pose of the target at one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KeyPose {
    /// The frame of this pose; may be fractional or outside the scene.
    pub frame: f64,
    /// Centre of the target, x and y in pixels.
    pub centre: [f64; 2],
    /// Size relative to [`SceneConfig::target_size`].
    pub scale: f64,
    /// Rotation in degrees, clockwise as seen on the screen.
    pub degrees: f64,
}

/// An upright tree trunk from the top to the bottom of the frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Post {
    /// Position of its centre line, in pixels.
    pub centre_x: f64,
    /// Width in pixels; the edges are wavy by a few percent of it.
    pub width: f64,
}

/// The light at one frame: a pixel becomes `gain * pixel + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KeyLight {
    /// The frame of this light; may be fractional or outside the scene.
    pub frame: f64,
    /// Factor for every channel.
    pub gain: f64,
    /// Grey levels (0 to 255) added to every channel.
    pub offset: f64,
}
