//! Reads sequences with ground truth from the layouts of public benchmarks. The layout is detected
//! from the files.

mod folders;
mod frames;
mod inspect;
mod otb;
pub mod selection;
mod table;
mod trackingnet;
mod truth;
mod truth_only;
mod uav123;

use std::fmt;
use std::path::{Path, PathBuf};

use patchlock::BoundingBox;
use patchlock_media::natural_order;
use serde::Serialize;

use crate::Error;
use frames::Images;
pub use inspect::Findings;
use patchlock_track::names;
pub use table::{OTB_ATTRIBUTES, counted_part};

/// The layout of a dataset's files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layout {
    /// `<Name>/img/0001.jpg`, `<Name>/groundtruth_rect[.k].txt`.
    Otb,
    /// `<Name>/00000001.jpg`, `<Name>/groundtruth.txt`, `<Name>/absence.label`.
    Got10k,
    /// `<Name>/img/00000001.jpg`, `<Name>/groundtruth.txt`, `<Name>/full_occlusion.txt`,
    /// `<Name>/out_of_view.txt`.
    Lasot,
    /// `data_seq/<set>/<name>/000001.jpg`, `anno/<set>/<name>.txt`.
    Uav123,
    /// `<name>/color/00000001.jpg`, `<name>/groundtruth.txt` with boxes or polygons.
    Vot,
    /// `frames/<name>/0.jpg`, `anno/<name>.txt`.
    TrackingNet,
    /// A folder of text files, `<name>.txt`: ground truth without frames.
    TruthOnly,
}

impl Layout {
    /// Coordinate of the first pixel in the files, 0 or 1. Only OTB documents it. Of the others,
    /// benchmarks with a MATLAB toolkit are assumed to count from 1, the rest from 0. Scores do not
    /// depend on it.
    pub fn origin(self) -> f64 {
        match self {
            Self::Otb | Self::TruthOnly | Self::Lasot | Self::Uav123 => 1.0,
            Self::Got10k | Self::Vot | Self::TrackingNet => 0.0,
        }
    }
}

impl fmt::Display for Layout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Otb => "OTB",
            Self::Got10k => "GOT-10k",
            Self::Lasot => "LaSOT",
            Self::Uav123 => "UAV123",
            Self::Vot => "VOT",
            Self::TrackingNet => "TrackingNet",
            Self::TruthOnly => "text files of truth, without frames",
        })
    }
}

/// One target: its frames and its ground truth.
#[derive(Debug, Clone, PartialEq)]
pub struct Sequence {
    /// Name of the target, such as `Jogging.2`.
    pub name: String,
    /// The image files, one for each row of ground truth; empty if the dataset has no frames or
    /// they do not match the ground truth.
    pub frames: Vec<PathBuf>,
    /// The box in each frame, in pixels counted from 0; `None` for frames without ground truth,
    /// which are not scored.
    pub truth: Vec<Option<BoundingBox>>,
    /// Short names of the attributes, such as `OCC`.
    pub attributes: Vec<String>,
}

/// Something unusual or wrong in a dataset.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Remark {
    /// The target concerned; `None` for the whole dataset.
    pub target: Option<String>,
    /// The consequence.
    pub severity: Severity,
    /// The description.
    pub text: String,
}

/// The consequence of a remark.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub enum Severity {
    /// For information; nothing is lost.
    #[serde(rename = "note")]
    Note,
    /// The frames of the target cannot be used: it can be scored but not tracked.
    #[serde(rename = "no frames")]
    NoFrames,
    /// The ground truth of the target cannot be used: it is not among the sequences.
    #[serde(rename = "no truth")]
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
    /// The layout of the files.
    pub layout: Layout,
    /// The folder.
    pub root: PathBuf,
    /// The targets, in natural order of their names.
    pub sequences: Vec<Sequence>,
    /// Everything unusual or wrong.
    pub remarks: Vec<Remark>,
}

