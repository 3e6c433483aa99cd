//! The target turns in the frame, or does not.

use crate::{config, mean, track};
use patchlock::{Estimate, Status};
use patchlock_scene::{Absences, KeyPose, Scene, SceneConfig};

/// Degrees per frame. Half as fast, rotation is partly learnt instead of followed.
const SPEEDS: [f64; 2] = [2.0, -4.0];

/// The outline is never off by so many degrees: a rotation counts from 10 degrees on
/// (`rotation_least`), and the target turns on until it is believed.
const MOST_OFF: f64 = 15.0;

/// The mean over the frames, half of which are without rotation: half of what counts as a rotation.
const MEAN_OFF: f64 = 5.0;

/// A target that does not turn is not turned by this many degrees: while none is known, no smaller
/// rotation than 10 degrees counts, so the outline stays upright.
const UPRIGHT: f64 = 1.0;

/// Frames before the target turns, and after.
const STILL: usize = 20;

/// A target that turns by this many degrees, at this many degrees per frame; to the left if that is
/// negative.
fn turning(degrees: f64, speed: f64) -> Scene {
    let turns = (degrees / speed.abs()).round();
    let degrees = degrees * speed.signum();
    let pose = |frame: f64, x: f64, degrees: f64| KeyPose {
        frame,
        centre: [x, 90.0],
        scale: 1.0,
        degrees,
    };
    let (begin, end) = (STILL as f64, STILL as f64 + turns);
    let last = end + STILL as f64;
    let path = vec![
        pose(0.0, 90.0, 0.0),
        pose(begin, 110.0, 0.0),
        pose(end, 130.0, degrees),
        pose(last, 150.0, degrees),
    ];
    Scene::new(SceneConfig { frames: last as usize + 1, path, ..SceneConfig::simple() })
}

/// How far the upper side is turned, in degrees, clockwise.
fn degrees(estimate: &Estimate) -> f64 {
    let [[x1, y1], [x2, y2], ..] = estimate.corners;
    (y2 - y1).atan2(x2 - x1).to_degrees()
}

#[test]
fn the_outline_turns_with_the_target() {
    for speed in SPEEDS {
        let scene = turning(60.0, speed);
        let off = |(k, estimate): &(usize, Estimate)| {
            (degrees(estimate) - scene.truth(*k).rotation.to_degrees()).abs()
        };
        let estimates = track(&scene, 0..scene.len(), config());
        let all: Vec<f64> = estimates.iter().map(off).collect();
        for ((k, estimate), off) in estimates.iter().zip(&all) {
            assert!(*off < MOST_OFF, "{speed} degrees per frame, frame {k}: off by {off}");
            assert_ne!(estimate.status, Status::Lost, "{speed} degrees per frame, frame {k}");
        }
        assert!(mean(&all) < MEAN_OFF, "{speed} degrees per frame: off by {}", mean(&all));
    }
}

#[test]
fn nothing_is_lost_and_nothing_turns_where_nothing_does() {
    let scene = Scene::new(SceneConfig::long(150, Absences::Never, 0.0, 1));
    for (k, estimate) in track(&scene, 0..scene.len(), config()) {
        let turned = degrees(&estimate).abs();
        assert!(turned < UPRIGHT, "frame {k}: {turned} degrees");
        assert_eq!(estimate.status, Status::Tracked, "frame {k}");
    }
}

#[test]
fn the_outline_stays_upright_if_rotation_is_not_followed() {
    let mut upright = config();
    upright.set("rotate", false).unwrap();
    let scene = turning(60.0, 4.0);
    for (k, estimate) in track(&scene, 0..scene.len(), upright) {
        assert_eq!(degrees(&estimate), 0.0, "frame {k}");
    }
}
