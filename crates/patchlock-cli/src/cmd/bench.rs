//! `patchlock bench`: a tracker over all sequences of a dataset, to trajectories on disk.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::Result;
use clap::Args;
use patchlock_eval::bench::runner::{self, Failure};
use patchlock_eval::bench::schemes::Scheme;
use patchlock_eval::bench::store::{Identity, Series, Store, Task};
use patchlock_eval::bench::subject;
use patchlock_eval::dataset::{Dataset, Layout, Remark};
use patchlock_eval::names::{self, counted};

use crate::complaint::{Complaint, failed, interrupted, usage};
use crate::output::printed::{print, quoted};
use crate::progress::RunsProgress;
use crate::whole::{threads, whole};
use crate::{interrupt, selection, settings};

const EXAMPLES: &str = "\
EXAMPLES:
  patchlock bench OTB --out out
      every target of the folder OTB once, with the preset paper, to out/paper
  patchlock bench OTB --out out --seeds 5 --sequences David,Jogging
      five seeds of three targets: Jogging has two
  patchlock bench OTB --out out --config wide.toml --name wide --attributes FM,MB
      other settings under a name of their own, on the targets with fast motion or motion blur
  patchlock bench OTB --out out --shard 1/4
      the first quarter of the work; all four may run at once, on machines that share the folder
  patchlock bench OTB --out out --cmd \"python3 my_tracker.py\" --name mine
      a tracker of your own that speaks TraX, measured in the same way
  patchlock score out --truth OTB
      then: the scores

It can be killed at any moment: the same command goes on where it stopped, with the same results. Times are honest only while nothing else
runs and with --jobs 1.";

/// Runs a tracker over the sequences of a dataset, and keeps boxes and times of each run
///
/// DATASET is recognised by looking; patchlock dataset DIR says what is in a folder. Boxes go to OUT/NAME/PROTOCOL/TARGET/SEED.txt, a
/// line a frame as the truth has them, and everything about the run to .json beside it: settings and their hash, seed, machine, times.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct BenchArgs {
    /// The folder with the sequences
    pub dataset: PathBuf,

    /// Folder for the results; it is made if it is missing
    #[arg(long, value_name = "DIR")]
    out: PathBuf,

    /// Where the tracker begins: ope (the first frame), tre (20 start frames), sre (12 first boxes)
    #[arg(long, value_name = "NAME", default_value = "ope")]
    protocol: Scheme,

    /// The set of settings to begin with: paper, or fast, which weighs fewer candidates by fewer patches
    #[arg(long, value_name = "NAME", default_value = "paper")]
    preset: String,

    /// Settings that differ from the preset, as TOML; see patchlock config
    #[arg(long, value_name = "FILE.toml")]
    config: Option<PathBuf>,

    /// Run another tracker instead of ours: a program that speaks TraX (protocol 1 to 4, text on its standard input and output, images as paths). It is
    /// started anew for each run, with the seed in the variable PATCHLOCK_SEED. Its times include reading the images
    #[arg(long, value_name = "PROGRAM ...", conflicts_with_all = ["preset", "config", "threads"], requires = "name")]
    cmd: Option<String>,

    /// Seconds to wait for each answer of the program of --cmd
    #[arg(long, value_name = "S", default_value_t = 60, value_parser = whole::<u64>(1, 86_400), allow_negative_numbers = true)]
    timeout: u64,

    /// Name of the results [default: that of the settings file, or of the preset]
    #[arg(long)]
    name: Option<String>,

    /// Number of seeds to run each target with, from that of the settings on
    #[arg(long, value_name = "K", default_value_t = 1, value_parser = whole::<u64>(1, 10_000), allow_negative_numbers = true)]
    seeds: u64,

    /// Only these targets, or all targets of these sequences
    #[arg(long, value_name = "A,B", value_delimiter = ',')]
    sequences: Vec<String>,

    /// Only targets that have at least one of these attributes
    #[arg(long, value_name = "IV,OCC", value_delimiter = ',')]
    attributes: Vec<String>,

    /// Runs side by side, each on its share of the threads; with more than 1 the times say nothing about the speed
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = threads::<u64>(), allow_negative_numbers = true)]
    jobs: u64,

    /// Threads for all runs together [default: one for each core]; the boxes are the same for any number
    #[arg(long, value_name = "N", value_parser = threads::<u64>(), allow_negative_numbers = true)]
    threads: Option<u64>,

    /// Only the Ith of N parts of the runs, counted from 1; all parts may use one folder
    #[arg(long, value_name = "I/N", value_parser = parse_shard)]
    shard: Option<(usize, usize)>,

    /// No progress bar
    #[arg(long, short)]
    quiet: bool,
}

impl BenchArgs {
    /// How long an answer of the program of `--cmd` may take.
    pub fn patience(&self) -> Duration {
        Duration::from_secs(self.timeout)
    }
}

fn parse_shard(text: &str) -> Result<(usize, usize), String> {
    let numbers = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
    numbers
        .filter(|&(i, n): &(usize, usize)| (1..=n).contains(&i))
        .ok_or_else(|| "it must be I/N with I from 1 to N, such as 1/4".to_string())
}

