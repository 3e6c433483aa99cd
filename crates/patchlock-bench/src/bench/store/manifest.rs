//! The manifests of a tracker and of its runs, and the text format of the boxes.

use std::path::{Path, PathBuf};

use patchlock::{BoundingBox, Status};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::files::sha256;
use super::{Clip, Run, Series};
use crate::bench::machine::Machine;
use crate::bench::subject::Answer;
use patchlock_track::files::name_of;

/// The contents of `manifest.json` of a tracker.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Version of the folder's format.
    pub format: u32,
    /// The tracker's name.
    pub tracker: String,
    /// SHA-256 of `subject`.
    pub configuration_hash: String,
    /// The tracker that was run: the fields of an [`Identity`](super::Identity), possibly of
    /// another version, or whatever another program that writes this layout stores here.
    pub subject: Value,
}

/// The contents of `<run>.json`: everything about a run except its boxes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunManifest {
    /// The tracker's name.
    pub tracker: String,
    /// SHA-256 of `subject`.
    pub configuration_hash: String,
    /// The tracker that was run: the fields of an [`Identity`](super::Identity), possibly of
    /// another version, or whatever another program that writes this layout stores here.
    pub subject: Value,
    /// The protocol: `ope`, `tre` or `sre`.
    pub protocol: String,
    /// The target's name.
    pub target: String,
    /// The seed.
    pub seed: u64,
    /// Index of the start (TRE) or of the first box (SRE); 0 in OPE.
    pub variant: usize,
    /// Index of the first frame of the run in the sequence.
    pub first: usize,
    /// The box given to the tracker, in pixels counted from 0.
    pub given: BoundingBox,
    /// Number of frames, the first one included.
    pub frames: usize,
    /// File name of the first frame; for a clip, of its source.
    pub first_frame: String,
    /// The clip, if the run is not on image files.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clip: Option<Clip>,
    /// Coordinate of the first pixel in the text file, 0 or 1.
    pub origin: f64,
    /// The computer.
    pub machine: Machine,
    /// Number of threads of the tracker.
    pub threads: usize,
    /// Number of runs made in parallel. Times are meaningful only if this is 1.
    pub jobs: usize,
    /// SHA-256 of the text file of boxes.
    pub boxes_sha256: String,
    /// Time of the tracker for each frame in seconds, decoding excluded.
    pub seconds: Vec<f64>,
    /// How sure the tracker was of each frame, 0 to 1; missing if it did not say so for all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub score: Option<Vec<f64>>,
    /// Whether the target was followed in each frame; missing if the tracker did not say so for
    /// all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub status: Option<Vec<Status>>,
}

impl RunManifest {
    /// Whether the manifest belongs to this run: same first box, and same frames as far as can be
    /// checked.
    pub(super) fn is_of(&self, run: &Run<'_>) -> bool {
        let same_start = self.given == run.start.bbox && self.first == run.start.first;
        let same_length = run.clip.is_some() || self.frames == run.frames.len();
        same_start && same_length && self.clip.as_ref() == run.clip
    }

    /// Describes the run, for an error message.
    pub(super) fn in_words(&self) -> String {
        let b = self.given;
        let part = self.clip.as_ref().map(|clip| {
            let end = clip.end.map_or("the end".to_string(), |end| end.to_string());
            format!(" (stride {}, {} to {end} of {})", clip.stride, clip.start, clip.source)
        });
        format!(
            "the run on {} has {} frames{} and starts on the box {},{},{},{}",
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

/// The contents of the two files of a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RunFiles {
    /// Contents of `<run>.txt`.
    pub boxes: String,
    /// Contents of `<run>.json`.
    pub manifest: String,
}

/// The answers of a tracker, frame by frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trajectory {
    /// The boxes, in pixels counted from 0; `None` where the tracker reported none.
    pub boxes: Vec<Option<BoundingBox>>,
    /// The time for each frame, in seconds.
    pub seconds: Vec<f64>,
    /// How sure the tracker was, 0 to 1; `None` where it did not say.
    pub scores: Vec<Option<f64>>,
    /// Whether the target was followed; `None` where the tracker did not say.
    pub statuses: Vec<Option<Status>>,
}

impl Trajectory {
    /// Appends the answer for the next frame.
    pub fn add(&mut self, answer: Answer) {
        self.boxes.push(answer.bbox);
        self.seconds.push(answer.seconds);
        self.scores.push(answer.score);
        self.statuses.push(answer.status);
    }
}

impl Series {
    /// The contents of the files of a run made on this machine, with `threads` threads per tracker
    /// and `jobs` runs in parallel.
    pub fn write(
        &self,
        run: &Run<'_>,
        trajectory: Trajectory,
        threads: usize,
        jobs: usize,
    ) -> RunFiles {
        let boxes = text_of(&trajectory.boxes, self.origin);
        let source = run.clip.map(|clip| Path::new(&clip.source));
        let first_frame = source.or(run.frames.first().map(PathBuf::as_path));
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
            first_frame: first_frame.map(name_of).unwrap_or_default(),
            clip: run.clip.cloned(),
            origin: self.origin,
            machine: Machine::here(),
            threads,
            jobs,
            boxes_sha256: sha256(boxes.as_bytes()),
            seconds: trajectory.seconds,
            score: of_all(trajectory.scores, trajectory.boxes.len()),
            status: of_all(trajectory.statuses, trajectory.boxes.len()),
        };
        RunFiles { boxes, manifest: serde_json::to_string(&manifest).unwrap_or_default() }
    }
}

/// The values, if every frame has one.
fn of_all<T>(values: Vec<Option<T>>, frames: usize) -> Option<Vec<T>> {
    values.into_iter().collect::<Option<Vec<T>>>().filter(|values| values.len() == frames)
}

/// One box per line, with enough digits to be read back exactly.
fn text_of(boxes: &[Option<BoundingBox>], origin: f64) -> String {
    let line = |bbox: &Option<BoundingBox>| match bbox {
        Some(b) => format!("{},{},{},{}\n", b.x + origin, b.y + origin, b.w, b.h),
        None => "NaN,NaN,NaN,NaN\n".to_string(),
    };
    boxes.iter().map(line).collect()
}
