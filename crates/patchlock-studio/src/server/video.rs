//! Videos out: all of it with the boxes drawn in, and the part around one target.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use axum::extract::State;
use axum::response::Response;
use patchlock::{BoundingBox, Status};
use patchlock_media::{FrameRate, Mp4Writer, Picture, Prefetcher};
use serde_json::json;
use tempfile::NamedTempFile;

use super::answer::{PathParam, Refusal, aside};
use super::app::App;
use super::clips::{ClipRequest, OpenClip, no_target};
use super::files::{cannot_keep, download, stem};
use crate::project::{Project, Target};
use patchlock_drawing::canvas::{Canvas, Line};
use patchlock_drawing::{LOST, lost_box, scale, tag, upright};

/// The quantiser: lines of one pixel stay crisp.
const QUALITY: u8 = 26;
/// Smallest side of the part around a target, in pixels.
const SMALLEST: f64 = 32.0;
/// Most frames to reserve the index for if a video does not say how many it has.
const EXPECTED: usize = 1 << 20;
/// Time between two messages on how far it is.
const MESSAGES: Duration = Duration::from_millis(500);

/// Stops work on an answer when nobody waits for it any more.
struct StopGuard(Arc<AtomicBool>);

impl Drop for StopGuard {
    fn drop(&mut self) {
        self.0.store(true, Ordering::SeqCst);
    }
}

/// A video that is made where it keeps no other request waiting, under this name.
async fn made(
    name: String,
    make: impl FnOnce(&AtomicBool) -> Result<NamedTempFile, Refusal> + Send + 'static,
) -> Result<Response, Refusal> {
    let waits = StopGuard(Arc::default());
    let stop = Arc::clone(&waits.0);
    let file = aside(move || make(&stop)).await?;
    drop(waits);
    download(Box::new(file.into_temp_path()), "video/mp4", &name).await
}

/// `GET /api/clips/ID/video`
pub async fn annotated(ClipRequest { clip, .. }: ClipRequest) -> Result<Response, Refusal> {
    let name = format!("{}.annotated.mp4", stem(&clip.name));
    made(name, move |stop| write(&clip, stop)).await
}

fn write(clip: &OpenClip, stop: &AtomicBool) -> Result<NamedTempFile, Refusal> {
    let project = clip.hold().store.project().clone();
    let size = [clip.width, clip.height];
    let paint = |frame: usize, picture: &Picture| paint(&project, frame, picture);
    encode(clip, (0, clip.frames - 1), size, stop, &paint)
}

/// `GET /api/clips/ID/targets/T/clip`: the frames of a target, cut around it.
pub async fn around(
    State(app): State<Arc<App>>,
    PathParam((clip, target)): PathParam<(usize, u64)>,
) -> Result<Response, Refusal> {
    let clip = app.clips.open(clip).await?;
    let name = format!("{}.{target}.mp4", stem(&clip.name));
    made(name, move |stop| write_around(&clip, target, stop)).await
}

fn write_around(clip: &OpenClip, id: u64, stop: &AtomicBool) -> Result<NamedTempFile, Refusal> {
    let target = clip.hold().store.project().target(id).cloned().ok_or_else(|| no_target(id))?;
    let whole = [clip.width, clip.height];
    let frames = target.keys.keys().chain(target.tracked.keys()).copied();
    let frames: BTreeSet<usize> = frames.filter(|&it| target.box_at(it).is_some()).collect();
    let Some((&first, &last)) = frames.first().zip(frames.last()) else {
        return Err(Refusal::bad(format!("target {id} has no boxes")));
    };
    let boxes = || frames.iter().filter_map(|&frame| target.box_at(frame));
    let widest = boxes().map(|bbox| bbox.w).fold(0.0, f64::max);
    let highest = boxes().map(|bbox| bbox.h).fold(0.0, f64::max);
    let size = [side(widest, whole[0]), side(highest, whole[1])];
    encode(clip, (first, last), size, stop, &|frame, picture| {
        // Where it is not seen, the part stays where it was.
        let near = frames.range(..=frame).next_back().and_then(|&near| target.box_at(near));
        let [x, y] = near.map_or([0.0; 2], |bbox| bbox.centre());
        let corner = [(x, size[0], whole[0]), (y, size[1], whole[1])]
            .map(|(at, side, whole)| corner(at, side, whole));
        cut(&picture.to_rgb(), whole[0], corner, size)
    })
}

/// The side of the part: twice that of the largest box, an even number, within the frame.
fn side(longest: f64, whole: usize) -> usize {
    let side = (2.0 * longest).max(SMALLEST).min(whole as f64) as usize;
    (side - side % 2).max(1)
}

