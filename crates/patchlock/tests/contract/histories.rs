//! Frames on which nothing can be told apart: boxes stay near the frame, and a snapshot holds what was reached.
//! Random configurations, frames and calls are the surface `library` of patchlock-fuzz.

use crate::methods::{paper, robust};
use patchlock::{BoundingBox, Frame, Snapshot, Tracker, TrackerConfig};

const WIDTH: usize = 48;
const HEIGHT: usize = 40;
const BOX: BoundingBox = BoundingBox { x: 9.6, y: 8.0, w: 24.0, h: 20.0 };

/// Tracks through grey frames of these samples. After each, a tracker that is restored from text goes on alike.
fn follow(config: &TrackerConfig, frames: &[Vec<u8>]) {
    let mut tracker = Tracker::start(config.clone(), &frame(&frames[0]), BOX).unwrap();
    for samples in &frames[1..] {
        let text = serde_json::to_string(&tracker.snapshot()).unwrap();
        let read: Snapshot = serde_json::from_str(&text).unwrap();
        assert_eq!(read, tracker.snapshot());
        let mut twin = Tracker::restore(read).unwrap();
        let estimate = tracker.update(&frame(samples)).unwrap().clone();
        assert_eq!(twin.update(&frame(samples)).unwrap(), &estimate);
        assert_eq!(twin.snapshot(), tracker.snapshot());
        assert!((0.0..=1.0).contains(&estimate.score), "{}", estimate.score);
        let BoundingBox { w, h, .. } = estimate.bbox;
        let [x, y] = estimate.bbox.centre();
        let most = 1.001 * 10.0 * WIDTH.max(HEIGHT) as f64;
        assert!(
            w > 0.0 && h > 0.0 && w.max(h).max(x.abs()).max(y.abs()) <= most,
            "{:?}",
            estimate.bbox
        );
    }
}

fn frame(samples: &[u8]) -> Frame<'_> {
    Frame::grey8(samples, WIDTH, HEIGHT).unwrap()
}

fn flat(value: u8) -> Vec<u8> {
    vec![value; WIDTH * HEIGHT]
}

/// Where nothing tells the candidates apart, their spread alone moves the box.
#[test]
fn boxes_on_flat_frames_stay_near_the_frame() {
    let mut config = paper();
    for (name, value) in
        [("sigma_scale", 10.0), ("sigma_aspect", 10.0), ("sigma_x", 1000.0), ("sigma_y", 1000.0)]
    {
        config.set(name, value).unwrap();
    }
    config.set("particles", 10).unwrap();
    config.set("update_interval", 2).unwrap();
    config.set("small_update_interval", 3).unwrap();
    follow(&config, &vec![flat(90); 200]);
}

/// The memory of a target without texture does not respond at all.
#[test]
fn a_target_without_texture_has_a_score_and_a_snapshot() {
    let noise = (0..(WIDTH * HEIGHT) as u64)
        .map(|k| (4 ^ k).wrapping_mul(0x9E37_79B9_7F4A_7C15).to_be_bytes()[1]);
    let noise: Vec<u8> = noise.collect();
    for first in [0, 255] {
        follow(&robust(), &[flat(first), flat(128), flat(first), flat(3), noise.clone()]);
    }
}
