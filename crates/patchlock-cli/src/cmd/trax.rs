//! `patchlock trax`: the tracker for other programs, through TraX.

use std::io;
use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use patchlock_eval::bench::trax::SEED_VARIABLE;
use patchlock_eval::{session, settings};

use super::{SEEDS_SHOWN, THREADS_SHOWN, seed, threads};
use crate::complaint::Complaint;
use crate::trax::{Protocol, Targets, serve};

const EXAMPLES: &str = "\
EXAMPLES:
  patchlock trax --config fast.toml
      waits on standard input for a client, such as the VOT toolkit
  patchlock bench OTB --out out --name mine --cmd \"patchlock trax --preset paper\"
      a client: it starts the server itself

In the file trackers.ini of the VOT toolkit:
  [patchlock]
  label = Patchlock
  protocol = trax
  command = /usr/local/bin/patchlock trax";

/// Answers another program that speaks TraX on standard input and output, such as the VOT toolkit
///
/// Regions are rectangles (left, top, width, height from 0) or polygons; the tracker begins on the upright box around a polygon. A target is
/// answered in the form in which it was given: as its box, or as the four corners of its turned outline. Every state has the score as its property
/// confidence, and the corners as its property region. Images are file names (path), pixels (memory: rgb, gray8, gray16) or the bytes of a file
/// (buffer). A client may begin anew at any time. What is wrong ends the program: the client is told in a quit, and standard error has the same.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct TraxArgs {
    /// Version of the protocol: 3 (one target) or 4 (many targets, that may come with any frame)
    #[arg(long, value_name = "N", default_value = "4", value_parser = parse_protocol)]
    protocol: Protocol,

    /// The set of settings to begin with: paper, or fast, which weighs fewer candidates by fewer patches
    #[arg(long, value_name = "NAME", default_value = "paper")]
    preset: String,

    /// Settings that differ from the preset, as TOML; see patchlock config
    #[arg(long, value_name = "FILE.toml")]
    config: Option<PathBuf>,

    /// Seed of the random numbers [default: that of the settings]; the same seed gives the same boxes
    #[arg(
        long,
        value_name = SEEDS_SHOWN,
        env = SEED_VARIABLE,
        allow_negative_numbers = true,
        value_parser = seed()
    )]
    seed: Option<u64>,

    /// Threads to use [default: one for each core]; the boxes are the same for any number
    #[arg(long, value_name = THREADS_SHOWN, allow_negative_numbers = true, value_parser = threads())]
    threads: Option<usize>,
}

fn parse_protocol(text: &str) -> Result<Protocol, String> {
    match text {
        "3" => Ok(Protocol::Three),
        "4" => Ok(Protocol::Four),
        _ => Err("it may be 3 or 4".to_string()),
    }
}

/// Serves.
pub fn run(args: &TraxArgs) -> Result<()> {
    let config = settings::resolve(&args.preset, args.config.as_deref(), args.seed)
        .map_err(Complaint::from)?;
    let pool = session::pool(args.threads).map_err(Complaint::from)?;
    let targets = Targets::new(config, pool)?;
    serve(io::stdin().lock(), io::stdout().lock(), args.protocol, targets)
}
