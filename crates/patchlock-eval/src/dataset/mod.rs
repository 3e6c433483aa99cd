//! Sequences with truth, read from the layouts in which benchmarks are given away. Each is recognised by looking.

mod otb;
mod table;
mod truth;
mod truth_only;

use std::fmt;
use std::path::{Path, PathBuf};

use patchlock::BoundingBox;

use crate::Error;
use crate::{names, natural};
pub use table::OTB_ATTRIBUTES;

/// How the files of a dataset lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layout {
    /// `<Name>/img/0001.jpg`, `<Name>/groundtruth_rect[.k].txt`.
    Otb,
    /// A folder of text files, `<name>.txt`: truth without frames.
    TruthOnly,
}

impl Layout {
    /// What the files call the first pixel.
    pub fn origin(self) -> f64 {
        match self {
            Self::Otb | Self::TruthOnly => 1.0,
        }
    }
}

impl fmt::Display for Layout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Otb => "OTB",
            Self::TruthOnly => "text files of truth, without frames",
        })
    }
}

/// One target: the frames that count and where it is in them.
#[derive(Debug, Clone, PartialEq)]
pub struct Sequence {
    /// The target's name, such as `Jogging.2`.
    pub name: String,
    /// The image files, one for each row of truth; empty where the dataset holds no frames or they do not fit to the truth.
    pub frames: Vec<PathBuf>,
    /// The box of each frame, counted from 0; `None` where the frame has no truth and does not count.
    pub truth: Vec<Option<BoundingBox>>,
    /// Short names of the attributes, such as `OCC`.
    pub attributes: Vec<String>,
}

/// Something odd in a dataset.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Remark {
    /// The target that it is about; `None` for the whole dataset.
    pub target: Option<String>,
    /// Whether it stands in the way.
    pub severity: Severity,
    /// What is odd.
    pub text: String,
}

/// How bad a remark is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Worth knowing; nothing is lost.
    Note,
    /// The target's frames can't be used: it can be scored but not tracked.
    NoFrames,
    /// The target's truth can't be used: it is not among the sequences.
    NoTruth,
}

impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.target {
            Some(target) => write!(f, "{target}: {}", self.text),
            None => f.write_str(&self.text),
        }
    }
}

/// The sequences of a folder.
#[derive(Debug, Clone, PartialEq)]
pub struct Dataset {
    /// How its files lie.
    pub layout: Layout,
    /// The folder.
    pub root: PathBuf,
    /// The targets, in natural order of their names.
    pub sequences: Vec<Sequence>,
    /// Everything odd.
    pub remarks: Vec<Remark>,
}

impl Dataset {
    /// Reads the sequences of a folder, in whichever layout it is. Frames are listed, not decoded.
    ///
    /// # Errors
    /// [`Error::Read`]; [`Error::NoDataset`] where no layout fits. What is wrong with one sequence is a remark, and the others are read.
    pub fn open(root: &Path) -> Result<Self, Error> {
        let mut dataset = read(root)?;
        dataset.sequences.sort_by(|a, b| natural::compare(&a.name, &b.name));
        table::add_attributes(&mut dataset)?;
        Ok(dataset)
    }

    /// What its files call the first pixel: 0 or 1.
    pub fn origin(&self) -> f64 {
        self.layout.origin()
    }

    /// Why the frames of a target can't be used, in the words of the remark on it.
    pub fn why_no_frames(&self, name: &str) -> String {
        let about = |remark: &&Remark| {
            remark.target.as_deref() == Some(name) && remark.severity == Severity::NoFrames
        };
        let remark = self.remarks.iter().find(about);
        remark.map_or("it has no frames".to_string(), |remark| remark.text.clone())
    }

    /// The sequence of this name, in whatever spelling.
    pub fn find(&self, name: &str) -> Option<&Sequence> {
        self.sequences.iter().find(|sequence| names::same(&sequence.name, name))
    }
}

fn read(root: &Path) -> Result<Dataset, Error> {
    if let Some(dataset) = otb::read(root)? {
        return Ok(dataset);
    }
    if let Some(dataset) = truth_only::read(root)? {
        return Ok(dataset);
    }
    Err(Error::NoDataset {
        path: root.to_path_buf(),
        reason: "there are neither sequences of a known layout nor text files of boxes in it"
            .into(),
    })
}

/// A dataset in the making.
struct Builder {
    dataset: Dataset,
}

impl Builder {
    fn new(layout: Layout, root: &Path) -> Self {
        let (sequences, remarks) = (Vec::new(), Vec::new());
        Self { dataset: Dataset { layout, root: root.to_path_buf(), sequences, remarks } }
    }

    fn remark(&mut self, target: &str, severity: Severity, text: impl Into<String>) {
        let target = Some(target.to_string());
        self.dataset.remarks.push(Remark { target, severity, text: text.into() });
    }

    /// Adds a target, or the reason why it can't be.
    fn add(
        &mut self,
        name: &str,
        truth: Result<truth::Truth, Error>,
        frames: Result<Vec<PathBuf>, String>,
    ) {
        let truth = match truth {
            Ok(truth) => truth,
            Err(error) => return self.remark(name, Severity::NoTruth, error.to_string()),
        };
        for oddity in &truth.oddities {
            self.remark(name, Severity::Note, oddity);
        }
        let frames = frames.unwrap_or_else(|reason| {
            self.remark(name, Severity::NoFrames, reason);
            Vec::new()
        });
        let (name, attributes) = (name.to_string(), Vec::new());
        self.dataset.sequences.push(Sequence { name, frames, truth: truth.boxes, attributes });
    }
}
