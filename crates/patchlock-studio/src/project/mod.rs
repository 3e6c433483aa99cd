//! A video with its targets, and everything that can be done to them.
//!
//! A [`Store`] holds a [`Project`] and its file. All changes are [`Edit`]s, which are checked, and
//! which the store can undo and redo. The file is described in `docs/project-file.md`.

mod by_frame;
mod changes;
pub(crate) mod check;
mod edit;
mod error;
pub(crate) mod file;
mod frames;
mod history;
mod lock;
mod log;
mod shared;
mod store;
pub(crate) mod stretches;
mod video;

use std::collections::BTreeMap;
use std::path::PathBuf;

use patchlock::{BoundingBox, Status};
pub use patchlock_track::attributes::{Attribute, Kind};
pub use patchlock_track::outline::Outline;
use serde::{Deserialize, Serialize};

pub use changes::Changes;
pub use check::limits;
pub use edit::Edit;
pub use error::Error;
pub use frames::Frames;
#[cfg(feature = "server")]
pub(crate) use frames::cut_map;
pub use history::{History, MAX_BOXES, MAX_STEPS};
pub use shared::{FILE as LABELS_FILE, SharedLabels, Vocabulary};
pub use store::{Store, beside, in_folder};

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
    /// The id of the next new target, above all that were ever used.
    pub next_id: u64,
    /// Whether a person said that the video is annotated completely.
    #[serde(default)]
    pub done: bool,
    /// What a reviewer has said, in the order of their ids.
    #[serde(default)]
    pub remarks: Vec<Remark>,
}

impl Project {
    /// A copy without the targets.
    #[cfg(feature = "server")]
    pub(crate) fn without_targets(&self) -> Self {
        let (video, labels) = (self.video.clone(), self.labels.clone());
        Self { video, labels, targets: Vec::new(), remarks: Vec::new(), ..*self }
    }

    /// The target with this id.
    pub fn target(&self, id: u64) -> Option<&Target> {
        self.targets.iter().find(|target| target.id == id)
    }

    /// The values of all attributes of a target in a frame: of those that its label declares, and of
    /// others that it has.
    pub fn values(&self, target: &Target, frame: usize) -> BTreeMap<String, String> {
        let mut values = target.attributes.clone();
        for attribute in self.declared(&target.label) {
            values.insert(attribute.name.clone(), target.value(attribute, frame).to_owned());
        }
        values
    }

    /// The attributes that a label declares.
    pub fn declared(&self, label: &str) -> &[Attribute] {
        let label = self.labels.iter().find(|known| known.name == label);
        label.map_or(&[], |label| &label.attributes)
    }
}

/// What a reviewer says of a target in a frame, or of the frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Remark {
    /// Unique in the project, from 1.
    pub id: u64,
    /// The frame that it is about.
    pub frame: usize,
    /// The target; without one, something that has no box, or the whole frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<u64>,
    /// What the reviewer decides.
    pub verdict: ReviewDecision,
    /// Why, in words; may be empty.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub text: String,
}

/// What a reviewer decides.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ReviewDecision {
    /// It is right, in all frames if it is about a target.
    Accepted,
    /// It is wrong here.
    Rejected,
    /// Neither.
    Comment,
}

/// The video of a project, with what tells whether it has changed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Video {
    /// The file or folder, relative to the folder of the project file.
    pub path: PathBuf,
    /// Its size in bytes; for a folder, that of all images together.
    pub bytes: u64,
    /// SHA-256 in hexadecimal digits. Of a file of at most 64 MiB, it is that of the file; of a
    /// longer one, that of 64 pieces of 1 MiB, evenly spaced. Of a folder, it is that of a line
    /// `NAME SIZE` for each image.
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
    /// The attributes that its targets have, in the order in which they are shown.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub attributes: Vec<Attribute>,
}

/// The label with which each project begins.
pub const PLACEHOLDER: &str = "target";

/// Colours for labels without one, which are told apart with any colour vision (Okabe and Ito,
/// 2008).
const COLOURS: [&str; 7] =
    ["#e69f00", "#56b4e9", "#009e73", "#f0e442", "#0072b2", "#d55e00", "#cc79a7"];

/// Colours of targets: neighbours in the list differ in hue and in lightness, and none is hard to
/// see on a dark or a light frame.
const TARGET_COLOURS: [&str; 12] = [
    "#e69f00", "#56b4e9", "#00c08b", "#f0e442", "#3d8bff", "#ff6b3d", "#e58fc1", "#9fe870",
    "#b48cff", "#ff5c8a", "#5ce1e6", "#d0b17a",
];

impl Label {
    /// The `index`-th label of a project, with a colour of its own if it is one of the first seven.
    pub fn new(name: impl Into<String>, index: usize) -> Self {
        let colour = COLOURS[index % COLOURS.len()].to_owned();
        Self { name: name.into(), colour, attributes: Vec::new() }
    }
}

