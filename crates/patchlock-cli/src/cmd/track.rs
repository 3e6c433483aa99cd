//! `patchlock track`: tracks one target or many through a source.

use std::ffi::OsString;
use std::io::{self, IsTerminal as _};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Error, Result};
use clap::{ArgGroup, Args};
use patchlock::Method;
use patchlock_media::live::Address;
use patchlock_media::{Feed, FrameRate, Limits, Order, Picture, Prefetcher, SourceInfo};
use patchlock_studio::project::Store;
use patchlock_studio::server::window::Window;

use super::input::{self, LiveArgs};
use super::page::PageArgs;
use super::pictures::PictureArgs;
use super::settings::SettingsArgs;
use super::{LimitArgs, SEEDS_SHOWN, THREADS_SHOWN, positive, seed, threads};
use crate::failure::{Failure, interrupted, say, usage};
use crate::interrupt;
use crate::output::Sink;
use crate::output::inputs::{Inputs, resolved};
use crate::output::pending::{self, PendingFile};
use crate::output::row::LostPosition;
use crate::output::summary::{Settings, Summary};
use crate::output::tables::{Format, Table};
use crate::output::video::played_by;
use crate::preview::{self, Preview};
use crate::progress::Progress;
use crate::project;
use crate::run::Run;
use crate::target::{self, Truth};
use crate::targets::Targets;

/// On one line, it would be wider than a terminal.
const USAGE: &str = "\
patchlock track [OPTIONS] <SOURCE>
       patchlock track [OPTIONS] --box <X,Y,W,H> <SOURCE>
       patchlock track [OPTIONS] --box-from <FILE> <SOURCE>
       patchlock track [OPTIONS] --boxes <CSV> <SOURCE>
       patchlock track [OPTIONS] --select <SOURCE>
       patchlock track [OPTIONS] --project <JSON> <SOURCE>";

const FEW_EXAMPLES: &str = "\
EXAMPLES:
  patchlock track video.mp4 --video tracked.mp4
      opens a page in the browser, where you draw the box
  patchlock track video.mp4 --box 120,80,64,48 --save boxes.csv
      saves the boxes as a table";

const EXAMPLES: &str = "\
EXAMPLES:
  patchlock track video.mp4 --video tracked.mp4
      opens a page in the browser, where you draw the box; saves a video with
      the track drawn in
  patchlock track video.mp4 --box 120,80,64,48 --save boxes.csv
      saves the boxes as a table
  patchlock track frames/ --box 120,80,64,48 > boxes.csv
      without an output option the CSV table goes to standard output
  patchlock track 'img/%04d.jpg' --box-from groundtruth_rect.txt \\
    --save result.txt
      reads frames and first box of an OTB sequence, and saves the boxes in the
      format of OTB
  patchlock track video.mp4 --box 120,80,64,48 --box 300,90,50,80 \\
    --save boxes.csv --video tracked.mp4
      tracks two targets at once, with the ids 1 and 2
  patchlock track video.mp4 --boxes starts.csv --save boxes.csv
      tracks many targets that start and end at any frame: the lines of
      starts.csv are frame,id,x,y,w,h
  patchlock track video.mp4 --box 300,90,50,80 --start 0 --end 251 --reverse \\
    --save back.csv
      tracks backwards from frame 250, in which the box is given, to frame 0
  patchlock track video.mp4 --project video.patchlock.json
      tracks the targets of a project from their key frames, and adds the boxes
      to it
  patchlock track rtsp://camera/stream --box 120,80,64,48 --save boxes.csv
      follows the newest frame of a live stream until Ctrl-C; 0 is the first
      camera of this machine
  ffmpeg -i video.webm -f yuv4mpegpipe -pix_fmt yuv420p - | patchlock track - \\
    --box 120,80,64,48
      reads frames from any program that writes Y4M";

const TARGETS: &str = "More ways to give targets";
const FRAMES: &str = "Frames";
const TRACKER: &str = "Tracker";
const OUTPUT: &str = "Tables and page";

