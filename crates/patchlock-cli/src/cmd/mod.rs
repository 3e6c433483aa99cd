//! The verbs, one file each.

pub mod bench;
pub mod config;
pub mod dataset;
pub mod demo;
pub mod export;
pub mod report;
pub mod score;
pub mod track;
pub mod trax;

use std::ops::RangeInclusive;

use anyhow::Result;
use clap::builder::RangedU64ValueParser;
use clap::{Parser, Subcommand};
use patchlock_eval::session::MOST_THREADS;

/// The seeds that there are: every file format keeps whole numbers up to the largest.
const SEEDS: RangeInclusive<u64> = 0..=(1 << 53) - 1;
/// [`SEEDS`] as the name of the value, so that help and every error show what is allowed.
const SEEDS_SHOWN: &str = "0..=9007199254740991";
/// Numbers of threads.
const THREADS: RangeInclusive<u64> = 1..=MOST_THREADS as u64;
/// [`THREADS`] as the name of the value.
const THREADS_SHOWN: &str = "1..=1024";

/// Reads a seed.
fn seed() -> RangedU64ValueParser {
    RangedU64ValueParser::new().range(SEEDS)
}

/// Reads a number of threads.
fn threads() -> RangedU64ValueParser<usize> {
    RangedU64ValueParser::new().range(THREADS)
}

const EXAMPLES: &str = "\
EXAMPLES:
  patchlock demo
      renders a scene, tracks it and shows what the results look like
  patchlock track video.mp4 --box 120,80,64,48 --save boxes.csv --video tracked.mp4
      tracks what is in the box of the first frame
  patchlock config > my.toml
      writes all settings to a file, to change some and use them with track --config my.toml
  patchlock bench OTB --out out && patchlock score out --truth OTB
      tracks every target of a benchmark and scores it
  patchlock report out --truth OTB --out report.html
      a page with the plots of all trackers in the folder out

EXIT CODES:
  0  done
  1  failed: a file can't be read or written, a frame is damaged; what was tracked before is kept
  2  wrong use: the options are wrong or do not fit to the source
  130  stopped by Ctrl-C; the files are complete up to there. A second Ctrl-C does not wait: track then keeps
       its tables, and no file is left half written";

/// Tracks one object through a video: you draw a box in the first frame, it finds the object in all others and says
/// how sure it is and what is hidden.
#[derive(Debug, Parser)]
#[command(name = "patchlock", version, after_help = EXAMPLES, max_term_width = 110)]
pub struct Cli {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    Track(Box<track::TrackArgs>),
    Export(Box<export::ExportArgs>),
    Demo(demo::DemoArgs),
    Config(config::ConfigArgs),
    Dataset(dataset::DatasetArgs),
    Bench(Box<bench::BenchArgs>),
    Score(score::ScoreArgs),
    Report(Box<report::ReportArgs>),
    Trax(trax::TraxArgs),
}

impl Cli {
    /// Does what the command line asks for. `program` is the name that it was called by.
    pub fn run(self, program: &str) -> Result<()> {
        match self.verb {
            Verb::Track(args) => track::run(&args),
            Verb::Export(args) => export::run(&args),
            Verb::Demo(args) => demo::run(&args, program),
            Verb::Config(args) => config::run(&args),
            Verb::Dataset(args) => dataset::run(&args),
            Verb::Bench(args) => bench::run(&args),
            Verb::Score(args) => score::run(&args),
            Verb::Report(args) => report::run(&args),
            Verb::Trax(args) => trax::run(&args),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_shown_is_what_is_allowed() {
        assert_eq!(SEEDS_SHOWN, format!("{SEEDS:?}"));
        assert_eq!(THREADS_SHOWN, format!("{THREADS:?}"));
    }
}
