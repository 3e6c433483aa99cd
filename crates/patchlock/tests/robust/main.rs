//! The method `robust` on rendered scenes: what it says when the target disappears, returns, turns or is
//! partly hidden.

mod absences;
mod hidden_side;
mod turn;

use patchlock::{BoundingBox, Estimate, Frame, Tracker, TrackerConfig};
use patchlock_scene::Scene;
use std::ops::Range;

/// The settings under test.
fn config() -> TrackerConfig {
    TrackerConfig::preset("robust").unwrap()
}

/// The true box of a frame.
fn truth(scene: &Scene, k: usize) -> BoundingBox {
    let [x, y, w, h] = scene.truth(k).bbox;
    BoundingBox { x, y, w, h }
}

/// Begins with the true box of the first of these frames; returns the others with their estimates.
fn track(scene: &Scene, frames: Range<usize>, config: TrackerConfig) -> Vec<(usize, Estimate)> {
    let mut tracker = Tracker::new(config).unwrap();
    let mut estimates = Vec::new();
    for k in frames.clone() {
        let rendered = scene.frame(k);
        let frame = Frame::rgb8(&rendered.rgb, rendered.width, rendered.height).unwrap();
        if k == frames.start {
            tracker.init(&frame, truth(scene, k)).unwrap();
        } else {
            estimates.push((k, tracker.update(&frame).unwrap()));
        }
    }
    estimates
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
