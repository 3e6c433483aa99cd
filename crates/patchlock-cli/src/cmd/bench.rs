//! `patchlock bench`: runs a tracker on all sequences of a dataset and stores the trajectories.

use std::path::PathBuf;
use std::time::Duration;

use anyhow::Result;
use clap::Args;
use patchlock_bench::bench::plan::{self, MOST_SECONDS, MOST_SEEDS, Options, Plan, TrackerSpec};
use patchlock_bench::bench::runner;
use patchlock_bench::bench::schemes::Scheme;
use patchlock_bench::bench::store::{Run, Store};
use patchlock_bench::bench::trackers;
use patchlock_bench::dataset::Dataset;
use patchlock_track::names::{self, counted};

use super::settings::ModelArgs;
use super::{THREADS_SHOWN, presets_shown, threads};
use crate::failure::{Failure, failed, interrupted, say};
use crate::interrupt;
use crate::output::printed::{print, quoted};
use crate::progress::RunsProgress;

const EXAMPLES: &str = "\
EXAMPLES:
  patchlock bench OTB --out out
      tracks every target in the folder OTB once, with the preset robust;
      results go to out/robust
  patchlock bench OTB --out out --seeds 5 --sequences David,Jogging
      five seeds on three targets: Jogging has two
  patchlock bench OTB --out out --config wide.toml --name wide \\
    --attributes FM,MB
      other settings under another name, on the targets with fast motion or
      motion blur
  patchlock bench OTB --out out --shard 1/4
      every fourth run, from the first; all four may run at the same time on
      machines that share the folder
  patchlock bench OTB --out out --cmd \"python3 my_tracker.py\" --name mine
      your own tracker, if it implements the TraX protocol, measured in the same
      way
  patchlock score out --truth OTB
      scores the results

It can be killed at any time: the same command continues where it stopped, with
the same results. Times are meaningful only with --jobs 1 and if nothing else is
running.";

/// Runs a tracker on the sequences of a dataset and stores boxes and times
///
/// The layout of DATASET is detected; patchlock dataset DIR lists the sequences of a folder. Boxes
/// go to OUT/NAME/PROTOCOL/TARGET/SEED.txt, one line per frame in the coordinates of the truth. A
/// .json file beside it describes the run: settings and their hash, seed, machine, times.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct BenchArgs {
    /// The folder with the sequences
    pub dataset: PathBuf,

    /// Folder for the results; created if missing
    #[arg(long, value_name = "DIR")]
    out: PathBuf,

    /// Where tracking starts: ope (the first frame), tre (20 start frames), sre (12 first boxes)
    #[arg(long, value_name = "NAME", default_value = "ope")]
    protocol: Scheme,

    #[arg(long, value_name = "NAME", default_value = "robust", help = presets_shown())]
    preset: String,

    /// Settings that differ from the preset, as TOML; see patchlock config
    #[arg(long, value_name = "FILE.toml")]
    config: Option<PathBuf>,

    #[command(flatten)]
    model: ModelArgs,

    /// Run another tracker: a program that implements the TraX protocol (version 1 to 4, text on
    /// its standard input and output, images as paths). It is restarted for each run, with the seed
    /// in the environment variable PATCHLOCK_SEED. Its times include reading the images
    #[arg(
        long,
        value_name = "PROGRAM ...",
        conflicts_with_all = ["preset", "config", "model", "runtime", "threads"],
        requires = "name"
    )]
    cmd: Option<String>,

    /// Seconds to wait for each answer of the program of --cmd
    #[arg(
        long,
        value_name = "1..=86400",
        default_value = "60",
        value_parser = clap::value_parser!(u64).range(1..=MOST_SECONDS)
    )]
    timeout: u64,

    /// Name of the results [default: the name of the settings file or preset]
    #[arg(long)]
    name: Option<String>,

    /// Number of seeds for each target, counted up from the seed in the settings
    #[arg(
        long,
        value_name = "1..=10000",
        default_value = "1",
        value_parser = clap::value_parser!(u64).range(1..=MOST_SEEDS)
    )]
    seeds: u64,

    /// Only these targets, or all targets of these sequences
    #[arg(long, value_name = "A,B", value_delimiter = ',')]
    sequences: Vec<String>,

    /// Only targets that have at least one of these attributes
    #[arg(long, value_name = "IV,OCC", value_delimiter = ',')]
    attributes: Vec<String>,

    /// Parallel runs, each with its share of the threads; with more than 1 the times do not measure
    /// speed
    #[arg(long, value_name = THREADS_SHOWN, default_value = "1", value_parser = threads())]
    jobs: usize,

    /// Threads for all runs together [default: one per core]; the number does not change the boxes
    #[arg(long, value_name = THREADS_SHOWN, value_parser = threads())]
    threads: Option<usize>,

    /// Only the Ith of N parts of the runs, counted from 1; all parts may share a folder
    #[arg(long, value_name = "I/N", value_parser = parse_shard)]
    shard: Option<(usize, usize)>,

    /// No progress bar
    #[arg(long, short)]
    quiet: bool,
}

