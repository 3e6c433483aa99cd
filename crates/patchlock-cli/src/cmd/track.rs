//! `patchlock track`: one object or many through one source.

use std::path::{Path, PathBuf};

use anyhow::{Error, Result};
use clap::builder::RangedU64ValueParser;
use clap::{ArgGroup, Args};
use patchlock_eval::{settings, start_box};
use patchlock_media::{Ahead, FrameRate, Order, Picture};

use super::{SEEDS_SHOWN, THREADS_SHOWN, seed, threads};
use crate::complaint::{Complaint, interrupted, usage};
use crate::output::plan::{Opened, Plan};
use crate::output::summary::Summary;
use crate::output::tables::{Format, ReaderLeft};
use crate::progress::Progress;
use crate::run::Run;
use crate::targets::{Event, Targets};
use crate::{interrupt, target};

const EXAMPLES: &str = "\
EXAMPLES:
  patchlock track video.mp4 --box 120,80,64,48 --save boxes.csv --video tracked.mp4
      the boxes as a table, and a video to look at
  patchlock track frames/ --box 120,80,64,48 > boxes.csv
      without an output option the CSV goes to standard output
  patchlock track 'img/%04d.jpg' --box-from groundtruth_rect.txt --save result.txt
      a benchmark's frames and its first box, and the boxes in the benchmark's own format
  patchlock track video.mp4 --box 120,80,64,48 --box 300,90,50,80 --save boxes.csv --video tracked.mp4
      two objects at once, called 1 and 2
  patchlock track video.mp4 --boxes starts.csv --save boxes.csv
      many, beginning and ending at any frame: the lines of starts.csv are frame,id,x,y,w,h
  patchlock track video.mp4 --box 300,90,50,80 --start 0 --end 251 --reverse --save back.csv
      backwards from frame 250, where the box is, to frame 0
  ffmpeg -i video.webm -f yuv4mpegpipe -pix_fmt yuv420p - | patchlock track - --box 120,80,64,48
      from any program that writes Y4M";

/// Tracks the objects in one or several boxes through a video or a folder of frames
///
/// SOURCE is a folder of images (in natural order: 2.jpg before 10.jpg), a pattern such as 'img/%04d.jpg', a glob in
/// quotes, an MP4 with H.264 video, a Y4M file, or - for Y4M on standard input. Every other video goes through the
/// program ffmpeg, if there is one. Images are jpg, png, tiff, bmp or webp; grey stays grey, 16-bit grey stays
/// 16-bit. Rotation tags of cameras and edit lists of MP4 files are not applied.
///
/// Frames count from 0. Pixels count from 0 with their centres at whole numbers, so a box covers its first pixel x to
/// its last pixel x + w - 1.
///
/// With several boxes, or a file of them, the tables have a column id after frame, and a line for each target in a frame.
///
/// Ctrl-C stops after the frame at work: all files are then complete up to there. A second Ctrl-C does not wait for that
/// frame: the tables are kept up to the frame before it, the video and the summary are not written.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES, group(ArgGroup::new("target").required(true).args(["bbox", "box_from", "boxes"])))]
pub struct TrackArgs {
    /// Frames: a folder, a pattern, a glob, a video file, or - for Y4M on stdin
    source: String,

    /// The object in the first tracked frame: left, top (from 0), width, height; fractions allowed. Given several times, there are as many targets,
    /// with the ids 1, 2 and so on
    #[arg(long = "box", id = "bbox", value_name = "X,Y,W,H", allow_hyphen_values = true)]
    bbox: Vec<String>,

    /// Take the box from the first line of a truth file, which counts from 1 (commas, tabs or spaces)
    #[arg(long, value_name = "FILE")]
    box_from: Option<PathBuf>,

    /// Targets that begin and end at any frame: a CSV with the columns frame,id,x,y,w,h, counted from 0. A target begins at its first line, begins anew
    /// at a further one, and ends at one without x, y, w and h
    #[arg(long, value_name = "FILE.csv")]
    boxes: Option<PathBuf>,

    /// The set of settings to begin with: paper, or fast, which weighs fewer candidates by fewer patches
    #[arg(long, value_name = "NAME", default_value = "paper")]
    preset: String,

    /// Settings that differ from the preset, as TOML; see patchlock config
    #[arg(long, value_name = "FILE.toml")]
    config: Option<PathBuf>,

