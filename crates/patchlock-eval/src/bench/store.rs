//! Runs on disk: `OUT/<tracker>/manifest.json`, and of each run `OUT/<tracker>/<scheme>/<target>/<run>.txt` with `<run>.json` beside it.
//!
//! The text has a box a line as the dataset's own truth has them, with all digits of the numbers, so that they are read back as they were
//! written; a box that was not given is `NaN,NaN,NaN,NaN`. The JSON is the manifest of the run. It is written after the text and holds the text's hash: a run is complete
//! when both are there and agree, so nothing half-written is ever taken for a result. Every file is written under a temporary name, flushed to the
//! disk and renamed.
//!
//! `<run>` is the seed, with `-<start>` behind it in TRE and SRE.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use patchlock::{BoundingBox, TrackerConfig};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use sha2::{Digest, Sha256};

use super::machine::Machine;
use super::schemes::{Scheme, Start};
use crate::Error;

/// Number of this format.
const FORMAT: u32 = 1;
/// Name of a tracker's manifest.
pub const MANIFEST: &str = "manifest.json";

/// What was run: two runs belong together only if all of it is the same.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum Identity {
    /// The tracker of this project.
    Patchlock {
        /// Version of the program.
        version: String,
        /// Name of the preset that the configuration began with.
        preset: String,
        /// The configuration. Its seed is 0: each run has its own.
        configuration: Box<TrackerConfig>,
    },
    /// Another program.
    Trax {
        /// The command line that starts it.
        command: Vec<String>,
    },
}

impl Identity {
    /// The tracker of this project with a configuration that began as a preset.
    pub fn patchlock(configuration: &TrackerConfig, preset: &str) -> Self {
        Self::Patchlock {
            version: env!("CARGO_PKG_VERSION").to_string(),
            preset: preset.to_string(),
            configuration: Box::new(TrackerConfig { seed: 0, ..configuration.clone() }),
        }
    }

    /// SHA-256 of its JSON, in hexadecimal.
    pub fn hash(&self) -> String {
        sha256(serde_json::to_string(self).unwrap_or_default().as_bytes())
    }

    /// The same as fields, as manifests hold it.
    fn fields(&self) -> Value {
        serde_json::to_value(self).unwrap_or_default()
    }
}

/// What is different here from what is there, in words.
fn difference(there: &Value, here: &Value) -> String {
    let (there, here) = (flat(there), flat(here));
    let value = |fields: &BTreeMap<String, String>, name: &String| {
        fields.get(name).cloned().unwrap_or("not set".to_string())
    };
    let names: BTreeSet<&String> = there.keys().chain(here.keys()).collect();
    let differing: Vec<String> = names
        .into_iter()
        .map(|name| (name, value(&there, name), value(&here, name)))
        .filter(|(_, there, here)| there != here)
        .map(|(name, there, here)| format!("{name} is {there} there and {here} here"))
        .collect();
    crate::names::some_of(&differing)
}

/// The fields of an object, those of an object in it as fields of their own.
fn flat(value: &Value) -> BTreeMap<String, String> {
    let Some(fields) = value.as_object() else { return BTreeMap::new() };
    let fields = fields.iter().flat_map(|(name, value)| match value.as_object() {
        Some(_) => flat(value),
        None => BTreeMap::from([(name.clone(), value.to_string())]),
    });
    fields.collect()
}

/// `manifest.json` of a tracker.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Number of the format of this folder.
    pub format: u32,
    /// The tracker's name.
    pub tracker: String,
    /// Hash of `subject`.
    pub configuration_hash: String,
    /// What was run: the fields of an [`Identity`], perhaps of another version, or what another program that writes this layout says of itself.
    pub subject: Value,
}

/// `<run>.json`: everything about one run but its boxes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunManifest {
    /// The tracker's name.
    pub tracker: String,
    /// Hash of `subject`.
    pub configuration_hash: String,
    /// What was run: the fields of an [`Identity`], perhaps of another version, or what another program that writes this layout says of itself.
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
    /// Name of the first frame's file.
    pub first_frame: String,
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

/// One run that is to be made.
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

/// The folder of one tracker and scheme.
#[derive(Debug, Clone)]
pub struct Store {
    folder: PathBuf,
    tracker: String,
    scheme: Scheme,
    subject: Identity,
    hash: String,
    origin: f64,
}

impl Store {
    /// Opens the tracker's folder, or makes it.
    ///
    /// # Errors
    /// [`Error::Conflict`] where the folder holds runs of something else; [`Error::Read`], [`Error::Write`].
    pub fn open(
        out: &Path,
        tracker: &str,
        scheme: Scheme,
        subject: Identity,
        origin: f64,
    ) -> Result<Self, Error> {
        let folder = out.join(tracker);
        fs::create_dir_all(&folder).map_err(|error| Error::write(&folder, error))?;
        let hash = subject.hash();
        let store = Self { folder, tracker: tracker.to_string(), scheme, subject, hash, origin };
        store.claim()?;
        Ok(store)
    }

