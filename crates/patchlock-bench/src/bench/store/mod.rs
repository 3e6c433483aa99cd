//! Stores runs on disk: `OUT/<tracker>/manifest.json`, and for each run
//! `OUT/<tracker>/<scheme>/<target>/<run>.txt` with `<run>.json` beside it.
//!
//! The text file has one box per line, counted from 0 or 1 like the dataset's own ground truth,
//! with enough digits to be read back exactly; a missing box is `NaN,NaN,NaN,NaN`. The JSON file is
//! the manifest of the run, with time, score and status of each frame. It is written after the text
//! file and holds its hash: a run is complete if both files exist and agree, so a partly written
//! run is never taken for a result. Every file is written under a temporary name, flushed to disk
//! and renamed.
//!
//! `<run>` is the seed, followed by `-<start>` in TRE and SRE.

mod files;
mod identity;
mod manifest;

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use patchlock_track::files::write;
use serde::{Deserialize, Serialize};

use super::schemes::{Scheme, Start};
use crate::Error;
pub(crate) use files::read_json;
pub use files::sha256;
pub use identity::Identity;
use identity::difference;
pub(in crate::bench) use identity::with_seed;
pub use manifest::{Manifest, RunFiles, RunManifest, Trajectory};

/// Version of the folder's format.
const FORMAT: u32 = 1;
/// File name of a tracker's manifest.
pub const MANIFEST: &str = "manifest.json";

/// A part of a video or of another source of frames.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Clip {
    /// The source, as the caller named it.
    pub source: String,
    /// First frame.
    pub start: usize,
    /// First frame after the clip; `None` for the end of the source.
    pub end: Option<usize>,
    /// Distance from one frame to the next.
    pub stride: usize,
}

/// The key of a run: the names of its files derive from it, and a stored run has to agree with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Run<'a> {
    /// The target's name.
    pub target: &'a str,
    /// Seed of the tracker.
    pub seed: u64,
    /// The frame and box to start on.
    pub start: Start,
    /// The image files, from the first frame of the run on; none for a clip.
    pub frames: &'a [PathBuf],
    /// The clip, if the run is not on image files. Its number of frames may be unknown until it has
    /// been tracked.
    pub clip: Option<&'a Clip>,
}

/// What all runs of a store have in common.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// The name of the tracker and of its folder.
    pub tracker: String,
    /// The protocol.
    pub scheme: Scheme,
    /// The tracker to run.
    pub subject: Identity,
    /// Coordinate of the first pixel in the text files, 0 or 1.
    pub origin: f64,
}

/// The stored runs of one tracker and protocol.
#[derive(Debug, Clone)]
pub struct Store {
    folder: PathBuf,
    series: Series,
    hash: String,
}

impl Store {
    /// Opens the tracker's folder, which is created if necessary.
    ///
    /// # Errors
    /// [`Error::Conflict`] if the folder holds runs of a different tracker; [`Error::Track`] if
    /// it cannot be read or written.
    pub fn open(out: &Path, series: Series) -> Result<Self, Error> {
        let folder = out.join(&series.tracker);
        fs::create_dir_all(&folder).map_err(|error| Error::write(&folder, error))?;
        let hash = series.subject.hash();
        let store = Self { folder, series, hash };
        store.claim()?;
        Ok(store)
    }

    /// Writes the manifest, or checks the existing one. Another process may write it at the same
    /// time.
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
        if !path.exists() {
            match write(&path, text.as_bytes(), false) {
                Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
                written => return written.map_err(|error| Error::write(&path, error)),
            }
        }
        let stored: Manifest = read_json(&path)?;
        if stored.configuration_hash != self.hash {
            let difference = difference(&stored.subject, &self.series.subject.fields());
            return Err(Error::Conflict { path: self.folder.clone(), difference });
        }
        Ok(())
    }

    /// The folder of the tracker.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// What the runs have in common.
    pub fn series(&self) -> &Series {
        &self.series
    }

    /// The path of a run's files without their extension.
    fn stem(&self, run: &Run<'_>) -> PathBuf {
        let name = match self.series.scheme {
            Scheme::Ope => run.seed.to_string(),
            Scheme::Tre | Scheme::Sre => format!("{}-{}", run.seed, run.start.variant),
        };
        self.folder.join(self.series.scheme.name()).join(run.target).join(name)
    }

    /// Whether the store holds the complete run.
    ///
    /// # Errors
    /// [`Error::Conflict`] if a complete run of this name is of other frames or another first box.
    pub fn holds(&self, run: &Run<'_>) -> Result<bool, Error> {
        let stem = self.stem(run);
        let Ok(manifest) = read_json::<RunManifest>(&stem.with_extension("json")) else {
            return Ok(false);
        };
        let Ok(text) = patchlock_track::files::read(&stem.with_extension("txt")) else {
            return Ok(false);
        };
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

    /// Saves the files of a complete run.
    ///
    /// # Errors
    /// [`Error::Track`].
    pub fn keep(&self, run: &Run<'_>, written: &RunFiles) -> Result<(), Error> {
        let stem = self.stem(run);
        let folder = stem.parent().unwrap_or(&self.folder);
        fs::create_dir_all(folder).map_err(|error| Error::write(folder, error))?;
        for (ending, text) in [("txt", &written.boxes), ("json", &written.manifest)] {
            let path = stem.with_extension(ending);
            write(&path, text.as_bytes(), true).map_err(|error| Error::write(&path, error))?;
        }
        Ok(())
    }
}
