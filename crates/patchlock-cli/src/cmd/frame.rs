//! `patchlock frame`: saves one frame of a source, with a grid for reading off a box.

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;
use patchlock_bench::report::round_step;
use patchlock_drawing::canvas::{Area, Canvas};
use patchlock_drawing::text;
use patchlock_media::live::Address;
use patchlock_media::{Feed, Limits, Order, Picture, Prefetcher};
use patchlock_track::files;

use super::{LimitArgs, input};
use crate::failure::{Failure, failed, interrupted, say, usage};
use crate::interrupt;
use crate::output::inputs::Inputs;
use crate::output::pending::{self, PendingFile};

const EXAMPLES: &str = "\
EXAMPLES:
  patchlock frame video.mp4 --grid
      writes frame_000000.png with a grid: read left, top, width and height of
      the object off it
  patchlock frame video.mp4 --around 640,360
      shows a square of 100 pixels around this place, large, with a grid: for a
      small target
  patchlock frame video.mp4 --at 250 --out start.png
      writes frame 250 without a grid";

/// About so many lines go across the longer side: of a frame, and of an enlarged part.
const LINES: f32 = 16.0;
const FINE_LINES: f32 = 24.0;

/// Saves a frame as PNG, with a grid for reading off a box
///
/// SOURCE is anything that patchlock track takes. Frames and pixels count from 0. A grid line is
/// the left or upper side of the pixel with its number.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct FrameArgs {
    /// Frames: a folder, a pattern, a glob, a video file, a camera or stream, or - for Y4M on stdin
    source: OsString,

    /// Number of the frame
    #[arg(long, value_name = "0..", default_value = "0")]
    at: usize,

    /// Draw numbered grid lines
    #[arg(long)]
    grid: bool,

    /// Show only a square around this pixel, enlarged, with a fine grid that has the numbers of the
    /// whole frame
    #[arg(long, value_name = "X,Y")]
    around: Option<String>,

    /// Side of the square of --around, in pixels
    #[arg(
        long,
        value_name = "10..1000",
        default_value = "100",
        requires = "around",
        value_parser = clap::value_parser!(u16).range(10..=1000)
    )]
    side: u16,

    #[command(flatten)]
    limits: LimitArgs,

    /// The file to write [default: frame_ and the number of the frame]
    #[arg(long, value_name = "FILE.png")]
    out: Option<PathBuf>,

    /// Replace an existing file
    #[arg(long)]
    overwrite: bool,
}