/// A target.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Target {
    /// Unique in the project, from 1; never used again after the target is deleted.
    pub id: u64,
    /// Name of its label.
    pub label: String,
    /// Values of attributes, by name: in all frames, or up to the first change.
    pub attributes: BTreeMap<String, String>,
    /// Values from a frame on, by name. [`Target::value`] says which counts.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub changes: BTreeMap<String, Changes>,
    /// What a person has said, by frame.
    #[serde(with = "by_frame")]
    pub keys: BTreeMap<usize, Key>,
    /// Where it is between key frames, as tracked, by frame. Key frames have no entry.
    #[serde(with = "by_frame")]
    pub tracked: BTreeMap<usize, TrackedBox>,
    /// First and last frame of each stretch in which a person said that it is not visible; in
    /// order, and apart from each other. A frame in a stretch has neither a key nor a tracked box.
    pub hidden: Vec<[usize; 2]>,
}

impl Target {
    /// A target about which nothing is said yet.
    pub(crate) fn new(id: u64, label: String) -> Self {
        Self {
            id,
            label,
            attributes: BTreeMap::new(),
            changes: BTreeMap::new(),
            keys: BTreeMap::new(),
            tracked: BTreeMap::new(),
            hidden: Vec::new(),
        }
    }

    /// The colour of its boxes, `#rrggbb`: its own, as targets of one label are told apart by it.
    pub fn colour(&self) -> &'static str {
        TARGET_COLOURS[(self.id.saturating_sub(1) % TARGET_COLOURS.len() as u64) as usize]
    }

    /// The box in this frame, as drawn or as tracked. `None` if there is none, or the target is
    /// lost there.
    pub fn box_at(&self, frame: usize) -> Option<BoundingBox> {
        let tracked = || self.tracked.get(&frame).filter(|tracked| tracked.status != Status::Lost);
        let key = self.keys.get(&frame).map(|key| key.bbox);
        key.or_else(|| tracked().map(|tracked| tracked.bbox))
    }

    /// Whether a person has drawn an outline in any frame.
    pub fn has_outlines(&self) -> bool {
        self.keys.values().any(|key| key.outline.is_some())
    }

    /// The outline in this frame: as drawn in a key frame; between two of them, that of the nearer one,
    /// carried along with the box. A rotated box turns from one to the other.
    pub fn outline_at(&self, frame: usize) -> Option<Outline> {
        if let Some(key) = self.keys.get(&frame) {
            return key.outline.clone();
        }
        let bbox = self.box_at(frame)?;
        let before = self.keys.range(..frame).next_back();
        let after = self.keys.range(frame..).next();
        let (Some((&from, a)), Some((&to, b))) = (before, after) else {
            let (_, key) = before.or(after)?;
            return Some(key.outline.as_ref()?.carried(key.bbox, bbox));
        };
        if a.outline.is_none() && b.outline.is_none() {
            return None;
        }
        let shape = |key: &Key| key.outline.clone().unwrap_or(Outline::of_box(key.bbox, 0.0));
        let [first, last] = [a, b].map(|key| shape(key).carried(key.bbox, bbox));
        if first.is_rectangle() && last.is_rectangle() {
            return Some(first.between(&last, (frame - from) as f64 / (to - from) as f64));
        }
        let (nearer, carried) = if frame - from <= to - frame { (a, first) } else { (b, last) };
        nearer.outline.as_ref().map(|_| carried)
    }

    /// Whether a person said that the target is not visible in this frame.
    pub fn is_hidden(&self, frame: usize) -> bool {
        let after = self.hidden.partition_point(|stretch| stretch[1] < frame);
        self.hidden.get(after).is_some_and(|stretch| stretch[0] <= frame)
    }
}

/// A key frame: the box that a person has drawn or confirmed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Key {
    /// The box; with an outline, the upright one around it.
    #[serde(rename = "box")]
    pub bbox: BoundingBox,
    /// A rotated box or a polygon.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outline: Option<Outline>,
    /// Part of the target is hidden by something else.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub occluded: bool,
    /// Part of the target is outside the frame.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub truncated: bool,
}

impl Key {
    /// A box without an outline, of which all is visible.
    pub fn new(bbox: BoundingBox) -> Self {
        Self { bbox, outline: None, occluded: false, truncated: false }
    }

    /// How many boxes have as many numbers as it.
    pub(crate) fn size(&self) -> usize {
        1 + self.outline.as_ref().map_or(0, |outline| outline.0.len() / 2)
    }
}

/// A frame between key frames.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrackedBox {
    /// The box.
    #[serde(rename = "box")]
    pub bbox: BoundingBox,
    /// The probability that the box overlaps the target by at least half, 0 to 1.
    pub score: f64,
    /// Whether the target is followed. The box of a lost target is what is still followed, or the
    /// last known one.
    pub status: Status,
    /// The visible share of the target, 0 to 1, if known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub visible: Option<f64>,
    /// Overlap of the boxes tracked forward and backward, 0 to 1, if it was tracked both ways.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub agreement: Option<f64>,
}