/// Tracks one or more objects through a video or a folder of frames
///
/// SOURCE is a folder of images (in natural order: 2.jpg before 10.jpg), a pattern such as
/// 'img/%04d.jpg', a glob in quotes, an MP4 with H.264 video, a Y4M file, or - for Y4M on standard
/// input. Other videos are decoded by ffmpeg, if it is installed. Images are jpg, png, tiff, bmp or
/// webp; grey images stay grey and 16-bit grey images stay 16-bit. Each page of a TIFF is a frame.
/// Frames are as a player shows them: rotation tags of videos and images and the edit lists of MP4
/// files are applied.
///
/// SOURCE may also be live: a number (0 is the first camera), /dev/video0, or an address that begins
/// with rtsp://, rtsps://, rtmp://, rtmps://, http://, https://, udp://, tcp:// or srt://. ffmpeg
/// opens it. The newest frame is tracked; frames that come meanwhile are left out, which the numbers
/// of the frames show, so the track is never late by more than a frame. Times are those at which
/// frames came. The boxes are those of the first frame. A stream of the network that is lost is
/// opened again. Of a file on a web server, every frame is tracked.
///
/// Frames count from 0. Pixels count from 0 with their centres at whole numbers, so a box covers
/// the pixels x to x + w - 1.
///
/// With several boxes, or a file of boxes, tables have a column id after frame and one line per
/// target and frame.
///
/// Ctrl-C stops after the current frame; all files are then complete up to that frame. A second
/// Ctrl-C does not wait for it: tables are kept up to the frame before, video and summary are not
/// written.
#[derive(Debug, Args)]
#[command(
    override_usage = USAGE,
    after_help = FEW_EXAMPLES,
    after_long_help = EXAMPLES,
    group(ArgGroup::new("target").args(["bbox", "box_from", "boxes", "select"]))
)]
pub struct TrackArgs {
    /// Frames: a folder, a pattern, a glob, a video file, a camera or stream, or - for Y4M on stdin
    source: OsString,

    /// The target in the first tracked frame: left, top, width, height
    ///
    /// Pixels count from 0; numbers may be fractional. If the option is repeated, each box is a
    /// target, with the ids 1, 2 and so on.
    #[arg(long = "box", id = "bbox", value_name = "X,Y,W,H", allow_hyphen_values = true)]
    bbox: Vec<String>,

    /// Draw the boxes on a page in the browser, on the first frame
    ///
    /// The boxes are printed as options. On a terminal, this is what happens if no target is given.
    /// Of a live source, they may be drawn on a newer frame instead.
    #[arg(long)]
    select: bool,

    /// Save the boxes as .csv, .jsonl or .txt; may be repeated
    ///
    /// .csv and .jsonl have all columns (0-based), .txt has x,y,w,h per line (1-based).
    #[arg(long, value_name = "FILE")]
    save: Vec<PathBuf>,

    /// Replace existing files
    #[arg(long)]
    overwrite: bool,

    /// Show each frame with the boxes on a page in the browser, while it tracks
    ///
    /// Of a live source, a target that is drawn again there restarts.
    #[arg(long)]
    preview: bool,

    // What is flattened leaves its heading to what comes after it, so this is after those without one.
    #[command(flatten, next_help_heading = "Pictures")]
    pictures: PictureArgs,

    /// Read the box from a truth file, with one box per line, counted from 1
    ///
    /// It is on the line of the first tracked frame, or on the only line. Numbers are separated by
    /// commas, tabs or spaces.
    #[arg(long, value_name = "FILE", help_heading = TARGETS)]
    box_from: Option<PathBuf>,

    /// Targets that start and end at any frame, from a table frame,id,x,y,w,h
    ///
    /// The columns of this CSV file are counted from 0. If an id is no number, all are names: tables
    /// then have a column name, and ids that count the names from 1. A target starts at its first
    /// line, restarts at a later one, and ends at a line without x, y, w and h.
    #[arg(long, value_name = "CSV", help_heading = TARGETS)]
    boxes: Option<PathBuf>,