/// Runs what is not there yet.
pub fn run(args: &BenchArgs) -> Result<()> {
    let dataset = Dataset::open(&args.dataset).map_err(Complaint::from)?;
    let Plan { store, tasks, before, mut failures } = plan(args, &dataset)?;
    interrupt::listen()?;
    let jobs = args.jobs as usize;
    let threads = threads_each(args.threads, jobs);
    let subject = &store.series().subject;
    let make = |seed| subject::start(subject, seed, threads, args.patience());
    let progress = RunsProgress::new(&tasks, args.quiet);
    failures.extend(runner::run(&tasks, &store, &make, jobs, threads, &progress));
    let made = progress.finish();
    tell(args, &store, made, before, &failures);
    conclude(&tasks, made, &failures)
}

/// What a command line asks for.
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

/// Looks what there is to do, and opens the store.
pub fn plan<'a>(args: &BenchArgs, dataset: &'a Dataset) -> Result<Plan<'a>> {
    let (subject, first_seed) = entrant(args)?;
    if dataset.layout == Layout::TruthOnly {
        return Err(usage(format!("{} holds truth without frames", args.dataset.display()))
            .hint(
                "name the folder of the sequences; patchlock dataset DIR shows what is recognised",
            )
            .into());
    }
    let chosen = selection::choose(dataset, &args.sequences, &args.attributes)?;
    let seeds: Vec<u64> = (0..args.seeds).map(|k| first_seed + k).collect();
    let (tasks, mut failures) = runner::tasks(dataset, &chosen.sequences, args.protocol, &seeds);
    failures.extend(chosen.without_truth.into_iter().map(without_truth));
    let (part, parts) = args.shard.unwrap_or((1, 1));
    let tasks = runner::shard(tasks, part, parts);

    let (tracker, origin) = (name(args)?, dataset.origin());
    let series = Series { tracker, scheme: args.protocol, subject, origin };
    let store = Store::open(&args.out, series).map_err(Complaint::from)?;
    let all = tasks.len();
    let tasks = runner::missing(tasks, &store).map_err(Complaint::from)?;
    let before = all - tasks.len();
    Ok(Plan { store, tasks, before, failures })
}

fn without_truth(remark: &Remark) -> Failure {
    let target = remark.target.clone().unwrap_or_default();
    let error = patchlock_eval::Error::Sequence(remark.text.clone());
    Failure { target, run: String::new(), error }
}

/// What is to be run, and the seed to begin with.
fn entrant(args: &BenchArgs) -> Result<(Identity, u64)> {
    let Some(command) = &args.cmd else {
        let config = settings::resolve(&args.preset, args.config.as_deref(), None)?;
        return Ok((Identity::patchlock(&config, &args.preset), config.seed));
    };
    let words = shell_words::split(command).ok().filter(|words| !words.is_empty());
    let command = words.ok_or_else(|| {
        usage(format!("--cmd {command}: it is no command line"))
            .hint("quote it as a shell wants it: --cmd \"python3 'my tracker.py'\"")
    })?;
    Ok((Identity::Trax { command }, 0))
}

/// The share of one run.
fn threads_each(threads: Option<u64>, jobs: usize) -> usize {
    let cores = || std::thread::available_parallelism().map_or(1, usize::from);
    (threads.map_or_else(cores, |threads| threads as usize) / jobs).max(1)
}

/// The name of the tracker's folder.
fn name(args: &BenchArgs) -> Result<String, Complaint> {
    let stem = args.config.as_deref().and_then(Path::file_stem).map(|stem| stem.to_string_lossy());
    let name = match (&args.name, stem) {
        (Some(name), _) => name.clone(),
        (None, Some(stem)) => stem.into_owned(),
        (None, None) => args.preset.clone(),
    };
    let is_plain = !name.is_empty() && !name.starts_with('.') && !name.contains(['/', '\\']);
    if is_plain {
        return Ok(name);
    }
    Err(usage(format!("--name {name}: it is the name of a folder in --out"))
        .hint("letters, digits, - and _ are good"))
}

/// What was done, and what to do next.
fn tell(args: &BenchArgs, store: &Store, made: usize, before: usize, failures: &[Failure]) {
    for failure in failures {
        let run =
            if failure.run.is_empty() { String::new() } else { format!(" ({})", failure.run) };
        eprintln!("error: {}{run}: {}", failure.target, failure.error);
    }
    if args.quiet || interrupt::requested() {
        return;
    }
    let already = if before > 0 { format!(", {before} there already") } else { String::new() };
    // Nobody may be reading; the runs are there all the same.
    let _ = print(&format!(
        "{} made{already}; they are in {}\nnext: patchlock score {} --truth {}\n",
        counted(made, "run"),
        store.folder().display(),
        quoted(&args.out),
        quoted(&args.dataset)
    ));
}

fn conclude(tasks: &[Task<'_>], made: usize, failures: &[Failure]) -> Result<()> {
    if interrupt::requested() {
        let left = tasks.len() - made;
        return Err(interrupted(format!(
            "stopped; {} left, and the same command goes on there",
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
    .hint("the others are complete; the same command tries again what is missing")
    .into())
}