impl BenchArgs {
    fn options(&self) -> Options {
        Options {
            dataset: self.dataset.clone(),
            out: self.out.clone(),
            tracker: self.tracker(),
            scheme: self.protocol,
            seeds: self.seeds,
            sequences: self.sequences.clone(),
            attributes: self.attributes.clone(),
            shard: self.shard.unwrap_or((1, 1)),
        }
    }

    fn tracker(&self) -> TrackerSpec {
        match &self.cmd {
            None => TrackerSpec::Patchlock {
                preset: self.preset.clone(),
                config: self.config.clone(),
                paths: self.model.paths(),
                name: self.name.clone(),
            },
            Some(command) => TrackerSpec::Program {
                command: command.clone(),
                // clap requires the name together with --cmd.
                name: self.name.clone().unwrap_or_default(),
                patience: Duration::from_secs(self.timeout),
            },
        }
    }
}

fn parse_shard(text: &str) -> Result<(usize, usize), String> {
    let numbers = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
    numbers
        .filter(|&(i, n): &(usize, usize)| (1..=n).contains(&i))
        .ok_or_else(|| "must be I/N with I from 1 to N, such as 1/4".to_string())
}

/// Performs the runs that are not complete yet.
pub fn run(args: &BenchArgs) -> Result<()> {
    let dataset = Dataset::open(&args.dataset).map_err(Failure::from)?;
    let options = args.options();
    let Plan { store, tasks, before, mut failures, .. } =
        plan::plan(&options, &dataset).map_err(Failure::from)?;
    interrupt::listen()?;
    let jobs = args.jobs;
    let threads = threads_each(args.threads, jobs);
    let subject = &store.series().subject;
    let make = |seed| trackers::start(subject, seed, threads, options.tracker.patience());
    let progress = RunsProgress::new(&tasks, args.quiet);
    failures.extend(runner::run(&tasks, &store, &make, jobs, threads, &progress));
    let made = progress.finish();
    report(args, &store, made, before, &failures);
    conclude(&tasks, made, &failures)
}

/// The number of threads for one run.
fn threads_each(threads: Option<usize>, jobs: usize) -> usize {
    let cores = || std::thread::available_parallelism().map_or(1, usize::from);
    (threads.unwrap_or_else(cores) / jobs).max(1)
}

/// Prints what was done, and the command to run next.
fn report(
    args: &BenchArgs,
    store: &Store,
    made: usize,
    before: usize,
    failures: &[runner::Failure],
) {
    for failure in failures {
        let run =
            if failure.run.is_empty() { String::new() } else { format!(" ({})", failure.run) };
        say(&format!("error: {}{run}: {}", failure.target, failure.error));
    }
    if args.quiet || interrupt::requested() {
        return;
    }
    let already = if before > 0 { format!(", {before} already done") } else { String::new() };
    // A closed pipe is not an error here: the runs are stored.
    let _ = print(&format!(
        "{} done{already}; results are in {}\nnext: patchlock score {} --truth {}\n",
        counted(made, "run"),
        store.folder().display(),
        quoted(&args.out),
        quoted(&args.dataset)
    ));
}

fn conclude(tasks: &[Run<'_>], made: usize, failures: &[runner::Failure]) -> Result<()> {
    if interrupt::requested() {
        let left = tasks.len() - made;
        return Err(interrupted(format!(
            "stopped; {} left; repeat the command to continue",
            counted(left, "run")
        ))
        .into());
    }
    if failures.is_empty() {
        return Ok(());
    }
    let mut targets: Vec<&str> = failures.iter().map(|failure| failure.target.as_str()).collect();
    targets.dedup();
    Err(failed(format!(
        "{} failed, on {}",
        counted(failures.len(), "run"),
        names::some_of(&targets)
    ))
    .hint("the others are complete; repeat the command to retry the failed ones")
    .into())
}
