//! The method `robust` on rendered scenes: what it says when the target disappears, returns, turns
//! or is partly hidden.

mod absences;
mod camera;
mod hidden_side;
mod turn;

use patchlock::{BoundingBox, Estimate, Frame, Preset, Tracker, TrackerConfig};
use patchlock_scene::{Scene, SceneFrame};
use std::ops::Range;

/// The settings under test.
fn config() -> TrackerConfig {
    TrackerConfig::from(Preset::Robust)
}

/// The true box of a frame.
fn truth(scene: &Scene, k: usize) -> BoundingBox {
    let [x, y, w, h] = scene.truth(k).bbox;
    BoundingBox { x, y, w, h }
}

/// Begins with the true box of the first of these frames; returns the others with their estimates.
fn track(scene: &Scene, frames: Range<usize>, config: TrackerConfig) -> Vec<(usize, Estimate)> {
    let first = scene.frame(frames.start);
    let mut tracker = Tracker::start(config, &view(&first), truth(scene, frames.start)).unwrap();
    let next = |k| (k, tracker.update(&view(&scene.frame(k))).unwrap().clone());
    (frames.start + 1..frames.end).map(next).collect()
}

fn view(frame: &SceneFrame) -> Frame<'_> {
    Frame::rgb8(&frame.rgb, frame.width, frame.height).unwrap()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
