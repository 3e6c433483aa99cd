//! Boxes that trackers gave, read from the layouts that people have. Each is recognised by looking.

mod text_files;

use std::fmt;
use std::path::{Path, PathBuf};

use patchlock::BoundingBox;

use crate::Error;

/// How the files of a tracker lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layout {
    /// `<target>.txt` with a box a line.
    Otb,
}

impl fmt::Display for Layout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Otb => "OTB text",
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
    /// Time that the tracker took for each frame, where that is known.
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
    /// What could not be read, and why.
    pub faults: Vec<String>,
}

/// Reads the results of the trackers at a path. `origin` is what the files call the first pixel: as the truth does that they will be scored
/// against.
///
/// # Errors
/// [`Error::Read`]; [`Error::NoResults`] where no layout fits. A file of a tracker that can't be read is a fault of that tracker.
pub fn read(path: &Path, origin: f64) -> Result<Vec<Results>, Error> {
    match text_files::read(path, origin)? {
        Some(results) => Ok(vec![results]),
        None => Err(Error::NoResults {
            path: path.to_path_buf(),
            reason: "there are no text files of boxes in it".to_string(),
        }),
    }
}