    /// Seed of the random numbers [default: that of the settings]; the same seed gives the same boxes
    #[arg(long, value_name = SEEDS_SHOWN, allow_negative_numbers = true, value_parser = seed())]
    seed: Option<u64>,

    /// Threads to use [default: one for each core]; the boxes are the same for any number
    #[arg(long, value_name = THREADS_SHOWN, allow_negative_numbers = true, value_parser = threads())]
    threads: Option<usize>,

    /// First frame of the range
    #[arg(long, value_name = "0..", default_value = "0", allow_negative_numbers = true)]
    start: usize,

    /// End of the range, not included: --start 10 --end 20 tracks frames 10 to 19 [default: all frames]
    #[arg(long, value_name = "0..", allow_negative_numbers = true)]
    end: Option<usize>,

    /// Take every Nth frame of the range
    #[arg(
        long,
        value_name = "1..",
        default_value = "1",
        allow_negative_numbers = true,
        value_parser = RangedU64ValueParser::<usize>::new().range(1..)
    )]
    stride: usize,

    /// From the last frame of the range to the first; the box is then in the last one
    #[arg(long)]
    reverse: bool,

    /// Save the boxes; may be given several times. The end of the name says how: .csv and .jsonl (0-based, all
    /// columns), .txt (x,y,w,h a line, 1-based)
    #[arg(long, value_name = "FILE")]
    save: Vec<PathBuf>,

    /// Save a video (MP4, H.264) with box, outline, visible patches, score and frame number drawn in. It plays at the
    /// speed of the source, or at 30 frames a second where that is not known
    #[arg(long, value_name = "FILE.mp4")]
    video: Option<PathBuf>,

    /// Save the run in numbers as JSON: frames, tracking_fps (without decoding), ms_median, ms_p95, ...
    #[arg(long, value_name = "FILE.json")]
    summary: Option<PathBuf>,

    /// No progress bar; there is none either where the CSV goes to the terminal
    #[arg(long, short)]
    quiet: bool,

    /// Replace files that exist already
    #[arg(long)]
    overwrite: bool,
}

impl TrackArgs {
    fn order(&self) -> Order {
        Order { start: self.start, end: self.end, stride: self.stride, reverse: self.reverse }
    }

    fn targets(&self) -> Result<Targets, Complaint> {
        if let Some(file) = &self.boxes {
            return Targets::from_table(file);
        }
        let boxes = match &self.box_from {
            Some(file) => vec![target::from_file(file)?],
            None => self.bbox.iter().map(|text| target::parse(text)).collect::<Result<_, _>>()?,
        };
        Ok(Targets::in_first_frame(&boxes))
    }

    fn plan(&self, targets: &Targets) -> Result<Plan> {
        let text = |file: &&PathBuf| matches!(Format::of(file), Ok(Format::Txt));
        if let Some(file) = self.save.iter().find(text).filter(|_| targets.many) {
            let message = format!("--save {}: .txt holds one target", file.display());
            return Err(usage(message).hint(".csv and .jsonl hold many").into());
        }
        let inputs = [
            Some(Path::new(&self.source)),
            self.config.as_deref(),
            self.box_from.as_deref(),
            self.boxes.as_deref(),
        ];
        let inputs: Vec<&Path> = inputs.into_iter().flatten().collect();
        let (video, summary) = (self.video.as_deref(), self.summary.as_deref());
        Ok(Plan::check(&self.save, video, summary, self.overwrite, &inputs)?)
    }
}