    /// Add the boxes to the project of SOURCE, in the format of patchlock studio
    ///
    /// It is created if missing. Given boxes become new targets. Without boxes, the targets of the
    /// project are tracked: they start at their key frames, restart at the next ones, and end where
    /// they are hidden.
    #[arg(long, value_name = "JSON", help_heading = TARGETS)]
    project: Option<PathBuf>,

    /// Maximum number of targets that are tracked at once
    ///
    /// A target takes about 1 MB of memory; with the preset paper, 20 MB.
    #[arg(
        long,
        value_name = "1..",
        default_value = "500",
        value_parser = positive::<usize>(),
        help_heading = TARGETS
    )]
    max_targets: usize,

    /// First frame of the range
    #[arg(long, value_name = "0..", default_value = "0", help_heading = FRAMES)]
    start: usize,

    /// End of the range, exclusive [default: all frames]
    ///
    /// --start 10 --end 20 tracks frames 10 to 19.
    #[arg(long, value_name = "0..", help_heading = FRAMES)]
    end: Option<usize>,

    /// Take every Nth frame of the range
    #[arg(
        long,
        value_name = "1..",
        default_value = "1",
        value_parser = positive::<usize>(),
        help_heading = FRAMES
    )]
    stride: usize,

    /// Track from the last frame of the range to the first; the box is in the last frame
    #[arg(long, help_heading = FRAMES)]
    reverse: bool,

    #[command(flatten, next_help_heading = FRAMES)]
    live: LiveArgs,

    #[command(flatten, next_help_heading = FRAMES)]
    limits: LimitArgs,

    #[command(flatten, next_help_heading = TRACKER)]
    settings: SettingsArgs,

    /// Seed of the random numbers [default: the seed in the settings]
    ///
    /// The same seed gives the same boxes.
    #[arg(long, value_name = SEEDS_SHOWN, value_parser = seed(), help_heading = TRACKER)]
    seed: Option<u64>,

    /// Number of threads [default: one per core]; it does not change the boxes
    #[arg(long, value_name = THREADS_SHOWN, value_parser = threads(), help_heading = TRACKER)]
    threads: Option<usize>,

    /// Positions in tables while a target is lost
    #[arg(long, value_name = "WHAT", default_value = "keep", value_enum, help_heading = OUTPUT)]
    lost: LostPosition,

    /// Save statistics of the run as JSON
    ///
    /// Among them are frames, frames_lost, losses (each with the frames of the loss and of the
    /// return), tracking_fps (without decoding), wall_fps (with it), ms_median.
    #[arg(long, value_name = "FILE.json", help_heading = OUTPUT)]
    summary: Option<PathBuf>,

    #[command(flatten, next_help_heading = OUTPUT)]
    page: PageArgs,

    /// No progress bar
    ///
    /// It is always hidden if the table is printed to the terminal.
    #[arg(long, short, help_heading = OUTPUT)]
    quiet: bool,
}

impl TrackArgs {
    fn order(&self) -> Order {
        Order { start: self.start, end: self.end, stride: self.stride, reverse: self.reverse }
    }

    /// Whether the boxes are given, and not those of the project.
    fn has_boxes(&self) -> bool {
        !self.bbox.is_empty() || self.box_from.is_some() || self.boxes.is_some()
    }

    /// Whether the user draws the boxes: as asked for, or on a terminal if no target is given.
    fn draws(&self) -> Result<bool, Failure> {
        if self.select || self.has_boxes() || self.project.is_some() {
            return Ok(self.select);
        }
        if io::stdin().is_terminal() && io::stderr().is_terminal() {
            return Ok(true);
        }
        Err(usage("no target is given").hint(
            "--box X,Y,W,H is the target in the first frame; --select opens a page where you draw it; \
             --boxes, --box-from and --project name files",
        ))
    }

