//! `patchlock demo`: tracks a rendered scene and compares the boxes with the truth.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result};
use clap::Args;
use patchlock::{BoundingBox, Status, TrackerConfig};
use patchlock_bench::report;
use patchlock_media::{Error, FrameRate, FrameSource, Mp4Writer, Picture, Prefetcher, SourceInfo};
use patchlock_scene::Scene;
use patchlock_track::files;

use crate::failure::{Failure, failed, interrupted, usage};
use crate::interrupt;
use crate::output::background_sink::BackgroundSink;
use crate::output::draw;
use crate::output::measurements::LostSpan;
use crate::output::pending::PendingFile;
use crate::output::printed::{print, quoted};
use crate::output::row::LostPosition;
use crate::output::strip::{self, Panel};
use crate::output::tables::{Format, Table};
use crate::output::video::{QUALITY, Video};
use crate::output::view::View;
use crate::output::{Sink, TargetResult, TrackedFrame};
use crate::progress::Progress;
use crate::run::Run;
use crate::targets::Targets;

const EXAMPLES: &str = "\
EXAMPLES:
  patchlock demo
      writes to ./demo
  patchlock demo --out pictures
      writes to another folder

The files of an earlier demo are replaced. Files of the same names that were not
written by a demo are replaced only with --overwrite.";

/// The files that the demo writes, with descriptions.
const FILES: [(&str, &str); 8] = [
    ("input.mp4", "the rendered scene, as input for track"),
    ("demo.mp4", "the same with the track drawn in"),
    ("demo.csv", "the boxes, one line per frame"),
    ("truth.csv", "the true boxes"),
    ("overlap.svg", "overlap with the truth over time"),
    ("overlap.png", "the same as an image"),
    ("strip.png", "selected frames side by side"),
    (ABOUT, "this list; it marks the folder as written by the demo"),
];
const ABOUT: &str = "about.txt";
/// Side of the square crops in the strip, in pixels.
const PANEL: usize = 320;
const MARK: &str = "Made by `patchlock demo`";

/// Renders a short scene with exact truth, tracks it, and shows the results
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct DemoArgs {
    /// Folder for the results; created if missing
    #[arg(long, value_name = "DIR", default_value = "demo")]
    out: PathBuf,

    /// Replace existing files even if they were not written by a demo
    #[arg(long)]
    overwrite: bool,

    /// No progress bar
    #[arg(long, short)]
    quiet: bool,
}

/// Runs the demo. `program` is the program name in the commands that it suggests.
pub fn run(args: &DemoArgs, program: &str) -> Result<()> {
    let is_new = !args.out.exists();
    prepare(&args.out, args.overwrite)?;
    let shown = show(args, program);
    if shown.is_err() && is_new {
        // Removes the folder only if it is empty.
        let _ = fs::remove_dir(&args.out);
    }
    shown
}

fn show(args: &DemoArgs, program: &str) -> Result<()> {
    interrupt::listen()?;
    let scene = Scene::demo();
    let mut targets = Targets::in_first_frame(&[truth_box(&scene, 0)]);
    let (mut run, mut show) = begin(&args.out, &scene, &targets)?;
    let progress = Progress::new(Some(scene.len()), args.quiet);
    let frames = Prefetcher::start(Box::new(SceneSource(scene.clone())), 0..scene.len());
    let frames = frames.take_while(|_| !interrupt::requested()).map(|frame| Ok(frame?));
    run.track_all(&mut targets, frames, &progress, |tracked| show.add(&scene, tracked))?;
    progress.finish("");
    let (count, fps) = (run.measurements().frames(), run.measurements().fps());
    let losses = run.measurements().losses().to_vec();
    if count < scene.len() {
        let message = format!("stopped after {count} frames; nothing was written");
        return Err(interrupted(message).into());
    }
    let overlap = show.finish(&scene, &args.out, run.into_sinks())?;
    print_summary(program, &args.out, &scene, &(overlap, losses), fps);
    Ok(())
}

