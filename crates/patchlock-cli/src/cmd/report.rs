//! `patchlock report`: compares results with the truth on an HTML page.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;
use patchlock_bench::dataset::Dataset;
use patchlock_bench::report::{self, Options, Plot, Report};
use patchlock_bench::results;
use patchlock_bench::score::{self, Scoreboard};
use patchlock_track::files;
use patchlock_track::names::counted;
use rayon::prelude::*;

use crate::failure::{Failure, interrupted, say, usage};
use crate::interrupt;
use crate::output::pending::{self, PendingFile};
use crate::output::printed::print;
use crate::progress::Progress;

/// On one line, it would be wider than a terminal.
const USAGE: &str = "\
patchlock report [OPTIONS] --truth <DATASET|DIR> --out <FILE.html>
                        <RESULTS>...";

const EXAMPLES: &str = "\
EXAMPLES:
  patchlock report out --truth OTB --out report.html
      all trackers whose results are in the folder out, as patchlock bench
      writes them
  patchlock report out published --truth OTB --show paper,Struck \\
    --out report.html
      the same beside other trackers; the report is about paper, and every plot
      labels it and Struck
  patchlock report published/SCM published/Struck \\
    --truth published/annotations --out two.html
      two trackers, with the truth in text files; without frames there are no
      thumbnails

The page needs no other files and no network. Every figure is also written as
SVG, PNG and CSV, with tables of all numbers, to a folder beside the page. The
same input gives the same files.";

/// Compares trackers on one page: plots, tables, differences with intervals, every sequence over
/// time
///
/// RESULTS are folders of trackers, or folders that contain such folders, in the layouts that
/// patchlock score reads. The trackers are compared on the targets that all of them have; the page
/// lists the targets that are left out. A tracker with a trajectory of the wrong length is left out
/// and named.
#[derive(Debug, Args)]
#[command(override_usage = USAGE, after_help = EXAMPLES)]
pub struct ReportArgs {
    /// Folders of trackers, or folders that contain such folders
    #[arg(required = true)]
    results: Vec<PathBuf>,

    /// The dataset, or a folder of text files with the true boxes, one file per target
    #[arg(long, value_name = "DATASET|DIR")]
    truth: PathBuf,

    /// The page to write
    #[arg(long, value_name = "FILE.html")]
    out: PathBuf,

    /// Trackers that every plot labels, whatever their rank; the report is about the first
    /// [default: the tracker with the largest AUC]
    #[arg(long, value_name = "NAME,..", value_delimiter = ',')]
    show: Vec<String>,

    /// How many of the best trackers each plot labels; the others are pale lines
    #[arg(
        long,
        value_name = "0..=40",
        default_value = "10",
        value_parser = clap::value_parser!(u8).range(0..=40)
    )]
    best: u8,

    /// Maximum number of pictures of failures for each target, if the dataset has frames; 0 for
    /// none
    #[arg(
        long,
        value_name = "0..=12",
        default_value = "3",
        value_parser = clap::value_parser!(u8).range(0..=12)
    )]
    thumbnails: u8,

    /// Folder for the figures as SVG, PNG and CSV and for the tables [default: the name of the page
    /// plus _plots]
    #[arg(long, value_name = "DIR")]
    plots: Option<PathBuf>,

    /// Seed of the bootstrap from which the intervals are computed
    #[arg(long, value_name = "0..", default_value = "0")]
    seed: u64,

    /// No progress bar
    #[arg(long, short)]
    quiet: bool,

    /// Replace existing files
    #[arg(long)]
    overwrite: bool,
}

pub fn run(args: &ReportArgs) -> Result<()> {
    if !files::ends_with(&args.out, "html") {
        let message = format!("--out {}: unknown extension; use .html", args.out.display());
        return Err(usage(message).hint("a report is a page").into());
    }
    pending::check(&args.out, args.overwrite)?;
    let folder = args.plots.clone().unwrap_or_else(|| folder_beside(&args.out));
    check_folder(&folder, args.overwrite)?;
    let truth = Dataset::open(&args.truth).map_err(Failure::from)?;
    let results = results::read_all(&args.results, &truth).map_err(Failure::from)?;
    let board = score::scoreboard(&results, &truth);
    for refused in &board.refused {
        say(&format!("note: {} is left out: {}", refused.name, refused.reasons.join("; ")));
    }
    check_shown(&args.show, &board)?;
    let options = Options {
        shown: args.show.clone(),
        best: usize::from(args.best),
        thumbnails: usize::from(args.thumbnails),
        seed: args.seed,
    };
    let report = report::build(&board, &truth, &options).map_err(Failure::from)?;
    interrupt::listen()?;
    let page = PendingFile::create(&args.out, args.overwrite)?;
    write_plots(&folder, &report, args)?;
    let page = page.filled(report.html.as_bytes())?.commit()?;
    Ok(print(&format!(
        "{}: {}\n{}: {} figures as SVG, PNG and CSV, {} tables\n",
        page.display(),
        counted(board.trackers.len(), "tracker"),
        folder.display(),
        report.plots.len(),
        report.tables.len()
    ))?)
}

/// `report_plots` for `report.html`.
fn folder_beside(page: &Path) -> PathBuf {
    let stem = page.file_stem().unwrap_or(page.as_os_str()).to_string_lossy();
    page.with_file_name(format!("{stem}_plots"))
}

fn check_shown(shown: &[String], board: &Scoreboard) -> Result<(), Failure> {
    let names: Vec<&str> = board.trackers.iter().map(|tracker| tracker.name.as_str()).collect();
    match shown.iter().find(|name| !names.contains(&name.as_str())) {
        Some(name) => {
            Err(usage(format!("--show {name}: there is no scored tracker with this name"))
                .hint(format!("the names are: {}", names.join(", "))))
        }
        None => Ok(()),
    }
}

fn check_folder(folder: &Path, overwrite: bool) -> Result<(), Failure> {
    if folder.exists() && !folder.is_dir() {
        return Err(
            usage(format!("{} is not a folder", folder.display())).hint("--plots chooses another")
        );
    }
    let is_used = fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_some());
    if is_used && !overwrite {
        let message = format!("the folder {} is not empty", folder.display());
        return Err(usage(message)
            .hint("--overwrite replaces files of the same names, --plots chooses another folder"));
    }
    Ok(())
}

fn write_plots(folder: &Path, report: &Report, args: &ReportArgs) -> Result<()> {
    fs::create_dir_all(folder)
        .with_context(|| format!("cannot create the folder {}", folder.display()))?;
    let put = |name: String, content: &[u8]| {
        PendingFile::create(&folder.join(name), args.overwrite)?.filled(content)?.commit()
    };
    for (name, table) in &report.tables {
        put(format!("{name}.csv"), report::csv(table).as_bytes())?;
    }
    let progress = Progress::new(Some(report.plots.len()), args.quiet);
    let plot = |plot: &Plot| -> Result<()> {
        if interrupt::requested() {
            return Err(interrupted("stopped; the page was not written").into());
        }
        put(format!("{}.svg", plot.name), plot.svg().as_bytes())?;
        put(format!("{}.csv", plot.name), plot.csv().as_bytes())?;
        let png = plot.png().map_err(Failure::from)?;
        put(format!("{}.png", plot.name), &png)?;
        progress.advance(plot.name.clone());
        Ok(())
    };
    let done: Result<()> = report.plots.par_iter().map(plot).collect();
    progress.finish(&format!("drew {} figures", report.plots.len()));
    done
}
