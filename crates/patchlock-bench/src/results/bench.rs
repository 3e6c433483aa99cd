//! Reads what `patchlock bench` writes; see [`crate::bench::store`]. The runs of each protocol are
//! separate results.

use std::path::Path;

use super::{Results, Run, boxes};
use crate::Error;
use crate::bench::schemes::{self, Scheme};
use crate::bench::store::{self, MANIFEST, Manifest, RunManifest};
use crate::dataset::Dataset;
use patchlock_track::files::{self, ends_with, entries};
use patchlock_track::{names, text};

/// Reads a tracker's folder.
pub fn read(folder: &Path, truth: &Dataset) -> Result<Vec<Results>, Error> {
    let manifest: Manifest = store::read_json(&folder.join(MANIFEST))?;
    let mut all = Vec::new();
    for scheme in Scheme::ALL {
        let inner = folder.join(scheme.name());
        if !inner.is_dir() {
            continue;
        }
        let name = match scheme {
            Scheme::Ope => manifest.tracker.clone(),
            Scheme::Tre | Scheme::Sre => format!("{} {}", manifest.tracker, scheme.title()),
        };
        let mut results = Results::new(name);
        let mut times = TimingConditions::default();
        for target in entries(&inner)?.into_iter().filter(|path| path.is_dir()) {
            read_target(&target, &manifest, truth.origin(), &mut results, &mut times)?;
        }
        results.notes.extend(times.notes());
        leave_out_incomplete(&mut results, scheme, truth);
        if !results.is_empty() {
            all.push(results);
        }
    }
    Ok(all)
}

/// Leaves out a seed on a target if runs from some starts are missing: it would be scored on other
/// frames than those of the other trackers.
fn leave_out_incomplete(results: &mut Results, scheme: Scheme, truth: &Dataset) {
    let mut runs: Vec<(String, u64)> =
        results.runs.iter().map(|run| (run.target.clone(), run.seed)).collect();
    runs.sort_unstable();
    for same in runs.chunk_by(|a, b| a == b) {
        let ((target, seed), count) = (&same[0], same.len());
        let Some(sequence) = truth.find(target) else { continue };
        let all = schemes::count(scheme, sequence, truth.origin());
        if count < all {
            results.notes.push(format!(
                "{target}, seed {seed}: left out, since only {count} of {all} runs are complete"
            ));
            results.runs.retain(|run| run.target != *target || run.seed != *seed);
        }
    }
    if results.runs.is_empty() {
        results.faults.append(&mut results.notes);
    }
}

/// The conditions under which the runs were timed.
#[derive(Default)]
struct TimingConditions {
    parallel: bool,
    machines: Vec<(String, usize)>,
}

impl TimingConditions {
    fn add(&mut self, manifest: &RunManifest) {
        self.parallel |= manifest.jobs > 1;
        let machine = (manifest.machine.processor.clone(), manifest.threads);
        if !self.machines.contains(&machine) {
            self.machines.push(machine);
        }
    }

    fn notes(&self) -> impl Iterator<Item = String> {
        let shared = self.parallel.then(|| {
            "runs were made in parallel, so their times say nothing about speed".to_string()
        });
        let machines = names::counted(self.machines.len(), "kind");
        let mixed = (self.machines.len() > 1)
            .then(|| format!("the times come from {machines} of processor or number of threads"));
        shared.into_iter().chain(mixed)
    }
}

fn read_target(
    folder: &Path,
    tracker: &Manifest,
    origin: f64,
    results: &mut Results,
    times: &mut TimingConditions,
) -> Result<(), Error> {
    let mut unfinished = Vec::new();
    for file in entries(folder)?.into_iter().filter(|path| ends_with(path, "txt")) {
        let manifest = file.with_extension("json");
        if !manifest.exists() {
            unfinished.push(file.display().to_string());
            continue;
        }
        let run = store::read_json(&manifest).and_then(|manifest: RunManifest| {
            times.add(&manifest);
            read_run(&file, manifest, tracker, origin)
        });
        match run {
            Ok(run) => results.runs.push(run),
            Err(error) => results.faults.push(error.to_string()),
        }
    }
    if !unfinished.is_empty() {
        results.notes.push(format!("incomplete and left out: {}", names::some_of(&unfinished)));
    }
    Ok(())
}

fn read_run(
    file: &Path,
    manifest: RunManifest,
    tracker: &Manifest,
    origin: f64,
) -> Result<Run, Error> {
    let wrong = |reason: &str| Error::Manifest {
        path: file.with_extension("json"),
        reason: reason.to_string(),
    };
    let bytes = files::read(file).map_err(|error| Error::read(file, error))?;
    if store::sha256(&bytes) != manifest.boxes_sha256 {
        return Err(wrong("the hash of the boxes beside it does not match"));
    }
    if manifest.configuration_hash != tracker.configuration_hash {
        return Err(wrong("its configuration is not that of the tracker's manifest.json"));
    }
    let boxes = boxes(file, &text::read(file)?, origin)?;
    let counts = [manifest.score.as_ref().map(Vec::len), manifest.status.as_ref().map(Vec::len)];
    if counts.into_iter().flatten().any(|count| count != boxes.len()) {
        return Err(wrong("it does not have one score and status for each box"));
    }
    if let Some(score) = manifest.score.iter().flatten().find(|s| !(0.0..=1.0).contains(*s)) {
        return Err(wrong(&format!("the score {score} is not between 0 and 1")));
    }
    let is_timed = manifest.jobs == 1 && manifest.seconds.len() == boxes.len();
    Ok(Run {
        target: manifest.target,
        seed: manifest.seed,
        variant: manifest.variant,
        first: manifest.first,
        boxes,
        seconds: is_timed.then_some(manifest.seconds),
        scores: manifest.score,
        statuses: manifest.status,
        file: file.to_path_buf(),
    })
}