/// The first pixel of a part with this middle, moved into the frame.
fn corner(middle: f64, side: usize, whole: usize) -> usize {
    let most = whole.saturating_sub(side);
    (middle - side as f64 / 2.0).round().clamp(0.0, most as f64) as usize
}

fn cut(rgb: &[u8], width: usize, [left, top]: [usize; 2], [w, h]: [usize; 2]) -> Vec<u8> {
    let rows = rgb.chunks_exact(3 * width).skip(top).take(h);
    rows.flat_map(|row| &row[3 * left..3 * (left + w)]).copied().collect()
}

/// Encodes a stretch of frames as `paint` makes them of the pictures; it ends early with an error.
fn encode(
    clip: &OpenClip,
    (first, last): (usize, usize),
    [width, height]: [usize; 2],
    stop: &AtomicBool,
    paint: &dyn Fn(usize, &Picture) -> Vec<u8>,
) -> Result<NamedTempFile, Refusal> {
    let stopped = || stop.load(Ordering::SeqCst);
    let source = clip.engine.open(false)?;
    let file = NamedTempFile::new();
    let file = file.map_err(|error| cannot_keep(&std::env::temp_dir(), &error))?;
    let rate = clip.rate.unwrap_or(FrameRate::DEFAULT);
    let total = last - first + 1;
    // What is reserved for the index must not follow what the project says of the video.
    let expected = total.min(source.length().unwrap_or(EXPECTED));
    let mut video = Mp4Writer::with_quantiser(file, width, height, rate, Some(expected), QUALITY)?;
    let mut frames = Prefetcher::start(source, first..=last);
    let mut told = Instant::now();
    while let Some((frame, picture)) = frames.next_unless(&stopped)? {
        if [picture.width, picture.height] != [clip.width, clip.height] {
            let message = format!("frame {frame} has another size than the first one");
            return Err(Refusal::bad(message));
        }
        video.push_at(&paint(frame, &picture), picture.time)?;
        if told.elapsed() >= MESSAGES {
            told = Instant::now();
            clip.tell(&json!({ "type": "video", "done": frame - first + 1, "total": total }));
        }
    }
    if stopped() {
        return Err(Refusal::bad("nobody waits for the video any more"));
    }
    Ok(video.finish()?)
}

/// The frame with all targets.
fn paint(project: &Project, frame: usize, picture: &Picture) -> Vec<u8> {
    let rgb = picture.to_rgb();
    let Some(mut canvas) = Canvas::from_rgb(picture.width, picture.height, &rgb) else {
        return rgb.into_owned();
    };
    let drawn: Vec<_> =
        project.targets.iter().filter_map(|target| TargetDrawing::new(target, frame)).collect();
    drawn.iter().for_each(|target| target.outline(&mut canvas));
    // Tags are drawn last, so that no line covers them.
    drawn.iter().for_each(|target| target.tag(&mut canvas));
    canvas.to_rgb()
}

/// A target in a frame.
struct TargetDrawing {
    bbox: BoundingBox,
    status: Status,
    words: String,
    colour: [u8; 3],
}

impl TargetDrawing {
    fn new(target: &Target, frame: usize) -> Option<Self> {
        let (label, id) = (&target.label, target.id);
        let colour = colour(target);
        if let Some(key) = target.keys.get(&frame) {
            let words = format!("{label} {id}");
            return Some(Self { bbox: key.bbox, status: Status::Tracked, words, colour });
        }
        let tracked = target.tracked.get(&frame)?;
        let words = match tracked.status {
            Status::Lost => format!("{label} {id}  LOST"),
            Status::Tracked | Status::Uncertain => format!("{label} {id}  {:.2}", tracked.score),
        };
        Some(Self { bbox: tracked.bbox, status: tracked.status, words, colour })
    }

    fn outline(&self, canvas: &mut Canvas) {
        let dashed = match self.status {
            Status::Lost => return lost_box(canvas, self.bbox),
            Status::Tracked => false,
            Status::Uncertain => true,
        };
        let line = Line { width: 1.8 * scale(canvas), colour: self.colour, dashed };
        canvas.outline(&upright(self.bbox), line);
    }

    fn tag(&self, canvas: &mut Canvas) {
        let colour = if self.status == Status::Lost { LOST } else { self.colour };
        tag(canvas, self.bbox, &self.words, colour);
    }
}

/// The colour of a target; those of the list are colours, so the default is never used.
fn colour(target: &Target) -> [u8; 3] {
    let hex = target.colour().trim_start_matches('#');
    let value = u32::from_str_radix(hex, 16).unwrap_or(0xff_ffff).to_be_bytes();
    [value[1], value[2], value[3]]
}
