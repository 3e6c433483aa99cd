//! `patchlock frame`: saves one frame of a source, with a grid for reading off a box.

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;
use patchlock_media::{Ahead, Limits, Order, Picture};
use patchlock_studio::drawing::canvas::{Area, Canvas};
use patchlock_studio::drawing::text;

use super::LimitArgs;
use crate::failure::{Failure, say, usage};
use crate::output::inputs::Inputs;
use crate::output::pending::{self, PendingFile};

const EXAMPLES: &str = "\
EXAMPLES:
  patchlock frame video.mp4 --grid
      writes frame_000000.png with a grid: read left, top, width and height of
      the object off it
  patchlock frame video.mp4 --at 250 --out start.png
      writes frame 250 without a grid";

/// About so many lines go across the longer side.
const LINES: f32 = 16.0;

/// Saves a frame as PNG, with a grid for reading off a box
///
/// SOURCE is anything that patchlock track takes. Frames and pixels count from 0. A grid line is
/// the left or upper side of the pixel with its number.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct FrameArgs {
    /// Frames: a folder, a pattern, a glob, a video file, or - for Y4M on stdin
    source: OsString,

    /// Number of the frame
    #[arg(long, value_name = "0..", default_value = "0", allow_negative_numbers = true)]
    at: usize,

    /// Draw numbered grid lines
    #[arg(long)]
    grid: bool,

    #[command(flatten)]
    limits: LimitArgs,

    /// The file to write [default: frame_ and the number of the frame]
    #[arg(long, value_name = "FILE.png")]
    out: Option<PathBuf>,

    /// Replace an existing file
    #[arg(long)]
    overwrite: bool,
}

/// Reads the frame, draws the grid, writes the file.
pub fn run(args: &FrameArgs) -> Result<()> {
    let out = args.out.clone().unwrap_or_else(|| format!("frame_{:06}.png", args.at).into());
    if !out.extension().is_some_and(|end| end.eq_ignore_ascii_case("png")) {
        let message = format!("--out {}: unknown extension; use .png", out.display());
        return Err(usage(message).hint("a frame is saved without loss, as PNG").into());
    }
    pending::check(&out, args.overwrite)?;
    Inputs::default().with_source(&args.source).check(&out)?;
    let picture = read(&args.source, args.at, args.limits.limits())?;
    let (width, height) = (picture.width, picture.height);
    let mut canvas = Canvas::from_rgb(width, height, &picture.to_rgb())
        .with_context(|| format!("a frame of {width} x {height} pixels cannot be drawn on"))?;
    if args.grid {
        draw_grid(&mut canvas);
    }
    write(&canvas, &out, args.overwrite)?;
    say(&format!("{}: frame {}, {width} x {height} pixels", out.display(), args.at));
    Ok(())
}

fn read(source: &OsStr, at: usize, limits: Limits) -> Result<Picture, Failure> {
    let source = patchlock_media::open_within(source, false, limits)?;
    if let Some(length) = source.length().filter(|length| at >= *length) {
        return Err(usage(format!("--at {at} is beyond the end: the source has {length} frames"))
            .hint("frames count from 0"));
    }
    let order = Order { start: at, end: at.checked_add(1), stride: 1, reverse: false };
    let indices = order.indices(source.length())?;
    match Ahead::start(source, indices).next() {
        Some(frame) => Ok(frame?.1),
        None => {
            Err(usage(format!("--at {at} is beyond the end of the source"))
                .hint("frames count from 0"))
        }
    }
}

fn write(canvas: &Canvas, out: &Path, overwrite: bool) -> Result<()> {
    let mut png = Vec::new();
    canvas.write_png(&mut png)?;
    PendingFile::create(out, overwrite)?.filled(&png)?.commit()?;
    Ok(())
}

/// Draws a line every 1, 2 or 5 times a power of ten pixels, and their numbers at the upper and
/// left side.
fn draw_grid(canvas: &mut Canvas) {
    let (width, height) = (canvas.width(), canvas.height());
    let longer = width.max(height);
    let step = step(longer / LINES);
    let thick = (longer / 1500.0).max(1.0).round();
    let size = (longer / 70.0).clamp(9.0, 60.0);
    for k in 0.. {
        let at = k as f32 * step;
        if at >= longer {
            break;
        }
        for (area, inside) in [
            (Area { x: at, y: 0.0, w: thick, h: height }, at < width),
            (Area { x: 0.0, y: at, w: width, h: thick }, at < height),
        ] {
            if inside {
                // White on dark pictures, black on bright ones: half of each line is seen on any.
                canvas.fill(area, [255, 255, 255], 0.45);
                let shadow = match area.w < area.h {
                    true => Area { x: area.x + thick, ..area },
                    false => Area { y: area.y + thick, ..area },
                };
                canvas.fill(shadow, [0, 0, 0], 0.45);
            }
        }
        let label = format!("{at}");
        if at < width {
            number(canvas, &label, [at + 2.0 * thick, 0.0], size);
        }
        if k > 0 && at < height {
            number(canvas, &label, [0.0, at + 2.0 * thick], size);
        }
    }
}

/// Draws a number on a dark ground, with its upper left corner here.
fn number(canvas: &mut Canvas, label: &str, [x, y]: [f32; 2], size: f32) {
    let area = Area { x, y, w: text::width(label, size) + 0.5 * size, h: 1.2 * size };
    canvas.fill(area, [0, 0, 0], 0.65);
    canvas.text(label, x + 0.25 * size, y + 0.6 * size, size, [255, 255, 255]);
}

/// The smallest of 1, 2, 5, 10, 20, 50 and so on that is at least this.
fn step(least: f32) -> f32 {
    let mut power = 1.0;
    loop {
        if let Some(step) = [1.0, 2.0, 5.0].map(|k| k * power).into_iter().find(|s| *s >= least) {
            return step;
        }
        power *= 10.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_round_numbers() {
        let steps =
            [(0.2, 1.0), (1.0, 1.0), (1.1, 2.0), (15.0, 20.0), (40.0, 50.0), (120.0, 200.0)];
        for (least, expected) in steps {
            assert_eq!(step(least), expected, "{least}");
        }
    }

    #[test]
    fn lines_are_where_their_numbers_say() {
        let mut canvas = Canvas::plain(320, 200, [90, 90, 90]).expect("a canvas");
        draw_grid(&mut canvas);
        let rgb = canvas.to_rgb();
        let bright = |x: usize, y: usize| rgb[3 * (y * 320 + x)] > 120;
        // Beside the numbers: lines every 20 pixels.
        for k in 0..320 {
            assert_eq!(bright(k, 196), k % 20 == 0, "column {k}");
        }
        for k in 15..200 {
            assert_eq!(bright(310, k), k % 20 == 0, "row {k}");
        }
    }
}
