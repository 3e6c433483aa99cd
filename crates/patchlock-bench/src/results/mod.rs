//! Reads the results of trackers from common layouts. The layout is detected from the files.
//!
//! A layout does not define the coordinate of the first pixel: results are assumed to have the same
//! origin as the ground truth that they are scored against.

mod bench;
mod mot;
mod per_target;
mod text_files;

use std::path::{Path, PathBuf};

use patchlock::{BoundingBox, Status};

use crate::Error;
use crate::dataset::Dataset;
use patchlock_track::files::entries;
use patchlock_track::text;

/// Depth below a path at which trackers are searched.
const DEPTH: usize = 3;

/// One run of a tracker on one target.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// Name of the target, as spelled in the results.
    pub target: String,
    /// The seed, or the index of the repetition.
    pub seed: u64,
    /// Index of the start (TRE) or first box (SRE); 0 in OPE.
    pub variant: usize,
    /// Index of the first frame of the run in the sequence.
    pub first: usize,
    /// The box in each frame, in pixels counted from 0; `None` where the tracker reported none.
    pub boxes: Vec<Option<BoundingBox>>,
    /// Time of the tracker for each frame in seconds, if it is known and was measured without
    /// parallel runs.
    pub seconds: Option<Vec<f64>>,
    /// How sure the tracker was of each frame, 0 to 1, if it is known.
    pub scores: Option<Vec<f64>>,
    /// Whether the target was followed in each frame, if it is known.
    pub statuses: Option<Vec<Status>>,
    /// The file that it was read from.
    pub file: PathBuf,
}

/// The results of one tracker.
#[derive(Debug, Clone, PartialEq)]
pub struct Results {
    /// Name of the tracker, which is that of its folder.
    pub name: String,
    /// The runs, ordered by target, seed and variant.
    pub runs: Vec<Run>,
    /// What could not be read, and why. A tracker with faults is not scored.
    pub faults: Vec<String>,
    /// Remarks that readers of the scores should know.
    pub notes: Vec<String>,
}

impl Results {
    fn new(name: String) -> Self {
        Self { name, runs: Vec::new(), faults: Vec::new(), notes: Vec::new() }
    }

    /// Adds a run from the first frame on. The file of its times may be missing.
    fn add(
        &mut self,
        target: String,
        seed: u64,
        file: &Path,
        boxes: Result<Vec<Option<BoundingBox>>, Error>,
        times: Option<&Path>,
    ) {
        match boxes {
            Ok(boxes) => self.runs.push(Run {
                target,
                seed,
                variant: 0,
                first: 0,
                seconds: times.and_then(|times| seconds(times, boxes.len())),
                boxes,
                scores: None,
                statuses: None,
                file: file.to_path_buf(),
            }),
            Err(error) => self.faults.push(error.to_string()),
        }
    }

    fn is_empty(&self) -> bool {
        self.runs.is_empty() && self.faults.is_empty()
    }
}

/// Reads the results of all trackers at several paths, each as [`read`] does. If trackers have the
/// same name, their paths are appended to it.
///
/// # Errors
/// As [`read`].
pub fn read_all<P: AsRef<Path>>(paths: &[P], truth: &Dataset) -> Result<Vec<Results>, Error> {
    let mut all = Vec::new();
    for path in paths {
        let found = read(path.as_ref(), truth)?;
        all.extend(found.into_iter().map(|results| (path.as_ref(), results)));
    }
    let names: Vec<String> = all.iter().map(|(_, results)| results.name.clone()).collect();
    let is_duplicate = |name: &String| names.iter().filter(|other| *other == name).count() > 1;
    let named = |(path, mut results): (&Path, Results)| {
        if is_duplicate(&results.name) {
            results.name = format!("{} ({})", results.name, path.display());
        }
        results
    };
    Ok(all.into_iter().map(named).collect())
}

/// Reads the results of all trackers at a path: the folder of one tracker, or a folder of such
/// folders.
///
/// # Errors
/// [`Error::Track`]; [`Error::NoResults`] if no layout matches. An unreadable file is a fault of
/// its tracker, not an error.
pub fn read(path: &Path, truth: &Dataset) -> Result<Vec<Results>, Error> {
    if path.is_file() {
        return Err(Error::NoResults {
            path: path.to_path_buf(),
            reason: "this is a file; results are a folder with one file per target".to_string(),
        });
    }
    // Paths such as `out/.` have no last component to name the tracker by.
    let path = &dunce::canonicalize(path).map_err(|error| Error::read(path, error))?;
    let found = below(path, truth, DEPTH)?;
    if found.is_empty() {
        return Err(Error::NoResults {
            path: path.to_path_buf(),
            reason: "there are no text files of boxes in or below it".to_string(),
        });
    }
    Ok(found)
}

fn below(folder: &Path, truth: &Dataset, depth: usize) -> Result<Vec<Results>, Error> {
    let found = one(folder, truth)?;
    if !found.is_empty() || depth == 0 {
        return Ok(found);
    }
    let is_truth = |path: &Path| dunce::canonicalize(&truth.root).is_ok_and(|root| root == path);
    let mut all = Vec::new();
    for inner in entries(folder)?.into_iter().filter(|path| path.is_dir() && !is_truth(path)) {
        all.extend(below(&inner, truth, depth - 1)?);
    }
    Ok(all)
}

/// The results directly in this folder, not below it.
fn one(folder: &Path, truth: &Dataset) -> Result<Vec<Results>, Error> {
    if folder.join(crate::bench::store::MANIFEST).is_file() {
        return bench::read(folder, truth);
    }
    if let Some(results) = per_target::read(folder, truth)? {
        return Ok(vec![results]);
    }
    Ok(text_files::read(folder, truth)?.into_iter().collect())
}

/// The boxes of the rows of a file; a row with NaN is a missing box.
fn boxes(file: &Path, table: &text::Table, origin: f64) -> Result<Vec<Option<BoundingBox>>, Error> {
    let row = |(k, row): (usize, &Vec<f64>)| {
        text::region(row, origin).map_err(|reason| Error::line(file, k + 1, reason))
    };
    table.rows.iter().enumerate().map(row).collect()
}

/// Reads the times in a file with one number of seconds per line; `None` unless there are `frames`
/// valid ones.
fn seconds(file: &Path, frames: usize) -> Option<Vec<f64>> {
    let rows = text::read(file).ok()?.rows;
    let seconds: Option<Vec<f64>> = rows
        .iter()
        .map(|row| row.first().copied().filter(|s| s.is_finite() && *s >= 0.0))
        .collect();
    seconds.filter(|seconds| seconds.len() == frames)
}