impl Dataset {
    /// Reads the sequences of a folder in any supported layout. Frames are listed, not decoded.
    ///
    /// # Errors
    /// [`Error::Track`]; [`Error::NoDataset`] if the layout is not recognised. A fault in one
    /// sequence is a remark and does not affect the others.
    pub fn open(root: &Path) -> Result<Self, Error> {
        let mut dataset = read(root)?;
        dataset.sequences.sort_by(|a, b| natural_order::compare(&a.name, &b.name));
        table::add_attributes(&mut dataset)?;
        Ok(dataset)
    }

    /// Coordinate of the first pixel in the files, 0 or 1.
    pub fn origin(&self) -> f64 {
        self.layout.origin()
    }

    /// Whether the ground truth has more than the first box, or the sequence a single frame.
    pub fn can_be_scored(sequence: &Sequence) -> bool {
        sequence.truth.len() == 1 || sequence.truth.iter().flatten().nth(1).is_some()
    }

    /// Why the frames of a target cannot be used, as its remark says.
    pub fn why_no_frames(&self, name: &str) -> String {
        let about = |remark: &&Remark| {
            remark.target.as_deref() == Some(name) && remark.severity == Severity::NoFrames
        };
        let remark = self.remarks.iter().find(about);
        remark.map_or("the sequence has no frames".to_string(), |remark| remark.text.clone())
    }

    /// The sequence of this name; case and separators are ignored (see [`names::key`]).
    pub fn find(&self, name: &str) -> Option<&Sequence> {
        self.sequences.iter().find(|sequence| names::same(&sequence.name, name))
    }
}

/// A reader of one layout; returns `None` if the folder has another layout.
type Reader = fn(&Path) -> Result<Option<Dataset>, Error>;

/// The readers, most distinctive layout first.
const READERS: [Reader; 5] =
    [otb::read, uav123::read, trackingnet::read, folders::read, truth_only::read];

fn read(root: &Path) -> Result<Dataset, Error> {
    if root.is_file() {
        let reason = "this is a file; a dataset is a folder".to_string();
        return Err(Error::NoDataset { path: root.to_path_buf(), reason });
    }
    for reader in READERS {
        if let Some(dataset) = reader(root)? {
            return Ok(dataset);
        }
    }
    Err(Error::NoDataset {
        path: root.to_path_buf(),
        reason: "it has neither <Name>/groundtruth_rect.txt (OTB), nor anno and data_seq (UAV123), anno \
                 and frames (TrackingNet), <Name>/groundtruth.txt (GOT-10k, LaSOT, VOT) or a text file of \
                 boxes"
            .to_string(),
    })
}

/// Collects the sequences and remarks of a dataset.
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

    fn remark_all(&mut self, text: String) {
        self.dataset.remarks.push(Remark { target: None, severity: Severity::Note, text });
    }

    /// Adds a target, or a remark on why it cannot be used. `images` is `None` for layouts without
    /// frames.
    fn add(
        &mut self,
        name: &str,
        truth: Result<truth::Truth, Error>,
        images: Option<Images>,
        attributes: Vec<String>,
    ) {
        let mut truth = match truth {
            Ok(truth) => truth,
            Err(error) => return self.remark(name, Severity::NoTruth, error.to_string()),
        };
        for note in &truth.notes {
            self.remark(name, Severity::Note, note);
        }
        let mut frames = Vec::new();
        if let Some(images) = images {
            self.only_the_first(name, &mut truth, &images);
            match frames::fit(&images, truth.boxes.len()) {
                Ok((fitting, note)) => {
                    frames = fitting;
                    note.into_iter().for_each(|note| self.remark(name, Severity::Note, note));
                }
                Err(reason) => self.remark(name, Severity::NoFrames, reason),
            }
        }
        let name = name.to_string();
        self.dataset.sequences.push(Sequence { name, frames, truth: truth.boxes, attributes });
    }

    /// GOT-10k and TrackingNet publish only the first box of each sequence of their test sets.
    fn only_the_first(&mut self, name: &str, truth: &mut truth::Truth, images: &Images) {
        let keeps = matches!(self.dataset.layout, Layout::Got10k | Layout::TrackingNet);
        if keeps && truth.boxes.len() == 1 && images.files.len() > 1 {
            truth.boxes.resize(images.files.len(), None);
            self.remark(
                name,
                Severity::Note,
                "only the first frame has truth: the target can be tracked but not scored",
            );
        }
    }
}
