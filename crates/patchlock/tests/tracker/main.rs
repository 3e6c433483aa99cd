//! The tracker as a whole, on rendered scenes with known truth.

use patchlock::{BoundingBox, Error, Estimate, Frame, FrameView, Snapshot, Tracker, TrackerConfig};
use patchlock_scene::{Scene, SceneFrame};

fn config() -> TrackerConfig {
    TrackerConfig { particles: 150, small_step: 4, ..TrackerConfig::preset("paper").unwrap() }
}

fn frame_of(scene: &SceneFrame) -> Frame<'_> {
    Frame::rgb8(&scene.rgb, scene.width, scene.height).unwrap()
}

fn truth(scene: &Scene, k: usize) -> BoundingBox {
    let [x, y, w, h] = scene.truth(k).bbox;
    BoundingBox { x, y, w, h }
}

/// Tracks the first `count` frames of a scene.
fn track(scene: &Scene, config: TrackerConfig, count: usize) -> Vec<Estimate> {
    let mut tracker = Tracker::new(config).unwrap();
    (0..count.min(scene.len()))
        .map(|k| {
            let frame = scene.frame(k);
            match k {
                0 => tracker.init(&frame_of(&frame), truth(scene, 0)).unwrap(),
                _ => tracker.update(&frame_of(&frame)).unwrap(),
            }
        })
        .collect()
}

fn bits(estimates: &[Estimate]) -> Vec<[u64; 4]> {
    let bits = |b: BoundingBox| [b.x, b.y, b.w, b.h].map(f64::to_bits);
    estimates.iter().map(|e| bits(e.bbox)).collect()
}

#[test]
fn it_follows_a_simple_target() {
    let scene = Scene::simple();
    let estimates = track(&scene, config(), scene.len());
    for (k, estimate) in estimates.iter().enumerate() {
        let overlap = estimate.bbox.overlap(&truth(&scene, k));
        assert!(overlap > 0.6, "frame {k}: overlap {overlap}");
        assert!((0.0..=1.0).contains(&estimate.score));
    }
}
