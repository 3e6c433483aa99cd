//! What all requests share.

use std::path::PathBuf;
use std::sync::Arc;

use patchlock::TrackerConfig;
use patchlock_media::Limits;
use rayon::ThreadPool;

use super::access::Access;
use super::camera::Recordings;
use super::clips::Clips;
use super::code::OneTimeCode;
use super::timeouts::Timeouts;

/// What all clips share.
#[derive(Clone)]
pub struct Settings {
    /// The settings of the tracker.
    pub config: TrackerConfig,
    /// The threads of the tracker.
    pub pool: Arc<ThreadPool>,
    /// What a video may claim.
    pub limits: Limits,
}

/// The state of a server.
pub struct App {
    /// What requests are checked against.
    pub access: Arc<Access>,
    /// The file that has the token.
    pub token_file: Option<PathBuf>,
    /// The code in the address of the browser.
    pub code: OneTimeCode,
    /// All clips.
    pub clips: Clips,
    /// What all clips share.
    pub settings: Settings,
    /// How long to wait for a client.
    pub timeouts: Timeouts,
    /// Most connections at once that have not shown the token.
    pub strangers: usize,
    /// The folder for uploads and recordings.
    pub uploads: PathBuf,
    /// Largest upload in bytes.
    pub upload_bytes: u64,
    /// Whether the page begins with the camera.
    pub camera: bool,
    /// What the camera of the page has recorded.
    pub recordings: Recordings,
}
