//! One run as a message: all that a process on any machine needs to make it. Its answer is the two files of the run.

use std::path::PathBuf;
use std::time::Duration;

use anyhow::Result;
use clap::Parser;
use patchlock_eval::bench::runner::{self, Failure};
use patchlock_eval::bench::schemes::Start;
use patchlock_eval::bench::store::{Clip, Footage, Run, Series, Store, Task, Trajectory, Written};
use patchlock_eval::bench::subject::{self, Patchlock};
use patchlock_eval::dataset::Dataset;
use serde::{Deserialize, Serialize};

use crate::cmd::bench::{self, BenchArgs, Plan};
use crate::complaint::{Complaint, failed, interrupted, usage};
use crate::source::{self, Ahead, Order};
use crate::{interrupt, target};

/// A run that is to be made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Job {
    /// What it has in common with the others.
    pub series: Series,
    /// The target's name.
    pub target: String,
    /// The seed.
    pub seed: u64,
    /// Where it begins.
    pub start: Start,
    /// What it is tracked on.
    pub frames: Frames,
    /// Threads that the tracker has.
    pub threads: usize,
    /// Runs that go on side by side, which the manifest says.
    pub side_by_side: usize,
    /// How long another program has for each answer.
    pub patience: Duration,
}

/// Where the frames are.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Frames {
    /// Image files.
    Files(Vec<PathBuf>),
    /// A part of a source; `path` is where it is found from any working directory.
    Clip {
        /// The source's full path.
        path: String,
        /// The part.
        clip: Clip,
    },
}

impl Job {
    /// The run as the store knows it.
    pub fn run(&self) -> Run<'_> {
        let footage = match &self.frames {
            Frames::Files(files) => Footage::Files(files),
            Frames::Clip { clip, .. } => Footage::Clip(clip),
        };
        Run { target: &self.target, seed: self.seed, start: self.start, footage }
    }

    /// Which run on the target it is, in words.
    pub fn label(&self) -> String {
        runner::label(self.seed, self.start.variant)
    }

    /// Makes the run.
    pub fn track(&self) -> Result<Written> {
        let trajectory = match &self.frames {
            Frames::Files(files) => self.track_files(files)?,
            Frames::Clip { path, clip } => self.track_clip(path, clip)?,
        };
        Ok(self.series.write(&self.run(), trajectory, self.threads, self.side_by_side))
    }

    fn track_files(&self, frames: &[PathBuf]) -> Result<Trajectory> {
        let task = Task { target: &self.target, frames, seed: self.seed, start: self.start };
        let subject = &self.series.subject;
        let subject = subject::start(subject, self.seed, self.threads, self.patience);
        let subject = subject.map_err(Complaint::from)?;
        runner::trace(&task, subject, &interrupt::requested, &mut || {})
            .map_err(Complaint::from)?
            .ok_or_else(stopped)
    }

    fn track_clip(&self, path: &str, clip: &Clip) -> Result<Trajectory> {
        let Clip { start, end, stride, .. } = *clip;
        let order = Order { start, end, stride, reverse: false };
        order.check()?;
        let source = source::open(path, false)?;
        let indices = order.indices(source.length())?;
        let mut frames = Ahead::start(source, indices);
        let Some((index, picture)) = frames.next()? else { return Err(order.nothing().into()) };
        let bbox = self.start.bbox;
        target::check(&bbox, index, picture.width, picture.height)?;
        let subject = Patchlock::of(&self.series.subject, self.seed, self.threads);
        let mut subject = subject.map_err(Complaint::from)?;
        let stopped_at =
            |index, error| failed(format!("the tracker stopped in frame {index}: {error}"));
        let mut trajectory = Trajectory::default();
        trajectory.add(subject.begin_on(&picture, bbox).map_err(|error| stopped_at(index, error))?);
        while let Some((index, picture)) = frames.next()? {
            trajectory.add(subject.follow_to(&picture).map_err(|error| stopped_at(index, error))?);
        }
        // The frames also end when somebody asks for the end: that is no complete run.
        if interrupt::requested() { Err(stopped()) } else { Ok(trajectory) }
    }
}

fn stopped() -> anyhow::Error {
    interrupted("stopped").into()
}

/// The command line of `bench` without its verb.
#[derive(Debug, Parser)]
#[command(name = "bench")]
struct BenchLine {
    #[command(flatten)]
    args: BenchArgs,
}

/// The runs that a command line of `patchlock bench` asks for.
#[derive(Debug)]
pub struct BenchJobs {
    /// Those that are to be made.
    pub jobs: Vec<Job>,
    /// Where they are kept.
    pub store: Store,
    /// How many are there already.
    pub before: usize,
    /// Why others can't be made.
    pub failures: Vec<Failure>,
}

/// What `patchlock bench` with these arguments would run, as jobs. How many go on side by side, and on how many threads, is the caller's choice.
pub fn of_bench(arguments: &[String], threads: usize, side_by_side: usize) -> Result<BenchJobs> {
    let line = std::iter::once("bench").chain(arguments.iter().map(String::as_str));
    let BenchLine { args } = BenchLine::try_parse_from(line)
        .map_err(|error| usage(error.to_string().trim_start_matches("error: ").to_string()))?;
    let dataset = Dataset::open(&args.dataset).map_err(Complaint::from)?;
    let Plan { store, tasks, before, failures } = bench::plan(&args, &dataset)?;
    let job = |task: Task<'_>| {
        let frames: std::io::Result<Vec<PathBuf>> =
            task.frames.iter().map(std::path::absolute).collect();
        Ok(Job {
            series: store.series().clone(),
            target: task.target.to_string(),
            seed: task.seed,
            start: task.start,
            frames: Frames::Files(frames?),
            threads,
            side_by_side,
            patience: args.patience(),
        })
    };
    let jobs = tasks.into_iter().map(job).collect::<Result<_>>()?;
    Ok(BenchJobs { jobs, store, before, failures })
}
