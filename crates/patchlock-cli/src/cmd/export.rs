//! `patchlock export`: converts a saved track to the format of another tool.

use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::Args;
use clap::builder::PossibleValuesParser;
use patchlock_media::Limits;
use patchlock_studio::export as of_project;
use patchlock_studio::project::Store;
use patchlock_track::export::{
    self, ExportSummary, Format, ImageUse, KeyFrames, Options, Purpose, Selection, Track,
};
use patchlock_track::names::counted;

use super::LimitArgs;
use crate::failure::{Failure, failed, interrupted, say, usage};
use crate::interrupt;
use crate::output::inputs::Inputs;
use crate::output::printed::wrapped;

const EXAMPLES: &str = "\
EXAMPLES:
  patchlock export track.csv --format mot --out track.txt
      a text file in the format of MOTChallenge, for TrackEval and motmetrics
  patchlock export track.csv --format cvat --key-frames 0.9 --label car \\
    --images video.mp4 --out track.xml
      for correction in CVAT: Upload annotations, CVAT 1.1; the number of frames
      is that of the video
  patchlock export video.patchlock.json --format coco --out video.json
      the targets of a project, with their labels
  patchlock export track.csv --format yolo --every 5 --min-score 0.8 \\
    --images video.mp4 --out dataset
      a folder for training a detector, with every 5th frame of the video as an
      image, unless a target in it is not tracked or has a lower score
  patchlock export clips --all --format yolo --out dataset --val 0.2
      all projects in the folder clips as one data set, a fifth of the clips for
      validation

FORMATS:
";

const NOTES: &str = "\
BOXES:
Formats to train a detector get only tracked boxes and those that a person has
drawn. A frame with another box or with a lost target is left out completely:
a detector would learn that a target without its box is background. The other
formats get all boxes; they mark frames in which a target is lost. --status,
--min-score and --every choose other boxes. The message counts what is left out
and what is doubtful. A box that a person has drawn is always certain.

If the row of a lost target has no box, there is no line in mot and no
annotation in coco. cvat and label-studio mark frames without a row like those
without a box: the tools show each target in the frames in which it has a box,
and in no other. Without a project or --images, the clip ends with the last row.

With --all the output is a folder. Class ids agree in all formats: they follow
the list of labels. coco has annotations/instances_train.json and images, yolo
and voc are one set, the other formats, csv too, have files or folders of each
clip, in train and val if there is --val. Frames come from videos in the folder
of their projects. Clips without boxes are left out.";

/// The text below the options: examples, the formats and notes.
fn after_help() -> String {
    let format = |format: &Format| {
        let lost = match format.lost {
            Some(mark) => format!("; lost: {mark}"),
            None => String::new(),
        };
        let only = if format.is_of_project { "for projects only: " } else { "" };
        entry(format.name, &format!("{only}{}{lost}", format.content))
    };
    let formats: String = Format::ALL.iter().map(format).collect();
    format!("{EXAMPLES}{formats}\n{NOTES}")
}

/// An entry of the list of formats, in lines of at most 80 columns.
fn entry(name: &str, text: &str) -> String {
    const INDENT: usize = 16;
    let text = wrapped(text, 80 - INDENT, &" ".repeat(INDENT));
    format!("  {name:<width$}{text}\n", width = INDENT - 2)
}

/// The names of the formats that are so.
fn names(is: fn(&Format) -> bool) -> String {
    let names: Vec<&str> =
        Format::ALL.iter().filter(|format| is(format)).map(|format| format.name).collect();
    match names.split_last() {
        Some((last, others)) if !others.is_empty() => format!("{} and {last}", others.join(", ")),
        _ => names.concat(),
    }
}

/// Converts a track for other tools: MOT, COCO, CVAT, YOLO, VOC, Label Studio and others
///
/// TRACK is a .csv or .jsonl table of patchlock track, a .txt file of track or bench with one box
/// per line, counted from 1, or a project (.json); with --all, a folder of projects. The output is
/// complete or absent.
#[derive(Debug, Args)]
#[command(after_help = after_help())]
pub struct ExportArgs {
    /// The track (.csv, .jsonl, .txt) or project (.json); with --all, a folder of projects
    track: PathBuf,

    /// Write all projects of the folder as one data set
    #[arg(long, conflicts_with_all = ["images", "follow_links", "size", "label", "overwrite"])]
    all: bool,

    /// Clips for validation: a share of them such as 0.2, chosen by their names alone and so the
    /// same each time; or their names, such as a,b
    #[arg(long, value_name = "SHARE|CLIP,...", requires = "all")]
    val: Option<String>,

    /// Write no frames, only boxes
    #[arg(long, requires = "all")]
    no_frames: bool,

