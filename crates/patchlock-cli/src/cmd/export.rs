//! `patchlock export`: converts a saved track to the format of another tool.

use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::Args;
use patchlock_studio::export as of_project;
use patchlock_studio::project::Store;
use patchlock_track::export::{self, Format, Options, Track};

use super::LimitArgs;
use crate::failure::{Failure, failed, interrupted, say, usage};
use crate::interrupt;
use crate::output::inputs::Inputs;

const EXAMPLES: &str = "\
EXAMPLES:
  patchlock export track.csv --format mot --out track.txt
      a text file in the format of MOTChallenge, for TrackEval and motmetrics
  patchlock export track.csv --format cvat --keyframes 10 --label car \\
    --images video.mp4 --out track.xml
      for correction in CVAT: Upload annotations, CVAT 1.1; the number of frames
      is that of the video
  patchlock export video.patchlock.json --format coco --out video.json
      the targets of a project, with their labels
  patchlock export track.csv --format yolo --images video.mp4 --out dataset
      a folder for training a detector, with the frames of the video as images
  patchlock export clips --all --format yolo --out dataset --val 0.2
      all projects in the folder clips as one data set, a fifth of the clips for
      validation

FORMATS:
  mot     a text file: frame,id,left,top,width,height,confidence (the
          score),-1,-1,-1; counted from 1
  coco    a JSON file: COCO with videos, tracks and track_id; the rotated
          outline is the segmentation
  cvat    an XML file: CVAT for video 1.1; targets with a score below 0.5 are
          marked as occluded
  cvat-obb  the same with the rotated outline: the box and its rotation; only
          for tables of patchlock track
  yolo    a folder: data.yaml and labels/train; boxes are clipped to the frame,
          ids are lost
  yolo-obb  the same with the corners of the rotated outline in place of the
          box; only for tables of patchlock track
  voc     a folder: Annotations and JPEGImages, Pascal VOC; boxes are clipped to
          the frame, ids are lost
  label-studio  a JSON file: a task with a prediction, for VideoRectangle
  lasot   a folder: <label>/<label>-<id>/groundtruth.txt for each target, with
          its flags
  got10k  a folder: <name>_<id>/groundtruth.txt for each target, with its
          labels; and list.txt
  csv     for projects only: a table of all targets and frames

Frames in which a target is lost (column status) are marked: in mot by
confidence 0, in coco by the attribute status, in cvat as outside, in
label-studio by the end of an interval, in lasot as full occlusion, in got10k as
absence. In yolo, yolo-obb and voc these frames are left out. If the row has no
box either, there is no line in mot and no annotation in coco. cvat and
label-studio mark frames without a row like those without a box: the tools show
each target in the frames in which it has a box, and in no other. Without a
project or --images, the clip ends with the last row.

With --all the output is a folder. Class ids agree in all formats: they follow
the list of labels. coco has annotations/instances_train.json and images, yolo
and voc are one set, the other formats, csv too, have files or folders of each
clip, in train and val if there is --val. Frames come from videos in the folder
of their projects. Clips without boxes are left out.";

/// Converts a track for other tools: MOT, COCO, CVAT, YOLO, VOC, Label Studio, LaSOT, GOT-10k
///
/// TRACK is a .csv or .jsonl table of patchlock track, a .txt file of track or bench with one box
/// per line, counted from 1, or a project (.json); with --all, a folder of projects. The output is
/// complete or absent.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
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

    /// mot, coco, cvat, cvat-obb, yolo, yolo-obb, voc, label-studio, lasot or got10k; for projects
    /// also csv
    #[arg(long, value_name = "NAME")]
    format: String,

    /// The file to write for mot, coco, cvat, cvat-obb and label-studio; the folder to create for the others
    #[arg(long, value_name = "PATH")]
    out: PathBuf,

    /// Width and height of the frames in pixels [default: from the images or TRACK]; mot and lasot
    /// do not need it
    #[arg(long, value_name = "WxH")]
    size: Option<String>,

    /// The folder of the frames, or the video. yolo, voc, lasot and got10k copy the frames of the
    /// track; coco refers to them by name; cvat and label-studio have their number
    #[arg(long, value_name = "PATH")]
    images: Option<PathBuf>,

    /// Also copy images that are links to files outside the folder of --images
    #[arg(long)]
    follow_links: bool,

    #[command(flatten)]
    limits: LimitArgs,

    /// Make every Nth frame a key frame, and each frame where something changes. Only for cvat and
    /// label-studio, which interpolate between key frames
    #[arg(long, value_name = "N", default_value = "1")]
    keyframes: usize,

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

/// Reads, converts, writes.
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
    export_track(args, &track, Vec::new())
}

