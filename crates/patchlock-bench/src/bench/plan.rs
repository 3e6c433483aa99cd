//! Determines which runs a benchmark has to make, and where they are stored.

use std::path::{Path, PathBuf};
use std::time::Duration;

use super::runner::{self, Failure};
use super::schemes::Scheme;
use super::store::{Identity, Run, Series, Store};
use crate::Error;
use crate::dataset::{Dataset, Layout, Remark, selection};
use patchlock_track::settings::{self, Overrides};
use patchlock_track::{ModelPaths, names};

/// Upper limit for the number of seeds.
pub const MOST_SEEDS: u64 = 10_000;
/// Upper limit for the time limit of an answer, in seconds: one day.
pub const MOST_SECONDS: u64 = 86_400;

/// The options of a benchmark.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// The folder with the sequences.
    pub dataset: PathBuf,
    /// Folder for the results.
    pub out: PathBuf,
    /// The tracker to run.
    pub tracker: TrackerSpec,
    /// Where runs start.
    pub scheme: Scheme,
    /// Number of seeds for each target, counted up from the seed of the settings.
    pub seeds: u64,
    /// Only these targets, or all targets of these sequences; empty for all.
    pub sequences: Vec<String>,
    /// Only targets with at least one of these attributes; empty for all.
    pub attributes: Vec<String>,
    /// The part of the runs to make, counted from 1, and the number of parts.
    pub shard: (usize, usize),
}

/// A tracker to run.
#[derive(Debug, Clone, PartialEq)]
pub enum TrackerSpec {
    /// The tracker of this project.
    Patchlock {
        /// The preset to start from.
        preset: String,
        /// A TOML file of settings that override the preset.
        config: Option<PathBuf>,
        /// The network, which takes precedence over that of the settings file.
        paths: ModelPaths,
        /// Name of the results; by default that of the file or of the preset.
        name: Option<String>,
    },
    /// An external program that speaks TraX.
    Program {
        /// Its command line, with the quoting of a shell.
        command: String,
        /// Name of the results.
        name: String,
        /// Time limit for each answer.
        patience: Duration,
    },
}

impl TrackerSpec {
    /// Time limit for each answer of an external program; zero for Patchlock, which has none.
    pub fn patience(&self) -> Duration {
        match self {
            Self::Patchlock { .. } => Duration::ZERO,
            Self::Program { patience, .. } => *patience,
        }
    }

    /// The identity of the tracker, the first seed, and the files of its network.
    fn identity(&self) -> Result<(Identity, u64, ModelPaths), Error> {
        match self {
            Self::Patchlock { preset, config, paths, .. } => {
                let overrides = Overrides { paths: paths.clone(), ..Overrides::default() };
                let (config, paths) = settings::resolve(preset, config.as_deref(), overrides)?;
                Ok((Identity::patchlock(&config, preset), config.seed, paths))
            }
            Self::Program { command, .. } => {
                let words = shell_words::split(command).ok().filter(|words| !words.is_empty());
                let words = words.ok_or_else(|| Error::CommandLine(command.clone()))?;
                Ok((Identity::Trax { command: words }, 0, ModelPaths::default()))
            }
        }
    }

    /// Name of the tracker's folder of results.
    fn folder_name(&self) -> Result<String, Error> {
        let name = match self {
            Self::Patchlock { name: Some(name), .. } | Self::Program { name, .. } => name.clone(),
            Self::Patchlock { preset, config, .. } => {
                let stem = config.as_deref().and_then(Path::file_stem);
                stem.map_or_else(|| preset.clone(), |stem| stem.to_string_lossy().into_owned())
            }
        };
        if names::is_folder_name(&name) { Ok(name) } else { Err(Error::FolderName(name)) }
    }
}

/// The work of a benchmark: a task makes a run.
#[derive(Debug)]
pub struct Plan<T> {
    /// The store that runs are saved to.
    pub store: Store,
    /// The files of the tracker's network.
    pub paths: ModelPaths,
    /// The runs to make.
    pub tasks: Vec<T>,
    /// Number of runs in the store already.
    pub before: usize,
    /// The runs that cannot be made, with the reasons.
    pub failures: Vec<Failure>,
}

/// Determines the runs to make on `dataset`, which is the one of the options, and opens the store.
///
/// # Errors
/// An error if the options are invalid, or if a file cannot be read or written.
pub fn plan<'a>(options: &Options, dataset: &'a Dataset) -> Result<Plan<Run<'a>>, Error> {
    let (subject, first_seed, paths) = options.tracker.identity()?;
    if dataset.layout == Layout::TruthOnly {
        return Err(Error::NoFrames { path: options.dataset.clone() });
    }
    let chosen = selection::choose(dataset, &options.sequences, &options.attributes)?;
    let seeds: Vec<u64> = (0..options.seeds).map(|k| first_seed + k).collect();
    let (tasks, mut failures) = runner::tasks(dataset, &chosen.sequences, options.scheme, &seeds);
    failures.extend(chosen.without_truth.into_iter().map(without_truth));
    let (part, parts) = options.shard;
    let tasks: Vec<Run> = tasks.into_iter().skip(part - 1).step_by(parts).collect();

    let (tracker, origin) = (options.tracker.folder_name()?, dataset.origin());
    let series = Series { tracker, scheme: options.scheme, subject, origin };
    let store = Store::open(&options.out, series)?;
    let all = tasks.len();
    let mut missing = Vec::new();
    for task in tasks {
        if !store.holds(&task)? {
            missing.push(task);
        }
    }
    let before = all - missing.len();
    Ok(Plan { store, paths, tasks: missing, before, failures })
}

fn without_truth(remark: &Remark) -> Failure {
    let target = remark.target.clone().unwrap_or_default();
    Failure { target, run: String::new(), error: Error::Sequence(remark.text.clone()) }
}