/// Creates the folder, and refuses to replace files that were not written by a demo.
fn prepare(out: &Path, overwrite: bool) -> Result<(), Failure> {
    if out.exists() && !out.is_dir() {
        return Err(usage(format!("--out {}: this is a file, not a folder", out.display()))
            .hint("name a folder"));
    }
    let ours = files::read(&out.join(ABOUT)).is_ok_and(|text| text.starts_with(MARK.as_bytes()));
    let foreign = FILES.iter().map(|(name, _)| out.join(name)).find(|path| path.exists());
    // The mark may be somebody else's, and a link leads to any file.
    let is_link = |path: &PathBuf| path.is_symlink() && (path.is_file() || !path.exists());
    if let Some(path) = FILES.iter().map(|(name, _)| out.join(name)).find(is_link) {
        return Err(usage(format!("{} is a link to a file, which no demo writes", path.display()))
            .hint("remove it, or choose another folder with --out"));
    }
    if let Some(path) = foreign.filter(|_| !ours && !overwrite) {
        return Err(usage(format!(
            "{} already exists and was not written by a demo",
            path.display()
        ))
        .hint("--overwrite replaces it, --out chooses another folder"));
    }
    fs::create_dir_all(out).map_err(|error| {
        failed(format!("cannot create the folder {}: {error}", out.display()))
            .hint("--out chooses another folder")
    })
}

/// Opens the files. The run writes the boxes and the video with the track.
fn begin(out: &Path, scene: &Scene, targets: &Targets) -> Result<(Run, DemoOutput)> {
    let create = |name: &str| PendingFile::create(&out.join(name), true);
    let first = scene.frame(0);
    let input = create("input.mp4")?;
    let write_error = Box::new(input.error_handler());
    let (frames, view) = (Some(scene.len()), View::new(true, None));
    let video = Video::new(create("demo.mp4")?, FrameRate::DEFAULT, view, QUALITY, frames);
    // The video first: completing it may still fail, before the other files are in place.
    let sinks: Vec<Box<dyn Sink>> = vec![
        Box::new(BackgroundSink::new(Box::new(video))),
        Box::new(Table::new(Format::Csv, LostPosition::Keep, create("demo.csv")?)),
    ];
    let run = Run::new(TrackerConfig::default(), None, targets, sinks)?;
    let input = Mp4Writer::new(input, first.width, first.height, FrameRate::DEFAULT, frames)
        .map_err(&write_error)?;
    let show = DemoOutput {
        input,
        write_error,
        overlap: Vec::new(),
        score: Vec::new(),
        captions: captions(scene),
        away: false,
        panels: Vec::new(),
    };
    Ok((run, show))
}

struct SceneSource(Scene);

impl FrameSource for SceneSource {
    fn info(&self) -> SourceInfo {
        let (length, rate) = (Some(self.0.len()), Some(FrameRate::DEFAULT));
        SourceInfo { length, rate, sound: false }
    }

    fn frame(&mut self, index: usize) -> Result<Option<Picture>, Error> {
        let frame = (index < self.0.len()).then(|| self.0.frame(index));
        Ok(frame.map(|frame| Picture::rgb(frame.width, frame.height, frame.rgb)))
    }
}

/// What the demo shows beside the outputs of the run, and the measurements so far.
struct DemoOutput {
    input: Mp4Writer<PendingFile>,
    /// Adds the name of `input` to errors.
    write_error: Box<dyn Fn(Error) -> Failure>,
    overlap: Vec<f64>,
    score: Vec<f64>,
    /// The captions of frames to show in the strip.
    captions: BTreeMap<usize, String>,
    /// Whether the target was lost and has not been tracked since.
    away: bool,
    panels: Vec<Panel>,
}

impl DemoOutput {
    fn add(&mut self, scene: &Scene, tracked: &TrackedFrame<'_>) -> Result<()> {
        self.input.push(&tracked.picture.to_rgb()).map_err(&self.write_error)?;
        let target = tracked.targets.first().context("there is a target")?;
        let overlap = target.bbox.overlap(&truth_box(scene, tracked.frame));
        self.overlap.push(overlap);
        self.score.push(target.estimate.score);
        let status = target.estimate.status;
        let found = self.away && status == Status::Tracked;
        self.away = !found && (self.away || status == Status::Lost);
        let caption = self.captions.get(&tracked.frame).map(String::as_str);
        if let Some(what) = caption.or(found.then_some("found again")) {
            let visible = !scene.truth(tracked.frame).is_absent();
            self.panels.push(panel(target, tracked, what, visible.then_some(overlap))?);
        }
        Ok(())
    }