    /// Refuses what cannot be done with frames that come only once, now.
    fn check_live(&self, address: &Address) -> Result<(), Failure> {
        let wrong = [
            (self.project.is_some(), "--project"),
            (self.reverse, "--reverse"),
            (self.stride > 1, "--stride"),
        ];
        match { wrong }.into_iter().find(|(given, _)| *given) {
            Some((_, option)) => {
                let message = format!("{option} is for files; {} is live", address.shown());
                Err(usage(message).hint("record it first, for example with ffmpeg"))
            }
            None => Ok(()),
        }
    }

    fn start(&self, project: Option<&Store>) -> Result<Start, Failure> {
        if self.draws()? {
            return Ok(Start::Drawn);
        }
        if let Some(store) = project.filter(|_| !self.has_boxes()) {
            return project::starts(store, &self.order()).map(Start::Known);
        }
        if let Some(file) = &self.boxes {
            return Targets::from_table(file).map(Start::Known);
        }
        if let Some(file) = &self.box_from {
            let truth = Truth::read(file)?;
            if !self.reverse {
                truth.at(self.start)?; // an error before the source is opened
            }
            return Ok(Start::Line(truth));
        }
        let boxes: Result<Vec<_>, _> = self.bbox.iter().map(|text| target::parse(text)).collect();
        Ok(Start::Known(Targets::in_first_frame(&boxes?)))
    }

    /// Refuses files that hold one target if there are many.
    fn check_files(&self, many: bool) -> Result<(), Failure> {
        let text = |file: &&PathBuf| matches!(Format::of(file), Ok(Format::Txt));
        match self.save.iter().find(text).filter(|_| many) {
            Some(file) => {
                let message = format!("--save {}: a .txt file holds one target", file.display());
                Err(usage(message).hint(".csv and .jsonl files hold many"))
            }
            None => Ok(()),
        }
    }

    /// All files that are written, in the order of the options.
    fn files(&self) -> impl Iterator<Item = &PathBuf> {
        let PictureArgs { video, gif, .. } = &self.pictures;
        self.save.iter().chain(video).chain(gif).chain(&self.summary)
    }

    /// Whether the table goes to standard output, which it does if no file and no project is given.
    fn prints(&self) -> bool {
        self.project.is_none() && self.files().next().is_none()
    }

    /// Checks names, duplicates and existing files, before the work starts.
    fn check_outputs(&self, start: &Start) -> Result<(), Failure> {
        let many = matches!(start, Start::Known(targets) if targets.many);
        self.check_files(many)?;
        let inputs = [
            Some(Path::new(&self.source)),
            self.settings.config.as_deref(),
            self.settings.model.model.as_deref(),
            self.box_from.as_deref(),
            self.boxes.as_deref(),
            self.project.as_deref(),
        ];
        let mut inputs = Inputs::new(inputs.into_iter().flatten());
        if self.live.address(&self.source)?.is_none() {
            inputs = inputs.with_source(&self.source);
        }
        self.pictures.check_crop(many)?;
        self.save.iter().try_for_each(|file| Format::of(file).map(drop))?;
        self.pictures.check_names()?;
        let mut taken: Vec<PathBuf> = Vec::new();
        for path in self.files() {
            pending::check(path, self.overwrite)?;
            inputs.check(path)?;
            let place = resolved(path);
            if taken.contains(&place) {
                return Err(usage(format!("{} is given for two outputs", path.display()))
                    .hint("give each its own name"));
            }
            taken.push(place);
        }
        Ok(())
    }

    fn create(&self, path: &Path) -> Result<PendingFile, Failure> {
        PendingFile::create(path, self.overwrite)
    }

    /// Opens the outputs that receive tracked frames, before the first one.
    fn open(&self, rate: FrameRate, expected: Option<usize>) -> Result<Vec<Box<dyn Sink>>> {
        let mut sinks: Vec<Box<dyn Sink>> = Vec::new();
        for path in &self.save {
            let file = self.create(path)?.keep_partial();
            sinks.push(Box::new(Table::new(Format::of(path)?, self.lost, file)));
        }
        sinks.extend(self.pictures.open(|path| self.create(path), rate, expected)?);
        if self.prints() {
            sinks.push(Box::new(Table::new(Format::Csv, self.lost, io::stdout())));
        }
        Ok(sinks)
    }
}