/// Writes a project.
fn export_project(args: &ExportArgs) -> Result<()> {
    if args.label.is_some() {
        let message = format!("--label is not for the project {}", args.track.display());
        return Err(usage(message).hint("each target of a project has a label").into());
    }
    let store = Store::open_shared(&args.track, None).map_err(Failure::from)?;
    Inputs::default().with_source(store.video()).check(&args.out)?;
    args.images.iter().for_each(|images| say_if_other(&store, images));
    let format = of_project::Format::named(&args.format).map_err(Failure::from)?;
    let track = of_project::track(store.project()).map_err(Failure::from)?;
    if format != of_project::Format::Csv {
        let project = store.project();
        return export_track(args, &track, of_project::classes(&project.labels, [project]));
    }
    let limits = args.limits.limits();
    let options =
        of_project::Options { format, name: String::new(), frames: false, key_frames: 1, limits };
    let files =
        of_project::write(store.project(), store.video(), &options, &args.out, args.overwrite);
    conclude(args, &track, files.map_err(Failure::from)?, 0);
    Ok(())
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

/// Writes all projects of a folder.
fn export_all(args: &ExportArgs) -> Result<()> {
    if !args.track.is_dir() {
        return Err(usage(format!("{} is not a folder", args.track.display()))
            .hint("with --all, name the folder of the clips and their projects")
            .into());
    }
    let (clips, labels) = of_project::of_folder(&args.track).map_err(Failure::from)?;
    let format = of_project::Format::named(&args.format).map_err(Failure::from)?;
    let of_folder = || {
        let name = args.track.canonicalize().map_or_else(|_| stem(&args.track), |it| stem(&it));
        // A hidden folder is no reason to refuse, and the root has no name.
        match name.trim_start_matches('.') {
            "" => "clips".to_owned(),
            name => name.to_owned(),
        }
    };
    let options = of_project::Options {
        format,
        name: args.name.clone().unwrap_or_else(of_folder),
        frames: !args.no_frames,
        key_frames: args.keyframes,
        limits: args.limits.limits(),
    };
    if options.frames && format.copies_frames() {
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
    match written {
        Ok(written) => say_all(args, &written),
        Err(_) if stopped() => return Err(interrupted("stopped; nothing was written").into()),
        Err(error) => return Err(Failure::from(error).into()),
    }
    Ok(())
}

/// Says what was written of all clips.
fn say_all(args: &ExportArgs, written: &of_project::Written) {
    let of_project::Written { files, boxes, targets, train, val, empty } = written;
    let clips = train.len() + val.len();
    say(&format!(
        "{}: {boxes} boxes of {targets} targets in {clips} clips, {files} files",
        args.out.display()
    ));
    if !val.is_empty() {
        say(&format!("for validation: {}", val.join(", ")));
    }
    if !empty.is_empty() {
        say(&format!("left out, without boxes: {}", empty.join(", ")));
    }
}

/// Writes a track in the format of another tool.
fn export_track(args: &ExportArgs, track: &Track, labels: Vec<String>) -> Result<()> {
    let options = Options {
        format: Format::named(&args.format).map_err(Failure::from)?,
        name: args.name.clone().unwrap_or_else(|| stem(&args.track)),
        label: args.label.clone().unwrap_or_else(|| "target".to_owned()),
        labels,
        size: args.size.as_deref().map(parse_size).transpose()?,
        images: args.images.clone(),
        follow_links: args.follow_links,
        key_frames: args.keyframes,
        limits: args.limits.limits(),
    };
    interrupt::listen()?;
    let stopped = &interrupt::requested;
    match export::write_unless(track, &options, &args.out, args.overwrite, stopped) {
        Ok(files) => {
            let lost = if options.format.leaves_out_lost() { track.lost_boxes() } else { 0 };
            conclude(args, track, files, lost);
        }
        Err(_) if stopped() => return Err(interrupted("stopped; nothing was written").into()),
        Err(error) => return Err(Failure::from(error).into()),
    }
    Ok(())
}

/// Says what was written; `lost` boxes were not.
fn conclude(args: &ExportArgs, track: &Track, files: usize, lost: usize) {
    let (targets, boxes) = (track.ids().len(), track.boxes() - lost);
    let plural = |count: usize| if count == 1 { "" } else { "s" };
    let without = if lost > 0 { format!("; without {lost} of lost frames") } else { String::new() };
    say(&format!(
        "{}: {boxes} box{} of {targets} target{} in {files} file{}{without}",
        args.out.display(),
        if boxes == 1 { "" } else { "es" },
        plural(targets),
        plural(files)
    ));
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