    /// Completes all files; returns the overlap in each frame.
    fn finish(self, scene: &Scene, out: &Path, sinks: Vec<Box<dyn Sink>>) -> Result<Vec<f64>> {
        let hidden: Vec<f64> = (0..scene.len()).map(|k| scene.truth(k).hidden).collect();
        let subtitle = format!(
            "mean {:.3}, lowest {:.3} where the target is visible; the box is given in frame 0",
            mean(&visible(scene, &self.overlap)),
            lowest(&visible(scene, &self.overlap)).1
        );
        let chart = report::overlap(&self.overlap, &self.score, &hidden, &subtitle);
        let chart = chart.map_err(Failure::from)?;
        let mut strip = Vec::new();
        strip::draw(&self.panels)?.write_png(&mut strip)?;
        // Write all files first and then rename all, so that a full disk does not leave an
        // incomplete demo.
        let files = [
            self.input.finish().map_err(self.write_error)?,
            filled(out, "overlap.svg", chart.as_bytes())?,
            filled(out, "overlap.png", &report::png(&chart).map_err(Failure::from)?)?,
            filled(out, "strip.png", &strip)?,
            filled(out, "truth.csv", truth_table(scene).as_bytes())?,
            filled(out, ABOUT, about().as_bytes())?,
        ];
        for sink in sinks {
            sink.finish()?;
        }
        for file in files {
            file.commit()?;
        }
        Ok(self.overlap)
    }
}

/// A crop of the frame around the target, annotated like a whole frame. There is no overlap where
/// nothing of the target is visible.
fn panel(
    target: &TargetResult,
    tracked: &TrackedFrame<'_>,
    what: &str,
    overlap: Option<f64>,
) -> Result<Panel> {
    let TrackedFrame { picture, frame, ms, .. } = *tracked;
    let side = PANEL.min(picture.width).min(picture.height);
    let begin = |centre: f64, length: usize| {
        ((centre - side as f64 / 2.0).max(0.0) as usize).min(length - side)
    };
    let BoundingBox { x, y, w, h } = target.bbox;
    let (left, top) = (begin(x + w / 2.0, picture.width), begin(y + h / 2.0, picture.height));
    let rgb = picture.to_rgb();
    let rows = rgb.chunks_exact(picture.width * 3).skip(top).take(side);
    let part = rows.flat_map(|row| &row[left * 3..(left + side) * 3]).copied().collect();
    let targets = [target.placed([left, top].map(|at| at as f64), 1.0)];
    let part = Arc::new(Picture::rgb(side, side, part));
    let part = TrackedFrame { frame, ms, targets: &targets, picture: &part };
    let estimate = &target.estimate;
    Ok(Panel {
        frame: View::new(true, None).draw(&part)?,
        title: what.to_string(),
        status: estimate.status.to_string().to_uppercase(),
        note: overlap.map_or_else(String::new, |overlap| format!("overlap {overlap:.2}")),
        mark: draw::colour(estimate),
    })
}

fn filled(out: &Path, name: &str, data: &[u8]) -> Result<PendingFile, Failure> {
    PendingFile::create(&out.join(name), true)?.filled(data)
}

fn truth_box(scene: &Scene, k: usize) -> BoundingBox {
    let [x, y, w, h] = scene.truth(k).bbox;
    BoundingBox { x, y, w, h }
}

/// The truth, in those columns of the track that apply to it.
fn truth_table(scene: &Scene) -> String {
    let head = "frame,x,y,w,h,x1,y1,x2,y2,x3,y3,x4,y4,hidden";
    let row = |k: usize| {
        let truth = scene.truth(k);
        let corners = truth.corners.into_iter().flatten();
        let numbers = truth.bbox.into_iter().chain(corners).chain([truth.hidden]);
        format!("\n{k}") + &numbers.map(|number| format!(",{number:.4}")).collect::<String>()
    };
    head.to_string() + &(0..scene.len()).map(row).collect::<String>() + "\n"
}

fn about() -> String {
    let mut text = format!(
        "{MARK}, version {}; running it again replaces these files.\n\n",
        env!("CARGO_PKG_VERSION")
    );
    FILES.iter().for_each(|(name, what)| text += &format!("{name:<12} {what}\n"));
    text
}