/// Where the targets come from.
enum Start {
    Known(Targets),
    /// The line of the first tracked frame.
    Line(Truth),
    /// The user draws them on the first tracked frame.
    Drawn,
}

impl Start {
    /// The targets of a run that begins at this frame.
    fn targets(self, first: usize) -> Result<Targets, Failure> {
        match self {
            Self::Known(targets) => Ok(targets),
            Self::Line(truth) => Ok(Targets::in_first_frame(&[truth.at(first)?])),
            Self::Drawn => Ok(Targets::in_first_frame(&[])),
        }
    }
}

/// Frames of the source, and what is known of it.
struct InputSource {
    feed: Feed,
    length: Option<usize>,
    rate: Option<FrameRate>,
    sound: bool,
    /// The number of the first frame.
    first: usize,
    is_live: bool,
    /// When a live source began, in seconds since 1970.
    live_since: Option<f64>,
}

impl InputSource {
    fn of(args: &TrackArgs, address: Option<Address>, limits: Limits) -> Result<Self, Failure> {
        let order = args.order();
        if let Some(address) = address {
            let feed = args.live.open(address, &order, limits);
            let (length, rate, sound, is_live) = (None, None, false, true);
            let (first, live_since) = (order.start, None);
            return Ok(Self { feed, length, rate, sound, first, is_live, live_since });
        }
        let source = patchlock_media::open_within(&args.source, args.reverse, limits)?;
        let SourceInfo { length, rate, sound } = source.info();
        let mut indices = order.indices(length)?.peekable();
        let first = indices.peek().copied().unwrap_or(order.start);
        let feed = Feed::File(Prefetcher::start(source, indices));
        Ok(Self { feed, length, rate, sound, first, is_live: false, live_since: None })
    }
}

/// The first frame with its targets, the frames after it, and the page that shows them.
struct RunStart {
    source: InputSource,
    first: (usize, Picture),
    targets: Targets,
    page: Option<Arc<Window>>,
}

impl RunStart {
    /// Opens the source, and the page if there is one, on which the user may draw the targets.
    fn of(
        args: &TrackArgs,
        start: Start,
        address: Option<Address>,
        method: &Method,
    ) -> Result<Self> {
        let (order, draws) = (args.order(), matches!(start, Start::Drawn));
        let page = draws || args.preview;
        if page {
            // Who has read the address of the page may press Ctrl-C before the source is open.
            interrupt::listen()?;
        }
        let open = || preview::open(args.page.port, args.page.hosts(), !args.page.no_open);
        let page = page.then(open).transpose()?;
        let mut source = InputSource::of(args, address, args.limits.limits())?;
        let mut targets = start.targets(source.first)?;
        if source.is_live {
            targets = targets.in_first_of_live()?;
        }
        targets.check_number(args.max_targets, &order, method)?;
        targets.check(&order, source.length)?;
        interrupt::listen()?;
        let first = input::next(&mut source.feed, say)?;
        let mut first = first.ok_or_else(|| nothing_to_track(&order))?;
        if let Some(page) = page.as_ref().filter(|_| draws) {
            let boxes;
            (boxes, first) = preview::ask(page, first, &mut source.feed)?;
            targets = Targets::in_first_frame(&boxes);
            args.check_files(targets.many)?;
        }
        targets.check_boxes(first.0, &first.1)?;
        if let Feed::Live(live) = &source.feed {
            (source.rate, source.live_since) = (live.rate(), live.begun());
        }
        Ok(Self { source, first, targets, page })
    }
}

