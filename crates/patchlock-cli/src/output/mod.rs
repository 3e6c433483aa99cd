//! Output of results: tables, the annotated video, the summary. Files are written completely or not
//! at all.

pub mod background_sink;
pub mod draw;
#[cfg(test)]
pub(crate) mod example;
pub(crate) mod gif;
pub(crate) mod inputs;
pub(crate) mod measurements;
pub(crate) mod panels;
pub mod partial_files;
pub mod pending;
pub(crate) mod printed;
pub(crate) mod row;
pub(crate) mod strip;
pub(crate) mod summary;
pub(crate) mod tables;
pub(crate) mod text_table;
pub mod video;
pub mod view;

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::Result;
use patchlock::{BoundingBox, Estimate, Point};
use patchlock_media::Picture;

/// One target in one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct TargetResult {
    /// The target's id; `None` if the run has a single target.
    pub id: Option<u64>,
    /// The name that the user has given instead of a number.
    pub name: Option<Arc<str>>,
    /// The box: the given one in the frame where the target starts, the tracked one in later
    /// frames.
    pub bbox: BoundingBox,
    /// The tracker's estimate.
    pub estimate: Estimate,
}

impl TargetResult {
    /// The target in a part of the frame that begins here and is enlarged. Boxes cover whole pixels,
    /// while corners are points, and pixel centres are at whole numbers.
    pub fn placed(&self, [left, top]: [f64; 2], by: f64) -> Self {
        let mut target = self.clone();
        let Estimate { bbox, corners, .. } = &mut target.estimate;
        for bbox in [&mut target.bbox, bbox] {
            let BoundingBox { x, y, w, h } = *bbox;
            *bbox = BoundingBox { x: (x - left) * by, y: (y - top) * by, w: w * by, h: h * by };
        }
        *corners = corners.map(|[x, y]: Point| [x - left, y - top].map(|at| (at + 0.5) * by - 0.5));
        target
    }
}

/// A tracked frame with its results.
pub struct TrackedFrame<'a> {
    /// Number of the frame in the source.
    pub frame: usize,
    /// Milliseconds that the tracker took for the frame, all targets together.
    pub ms: f64,
    /// The targets in this frame.
    pub targets: &'a [TargetResult],
    /// The pixels of the frame.
    pub picture: &'a Arc<Picture>,
}

/// An output that receives tracked frames one by one.
pub trait Sink {
    /// Writes one frame.
    fn write(&mut self, tracked: &TrackedFrame<'_>) -> Result<()>;

    /// Completes the output and moves it into place; returns the path if it is a file.
    fn finish(self: Box<Self>) -> Result<Option<PathBuf>>;
}