/// Tracks.
pub fn run(args: &TrackArgs) -> Result<()> {
    let order = args.order();
    order.check().map_err(Complaint::from)?;
    let mut targets = args.targets()?;
    let config = settings::resolve(&args.preset, args.config.as_deref(), args.seed);
    let config = config.map_err(Complaint::from)?;
    let seed = config.seed;
    let plan = args.plan(&targets)?;

    let source = patchlock_media::open(&args.source, args.reverse).map_err(Complaint::from)?;
    let rate = played_by(source.rate().unwrap_or(FrameRate::DEFAULT), args.stride);
    let length = source.length();
    let expected = order.count(length);
    targets.check(&order, length)?;
    interrupt::listen()?;
    let mut frames = Ahead::start(source, order.indices(length).map_err(Complaint::from)?);
    let Some((index, picture)) = next(&mut frames)? else { return Err(nothing_to_track(&order)) };
    let first = due(&mut targets, index, &picture)?;

    let Opened { sinks, summary } = plan.open(rate, expected)?;
    let progress = match plan.prints() {
        true => Progress::beside_table(expected, args.quiet),
        false => Progress::new(expected, args.quiet),
    };
    let mut run = Run::new(config, args.threads, targets.many, sinks)?;
    let tracked =
        track_all(&mut run, &mut targets, &progress, &mut frames, (index, picture, first));
    let count = run.times_ms().len();
    let numbers = Summary::new(run.times_ms(), run.targets(), &args.preset, seed, run.threads());
    progress
        .finish(&format!("tracked {count} frames at {:.1} frames a second", numbers.tracking_fps));
    let mut kept = Kept::default();
    if count > 0 {
        run.into_sinks().into_iter().for_each(|sink| kept.add(sink.finish()));
        summary.into_iter().for_each(|file| kept.add(numbers.write(file).map(Some)));
    }
    conclude(tracked, kept, count)
}

/// The next frame with its number; `None` at the end, and soon after Ctrl-C.
fn next(frames: &mut Ahead) -> Result<Option<(usize, Picture)>, Complaint> {
    Ok(frames.next_unless(&interrupt::requested)?)
}

/// Every stride-th frame at the same speed of the world needs fewer frames a second.
fn played_by(rate: FrameRate, stride: usize) -> FrameRate {
    let stride = u32::try_from(stride).unwrap_or(u32::MAX);
    FrameRate { seconds: rate.seconds.saturating_mul(stride), ..rate }
}

fn nothing_to_track(order: &Order) -> Error {
    if interrupt::requested() {
        return interrupted("stopped before the first frame").into();
    }
    Complaint::from(order.nothing()).into()
}

/// What happens on a frame, its boxes being checked against it.
fn due(targets: &mut Targets, index: usize, picture: &Picture) -> Result<Vec<Event>, Complaint> {
    let due = targets.due(index);
    for bbox in due.iter().filter_map(|event| event.bbox) {
        start_box::check(&bbox, index, picture.width, picture.height)?;
    }
    Ok(due)
}

/// The loop. An error leaves in the outputs what was tracked before.
fn track_all(
    run: &mut Run,
    targets: &mut Targets,
    progress: &Progress,
    frames: &mut Ahead,
    (mut index, mut picture, mut events): (usize, Picture, Vec<Event>),
) -> Result<()> {
    loop {
        let (found, ms) = run.track(index, &picture, &events)?;
        let seen = run.write(index, &picture, found, ms)?;
        let scores: f64 = seen.iter().map(|seen| seen.estimate.score).sum();
        progress.step(run.fps(), scores / seen.len().max(1) as f64);
        match next(frames)? {
            Some(next) => (index, picture) = next,
            None if interrupt::requested() => return Ok(()),
            None => return Ok(targets.check_all_done()?),
        }
        events = due(targets, index, &picture)?;
    }
}

/// The outputs that were completed, and the first error on the way.
#[derive(Default)]
struct Kept {
    files: Vec<PathBuf>,
    error: Option<Error>,
}

impl Kept {
    fn add(&mut self, finished: Result<Option<PathBuf>>) {
        match finished {
            Ok(file) => self.files.extend(file),
            Err(error) => self.error = self.error.take().or(Some(error)),
        }
    }
}

/// What the run ends with. The first error counts; on the way out the user learns what is kept.
fn conclude(tracked: Result<()>, kept: Kept, count: usize) -> Result<()> {
    let error = match tracked {
        Err(error) if error.is::<ReaderLeft>() => return Ok(()),
        Err(error) => Some(error),
        Ok(()) => kept.error,
    };
    let names: Vec<String> = kept.files.iter().map(|file| file.display().to_string()).collect();
    match error {
        Some(error) => {
            if !names.is_empty() {
                eprintln!(
                    "note: the {count} frames tracked before this are in {}",
                    names.join(", ")
                );
            }
            Err(error)
        }
        None if interrupt::requested() => Err(interrupted(format!(
            "stopped after {count} frames; the files are complete up to there"
        ))
        .into()),
        None => Ok(()),
    }
}
