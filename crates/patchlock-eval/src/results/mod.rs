//! Boxes that trackers gave, read from the layouts that people have. Each is recognised by looking.
//!
//! A layout says how files lie, not what they call the first pixel: results count pixels as the truth does that they are scored against.

mod bench;
mod mot;
mod per_target;
mod text_files;

use std::fmt;
use std::path::{Path, PathBuf};

use patchlock::BoundingBox;

use crate::dataset::Dataset;
use crate::files::entries;
use crate::{Error, text};

/// How deep below a path trackers are looked for.
const DEPTH: usize = 3;

/// How the files of a tracker lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layout {
    /// What `patchlock bench` writes: `manifest.json` and `<protocol>/<target>/<seed>.txt`.
    Bench,
    /// `<target>.txt` with a box a line, as the tracker benchmark has it, and the got10k toolkit for it.
    Otb,
    /// `<target>/<target>_001.txt` with a box a line: the got10k toolkit for GOT-10k. Several files are repetitions.
    Got10k,
    /// `<target>/<target>_001.txt`, in which a line may be a code: 1 begin, 2 failure, 0 nothing; and a region may be a polygon.
    Vot,
    /// `<target>.txt` with `frame,id,x,y,w,h,confidence,..` a line.
    Mot,
}

impl fmt::Display for Layout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Bench => "patchlock bench",
            Self::Otb => "OTB text",
            Self::Got10k => "got10k",
            Self::Vot => "VOT",
            Self::Mot => "MOT",
        })
    }
}

/// One pass of a tracker over one target.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// The target's name, as the results spell it.
    pub target: String,
    /// Which repetition it is.
    pub seed: u64,
    /// Which start frame (TRE) or first box (SRE) it is; 0 in one-pass evaluation.
    pub variant: usize,
    /// Row of the truth at which it begins, counted from 0.
    pub first: usize,
    /// A box a frame, counted from 0; `None` where the tracker gave none.
    pub boxes: Vec<Option<BoundingBox>>,
    /// Time that the tracker took for each frame, where that is known and honest.
    pub seconds: Option<Vec<f64>>,
    /// The file that it comes from.
    pub file: PathBuf,
}

/// Everything of one tracker.
#[derive(Debug, Clone, PartialEq)]
pub struct Results {
    /// The tracker's name: that of its folder.
    pub name: String,
    /// How its files lie.
    pub layout: Layout,
    /// The runs, by target, seed and variant.
    pub runs: Vec<Run>,
    /// What could not be read, and why: the tracker is then not scored.
    pub faults: Vec<String>,
    /// What a reader of the scores should know.
    pub notes: Vec<String>,
}

impl Results {
    fn new(name: String, layout: Layout) -> Self {
        Self { name, layout, runs: Vec::new(), faults: Vec::new(), notes: Vec::new() }
    }

    /// A run from the beginning, without times.
    fn add(
        &mut self,
        target: String,
        seed: u64,
        file: &Path,
        boxes: Result<Vec<Option<BoundingBox>>, Error>,
    ) {
        match boxes {
            Ok(boxes) => self.runs.push(Run {
                target,
                seed,
                variant: 0,
                first: 0,
                boxes,
                seconds: None,
                file: file.to_path_buf(),
            }),
            Err(error) => self.faults.push(error.to_string()),
        }
    }

    fn is_empty(&self) -> bool {
        self.runs.is_empty() && self.faults.is_empty()
    }
}

/// Reads the results of all trackers at several paths, each as [`read`] does. Trackers of one name are told apart by their paths.
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
    let is_double = |name: &String| names.iter().filter(|other| *other == name).count() > 1;
    let named = |(path, mut results): (&Path, Results)| {
        if is_double(&results.name) {
            results.name = format!("{} ({})", results.name, path.display());
        }
        results
    };
    Ok(all.into_iter().map(named).collect())
}

/// Reads the results of all trackers at a path: a tracker's folder, or a folder around such folders.
///
/// # Errors
/// [`Error::Read`]; [`Error::NoResults`] where no layout fits. A file of a tracker that can't be read is a fault of that tracker.
pub fn read(path: &Path, truth: &Dataset) -> Result<Vec<Results>, Error> {
    if path.is_file() {
        return Err(Error::NoResults {
            path: path.to_path_buf(),
            reason: "it is a file; results are a folder with a file for each target".to_string(),
        });
    }
    // `out/.` and the like have no last part to be named by.
    let path = &path.canonicalize().map_err(|error| Error::read(path, error))?;
    let found = below(path, truth, DEPTH)?;
    if found.is_empty() {
        return Err(Error::NoResults {
            path: path.to_path_buf(),
            reason: "there are no text files of boxes in it or below it".to_string(),
        });
    }
    Ok(found)
}

fn below(folder: &Path, truth: &Dataset, depth: usize) -> Result<Vec<Results>, Error> {
    let found = one(folder, truth)?;
    if !found.is_empty() || depth == 0 {
        return Ok(found);
    }
    let is_truth = |path: &Path| truth.root.canonicalize().is_ok_and(|root| root == path);
    let mut all = Vec::new();
    for inner in entries(folder)?.into_iter().filter(|path| path.is_dir() && !is_truth(path)) {
        all.extend(below(&inner, truth, depth - 1)?);
    }
    Ok(all)
}

/// The results that lie in this folder itself.
fn one(folder: &Path, truth: &Dataset) -> Result<Vec<Results>, Error> {
    let origin = truth.origin();
    if folder.join(crate::bench::store::MANIFEST).is_file() {
        return bench::read(folder, truth);
    }
    if let Some(results) = per_target::read(folder, truth)? {
        return Ok(vec![results]);
    }
    Ok(text_files::read(folder, origin)?.into_iter().collect())
}

/// The boxes of rows; a row with NaN is a box that was not given.
fn boxes(file: &Path, table: &text::Table, origin: f64) -> Result<Vec<Option<BoundingBox>>, Error> {
    let row = |(k, row): (usize, &Vec<f64>)| {
        text::region(row, origin).map_err(|reason| Error::Line {
            path: file.to_path_buf(),
            line: k + 1,
            reason,
        })
    };
    table.rows.iter().enumerate().map(row).collect()
}

/// The seconds in a file with one number a line, if it has so many.
fn seconds(file: &Path, frames: usize) -> Option<Vec<f64>> {
    let rows = text::read(file).ok()?.rows;
    let seconds: Option<Vec<f64>> = rows
        .iter()
        .map(|row| row.first().copied().filter(|s| s.is_finite() && *s >= 0.0))
        .collect();
    seconds.filter(|seconds| seconds.len() == frames)
}
