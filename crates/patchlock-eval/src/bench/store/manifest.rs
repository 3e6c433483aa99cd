//! What is said of a tracker and of each of its runs, and the text of the boxes.

use patchlock::BoundingBox;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::files::sha256;
use super::{Clip, Footage, Run, Series};
use crate::bench::machine::Machine;
use crate::bench::subject::Answer;
use crate::files::name_of;

/// `manifest.json` of a tracker.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Number of the format of this folder.
    pub format: u32,
    /// The tracker's name.
    pub tracker: String,
    /// Hash of `subject`.
    pub configuration_hash: String,
    /// What was run: the fields of an [`Identity`](super::Identity), perhaps of another version, or what another program that writes this layout says of itself.
    pub subject: Value,
}

/// `<run>.json`: everything about one run but its boxes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunManifest {
    /// The tracker's name.
    pub tracker: String,
    /// Hash of `subject`.
    pub configuration_hash: String,
    /// What was run: the fields of an [`Identity`](super::Identity), perhaps of another version, or what another program that writes this layout says of itself.
    pub subject: Value,
    /// Where it began: `ope`, `tre` or `sre`.
    pub protocol: String,
    /// The target's name.
    pub target: String,
    /// The seed.
    pub seed: u64,
    /// Number of the start (TRE) or of the first box (SRE); 0 in OPE.
    pub variant: usize,
    /// Row of the truth at which it began, counted from 0.
    pub first: usize,
    /// The box that the tracker was given, counted from 0.
    pub given: BoundingBox,
    /// Frames, the first one included.
    pub frames: usize,
    /// Name of the first frame's file; of a clip, of its source.
    pub first_frame: String,
    /// The clip that it is of, where it is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clip: Option<Clip>,
    /// What the text calls the first pixel, 0 or 1.
    pub origin: f64,
    /// What it ran on.
    pub machine: Machine,
    /// Threads that the tracker had.
    pub threads: usize,
    /// Runs that went on side by side. Times are honest only with 1.
    pub jobs: usize,
    /// SHA-256 of the text with the boxes.
    pub boxes_sha256: String,
    /// Time of the tracker for each frame, in seconds, without decoding.
    pub seconds: Vec<f64>,
}

impl RunManifest {
    /// Whether it is of this run: begun on the same box, and on the same frames as far as that can be said.
    pub(super) fn is_of(&self, run: &Run<'_>) -> bool {
        let begun = self.given == run.start.bbox && self.first == run.start.first;
        begun
            && match run.footage {
                Footage::Files(files) => self.clip.is_none() && self.frames == files.len(),
                Footage::Clip(clip) => self.clip.as_ref() == Some(clip),
            }
    }

    /// What it is of, for an error.
    pub(super) fn in_words(&self) -> String {
        let b = self.given;
        let part = self.clip.as_ref().map(|clip| {
            let end = clip.end.map_or("its end".to_string(), |end| end.to_string());
            format!(", every {}. from {} to {end} of {}", clip.stride, clip.start, clip.source)
        });
        format!(
            "its run on {} has {} frames{} from the box {},{},{},{}",
            self.target,
            self.frames,
            part.unwrap_or_default(),
            b.x,
            b.y,
            b.w,
            b.h
        )
    }
}

/// The two files of a run, before they are on disk.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Written {
    /// `<run>.txt`.
    pub boxes: String,
    /// `<run>.json`.
    pub manifest: String,
}

/// What a tracker said of each frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trajectory {
    /// The boxes, counted from 0; `None` where it gave none.
    pub boxes: Vec<Option<BoundingBox>>,
    /// The time that it took, in seconds.
    pub seconds: Vec<f64>,
}

impl Trajectory {
    /// One frame more.
    pub fn add(&mut self, answer: Answer) {
        self.boxes.push(answer.bbox);
        self.seconds.push(answer.seconds);
    }
}

impl Series {
    /// Writes the files of a run that was made on this machine: the tracker had so many threads, and so many runs went on side by side.
    pub fn write(
        &self,
        run: &Run<'_>,
        trajectory: Trajectory,
        threads: usize,
        jobs: usize,
    ) -> Written {
        let boxes = text_of(&trajectory.boxes, self.origin);
        let manifest = RunManifest {
            tracker: self.tracker.clone(),
            configuration_hash: self.subject.hash(),
            subject: self.subject.fields(),
            protocol: self.scheme.name().to_string(),
            target: run.target.to_string(),
            seed: run.seed,
            variant: run.start.variant,
            first: run.start.first,
            given: run.start.bbox,
            frames: trajectory.boxes.len(),
            first_frame: run.footage.name(),
            clip: run.footage.clip().cloned(),
            origin: self.origin,
            machine: Machine::here(),
            threads,
            jobs,
            boxes_sha256: sha256(boxes.as_bytes()),
            seconds: trajectory.seconds,
        };
        Written { boxes, manifest: serde_json::to_string(&manifest).unwrap_or_default() }
    }
}

impl Footage<'_> {
    fn clip(&self) -> Option<&Clip> {
        match self {
            Self::Files(_) => None,
            Self::Clip(clip) => Some(clip),
        }
    }

    fn name(&self) -> String {
        match self {
            Self::Files(files) => files.first().map(|path| name_of(path)).unwrap_or_default(),
            Self::Clip(clip) => name_of(clip.source.as_ref()),
        }
    }
}

/// A box a line, with all digits.
fn text_of(boxes: &[Option<BoundingBox>], origin: f64) -> String {
    let line = |bbox: &Option<BoundingBox>| match bbox {
        Some(b) => format!("{},{},{},{}\n", b.x + origin, b.y + origin, b.w, b.h),
        None => "NaN,NaN,NaN,NaN\n".to_string(),
    };
    boxes.iter().map(line).collect()
}
