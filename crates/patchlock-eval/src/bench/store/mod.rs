//! Runs on disk: `OUT/<tracker>/manifest.json`, and of each run `OUT/<tracker>/<scheme>/<target>/<run>.txt` with `<run>.json` beside it.
//!
//! The text has a box a line as the dataset's own truth has them, with all digits of the numbers, so that they are read back as they were
//! written; a box that was not given is `NaN,NaN,NaN,NaN`. The JSON is the manifest of the run. It is written after the text and holds the text's hash: a run is complete
//! when both are there and agree, so nothing half-written is ever taken for a result. Every file is written under a temporary name, flushed to the
//! disk and renamed.
//!
//! `<run>` is the seed, with `-<start>` behind it in TRE and SRE.

mod files;
mod identity;
mod manifest;

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::schemes::{Scheme, Start};
use crate::Error;
use files::place;
pub(crate) use files::read_json;
pub use files::sha256;
pub use identity::Identity;
use identity::difference;
pub use manifest::{Manifest, RunManifest, Trajectory, Written};

/// Number of this format.
const FORMAT: u32 = 1;
/// Name of a tracker's manifest.
pub const MANIFEST: &str = "manifest.json";

/// One run that is to be made on image files.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Task<'a> {
    /// The target's name.
    pub target: &'a str,
    /// The image files, from the first of the run on.
    pub frames: &'a [PathBuf],
    /// The seed.
    pub seed: u64,
    /// Where it begins.
    pub start: Start,
}

impl Task<'_> {
    /// The run as the store knows it.
    pub fn run(&self) -> Run<'_> {
        let Self { target, frames, seed, start } = *self;
        Run { target, seed, start, footage: Footage::Files(frames) }
    }
}

/// A part of a video or of any other source of frames.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Clip {
    /// The source, as whoever asked for the run wrote it.
    pub source: String,
    /// First frame.
    pub start: usize,
    /// First frame after the clip; `None` for the end of the source.
    pub end: Option<usize>,
    /// Distance from one frame to the next.
    pub stride: usize,
}

/// What a run is tracked on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Footage<'a> {
    /// Image files, from the first of the run on.
    Files(&'a [PathBuf]),
    /// A clip, whose number of frames need not be known before it is tracked.
    Clip(&'a Clip),
}

/// A run: the names of its files follow from it, and what it has to agree with to be taken for this one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Run<'a> {
    /// The target's name.
    pub target: &'a str,
    /// The seed.
    pub seed: u64,
    /// Where it begins.
    pub start: Start,
    /// What it is tracked on.
    pub footage: Footage<'a>,
}

/// What all runs of a store have in common.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// The tracker's name, and that of its folder.
    pub tracker: String,
    /// Where it begins.
    pub scheme: Scheme,
    /// What is run.
    pub subject: Identity,
    /// What the text calls the first pixel, 0 or 1.
    pub origin: f64,
}

/// The folder of one tracker and scheme.
#[derive(Debug, Clone)]
pub struct Store {
    folder: PathBuf,
    series: Series,
    hash: String,
}

impl Store {
    /// Opens the tracker's folder, or makes it.
    ///
    /// # Errors
    /// [`Error::Conflict`] where the folder holds runs of something else; [`Error::Read`], [`Error::Write`].
    pub fn open(out: &Path, series: Series) -> Result<Self, Error> {
        let folder = out.join(&series.tracker);
        fs::create_dir_all(&folder).map_err(|error| Error::write(&folder, error))?;
        let hash = series.subject.hash();
        let store = Self { folder, series, hash };
        store.claim()?;
        Ok(store)
    }

    /// Puts the manifest there, or checks the one that is: another shard may have been quicker.
    fn claim(&self) -> Result<(), Error> {
        let path = self.folder.join(MANIFEST);
        let manifest = Manifest {
            format: FORMAT,
            tracker: self.series.tracker.clone(),
            configuration_hash: self.hash.clone(),
            subject: self.series.subject.fields(),
        };
        let mut text = serde_json::to_string_pretty(&manifest).unwrap_or_default();
        text.push('\n');
        if !path.exists() && place(&path, text.as_bytes(), false)? {
            return Ok(());
        }
        let there: Manifest = read_json(&path)?;
        if there.configuration_hash != self.hash {
            let difference = difference(&there.subject, &self.series.subject.fields());
            return Err(Error::Conflict { path: self.folder.clone(), difference });
        }
        Ok(())
    }

    /// The folder of the tracker.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// What its runs have in common.
    pub fn series(&self) -> &Series {
        &self.series
    }

    /// The file of a run without its ending.
    fn stem(&self, run: &Run<'_>) -> PathBuf {
        let name = match self.series.scheme {
            Scheme::Ope => run.seed.to_string(),
            Scheme::Tre | Scheme::Sre => format!("{}-{}", run.seed, run.start.variant),
        };
        self.folder.join(self.series.scheme.name()).join(run.target).join(name)
    }

    /// Whether the run is there, complete.
    ///
    /// # Errors
    /// [`Error::Conflict`] where a complete run of this name is of something else: of another dataset, or another part of a source.
    pub fn holds(&self, run: &Run<'_>) -> Result<bool, Error> {
        let stem = self.stem(run);
        let Ok(manifest) = read_json::<RunManifest>(&stem.with_extension("json")) else {
            return Ok(false);
        };
        let Ok(text) = fs::read(stem.with_extension("txt")) else { return Ok(false) };
        if sha256(&text) != manifest.boxes_sha256 || manifest.configuration_hash != self.hash {
            return Ok(false);
        }
        match manifest.is_of(run) {
            true => Ok(true),
            false => {
                let difference = manifest.in_words();
                Err(Error::Conflict { path: self.folder.clone(), difference })
            }
        }
    }

    /// Puts the files of a complete run in their place.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub fn keep(&self, run: &Run<'_>, written: &Written) -> Result<(), Error> {
        let stem = self.stem(run);
        let folder = stem.parent().unwrap_or(&self.folder);
        fs::create_dir_all(folder).map_err(|error| Error::write(folder, error))?;
        place(&stem.with_extension("txt"), written.boxes.as_bytes(), true)?;
        place(&stem.with_extension("json"), written.manifest.as_bytes(), true)?;
        Ok(())
    }
}
