//! What `patchlock bench` writes; see [`crate::bench::store`]. The runs of each protocol are results of their own.

use std::fs;
use std::path::Path;

use super::{Layout, Results, Run, boxes};
use crate::bench::schemes::Scheme;
use crate::bench::store::{self, MANIFEST, Manifest, RunManifest};
use crate::files::{ends_with, entries};
use crate::{Error, names, text};

/// Reads a tracker's folder.
pub fn read(folder: &Path, origin: f64) -> Result<Vec<Results>, Error> {
    let manifest: Manifest = store::read_json(&folder.join(MANIFEST))?;
    let mut all = Vec::new();
    for scheme in Scheme::ALL {
        let inner = folder.join(scheme.name());
        if !inner.is_dir() {
            continue;
        }
        let name = match scheme {
            Scheme::Ope => manifest.tracker.clone(),
            Scheme::Tre | Scheme::Sre => {
                format!("{} {}", manifest.tracker, scheme.name().to_uppercase())
            }
        };
        let mut results = Results::new(name, Layout::Bench);
        for target in entries(&inner)?.into_iter().filter(|path| path.is_dir()) {
            read_target(&target, &manifest, origin, &mut results)?;
        }
        if !results.is_empty() {
            all.push(results);
        }
    }
    Ok(all)
}

fn read_target(
    folder: &Path,
    tracker: &Manifest,
    origin: f64,
    results: &mut Results,
) -> Result<(), Error> {
    let (mut unfinished, mut shared) = (Vec::new(), false);
    for file in entries(folder)?.into_iter().filter(|path| ends_with(path, "txt")) {
        let manifest = file.with_extension("json");
        if !manifest.exists() {
            unfinished.push(file.display().to_string());
            continue;
        }
        match read_run(&file, &manifest, tracker, origin) {
            Ok((run, jobs)) => {
                shared |= jobs > 1;
                results.runs.push(run);
            }
            Err(error) => results.faults.push(error.to_string()),
        }
    }
    if !unfinished.is_empty() {
        results.notes.push(format!("not complete and left out: {}", names::some_of(&unfinished)));
    }
    let note = "several runs went on side by side, so their times say nothing about the speed";
    if shared && !results.notes.iter().any(|other| other == note) {
        results.notes.push(note.to_string());
    }
    Ok(())
}

fn read_run(
    file: &Path,
    manifest_file: &Path,
    tracker: &Manifest,
    origin: f64,
) -> Result<(Run, usize), Error> {
    let manifest: RunManifest = store::read_json(manifest_file)?;
    let wrong = |reason: &str| Error::Manifest {
        path: manifest_file.to_path_buf(),
        reason: reason.to_string(),
    };
    let bytes = fs::read(file).map_err(|error| Error::read(file, error))?;
    if store::sha256(&bytes) != manifest.boxes_sha256 {
        return Err(wrong("the boxes beside it are not those that it was written for"));
    }
    if manifest.configuration_hash != tracker.configuration_hash {
        return Err(wrong("it is of another configuration than the tracker's manifest.json"));
    }
    let boxes = boxes(file, &text::read(file)?, origin)?;
    let honest = manifest.jobs == 1 && manifest.seconds.len() == boxes.len();
    let run = Run {
        target: manifest.target,
        seed: manifest.seed,
        variant: manifest.variant,
        first: manifest.first,
        boxes,
        seconds: honest.then_some(manifest.seconds),
        file: file.to_path_buf(),
    };
    Ok((run, manifest.jobs))
}
