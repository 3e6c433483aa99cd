//! What tracking needs of a video: the stretches that a request means ([`plan`]), and the comparison
//! of a frame with the nearest key frame ([`look`]).

pub mod look;
pub mod plan;

use std::path::PathBuf;
use std::sync::Arc;

use patchlock::TrackerConfig;
use patchlock_media::{FrameSource, Limits};
use rayon::ThreadPool;

/// What all videos share.
#[derive(Clone)]
pub struct Settings {
    /// The settings of the tracker.
    pub config: TrackerConfig,
    /// The threads of the tracker.
    pub pool: Arc<ThreadPool>,
    /// What a video may claim.
    pub limits: Limits,
}

/// What a tracker needs to know of a video.
pub struct Engine {
    /// The video, as [`patchlock_media::open`] takes it.
    pub video: PathBuf,
    pub settings: Settings,
}

impl Engine {
    /// Opens the video, to read it forward or backward.
    pub fn open(&self, backward: bool) -> Result<Box<dyn FrameSource>, patchlock_media::Error> {
        patchlock_media::open_within(&self.video, backward, self.settings.limits)
    }
}
