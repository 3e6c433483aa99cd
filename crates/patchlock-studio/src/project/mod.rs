//! What a project file holds.

use std::collections::BTreeMap;
use std::path::PathBuf;

use patchlock::{BoundingBox, Status};
use serde::{Deserialize, Serialize};

/// A video with its targets.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Project {
    /// The video that the boxes belong to.
    pub video: Video,
    /// The classes of targets, in the order in which they are offered.
    pub labels: Vec<Label>,
    /// The targets, in the order in which they were made.
    pub targets: Vec<Target>,
}

/// The video of a project, with what tells whether it has changed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Video {
    /// The file or folder, relative to the folder of the project file.
    pub path: PathBuf,
    /// Its size in bytes; for a folder, that of all images together.
    pub bytes: u64,
    /// SHA-256 in hexadecimal digits, of the file, or of names and sizes of the images.
    pub hash: String,
    /// Number of frames.
    pub frames: usize,
    /// Width of a frame in pixels.
    pub width: usize,
    /// Height of a frame in pixels.
    pub height: usize,
}

/// A class of targets.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Label {
    /// The name, such as `car`.
    pub name: String,
    /// The colour of its boxes, `#rrggbb`.
    pub colour: String,
}

/// A target.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Target {
    /// Unique in the project, from 1; never used again after the target is deleted.
    pub id: u64,
    /// Name of its label.
    pub label: String,
    /// Values of attributes of the whole target, by name.
    pub attributes: BTreeMap<String, String>,
    /// What a person has said, by frame.
    pub keys: BTreeMap<usize, Key>,
    /// Where it is between key frames, as tracked, by frame. Key frames have no entry.
    pub tracked: BTreeMap<usize, Tracked>,
    /// First and last frame of each stretch in which a person said that it is not visible; in order, and
    /// apart from each other. A frame in a stretch has neither a key nor a tracked box.
    pub hidden: Vec<[usize; 2]>,
}

/// A key frame: the box that a person has drawn or confirmed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Key {
    /// The box.
    #[serde(rename = "box")]
    pub bbox: BoundingBox,
    /// Part of the target is hidden by something else.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub occluded: bool,
    /// Part of the target is outside the frame.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub truncated: bool,
}

/// A frame between key frames.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tracked {
    /// The box.
    #[serde(rename = "box")]
    pub bbox: BoundingBox,
    /// The probability that the box overlaps the target by at least half, 0 to 1.
    pub score: f64,
    /// Whether the target is followed. The box of a lost target is the last one that was known.
    pub status: Status,
    /// The visible share of the target, 0 to 1, if known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub visible: Option<f64>,
    /// Overlap of the boxes tracked forward and backward, 0 to 1, if it was tracked both ways.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub agreement: Option<f64>,
}