    /// The format; csv is for projects only, cvat-obb is not for them
    #[arg(long, value_name = "NAME", value_parser = formats())]
    format: String,

    #[arg(long, value_name = "PATH", help = format!(
        "The file to write for {}; the folder to create for the others", names(Format::is_file)
    ))]
    out: PathBuf,

    #[arg(long, value_name = "WxH", help = format!(
        "Width and height of the frames in pixels [default: from the images or TRACK]; not needed for {}",
        names(|format| !format.needs_size)
    ))]
    size: Option<String>,

    #[arg(long, value_name = "PATH", help = format!(
        "The folder of the frames, or the video. {} copy the frames of the track; {} refers to them by name; \
         {} have their number",
        names(Format::holds_frames),
        names(|format| format.images == ImageUse::Named),
        names(|format| format.images == ImageUse::Measured)
    ))]
    images: Option<PathBuf>,

    /// Also copy images that are links to files outside the folder of --images
    #[arg(long)]
    follow_links: bool,

    #[command(flatten)]
    limits: LimitArgs,

    #[arg(long, value_name = "N|IOU", default_value = "1", help = format!(
        "A whole number makes every Nth frame a key frame, besides each frame where something changes. \
         A number below 1, such as 0.9, takes as few as are needed for interpolated boxes to overlap \
         those of the track by at least this IoU. Only for {}, which interpolate between key frames",
        names(|format| format.has_key_frames)
    ))]
    key_frames: f64,

    #[arg(long, value_name = "STATUS,...", help = format!(
        "Write only boxes with these statuses: tracked, uncertain, lost [default: tracked for {}, all \
         for the others]",
        names(|format| format.purpose == Purpose::Training)
    ))]
    status: Option<String>,

    /// Write only boxes with at least this score, from 0 to 1
    #[arg(long, value_name = "S")]
    min_score: Option<f64>,

    #[arg(long, value_name = "N", default_value = "1", help = format!(
        "Write only every Nth frame: 0, N, 2N and so on. Not for {}, which have all frames",
        names(|format| format.has_key_frames)
    ))]
    every: usize,

    /// Class of the targets [default: target]; the targets of a project have labels
    #[arg(long, value_name = "NAME")]
    label: Option<String>,

    /// Name of the video [default: the name of the track's file]
    #[arg(long, value_name = "NAME")]
    name: Option<String>,

    /// Replace an existing file; a folder that is not empty is never replaced
    #[arg(long)]
    overwrite: bool,
}

/// The names of all formats, which shells complete.
fn formats() -> PossibleValuesParser {
    PossibleValuesParser::new(Format::ALL.map(|format| format.name))
}

pub fn run(args: &ExportArgs) -> Result<()> {
    if args.all {
        return export_all(args);
    }
    let inputs = Inputs::new([args.track.as_path()]);
    args.images.iter().fold(inputs, |all, images| all.with_source(images)).check(&args.out)?;
    let is_project = args.track.extension().is_some_and(|end| end.eq_ignore_ascii_case("json"));
    if is_project {
        return export_project(args);
    }
    let track = Track::read(&args.track).map_err(Failure::from)?;
    export_track(args, false, &track, Vec::new())
}

fn export_project(args: &ExportArgs) -> Result<()> {
    if args.label.is_some() {
        let message = format!("--label is not for the project {}", args.track.display());
        return Err(usage(message).hint("each target of a project has a label").into());
    }
    let store = Store::open_shared(&args.track, None, Limits::default()).map_err(Failure::from)?;
    Inputs::default().with_source(store.video()).check(&args.out)?;
    args.images.iter().for_each(|images| say_if_other(&store, images));
    let project = store.project();
    let track = of_project::track(project).map_err(Failure::from)?;
    export_track(args, true, &track, of_project::classes(&project.labels, [project]))
}

/// Warns of images that are not those of a project. A folder may hold the frames of its video.
fn say_if_other(store: &Store, images: &Path) {
    let is_comparable = !images.is_dir() || store.video().is_dir();
    if is_comparable && store.project().video.change(images).is_some() {
        say(&format!(
            "warning: {} is not the video of {}, which is {}: check that the boxes fit its frames",
            images.display(),
            store.path().display(),
            store.video().display()
        ));
    }
}