/// The frames to show in the strip: the first one and those in which each difficulty is greatest. The
/// middle of the frames in which the target is hidden completely stands for all of them.
fn captions(scene: &Scene) -> BTreeMap<usize, String> {
    let percent = |share: f64| format!("{:.0} %", 100.0 * share);
    let most = |value: &dyn Fn(usize) -> f64| {
        (1..scene.len()).max_by(|&a, &b| value(a).total_cmp(&value(b))).unwrap_or(0)
    };
    let turned = most(&|k| scene.truth(k).rotation.abs());
    let darkest = most(&|k| -scene.light(k).0);
    let absent: Vec<usize> = (0..scene.len()).filter(|&k| scene.truth(k).is_absent()).collect();
    let hidden = absent.get(absent.len() / 2).copied();
    let hidden = hidden.unwrap_or_else(|| most(&|k| scene.truth(k).hidden));
    let turn = |k: usize| format!("{:+.0}°", scene.truth(k).rotation.to_degrees());
    // Of two captions for one frame, the later one counts.
    BTreeMap::from([
        (darkest, format!("{} light, {}", percent(scene.light(darkest).0), turn(darkest))),
        (hidden, format!("{} hidden", percent(scene.truth(hidden).hidden))),
        (turned, format!("{} size, {}", percent(scene.truth(turned).scale), turn(turned))),
        (0, "the given box".to_string()),
    ])
}

/// The frames in which some of the target is visible, with their overlap.
fn visible(scene: &Scene, overlap: &[f64]) -> Vec<(usize, f64)> {
    let all = overlap.iter().copied().enumerate();
    all.filter(|&(k, _)| !scene.truth(k).is_absent()).collect()
}

fn mean(values: &[(usize, f64)]) -> f64 {
    values.iter().map(|(_, value)| value).sum::<f64>() / values.len().max(1) as f64
}

/// The frame and value of the smallest value.
fn lowest(values: &[(usize, f64)]) -> (usize, f64) {
    let all = values.iter().copied();
    all.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 0.0))
}

/// How much of the target is hidden in a frame, for a sentence; empty if nothing is.
fn hidden_words(scene: &Scene, frame: usize) -> String {
    match (100.0 * scene.truth(frame).hidden).round() {
        0.0 => String::new(),
        percent => format!(", {percent:.0} % hidden"),
    }
}

/// Prints the results and what to do next.
fn print_summary(
    program: &str,
    out: &Path,
    scene: &Scene,
    (overlap, losses): &(Vec<f64>, Vec<LostSpan>),
    fps: f64,
) {
    let seen = visible(scene, overlap);
    let (frame, least) = lowest(&seen);
    let hidden = hidden_words(scene, frame);
    let BoundingBox { x, y, w, h } = truth_box(scene, 0);
    let command_out = |name: &str| quoted(&out.join(name));
    let mut text = format!(
        "Tracked {} rendered frames at {fps:.1} frames per second.\n\
         Overlap with the truth: mean {:.3}, lowest {least:.3} (frame {frame}{hidden}),\n\
         in the {} frames in which some of the target is visible.\n",
        overlap.len(),
        mean(&seen),
        seen.len(),
    );
    for LostSpan { lost_frame, return_frame, .. } in losses {
        let returned =
            return_frame.map_or("not found again".to_string(), |k| format!("found in frame {k}"));
        text += &format!("Lost in frame {lost_frame}, {returned}.\n");
    }
    text += &format!("\nIn {}:\n", out.display());
    FILES.iter().for_each(|(name, what)| text += &format!("  {name:<12} {what}\n"));
    text += &format!(
        "\nTo do the same from the video file:\n  \
         {program} track {} --box {x},{y},{w},{h} \\\n    \
         --video {} --save {}\n\n\
         For your own video, read left, top, width and height of the object off a grid:\n  \
         {program} frame VIDEO.mp4 --grid\n  \
         {program} track VIDEO.mp4 --box X,Y,W,H \\\n    \
         --video tracked.mp4 --save boxes.csv\n",
        command_out("input.mp4"),
        command_out("mine.mp4"),
        command_out("mine.csv")
    );
    // A closed pipe is not an error here: the files are written.
    let _ = print(&text);
}
