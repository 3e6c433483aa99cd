//! Saved trackers: one version for [`Tracker`](crate::Tracker) and
//! [`MultiTracker`](crate::MultiTracker), of any method.

use crate::Error;
use crate::config::TrackerConfig;
use crate::error;
use crate::estimate::Estimate;
use crate::network::Network;
use crate::target::SavedTarget;
use crate::target_id::TargetId;
use crate::vision::frame::FrameSize;
use serde::{Deserialize, Serialize};

/// The version of the saved form; raised when the meaning of its fields changes.
const VERSION: u32 = 11;

/// The state of a [`Tracker`](crate::Tracker) between two frames.
///
/// Serialise it with a self-describing `serde` format that keeps floats exact and has 128-bit
/// integers, such as JSON text (with `serde_json`'s feature `float_roundtrip`), or MessagePack with
/// the names of fields, which is a third as large.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Snapshot {
    version: Version,
    config: TrackerConfig,
    frame_size: FrameSize,
    track: SavedTrack,
}

/// The state of a [`MultiTracker`](crate::MultiTracker) between two frames; otherwise as
/// [`Snapshot`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MultiSnapshot {
    version: Version,
    config: TrackerConfig,
    next: u64,
    frame_size: Option<FrameSize>,
    tracks: Vec<(TargetId, SavedTrack)>,
}

/// A target and its latest estimate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct SavedTrack {
    pub target: SavedTarget,
    pub estimate: Estimate,
}

/// The version of a snapshot. Reading any other one than [`VERSION`] is an error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "u32")]
struct Version(u32);

impl TryFrom<u32> for Version {
    type Error = Error;

    fn try_from(version: u32) -> Result<Self, Error> {
        if version == VERSION {
            return Ok(Self(version));
        }
        Err(error::snapshot(format!("its version is {version}; allowed: {VERSION}")))
    }
}

impl Snapshot {
    /// The same with a network, which a saved state does not hold. It must be the one that the
    /// target was tracked with.
    #[must_use]
    pub fn with_network(mut self, network: Network) -> Self {
        self.config.network = Some(network);
        self
    }

    /// The configuration.
    pub fn config(&self) -> &TrackerConfig {
        &self.config
    }

    pub(crate) fn new(config: TrackerConfig, frame_size: FrameSize, track: SavedTrack) -> Self {
        // A network is a file of its own, which the text of a snapshot does not hold.
        let config = TrackerConfig { network: None, ..config };
        Self { version: Version(VERSION), config, frame_size, track }
    }

    pub(crate) fn into_parts(self) -> (TrackerConfig, FrameSize, SavedTrack) {
        (self.config, self.frame_size, self.track)
    }
}

/// The parts of a [`MultiSnapshot`].
pub(crate) struct MultiParts {
    pub config: TrackerConfig,
    pub next: u64,
    pub frame_size: Option<FrameSize>,
    pub tracks: Vec<(TargetId, SavedTrack)>,
}

impl MultiSnapshot {
    /// As [`Snapshot::with_network`].
    #[must_use]
    pub fn with_network(mut self, network: Network) -> Self {
        self.config.network = Some(network);
        self
    }

    /// The configuration.
    pub fn config(&self) -> &TrackerConfig {
        &self.config
    }

    pub(crate) fn new(parts: MultiParts) -> Self {
        let MultiParts { config, next, frame_size, tracks } = parts;
        let config = TrackerConfig { network: None, ..config };
        Self { version: Version(VERSION), config, next, frame_size, tracks }
    }

    pub(crate) fn into_parts(self) -> Result<MultiParts, Error> {
        let Self { config, next, frame_size, tracks, .. } = self;
        // Ids only grow, so those in use stand in rising order.
        let ids: Vec<u64> = tracks.iter().map(|(id, _)| id.number()).chain([next]).collect();
        if ids[0] == 0 || !ids.is_sorted_by(|a, b| a < b) {
            return Err(error::snapshot(format!("its ids {ids:?} do not rise from 1")));
        }
        if frame_size.is_none() && !tracks.is_empty() {
            return Err(error::snapshot("it has targets but no frame size"));
        }
        Ok(MultiParts { config, next, frame_size, tracks })
    }
}
