//! The subcommands, one file each.

pub mod bench;
pub mod config;
pub mod dataset;
pub mod demo;
pub mod export;
pub mod frame;
mod input;
pub mod model;
mod page;
mod pictures;
pub mod report;
pub mod score;
mod settings;
pub mod shell;
pub mod studio;
pub mod track;
pub mod trax;

use std::ops::RangeInclusive;
use std::sync::LazyLock;

use anyhow::Result;
use clap::builder::{PossibleValuesParser, RangedU64ValueParser, TypedValueParser};
use clap::{Args, CommandFactory, Parser, Subcommand};
use patchlock::Preset;
use patchlock_media::{Helper, Limits};
use patchlock_track::session::MOST_THREADS;

/// Valid seeds. Every file format represents whole numbers up to the maximum exactly.
const SEEDS: RangeInclusive<u64> = 0..=(1 << 53) - 1;
/// [`SEEDS`] as the value name, so that the help and error messages show the range.
const SEEDS_SHOWN: &str = "0..=9007199254740991";
const THREADS: RangeInclusive<u64> = 1..=MOST_THREADS as u64;
/// [`THREADS`] as the value name.
const THREADS_SHOWN: &str = "1..=1024";

/// The short help of `--preset`.
fn presets_named() -> String {
    let [others @ .., last] = &Preset::ALL.map(Preset::name);
    format!("Settings to start from: {} or {last}", others.join(", "))
}

/// The help of `--preset`.
fn presets_shown() -> String {
    let preset = |preset: Preset| format!("{preset}: {}", preset.info().purpose);
    format!("Settings to start from. {}", Preset::ALL.map(preset).join(". "))
}

fn on_or_off() -> impl TypedValueParser<Value = bool> {
    PossibleValuesParser::new(["on", "off"]).map(|word| word == "on")
}

fn seed() -> RangedU64ValueParser {
    RangedU64ValueParser::new().range(SEEDS)
}

fn threads() -> RangedU64ValueParser<usize> {
    RangedU64ValueParser::new().range(THREADS)
}

fn positive<T: TryFrom<u64>>() -> RangedU64ValueParser<T> {
    RangedU64ValueParser::new().range(1..)
}

/// The same command, in which all options take negative numbers: those that are out of range are
/// then refused as such.
fn with_negative_numbers(command: clap::Command) -> clap::Command {
    command.mut_args(|arg| {
        let takes_value = arg.get_action().takes_values() && !arg.is_positional();
        arg.allow_negative_numbers(takes_value)
    })
}

/// What a source may claim, for all commands that read one.
#[derive(Debug, Args)]
struct LimitArgs {
    /// Maximum number of pixels of a frame, width times height
    ///
    /// A source with larger frames is refused before memory is allocated.
    #[arg(
        long,
        value_name = "1..",
        default_value_t = Limits::DEFAULT_PIXELS,
        value_parser = positive::<usize>()
    )]
    max_pixels: usize,
}

impl LimitArgs {
    fn limits(&self) -> Limits {
        Limits { pixels: self.max_pixels, ..Limits::default() }
    }
}

const EXAMPLES: &str = "\
EXAMPLES:
  patchlock demo
      renders a scene, tracks it and shows the results
  patchlock track video.mp4 --box 120,80,64,48 --save boxes.csv \\
    --video tracked.mp4
      tracks the object in the box of the first frame
  patchlock config > my.toml
      writes all settings to a file; change some and use it with track --config
      my.toml
  patchlock bench OTB --out out && patchlock score out --truth OTB
      tracks every target of a benchmark and scores it
  patchlock report out --truth OTB --out report.html
      writes a page with plots of all trackers in the folder out

EXIT CODES:
  0    success
  1    failure: a file can't be read or written, or a frame is damaged; earlier
       results are kept
  2    usage error: the options are invalid or do not fit the source
  130  stopped by Ctrl-C; the files are complete up to that frame

A second Ctrl-C stops immediately: track then keeps its tables, and no file is
left partly written.";

static VERSION: LazyLock<String> =
    LazyLock::new(|| format!("{} (build {})", env!("CARGO_PKG_VERSION"), patchlock::BUILD));

/// A visual object tracker. Draw a box in the first frame of a video; get the box in all other
/// frames, a score, and which parts are hidden.
#[derive(Debug, Parser)]
#[command(
    name = "patchlock",
    version = VERSION.as_str(),
    after_help = EXAMPLES,
    max_term_width = 110,
    mut_subcommands = with_negative_numbers
)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Track(Box<track::TrackArgs>),
    Frame(frame::FrameArgs),
    Export(Box<export::ExportArgs>),
    Demo(demo::DemoArgs),
    Studio(studio::StudioArgs),
    Config(config::ConfigArgs),
    Model(model::ModelArgs),
    Dataset(dataset::DatasetArgs),
    Bench(Box<bench::BenchArgs>),
    Score(score::ScoreArgs),
    Report(Box<report::ReportArgs>),
    Trax(trax::TraxArgs),
    Completions(shell::CompletionsArgs),
    Man(shell::ManArgs),
}

impl Cli {
    /// Runs the subcommand. `program` is the name by which the program was called; `helper` may
    /// decode the files of strangers.
    pub fn run(self, program: &str, helper: Option<Helper>) -> Result<()> {
        match self.command {
            Command::Track(args) => track::run(&args),
            Command::Frame(args) => frame::run(&args),
            Command::Export(args) => export::run(&args),
            Command::Demo(args) => demo::run(&args, program),
            Command::Studio(args) => studio::run(&args, helper),
            Command::Config(args) => config::run(&args),
            Command::Model(args) => model::run(&args),
            Command::Dataset(args) => dataset::run(&args),
            Command::Bench(args) => bench::run(&args),
            Command::Score(args) => score::run(&args),
            Command::Report(args) => report::run(&args),
            Command::Trax(args) => trax::run(&args),
            Command::Completions(args) => shell::completions(&args, Self::command()),
            Command::Man(args) => shell::man(&args, Self::command()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn value_names_show_the_ranges() {
        assert_eq!(SEEDS_SHOWN, format!("{SEEDS:?}"));
        assert_eq!(THREADS_SHOWN, format!("{THREADS:?}"));
    }
}
