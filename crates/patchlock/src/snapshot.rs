//! Saved trackers: one version for [`Tracker`](crate::Tracker) and [`MultiTracker`](crate::MultiTracker), of
//! any method. What version 0.1 of the library wrote is read too.

use crate::Error;
use crate::config::{Method, TrackerConfig};
use crate::error;
use crate::method::SavedTarget;
use crate::paper::state::State;
use crate::patch_model::memory::PatchMemory;
use crate::patch_model::subspace::Subspace;
use crate::target_id::TargetId;
use crate::vision::frame::FrameSize;
use crate::{paper, robust};
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};

/// The version of the saved form; raised when the meaning of its fields changes.
const VERSION: u32 = 2;

/// The version that 0.1 of the library wrote.
const VERSION_OF_0_1: u32 = 1;

/// The state of a [`Tracker`](crate::Tracker) between two frames.
///
/// Serialise it with a self-describing `serde` format that keeps floats exact and has 128-bit integers, such
/// as JSON text (with `serde_json`'s feature `float_roundtrip`). What version 0.1 of the library wrote can be
/// read, unless it used an option that no longer exists; the error then names the option.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "SnapshotForm")]
pub struct Snapshot {
    version: u32,
    config: TrackerConfig,
    frame_size: Option<FrameSize>,
    target: Option<SavedTarget>,
}

/// The state of a [`MultiTracker`](crate::MultiTracker) between two frames; otherwise as [`Snapshot`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "MultiSnapshotForm")]
pub struct MultiSnapshot {
    version: u32,
    config: TrackerConfig,
    next: u64,
    frame_size: Option<FrameSize>,
    targets: Vec<(TargetId, SavedTarget)>,
}

/// A target and the size of the frames that it is tracked in.
type TargetWithSize = (FrameSize, SavedTarget);

impl Snapshot {
    pub(crate) fn new(config: &TrackerConfig, target: Option<TargetWithSize>) -> Self {
        let (frame_size, target) = target.unzip();
        Self { version: VERSION, config: config.clone(), frame_size, target }
    }

    pub(crate) fn into_parts(self) -> (TrackerConfig, Option<TargetWithSize>) {
        (self.config, self.frame_size.zip(self.target))
    }
}

/// The parts of a [`MultiSnapshot`].
pub(crate) struct MultiParts {
    pub config: TrackerConfig,
    pub next: u64,
    pub frame_size: Option<FrameSize>,
    pub targets: Vec<(TargetId, SavedTarget)>,
}

impl MultiSnapshot {
    pub(crate) fn new(parts: MultiParts) -> Self {
        let MultiParts { config, next, frame_size, targets } = parts;
        Self { version: VERSION, config, next, frame_size, targets }
    }

    pub(crate) fn into_parts(self) -> Result<MultiParts, Error> {
        let Self { config, next, frame_size, targets, .. } = self;
        // Ids only grow, so those in use stand in rising order.
        let ids: Vec<u64> = targets.iter().map(|(id, _)| id.number()).chain([next]).collect();
        if ids[0] == 0 || !ids.is_sorted_by(|a, b| a < b) {
            return Err(error::snapshot(format!("its ids {ids:?} do not rise from 1")));
        }
        Ok(MultiParts { config, next, frame_size, targets })
    }
}

/// A [`Snapshot`] as any version wrote it.
#[derive(Deserialize)]
struct SnapshotForm {
    version: u32,
    config: TrackerConfig,
    frame_size: Option<FrameSize>,
    target: Option<TargetForm>,
    /// The target, in version 1.
    memory: Option<TargetForm>,
}

impl TryFrom<SnapshotForm> for Snapshot {
    type Error = Error;

    fn try_from(form: SnapshotForm) -> Result<Self, Error> {
        let SnapshotForm { version, config, frame_size, target, memory } = form;
        let config = config_of(version, config);
        let target = match version {
            VERSION => target.map(TargetForm::now).transpose()?,
            VERSION_OF_0_1 => memory.map(TargetForm::of_0_1).transpose()?,
            _ => return Err(unknown_version(version)),
        };
        let frame_size = frame_size.or(target.as_ref().and_then(|(size, _)| *size));
        let target = target.map(|(_, target)| target);
        if frame_size.is_some() != target.is_some() {
            return Err(error::snapshot("it has a target or a frame size, but not both"));
        }
        Ok(Self { version: VERSION, config, frame_size, target })
    }
}

