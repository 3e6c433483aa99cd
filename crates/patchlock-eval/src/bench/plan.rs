//! What a benchmark has to do: the runs that are to be made, and where they are kept.

use std::path::{Path, PathBuf};
use std::time::Duration;

use super::runner::{self, Failure};
use super::schemes::Scheme;
use super::store::{Identity, Series, Store, Task};
use crate::dataset::{Dataset, Layout, Remark, selection};
use crate::{Error, settings};

/// More seeds than anybody runs.
pub const MOST_SEEDS: u64 = 10_000;
/// More seconds than anybody waits for an answer: a day.
pub const MOST_SECONDS: u64 = 86_400;

/// What the user asks for.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// The folder with the sequences.
    pub dataset: PathBuf,
    /// Folder for the results.
    pub out: PathBuf,
    /// What is run.
    pub entrant: Entrant,
    /// Where it begins.
    pub scheme: Scheme,
    /// Number of seeds to run each target with, from that of the settings on.
    pub seeds: u64,
    /// Only these targets, or all targets of these sequences; all where it is empty.
    pub sequences: Vec<String>,
    /// Only targets that have at least one of these attributes; all where it is empty.
    pub attributes: Vec<String>,
    /// Only this part of the runs, counted from 1, of so many.
    pub shard: (usize, usize),
}

/// A tracker that is run.
#[derive(Debug, Clone, PartialEq)]
pub enum Entrant {
    /// Ours.
    Patchlock {
        /// The settings to begin with.
        preset: String,
        /// A file of settings that differ.
        config: Option<PathBuf>,
        /// Name of the results; without one, that of the file or of the preset.
        name: Option<String>,
    },
    /// Another program, that speaks TraX.
    Program {
        /// Its command line, as for a shell.
        command: String,
        /// Name of the results.
        name: String,
        /// How long it has for each answer.
        patience: Duration,
    },
}

impl Entrant {
    /// How long an answer may take. Our tracker is not waited for.
    pub fn patience(&self) -> Duration {
        match self {
            Self::Patchlock { .. } => Duration::ZERO,
            Self::Program { patience, .. } => *patience,
        }
    }

    /// What is run, and the seed to begin with.
    fn identity(&self) -> Result<(Identity, u64), Error> {
        match self {
            Self::Patchlock { preset, config, .. } => {
                let config = settings::resolve(preset, config.as_deref(), None)?;
                Ok((Identity::patchlock(&config, preset), config.seed))
            }
            Self::Program { command, .. } => {
                let words = shell_words::split(command).ok().filter(|words| !words.is_empty());
                let words = words.ok_or_else(|| Error::CommandLine(command.clone()))?;
                Ok((Identity::Trax { command: words }, 0))
            }
        }
    }

    /// The name of the tracker's folder.
    fn folder_name(&self) -> Result<String, Error> {
        let name = match self {
            Self::Patchlock { name: Some(name), .. } | Self::Program { name, .. } => name.clone(),
            Self::Patchlock { preset, config, .. } => {
                let stem = config.as_deref().and_then(Path::file_stem);
                stem.map_or_else(|| preset.clone(), |stem| stem.to_string_lossy().into_owned())
            }
        };
        let is_plain = !name.is_empty() && !name.starts_with('.') && !name.contains(['/', '\\']);
        if is_plain { Ok(name) } else { Err(Error::FolderName(name)) }
    }
}

/// What there is to do.
pub struct Plan<'a> {
    /// Where the runs are kept.
    pub store: Store,
    /// The runs that are to be made.
    pub tasks: Vec<Task<'a>>,
    /// How many are there already.
    pub before: usize,
    /// Why others can't be made.
    pub failures: Vec<Failure>,
}

/// Looks what there is to do on a dataset, that of the options, and opens the store.
///
/// # Errors
/// What is wrong with the options, or can't be read or written.
pub fn plan<'a>(options: &Options, dataset: &'a Dataset) -> Result<Plan<'a>, Error> {
    let (subject, first_seed) = options.entrant.identity()?;
    if dataset.layout == Layout::TruthOnly {
        return Err(Error::NoFrames { path: options.dataset.clone() });
    }
    let chosen = selection::choose(dataset, &options.sequences, &options.attributes)?;
    let seeds: Vec<u64> = (0..options.seeds).map(|k| first_seed + k).collect();
    let (tasks, mut failures) = runner::tasks(dataset, &chosen.sequences, options.scheme, &seeds);
    failures.extend(chosen.without_truth.into_iter().map(without_truth));
    let (part, parts) = options.shard;
    let tasks = runner::shard(tasks, part, parts);

    let (tracker, origin) = (options.entrant.folder_name()?, dataset.origin());
    let series = Series { tracker, scheme: options.scheme, subject, origin };
    let store = Store::open(&options.out, series)?;
    let all = tasks.len();
    let tasks = runner::missing(tasks, &store)?;
    let before = all - tasks.len();
    Ok(Plan { store, tasks, before, failures })
}

fn without_truth(remark: &Remark) -> Failure {
    let target = remark.target.clone().unwrap_or_default();
    Failure { target, run: String::new(), error: Error::Sequence(remark.text.clone()) }
}
