//! Rendered sequences, and trackers that run on them.

use patchlock::{BoundingBox, Estimate, Frame, Tracker, TrackerConfig};
use patchlock_scene::{Scene, SceneFrame};
use std::ops::Range;
use std::sync::LazyLock;

/// 40 frames of a target that moves slowly and grows slightly.
pub static SIMPLE: LazyLock<Sequence> = LazyLock::new(|| Sequence::new(Scene::simple()));

/// 60 frames in which a tree occludes half of the target.
pub static OCCLUDED: LazyLock<Sequence> = LazyLock::new(|| Sequence::new(Scene::occluded()));

/// The rendered frames of a scene.
pub struct Sequence {
    scene: Scene,
    frames: Vec<SceneFrame>,
}

impl Sequence {
    pub fn new(scene: Scene) -> Self {
        let frames = (0..scene.len()).map(|k| scene.frame(k)).collect();
        Self { scene, frames }
    }

    pub fn len(&self) -> usize {
        self.frames.len()
    }

    pub fn width(&self) -> usize {
        self.frames[0].width
    }

    pub fn height(&self) -> usize {
        self.frames[0].height
    }

    pub fn frame(&self, k: usize) -> Frame<'_> {
        let frame = &self.frames[k];
        Frame::rgb8(&frame.rgb, frame.width, frame.height).unwrap()
    }

    pub fn rgb(&self, k: usize) -> &[u8] {
        &self.frames[k].rgb
    }

    pub fn truth(&self, k: usize) -> BoundingBox {
        let [x, y, w, h] = self.scene.truth(k).bbox;
        BoundingBox { x, y, w, h }
    }

    /// A tracker that starts on the true box of frame `k`.
    pub fn begin(&self, config: &TrackerConfig, k: usize) -> Tracker {
        Tracker::start(config.clone(), &self.frame(k), self.truth(k)).unwrap()
    }

    /// Continues tracking over these frames.
    pub fn resume(&self, tracker: &mut Tracker, frames: Range<usize>) -> Vec<Estimate> {
        frames.map(|k| tracker.update(&self.frame(k)).unwrap().clone()).collect()
    }

    /// Begins on the first of these frames; returns the estimates of the others.
    pub fn track(&self, config: &TrackerConfig, frames: Range<usize>) -> Vec<Estimate> {
        let mut tracker = self.begin(config, frames.start);
        self.resume(&mut tracker, frames.start + 1..frames.end)
    }
}

/// Every number of the estimates, bit for bit.
pub fn bits(estimates: &[Estimate]) -> Vec<Vec<u64>> {
    estimates.iter().map(|e| numbers(e).into_iter().map(f64::to_bits).collect()).collect()
}

pub fn numbers(estimate: &Estimate) -> Vec<f64> {
    let Estimate { bbox, corners, score, visibility, .. } = estimate;
    let mut all = vec![bbox.x, bbox.y, bbox.w, bbox.h];
    all.extend(corners.as_flattened());
    all.push(*score);
    all.extend(visibility.iter().flat_map(|v| [v.large.share(), v.small.share()]));
    all
}