/// A [`MultiSnapshot`] as any version wrote it.
#[derive(Deserialize)]
struct MultiSnapshotForm {
    version: u32,
    config: TrackerConfig,
    next: u64,
    frame_size: Option<FrameSize>,
    targets: Vec<(TargetId, TargetForm)>,
}

impl TryFrom<MultiSnapshotForm> for MultiSnapshot {
    type Error = Error;

    fn try_from(form: MultiSnapshotForm) -> Result<Self, Error> {
        let MultiSnapshotForm { version, config, next, mut frame_size, targets: forms } = form;
        let config = config_of(version, config);
        let read = match version {
            VERSION => TargetForm::now,
            VERSION_OF_0_1 => TargetForm::of_0_1,
            _ => return Err(unknown_version(version)),
        };
        let mut targets = Vec::with_capacity(forms.len());
        for (id, form) in forms {
            let (size, target) = read(form)?;
            if frame_size.is_some() && size.is_some_and(|size| Some(size) != frame_size) {
                let reason = format!("target {id} is tracked on frames of another size");
                return Err(error::snapshot(reason));
            }
            frame_size = frame_size.or(size);
            targets.push((id, target));
        }
        if frame_size.is_none() && !targets.is_empty() {
            return Err(error::snapshot("it has targets but no frame size"));
        }
        Ok(Self { version: VERSION, config, next, frame_size, targets })
    }
}

/// The configuration of a snapshot of this version: 0.1 had no method but the paper's.
fn config_of(version: u32, config: TrackerConfig) -> TrackerConfig {
    match version {
        VERSION_OF_0_1 => TrackerConfig { method: Method::Patchwise, ..config },
        _ => config,
    }
}

fn unknown_version(version: u32) -> Error {
    error::snapshot(format!(
        "its version is {version}, this program reads the versions {VERSION_OF_0_1} and {VERSION}"
    ))
}

/// A target as any version wrote it: under the name of its method, or in version 1 as its fields.
#[derive(Deserialize)]
struct TargetForm {
    patchwise: Option<paper::Saved>,
    robust: Option<robust::Saved>,
    width: Option<usize>,
    height: Option<usize>,
    state: Option<State>,
    rng: Option<Pcg64>,
    frames: Option<u64>,
    templates: Option<Vec<Vec<f32>>>,
    small_templates: Option<Vec<Vec<f32>>>,
    large_buffer: Option<Vec<Vec<f32>>>,
    small_buffer: Option<Vec<Vec<f32>>>,
    subspace: Option<Subspace>,
    batch: Option<Vec<Vec<f32>>>,
}

/// A target, with the size of its frames where the form has it.
type ReadTarget = (Option<FrameSize>, SavedTarget);

impl TargetForm {
    fn now(self) -> Result<ReadTarget, Error> {
        let saved = match (self.patchwise, self.robust) {
            (Some(saved), None) => SavedTarget::Patchwise(saved),
            (None, Some(saved)) => SavedTarget::Robust(saved),
            _ => return Err(error::snapshot("a target has no known method")),
        };
        Ok((None, saved))
    }

    fn of_0_1(self) -> Result<ReadTarget, Error> {
        let size =
            FrameSize { width: given(self.width, "width")?, height: given(self.height, "height")? };
        let model = PatchMemory {
            templates: given(self.templates, "templates")?,
            small_templates: given(self.small_templates, "small_templates")?,
            large_buffer: given(self.large_buffer, "large_buffer")?,
            small_buffer: given(self.small_buffer, "small_buffer")?,
            subspace: given(self.subspace, "subspace")?,
            batch: given(self.batch, "batch")?,
        };
        let saved = paper::Saved {
            state: given(self.state, "state")?,
            rng: given(self.rng, "rng")?,
            frames: given(self.frames, "frames")?,
            model,
        };
        Ok((Some(size), SavedTarget::Patchwise(saved)))
    }
}

fn given<T>(value: Option<T>, field: &str) -> Result<T, Error> {
    value.ok_or_else(|| error::snapshot(format!("its field `{field}` is missing")))
}