pub fn run(args: &TrackArgs) -> Result<()> {
    let order = args.order();
    order.check().map_err(Failure::from)?;
    let address = args.live.address(&args.source)?;
    address.as_ref().map_or(Ok(()), |address| args.check_live(address))?;
    let (file, limits) = (args.project.as_deref(), args.limits.limits());
    let project = file.map(|file| project::open(file, Path::new(&args.source), limits));
    let project = project.transpose()?;
    let start = args.start(project.as_ref())?;
    let config = args.settings.resolve(args.seed)?;
    let settings = Settings::new(&args.settings.preset, &config);
    args.check_outputs(&start)?;
    // Boxes that the project had are not added to it again.
    let project = project.map(|store| (store, !matches!(start, Start::Drawn) && !args.has_boxes()));
    let start = RunStart::of(args, start, address, &config.method)?;
    let RunStart { source, first, mut targets, page } = start;
    let InputSource { mut feed, length, rate, live_since, is_live, .. } = source;
    let expected = order.count(length);

    let begun = Instant::now();
    let mut sinks = args.open(played_by(rate, args.stride), expected)?;
    let summary = args.summary.as_deref().map(|path| args.create(path)).transpose()?;
    if let Some(video) = args.pictures.video.as_ref().filter(|_| source.sound) {
        say(&format!("note: {} has no sound: only pictures are written", video.display()));
    }
    // On the same terminal, the bar would mix with the rows, which show the progress anyway.
    let has_rows = args.prints() && io::stdout().is_terminal();
    let progress = Progress::new(expected, args.quiet || has_rows);
    if let Some((store, known)) = project {
        sinks.push(Box::new(project::Output::new(store, &targets, known)));
    }
    // The page is there until the end, so that it shows the answer to the boxes.
    if let Some(page) = page.as_ref().filter(|_| args.preview) {
        sinks.push(Box::new(Preview::new(Arc::clone(page), live_since, is_live)));
    }
    let redrawn_on = page.clone().filter(|_| args.preview && is_live);
    let mut run = Run::new(config, args.threads, &targets, sinks)?.redrawn_on(redrawn_on);
    let rest = std::iter::from_fn(|| {
        let next = input::next(&mut feed, |line| progress.note(line));
        progress.set_dropped(feed.dropped().unwrap_or(0));
        next.map_err(Error::from).transpose()
    });
    let frames = std::iter::once(Ok(first)).chain(rest);
    let tracked = run.track_all(&mut targets, frames, &progress, |_| Ok(()));
    // Frames of a live source are not as far apart as its rate says.
    let even = rate.filter(|_| !is_live);
    let numbers = Summary::new(run.measurements(), even, settings, run.threads());
    let count = numbers.frames;
    let (mut error, mut files) = (tracked.err(), Vec::new());
    let mut complete = |finished: Result<Option<PathBuf>>| match finished {
        Ok(file) => files.extend(file),
        Err(failed) => drop(error.get_or_insert(failed)),
    };
    if count > 0 {
        run.into_sinks().into_iter().for_each(|sink| complete(sink.finish()));
    }
    let numbers = numbers.with_run(begun.elapsed().as_secs_f64(), feed.dropped());
    progress.finish(&numbers.to_string());
    if count > 0 {
        summary.into_iter().for_each(|file| complete(numbers.write(file).map(Some)));
    }
    conclude(error, &files, count)
}

fn nothing_to_track(order: &Order) -> Error {
    if interrupt::requested() {
        return interrupted("stopped before the first frame").into();
    }
    Failure::from(order.nothing()).into()
}

fn is_closed_pipe(error: &Error) -> bool {
    let error = error.downcast_ref::<io::Error>();
    error.is_some_and(|error| error.kind() == io::ErrorKind::BrokenPipe)
}

/// The result of the run: the first error, after a note that lists the files that were kept.
fn conclude(error: Option<Error>, files: &[PathBuf], count: usize) -> Result<()> {
    let names: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
    match error {
        // The reader of standard output has closed it, as `head` does.
        Some(error) if is_closed_pipe(&error) => Ok(()),
        Some(error) => {
            if !names.is_empty() {
                say(&format!(
                    "note: the {count} frames tracked before this are in {}",
                    names.join(", ")
                ));
            }
            Err(error)
        }
        None if interrupt::requested() => Err(interrupted(format!(
            "stopped after {count} frames; the files are complete up to that frame"
        ))
        .into()),
        None => Ok(()),
    }
}
