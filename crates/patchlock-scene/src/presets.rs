//! Ready-made scenes.

use crate::config::{KeyLight, KeyPose, Post, SceneConfig, TargetLook};

impl SceneConfig {
    /// 150 frames of 480 x 360 pixels with all difficulties: the target moves
    /// by up to four pixels per frame, rotates, shrinks and grows, and passes
    /// behind a tree that hides nearly half of it; then the scene becomes dark
    /// and overexposed.
    pub fn demo() -> Self {
        SceneConfig {
            width: 480,
            height: 360,
            frames: 150,
            target_size: [80.0, 64.0],
            target_look: TargetLook::Badge,
            path: vec![
                pose(0.0, [88.0, 236.0], 1.0, 0.0),
                pose(24.0, [122.0, 184.0], 0.8, -12.0),
                pose(54.0, [188.0, 170.0], 0.96, -3.0),
                pose(88.0, [304.0, 192.0], 1.04, 7.0),
                pose(120.0, [366.0, 164.0], 1.3, 12.0),
                pose(149.0, [392.0, 206.0], 1.14, 2.0),
            ],
            post: Some(Post { centre_x: 246.0, width: 36.0 }),
            light: vec![
                light(94.0, 1.0, 0.0),
                light(112.0, 0.55, 6.0),
                light(134.0, 1.25, -4.0),
                light(149.0, 0.95, 0.0),
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
