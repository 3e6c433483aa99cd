//! Ready-made scenes.

use crate::config::{KeyLight, KeyPose, Post, SceneConfig, TargetTexture};

impl SceneConfig {
    /// 210 frames of 480 x 360 pixels with all difficulties: the target moves
    /// by up to five pixels per frame, turns to the left and back, passes
    /// behind a tree that hides it completely for more than 20 frames, turns
    /// to the right and grows; meanwhile the scene becomes dark and
    /// overexposed.
    pub fn demo() -> Self {
        SceneConfig {
            width: 480,
            height: 360,
            frames: 210,
            target_size: [80.0, 64.0],
            target_texture: TargetTexture::Badge,
            path: vec![
                pose(0.0, [88.0, 236.0], 1.0, 0.0),
                pose(16.0, [92.0, 214.0], 1.0, 0.0),
                pose(30.0, [100.0, 194.0], 0.95, -36.0),
                pose(40.0, [112.0, 186.0], 0.9, -36.0),
                pose(54.0, [140.0, 182.0], 0.85, 0.0),
                pose(66.0, [174.0, 186.0], 0.8, 0.0),
                pose(96.0, [250.0, 198.0], 0.8, 0.0),
                pose(120.0, [256.0, 206.0], 0.8, 0.0),
                pose(150.0, [338.0, 186.0], 0.9, 0.0),
                pose(166.0, [366.0, 166.0], 1.05, 32.0),
                pose(184.0, [388.0, 156.0], 1.2, 32.0),
                pose(209.0, [380.0, 206.0], 1.1, 32.0),
            ],
            post: Some(Post { centre_x: 253.0, width: 90.0 }),
            light: vec![
                light(154.0, 1.0, 0.0),
                light(172.0, 0.55, 6.0),
                light(194.0, 1.25, -4.0),
                light(209.0, 0.95, 0.0),
            ],
            sensor_noise: 2.0,
            seed: 7,
        }
    }

    /// 40 frames of 240 x 180 pixels with only slow motion and slight growth.
    pub fn simple() -> Self {
        SceneConfig {
            width: 240,
            height: 180,
            frames: 40,
            target_size: [48.0, 40.0],
            path: vec![
                pose(0.0, [70.0, 78.0], 1.0, 0.0),
                pose(20.0, [104.0, 92.0], 1.06, 0.0),
                pose(39.0, [146.0, 96.0], 1.12, 0.0),
            ],
            post: None,
            light: Vec::new(),
            ..Self::demo()
        }
    }

    /// 60 frames of 240 x 180 pixels in which a tree hides half of the target.
    pub fn occluded() -> Self {
        SceneConfig {
            frames: 60,
            path: vec![pose(0.0, [56.0, 84.0], 1.0, 0.0), pose(59.0, [184.0, 98.0], 1.0, 0.0)],
            post: Some(Post { centre_x: 120.0, width: 25.0 }),
            ..Self::simple()
        }
    }
}

fn pose(frame: f64, centre: [f64; 2], scale: f64, degrees: f64) -> KeyPose {
    KeyPose { frame, centre, scale, degrees }
}

fn light(frame: f64, gain: f64, offset: f64) -> KeyLight {
    KeyLight { frame, gain, offset }
}