fn export_all(args: &ExportArgs) -> Result<()> {
    if !args.track.is_dir() {
        return Err(usage(format!("{} is not a folder", args.track.display()))
            .hint("with --all, name the folder of the clips and their projects")
            .into());
    }
    let (mut clips, labels) = of_project::of_folder(&args.track).map_err(Failure::from)?;
    let format = Format::named(&args.format, true).map_err(Failure::from)?;
    let of_folder = || {
        let name = args.track.canonicalize().map_or_else(|_| stem(&args.track), |it| stem(&it));
        // A hidden folder is no reason to refuse, and the root has no name.
        match name.trim_start_matches('.') {
            "" => "clips".to_owned(),
            name => name.to_owned(),
        }
    };
    let options = Options {
        selection: args.selection()?,
        key_frames: args.key_frames()?,
        limits: args.limits.limits(),
        ..Options::new(format, args.name.clone().unwrap_or_else(of_folder))
    };
    if args.no_frames {
        clips.iter_mut().for_each(|clip| clip.video = None);
    } else if format.copies_frames() {
        let outside = clips.iter().find(|clip| clip.video.is_none());
        if let Some(clip) = outside {
            let video = clip.project.video.path.display();
            let message =
                format!("the video of {}, {video}, cannot be read in its folder", clip.name);
            return Err(failed(message).hint("put it there, or add --no-frames").into());
        }
    }
    let val = args.val.as_deref().and_then(of_project::Val::named);
    interrupt::listen()?;
    let stopped = &interrupt::requested;
    let written =
        of_project::write_all(&clips, &labels, &options, val.as_ref(), &args.out, stopped);
    say_all(args, &written.map_err(stopped_or)?);
    Ok(())
}

/// Says what was written of all clips.
fn say_all(args: &ExportArgs, written: &of_project::CombinedExport) {
    let of_project::CombinedExport { written, train, val, empty } = written;
    let clips = train.len() + val.len();
    say(&format!(
        "{}: {} boxes of {} targets in {clips} clips, {} files",
        args.out.display(),
        written.boxes.boxes,
        written.targets,
        written.files
    ));
    say_remarks(written);
    if !val.is_empty() {
        say(&format!("for validation: {}", val.join(", ")));
    }
    if !empty.is_empty() {
        say(&format!("left out, without boxes: {}", empty.join(", ")));
    }
}

/// Writes a track, of a project or else of a tracker.
fn export_track(
    args: &ExportArgs,
    of_project: bool,
    track: &Track,
    labels: Vec<String>,
) -> Result<()> {
    let options = Options {
        format: Format::named(&args.format, of_project).map_err(Failure::from)?,
        name: args.name.clone().unwrap_or_else(|| stem(&args.track)),
        label: args.label.clone().unwrap_or_else(|| "target".to_owned()),
        labels,
        size: args.size.as_deref().map(parse_size).transpose()?,
        images: args.images.clone(),
        follow_links: args.follow_links,
        selection: args.selection()?,
        key_frames: args.key_frames()?,
        limits: args.limits.limits(),
    };
    interrupt::listen()?;
    let stopped = &interrupt::requested;
    let written = export::write_unless(track, &options, &args.out, args.overwrite, stopped);
    conclude(args, &written.map_err(stopped_or)?);
    Ok(())
}

/// Why nothing was written: Ctrl-C, or else this error.
fn stopped_or(error: impl Into<Failure>) -> Failure {
    match interrupt::requested() {
        true => interrupted("stopped; nothing was written"),
        false => error.into(),
    }
}

fn conclude(args: &ExportArgs, written: &ExportSummary) {
    let ExportSummary { files, targets, boxes, .. } = written;
    say(&format!(
        "{}: {} box{} of {} in {}",
        args.out.display(),
        boxes.boxes,
        if boxes.boxes == 1 { "" } else { "es" },
        counted(*targets, "target"),
        counted(*files, "file")
    ));
    say_remarks(written);
}

/// Says what was left out and what is doubtful.
fn say_remarks(written: &ExportSummary) {
    written.remarks().iter().for_each(|remark| say(remark));
}

impl ExportArgs {
    fn selection(&self) -> Result<Selection, Failure> {
        let status = self.status.as_deref().map(Selection::statuses).transpose()?;
        Ok(Selection { status, min_score: self.min_score, every: self.every })
    }

    fn key_frames(&self) -> Result<KeyFrames, Failure> {
        Ok(KeyFrames::of(self.key_frames)?)
    }
}

fn stem(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    stem.strip_suffix(".patchlock").unwrap_or(&stem).to_owned()
}

fn parse_size(text: &str) -> Result<(usize, usize), Failure> {
    let sides = text.split_once(['x', 'X']);
    let sides = sides.and_then(|(w, h)| Some((w.trim().parse().ok()?, h.trim().parse().ok()?)));
    sides.ok_or_else(|| {
        usage(format!("--size {text} is not a size"))
            .hint("a size is WIDTHxHEIGHT in pixels, such as 1280x720")
    })
}
