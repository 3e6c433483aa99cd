//! What a scene is made of.

/// Everything that decides how a scene looks, frame by frame.
///
/// Start from one of the presets ([`SceneConfig::demo`],
/// [`SceneConfig::simple`], [`SceneConfig::occluded`]) and change what matters.
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
    pub target_look: TargetLook,
    /// Poses the target goes through, in rising order of frame; at least one.
    ///
    /// Between two of them the target moves smoothly and never beyond either;
    /// before the first and after the last it stands still.
    pub path: Vec<KeyPose>,
    /// The tree trunk in front of the target, if there is one.
    pub post: Option<Post>,
    /// Lights the scene goes through, in rising order of frame; none means an
    /// unchanging gain of 1 and offset of 0. Interpolated like `path`.
    pub light: Vec<KeyLight>,
    /// Standard deviation of the sensor noise, in grey levels of 255.
    pub sensor_noise: f64,
    /// Chooses the backdrop, the bark and the sensor noise.
    pub seed: u64,
}

/// What is drawn on the target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TargetLook {
    /// A picture card: a boat before mountains, different in every corner.
    Badge,
    /// One colour (red, green, blue), for exact measurements.
    Flat([u8; 3]),
}

/// Where the target is at one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KeyPose {
    /// The frame this pose belongs to; may lie between or beyond the frames.
    pub frame: f64,
    /// Centre of the target, x and y in pixels.
    pub centre: [f64; 2],
    /// Size relative to [`SceneConfig::target_size`].
    pub scale: f64,
    /// Turn in degrees, clockwise as seen on the screen.
    pub degrees: f64,
}

/// An upright tree trunk from the top to the bottom of the frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Post {
    /// Where its middle line is, in pixels.
    pub centre_x: f64,
    /// How wide it is, in pixels; its edges waver by a few percent of this.
    pub width: f64,
}

/// The light at one frame: a pixel becomes `gain * pixel + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KeyLight {
    /// The frame this light belongs to; may lie between or beyond the frames.
    pub frame: f64,
    /// Factor on every colour.
    pub gain: f64,
    /// Grey levels (of 255) added to every colour.
    pub offset: f64,
}
