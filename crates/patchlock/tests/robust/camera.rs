//! The camera turns, zooms or pans slowly over a scene in which nothing moves.

use crate::{config, mean};
use patchlock::{BoundingBox, Estimate, Frame, Status, Tracker};
use patchlock_scene::{KeyPose, Scene, SceneConfig, SceneFrame};

/// Width and height of the camera's frames.
const SIZE: [usize; 2] = [320, 240];

/// The target in the scene, relative to the middle of the camera's first frame.
const TARGET: [f64; 2] = [34.0, -22.0];

/// Width and height of the target.
const SIDES: [f64; 2] = [48.0, 40.0];

/// Where the middle of the first frame is in the scene.
const MIDDLE: [f64; 2] = [320.0, 240.0];

/// How the camera sees the scene on a frame.
#[derive(Clone, Copy)]
struct View {
    /// By how much the scene has turned in the frame, in radians, clockwise on screen.
    rotation: f64,
    /// Frame pixels per pixel of the scene.
    scale: f64,
    /// By how much the scene has moved in the frame, in pixels.
    shift: [f64; 2],
}

const FIRST: View = View { rotation: 0.0, scale: 1.0, shift: [0.0; 2] };

impl View {
    /// Where a point of the scene, relative to its middle, is in the frame.
    fn centre(self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.rotation.sin_cos();
        let [dx, dy] = [cos * x - sin * y, sin * x + cos * y].map(|v| v * self.scale);
        [160.0 + self.shift[0] + dx, 120.0 + self.shift[1] + dy]
    }

    /// The frame: the scene between its pixels.
    fn picture(self, scene: &SceneFrame) -> Vec<u8> {
        let (sin, cos) = self.rotation.sin_cos();
        let mut rgb = Vec::with_capacity(3 * SIZE[0] * SIZE[1]);
        for pixel in 0..SIZE[0] * SIZE[1] {
            let [x, y] = [pixel % SIZE[0], pixel / SIZE[0]].map(|v| v as f64);
            let [dx, dy] = [x - 160.0 - self.shift[0], y - 120.0 - self.shift[1]];
            let [u, v] = [cos * dx + sin * dy, cos * dy - sin * dx].map(|v| v / self.scale);
            let [u, v] = [MIDDLE[0] + u, MIDDLE[1] + v];
            let (column, row) = (u.floor() as usize, v.floor() as usize);
            let [fx, fy] = [u - u.floor(), v - v.floor()];
            for colour in 0..3 {
                let at = |dx, dy| {
                    f64::from(scene.rgb[((row + dy) * scene.width + column + dx) * 3 + colour])
                };
                let upper = at(0, 0) + fx * (at(1, 0) - at(0, 0));
                let lower = at(0, 1) + fx * (at(1, 1) - at(0, 1));
                rgb.push((upper + fy * (lower - upper)).round() as u8);
            }
        }
        rgb
    }
}

/// Tracks the target under a camera whose view is `view(k)` on frame `k`.
fn track(frames: usize, view: impl Fn(f64) -> View) -> Vec<(View, Estimate)> {
    let centre = [MIDDLE[0] + TARGET[0], MIDDLE[1] + TARGET[1]];
    let path = vec![KeyPose { frame: 0.0, centre, scale: 1.0, degrees: 0.0 }];
    let (width, height) = (640, 480);
    let config = SceneConfig { width, height, path, target_size: SIDES, ..SceneConfig::simple() };
    let scene = Scene::new(config).frame(0);
    let [x, y] = FIRST.centre(TARGET);
    let bbox =
        BoundingBox { x: x - SIDES[0] / 2.0, y: y - SIDES[1] / 2.0, w: SIDES[0], h: SIDES[1] };
    let start = |picture: &[u8]| {
        Tracker::start(self::config(), &Frame::rgb8(picture, SIZE[0], SIZE[1]).unwrap(), bbox)
    };
    let mut tracker = start(&FIRST.picture(&scene)).unwrap();
    let next = |k: usize| {
        let view = view(k as f64);
        let picture = view.picture(&scene);
        let frame = Frame::rgb8(&picture, SIZE[0], SIZE[1]).unwrap();
        (view, tracker.update(&frame).unwrap().clone())
    };
    (1..frames).map(next).collect()
}

/// How far the centre is off, in pixels.
fn off((view, estimate): &(View, Estimate)) -> f64 {
    let [x, y] = view.centre(TARGET);
    let BoundingBox { x: left, y: top, w, h } = estimate.bbox;
    (left + w / 2.0 - x).hypot(top + h / 2.0 - y)
}

/// How far the outline is off, in degrees.
fn degrees_off((view, estimate): &(View, Estimate)) -> f64 {
    let [[x1, y1], [x2, y2], ..] = estimate.corners;
    let difference = (y2 - y1).atan2(x2 - x1) - view.rotation;
    difference.sin().atan2(difference.cos()).to_degrees().abs()
}

#[test]
fn the_outline_turns_slowly_with_the_camera() {
    // Degrees per frame: that of a drone over a crossing, and the other way.
    for speed in [0.7_f64, -1.0] {
        let view = |k: f64| View { rotation: (speed * k).to_radians(), ..FIRST };
        let tracked = track(180, view);
        for (k, estimate) in tracked.iter().enumerate() {
            assert!(off(estimate) < 6.0, "{speed}, frame {k}: {} pixels", off(estimate));
            let degrees = degrees_off(estimate);
            assert!(degrees < 15.0, "{speed}, frame {k}: {degrees} degrees");
        }
        let degrees: Vec<f64> = tracked.iter().map(degrees_off).collect();
        assert!(mean(&degrees) < 6.0, "{speed}: {} degrees", mean(&degrees));
    }
}

#[test]
fn the_target_is_tracked_while_the_camera_zooms_or_pans() {
    let zoom = |k: f64| View { scale: 1.004_f64.powf(k), ..FIRST };
    let pan = |k: f64| View { shift: [-1.5 * k, 0.5 * k], ..FIRST };
    for (name, tracked) in [("zoom", track(120, zoom)), ("pan", track(80, pan))] {
        for (k, estimate) in tracked.iter().enumerate() {
            assert!(off(estimate) < 5.0, "{name}, frame {k}: {} pixels", off(estimate));
            assert!(degrees_off(estimate) < 1.0, "{name}, frame {k}");
            assert_eq!(estimate.1.status, Status::Tracked, "{name}, frame {k}");
            let size = estimate.1.bbox.w / (SIDES[0] * estimate.0.scale);
            assert!((0.85..1.15).contains(&size), "{name}, frame {k}: {size} of the size");
        }
    }
}
