//! Saved trackers: one version for [`Tracker`](crate::Tracker) and
//! [`MultiTracker`](crate::MultiTracker), of any method.

use crate::Error;
use crate::error;
use crate::estimate::Estimate;
use crate::methods::{SavedTarget, TrackerConfig};
use crate::network::Network;
use crate::target_id::TargetId;
use crate::vision::frame::FrameSize;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};

/// The version of the saved form; raised when the meaning of its fields changes.
pub(crate) const VERSION: u32 = 11;

/// The state of a [`Tracker`](crate::Tracker) between two frames.
///
/// Serialise it with a self-describing `serde` format that keeps floats exact and has 128-bit
/// integers, such as JSON text (with `serde_json`'s feature `float_roundtrip`), or MessagePack with
/// the names of fields, which is a third as large.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Snapshot {
    #[serde(deserialize_with = "read_version")]
    pub(crate) version: u32,
    pub(crate) config: TrackerConfig,
    pub(crate) frame_size: FrameSize,
    pub(crate) track: SavedTrack,
}

/// The state of a [`MultiTracker`](crate::MultiTracker) between two frames; otherwise as
/// [`Snapshot`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MultiSnapshot {
    #[serde(deserialize_with = "read_version")]
    pub(crate) version: u32,
    pub(crate) config: TrackerConfig,
    pub(crate) next: u64,
    pub(crate) frame_size: Option<FrameSize>,
    pub(crate) tracks: Vec<(TargetId, SavedTrack)>,
}

/// A target and its latest estimate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct SavedTrack {
    pub target: SavedTarget,
    pub estimate: Estimate,
}

/// Reads the version of a snapshot. Any other one than [`VERSION`] is an error.
fn read_version<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    let version = u32::deserialize(deserializer)?;
    if version != VERSION {
        let reason = format!("its version is {version}; allowed: {VERSION}");
        return Err(D::Error::custom(error::snapshot(reason)));
    }
    Ok(version)
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

    /// Checks that the parts fit together.
    ///
    /// # Errors
    /// [`Error::Snapshot`] names those that do not.
    pub(crate) fn check(&self) -> Result<(), Error> {
        // Ids only grow, so those in use stand in rising order.
        let ids = self.tracks.iter().map(|(id, _)| id.number()).chain([self.next]);
        let ids: Vec<u64> = ids.collect();
        if ids[0] == 0 || !ids.is_sorted_by(|a, b| a < b) {
            return Err(error::snapshot(format!("its ids {ids:?} do not rise from 1")));
        }
        if self.frame_size.is_none() && !self.tracks.is_empty() {
            return Err(error::snapshot("it has targets but no frame size"));
        }
        Ok(())
    }
}
