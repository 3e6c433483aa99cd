//! The video with the boxes drawn in.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use axum::extract::State;
use axum::response::Response;
use patchlock::{BoundingBox, Status};
use patchlock_media::{Ahead, FrameRate, Mp4Writer, Picture};
use serde_json::json;
use tempfile::NamedTempFile;

use super::App;
use super::answer::{At, Refusal, aside};
use super::clips::Opened;
use super::files::{cannot_keep, download, stem};
use crate::drawing::canvas::{Canvas, Line};
use crate::drawing::{LOST, lost_box, scale, tag, upright};
use crate::project::{Project, Target};

/// The quantiser: lines of one pixel stay crisp.
const QUALITY: u8 = 26;
/// Time between two messages on how far it is.
const MESSAGES: Duration = Duration::from_millis(500);

/// Stops work on an answer when nobody waits for it any more.
pub struct Waits(pub Arc<AtomicBool>);

impl Drop for Waits {
    fn drop(&mut self) {
        self.0.store(true, Ordering::SeqCst);
    }
}

/// `GET /api/clips/ID/video`
pub async fn annotated(
    State(app): State<Arc<App>>,
    At(clip): At<usize>,
) -> Result<Response, Refusal> {
    let clip = app.clips.open(clip).await?;
    let waits = Waits(Arc::default());
    let stop = Arc::clone(&waits.0);
    let name = format!("{}.annotated.mp4", stem(&clip.name));
    let file = aside(move || write(&clip, &stop)).await?;
    drop(waits);
    download(file.into_temp_path(), "video/mp4", &name).await
}

fn write(clip: &Opened, stop: &AtomicBool) -> Result<NamedTempFile, Refusal> {
    let project = clip.hold().store.project().clone();
    let stopped = || stop.load(Ordering::SeqCst);
    let name = clip.engine.video.to_string_lossy();
    let source = patchlock_media::open_within(&name, false, clip.engine.limits)?;
    let file = NamedTempFile::new();
    let file = file.map_err(|error| cannot_keep(&std::env::temp_dir(), &error))?;
    let rate = clip.rate.unwrap_or(FrameRate::DEFAULT);
    let (width, height) = (clip.width, clip.height);
    let mut video =
        Mp4Writer::with_quantiser(file, width, height, rate, Some(clip.frames), QUALITY)?;
    let mut frames = Ahead::start(source, 0..clip.frames);
    let mut told = Instant::now();
    while let Some((frame, picture)) = frames.next_unless(&stopped)? {
        video.push_at(&paint(&project, frame, &picture), picture.time)?;
        if told.elapsed() >= MESSAGES {
            told = Instant::now();
            clip.tell(&json!({ "type": "video", "done": frame + 1, "total": clip.frames }));
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
        return rgb;
    };
    let drawn: Vec<_> =
        project.targets.iter().filter_map(|target| Drawn::new(project, target, frame)).collect();
    drawn.iter().for_each(|target| target.outline(&mut canvas));
    // Tags are drawn last, so that no line covers them.
    drawn.iter().for_each(|target| target.tag(&mut canvas));
    canvas.to_rgb()
}

/// A target in a frame.
struct Drawn {
    bbox: BoundingBox,
    status: Status,
    words: String,
    colour: [u8; 3],
}

impl Drawn {
    fn new(project: &Project, target: &Target, frame: usize) -> Option<Self> {
        let (label, id) = (&target.label, target.id);
        let colour = colour(project, label);
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

/// The colour of a label; labels of a project are checked, so the default is never used.
fn colour(project: &Project, label: &str) -> [u8; 3] {
    let label = project.labels.iter().find(|known| known.name == label);
    let hex = label.and_then(|label| label.colour.strip_prefix('#')).unwrap_or_default();
    let value = u32::from_str_radix(hex, 16).unwrap_or(0xff_ffff).to_be_bytes();
    [value[1], value[2], value[3]]
}
