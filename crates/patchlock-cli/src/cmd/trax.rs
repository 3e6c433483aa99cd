//! `patchlock trax`: offers the tracker to other programs through the TraX protocol.

use std::io;

use anyhow::Result;
use clap::Args;
use patchlock_bench::bench::trax::SEED_VARIABLE;
use patchlock_track::session;

use super::settings::SettingsArgs;
use super::{SEEDS_SHOWN, THREADS_SHOWN, seed, threads};
use crate::failure::Failure;
use crate::trax::{Protocol, Targets, serve};

const EXAMPLES: &str = "\
EXAMPLES:
  patchlock trax --config my.toml
      waits on standard input for a client, such as the VOT toolkit
  patchlock bench OTB --out out --name mine \\
    --cmd \"patchlock trax --preset robust\"
      a client that starts the server itself

Entry for trackers.ini of the VOT toolkit:
  [patchlock]
  label = Patchlock
  protocol = trax
  command = /usr/local/bin/patchlock trax";

/// Runs a TraX server on standard input and output, for the VOT toolkit and others
///
/// Regions are rectangles (left, top, width, height from 0) or polygons; tracking starts on the
/// bounding box of a polygon. Each target is reported in the form in which it was given: as a box,
/// or as the four corners of the rotated outline. Every state has the properties confidence (the
/// score) and region (the corners). Images are file names (path), pixels (memory: rgb, gray8,
/// gray16) or the bytes of a file (buffer). A client may restart at any time. An error ends the
/// program; the client receives a quit message with the same text as standard error.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct TraxArgs {
    /// Version of the protocol: 3 (one target) or 4 (many targets, added at any frame)
    #[arg(long, value_name = "N", default_value = "4", value_parser = parse_protocol)]
    protocol: Protocol,

    #[command(flatten)]
    settings: SettingsArgs,

    /// Seed of the random numbers [default: the seed in the settings]; the same seed gives the same
    /// boxes
    #[arg(long, value_name = SEEDS_SHOWN, env = SEED_VARIABLE, value_parser = seed())]
    seed: Option<u64>,

    /// Number of threads [default: one per core]; it does not change the boxes
    #[arg(long, value_name = THREADS_SHOWN, value_parser = threads())]
    threads: Option<usize>,
}

fn parse_protocol(text: &str) -> Result<Protocol, String> {
    match text {
        "3" => Ok(Protocol::Three),
        "4" => Ok(Protocol::Four),
        _ => Err("must be 3 or 4".to_string()),
    }
}

pub fn run(args: &TraxArgs) -> Result<()> {
    let config = args.settings.resolve(args.seed)?;
    let pool = session::pool(args.threads).map_err(Failure::from)?;
    let targets = Targets::new(config, pool)?;
    serve(io::stdin().lock(), io::stdout().lock(), args.protocol, targets)
}