pub fn run(args: &FrameArgs) -> Result<()> {
    let out = args.out.clone().unwrap_or_else(|| format!("frame_{:06}.png", args.at).into());
    if !files::ends_with(&out, "png") {
        let message = format!("--out {}: unknown extension; use .png", out.display());
        return Err(usage(message).hint("a frame is saved without loss, as PNG").into());
    }
    pending::check(&out, args.overwrite)?;
    let limits = args.limits.limits();
    let picture = match Address::parse(&args.source).map_err(Failure::from)? {
        Some(address) => newest(address, args.at, limits)?,
        None => {
            Inputs::default().with_source(&args.source).check(&out)?;
            read(&args.source, args.at, limits)?
        }
    };
    let (width, height) = (picture.width, picture.height);
    let mut canvas = Canvas::from_rgb(width, height, &picture.to_rgb())
        .with_context(|| format!("a frame of {width} x {height} pixels cannot be drawn on"))?;
    if let Some(centre) = args.around.as_deref() {
        let part = Viewport::around(centre, args.side, [width, height])?;
        let area = Area { x: part.x, y: part.y, w: part.side, h: part.side };
        let pixels = (part.side * part.scale) as usize;
        canvas = canvas.part(area, pixels).context("the part has no pixels")?;
        draw_grid(&mut canvas, &part);
    } else if args.grid {
        draw_grid(&mut canvas, &Viewport::whole(width.max(height)));
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
    match input::next(&mut Feed::File(Prefetcher::start(source, indices)), say)? {
        Some((_, picture)) => Ok(picture),
        None => {
            Err(usage(format!("--at {at} is beyond the end of the source"))
                .hint("frames count from 0"))
        }
    }
}

/// A frame of a live source: the first one that has this number or a higher one.
fn newest(address: Address, at: usize, limits: Limits) -> Result<Picture> {
    interrupt::listen()?;
    let mut feed = input::open_once(address, at, limits);
    match input::next(&mut feed, say)? {
        Some((_, picture)) => Ok(picture),
        None if interrupt::requested() => {
            Err(interrupted("stopped before the frame was there").into())
        }
        None => Err(failed(format!("the source ended before frame {at}")).into()),
    }
}

fn write(canvas: &Canvas, out: &Path, overwrite: bool) -> Result<()> {
    let mut png = Vec::new();
    canvas.write_png(&mut png)?;
    PendingFile::create(out, overwrite)?.filled(&png)?.commit()?;
    Ok(())
}

/// The side of the enlarged part, about, in pixels of the picture.
const ENLARGED: f32 = 1200.0;

/// The part of a frame that is shown: its upper left corner and larger side in pixels of the frame,
/// and how many pixels of the picture each of them takes.
struct Viewport {
    x: f32,
    y: f32,
    side: f32,
    scale: f32,
}

impl Viewport {
    fn whole(side: usize) -> Self {
        Self { x: 0.0, y: 0.0, side: side as f32, scale: 1.0 }
    }

    /// The square around a pixel `X,Y`, moved into the frame as far as it fits there.
    fn around(centre: &str, side: u16, size: [usize; 2]) -> Result<Self, Failure> {
        let wrong = |reason: String| {
            usage(format!("--around {centre}: {reason}"))
                .hint("it is the column and the row of a pixel, counted from 0, such as 640,360")
        };
        let numbers = centre.split_once(',').map(|(x, y)| [x.trim().parse(), y.trim().parse()]);
        let Some([Ok(x), Ok(y)]) = numbers else {
            return Err(wrong("it is not two whole numbers".to_string()));
        };
        let place: [usize; 2] = [x, y];
        if place[0] >= size[0] || place[1] >= size[1] {
            let [width, height] = size;
            return Err(wrong(format!("the frame has {width} x {height} pixels")));
        }
        let side = usize::from(side).min(size[0].max(size[1]));
        let begin = |at: usize, length: usize| {
            at.saturating_sub(side / 2).min(length.saturating_sub(side)) as f32
        };
        let scale = (ENLARGED / side as f32).round().max(1.0);
        let [x, y] = [begin(place[0], size[0]), begin(place[1], size[1])];
        Ok(Self { x, y, side: side as f32, scale })
    }
}

/// Draws a line every 1, 2 or 5 times a power of ten pixels of the frame, and their numbers at the
/// upper and left side.
fn draw_grid(canvas: &mut Canvas, part: &Viewport) {
    let (width, height) = (canvas.width(), canvas.height());
    let longer = width.max(height);
    let lines = if part.scale > 1.0 { FINE_LINES } else { LINES };
    let step = round_step(f64::from(part.side / lines)) as f32;
    let thick = (longer / 1500.0).max(1.0).round();
    let size = (longer / 70.0).clamp(9.0, 60.0);
    for (k, begin) in [part.x, part.y].into_iter().enumerate() {
        let (along, across) = if k == 0 { (width, height) } else { (height, width) };
        let first = (begin / step).ceil() as usize;
        for value in (first..).map(|line| line as f32 * step) {
            let at = (value - begin) * part.scale;
            if at >= along {
                break;
            }
            // White on dark pictures, black on bright ones: half of each line is seen on any.
            for (at, colour) in [(at, [255; 3]), (at + thick, [0; 3])] {
                let line = match k {
                    0 => Area { x: at, y: 0.0, w: thick, h: across },
                    _ => Area { x: 0.0, y: at, w: across, h: thick },
                };
                canvas.fill(line, colour, 0.45);
            }
            let place = [at + 2.0 * thick, 0.0];
            // Where both have one, the number of the column is enough.
            match k {
                0 => number(canvas, &format!("{value}"), place, size),
                _ if at > 0.0 => number(canvas, &format!("{value}"), [place[1], place[0]], size),
                _ => {}
            }
        }
    }
}

/// Draws a number on a dark ground, with its upper left corner here.
fn number(canvas: &mut Canvas, label: &str, [x, y]: [f32; 2], size: f32) {
    let area = Area { x, y, w: text::width(label, size) + 0.5 * size, h: 1.2 * size };
    canvas.fill(area, [0, 0, 0], 0.65);
    canvas.text(label, x + 0.25 * size, y + 0.6 * size, size, [255, 255, 255]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_part_around_a_pixel_stays_in_the_frame() {
        let part = |centre: &str| {
            let Viewport { x, y, side, scale } = Viewport::around(centre, 100, [640, 80])?;
            Ok::<_, Failure>([x, y, side, scale])
        };
        assert_eq!(part("320,40").expect("inside"), [270.0, 0.0, 100.0, 12.0]);
        assert_eq!(part("0, 79").expect("inside"), [0.0, 0.0, 100.0, 12.0]);
        assert_eq!(part("639,0").expect("inside"), [540.0, 0.0, 100.0, 12.0]);
        for (wrong, reason) in [
            ("640,0", "the frame has 640 x 80 pixels"),
            ("0,80", "the frame has 640 x 80 pixels"),
            ("1", "not two whole numbers"),
            ("1,-2", "not two whole numbers"),
            ("1.5,2", "not two whole numbers"),
        ] {
            let error = part(wrong).expect_err(wrong).to_string();
            assert!(error.contains(reason) && error.contains(wrong), "{error}");
        }
    }

    /// Each pixel of the frame takes 12 x 12 here, and a line is its left side.
    #[test]
    fn lines_of_a_part_have_the_numbers_of_the_frame() {
        let plain = Canvas::plain(1200, 1200, [90, 90, 90]);
        let mut canvas = plain.expect("a canvas");
        draw_grid(&mut canvas, &Viewport { x: 273.0, y: 118.0, side: 100.0, scale: 12.0 });
        let rgb = canvas.to_rgb();
        let bright = |x: usize, y: usize| rgb[3 * (y * 1200 + x)] > 120;
        for k in 60..1200 {
            // Lines every five pixels: 275, 280 and so on; 120, 125 and so on.
            assert_eq!(bright(k, 1190), k % 60 == 24, "column {k}");
            assert_eq!(bright(1190, k), k % 60 == 24, "row {k}");
        }
    }

    #[test]
    fn lines_are_where_their_numbers_say() {
        let mut canvas = Canvas::plain(320, 200, [90, 90, 90]).expect("a canvas");
        draw_grid(&mut canvas, &Viewport::whole(320));
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