    /// Puts the manifest there, or checks the one that is: another shard may have been quicker.
    fn claim(&self) -> Result<(), Error> {
        let path = self.folder.join(MANIFEST);
        let manifest = Manifest {
            format: FORMAT,
            tracker: self.tracker.clone(),
            configuration_hash: self.hash.clone(),
            subject: self.subject.fields(),
        };
        let mut text = serde_json::to_string_pretty(&manifest).unwrap_or_default();
        text.push('\n');
        if !path.exists() && place(&path, text.as_bytes(), false)? {
            return Ok(());
        }
        let there: Manifest = read_json(&path)?;
        if there.configuration_hash != self.hash {
            let difference = difference(&there.subject, &self.subject.fields());
            return Err(Error::Conflict { path: self.folder.clone(), difference });
        }
        Ok(())
    }

    /// The folder of the tracker.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The file of a run without its ending.
    fn stem(&self, task: &Task<'_>) -> PathBuf {
        let run = match self.scheme {
            Scheme::Ope => task.seed.to_string(),
            Scheme::Tre | Scheme::Sre => format!("{}-{}", task.seed, task.start.variant),
        };
        self.folder.join(self.scheme.name()).join(task.target).join(run)
    }

    /// Whether the run is there, complete.
    ///
    /// # Errors
    /// [`Error::Conflict`] where a complete run of this name began elsewhere: it is one of another dataset.
    pub fn holds(&self, task: &Task<'_>) -> Result<bool, Error> {
        let stem = self.stem(task);
        let Ok(manifest) = read_json::<RunManifest>(&stem.with_extension("json")) else {
            return Ok(false);
        };
        let Ok(text) = fs::read(stem.with_extension("txt")) else { return Ok(false) };
        if sha256(&text) != manifest.boxes_sha256 || manifest.configuration_hash != self.hash {
            return Ok(false);
        }
        let same = manifest.given == task.start.bbox
            && manifest.frames == task.frames.len()
            && manifest.first == task.start.first;
        if !same {
            let b = manifest.given;
            let difference = format!(
                "its run on {} has {} frames from the box {},{},{},{}",
                task.target, manifest.frames, b.x, b.y, b.w, b.h
            );
            return Err(Error::Conflict { path: self.folder.clone(), difference });
        }
        Ok(true)
    }

    /// Writes a complete run.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub fn keep(
        &self,
        task: &Task<'_>,
        boxes: &[Option<BoundingBox>],
        seconds: Vec<f64>,
        threads: usize,
        jobs: usize,
    ) -> Result<(), Error> {
        let stem = self.stem(task);
        let folder = stem.parent().unwrap_or(&self.folder);
        fs::create_dir_all(folder).map_err(|error| Error::write(folder, error))?;
        let text = text_of(boxes, self.origin);
        let manifest = RunManifest {
            tracker: self.tracker.clone(),
            configuration_hash: self.hash.clone(),
            subject: self.subject.fields(),
            protocol: self.scheme.name().to_string(),
            target: task.target.to_string(),
            seed: task.seed,
            variant: task.start.variant,
            first: task.start.first,
            given: task.start.bbox,
            frames: boxes.len(),
            first_frame: task
                .frames
                .first()
                .map(|path| crate::files::name_of(path))
                .unwrap_or_default(),
            origin: self.origin,
            machine: Machine::here(),
            threads,
            jobs,
            boxes_sha256: sha256(text.as_bytes()),
            seconds,
        };
        place(&stem.with_extension("txt"), text.as_bytes(), true)?;
        let json = serde_json::to_string(&manifest).unwrap_or_default();
        place(&stem.with_extension("json"), json.as_bytes(), true)?;
        Ok(())
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

/// SHA-256 in hexadecimal.
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Reads a JSON file.
pub(crate) fn read_json<T: for<'de> Deserialize<'de>>(path: &Path) -> Result<T, Error> {
    let text = fs::read(path).map_err(|error| Error::read(path, error))?;
    serde_json::from_slice(&text)
        .map_err(|error| Error::Manifest { path: path.to_path_buf(), reason: error.to_string() })
}

/// Puts a complete file in its place. Without `replace` a file that is there stays, and the answer is `false`.
fn place(path: &Path, bytes: &[u8], replace: bool) -> Result<bool, Error> {
    let cannot = |error| Error::write(path, error);
    let folder = path.parent().unwrap_or(Path::new("."));
    let mut builder = tempfile::Builder::new();
    builder.prefix(".patchlock-").suffix(".part");
    #[cfg(unix)]
    {
        // Temporary files are private; a result should have the permissions of any other new file.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    let mut file = builder.tempfile_in(folder).map_err(cannot)?;
    file.write_all(bytes).and_then(|()| file.as_file().sync_all()).map_err(cannot)?;
    if replace {
        file.persist(path).map_err(|error| cannot(error.error))?;
        return Ok(true);
    }
    match file.persist_noclobber(path) {
        Ok(_) => Ok(true),
        Err(error) if error.error.kind() == std::io::ErrorKind::AlreadyExists => Ok(false),
        Err(error) => Err(cannot(error.error)),
    }
}
