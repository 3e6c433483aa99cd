//! The page of `track`: the user draws the boxes there, and sees the frames while they are tracked.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use anyhow::Result;
use patchlock::BoundingBox;
use patchlock_media::live::LiveSource;
use patchlock_media::{Feed, NextFrame, Picture};
use patchlock_studio::server::AllowedHosts;
use patchlock_studio::server::window::{Window, WindowOptions};
use serde_json::{Value, json};

use crate::failure::{Failure, failed, interrupted, say};
use crate::output::{Sink, TrackedFrame};
use crate::{browser, interrupt};

/// Opens the page and says where it is; the browser is started on request.
pub fn open(port: u16, hosts: AllowedHosts, in_browser: bool) -> Result<Arc<Window>, Failure> {
    let window = Window::open(WindowOptions { port, hosts, in_notebook: false });
    let window = window.map_err(|error| {
        failed(error.to_string()).hint("choose another --port, or none for a free one")
    })?;
    say(&format!("the page is at {}", window.address()));
    browser::say_tunnel(window.port());
    if in_browser {
        browser::show(window.address_once());
    }
    Ok(Arc::new(window))
}

/// Lets the user draw boxes on a frame, or on a newer one of a live source. Returns the boxes and the
/// frame on which they were drawn.
pub fn ask(
    window: &Window,
    first: (usize, Picture),
    feed: &mut Feed,
) -> Result<(Vec<BoundingBox>, (usize, Picture)), Failure> {
    say("draw a box around the target there");
    let mut shown = (first.0, Arc::new(first.1));
    let boxes = match feed {
        Feed::Live(live) if !live.has_length() => {
            let newer = &mut || newer_of(live);
            window.ask(&mut shown, Some(newer), &interrupt::requested)?
        }
        _ => window.ask::<Failure>(&mut shown, None, &interrupt::requested)?,
    };
    if boxes.is_empty() {
        return Err(interrupted("stopped: no box was drawn"));
    }
    let options: Vec<String> =
        boxes.iter().map(|BoundingBox { x, y, w, h }| format!("--box {x},{y},{w},{h}")).collect();
    say(&options.join(" "));
    Ok((boxes, (shown.0, Arc::unwrap_or_clone(shown.1))))
}

/// Waits shortly for a newer frame, which takes the place of the last one.
fn newer_of(live: &mut LiveSource) -> Result<NextFrame, Failure> {
    let next = live.wait();
    live.notes().for_each(|happened| say(&format!("note: {happened}")));
    match next {
        // What ends the program may also end what it reads from.
        Err(_) if interrupt::requested() => Ok(NextFrame::NotYet),
        Ok(NextFrame::Frame(..)) => {
            live.leave_out();
            Ok(next?)
        }
        next => Ok(next?),
    }
}

/// Shows each frame on the page, if a page is open.
pub struct Preview {
    window: Arc<Window>,
    /// When frame 0 of a live source came, in seconds since 1970.
    begun: Option<f64>,
    rate: FrameRateMeter,
    /// Frames up to the last one, and of these the ones that were left out.
    shown: usize,
    is_live: bool,
}

impl Preview {
    /// Shows frames of a source; a live one began at this time.
    pub fn new(window: Arc<Window>, begun: Option<f64>, is_live: bool) -> Self {
        Self { window, begun, rate: FrameRateMeter::default(), shown: 0, is_live }
    }

    fn about(&self, tracked: &TrackedFrame<'_>) -> Value {
        let targets = tracked.targets.iter().map(|shown| {
            let BoundingBox { x, y, w, h } = shown.bbox;
            let mut target = json!({
                "status": shown.estimate.status.name(),
                "score": shown.estimate.score,
                "box": [x, y, w, h],
                "corners": shown.estimate.corners,
            });
            if let Some(id) = shown.id {
                target["id"] = id.into();
            }
            if let Some(name) = &shown.name {
                target["name"] = (**name).into();
            }
            target
        });
        let dropped = (tracked.frame + 1).saturating_sub(self.shown);
        json!({
            "frame": tracked.frame,
            "at": self.begun.zip(tracked.picture.time).map(|(begun, time)| begun + time),
            "fps": self.rate.fps,
            "dropped": self.is_live.then_some(dropped),
            "redraw": self.is_live,
            "targets": targets.collect::<Vec<Value>>(),
        })
    }
}

impl Sink for Preview {
    fn write(&mut self, tracked: &TrackedFrame<'_>) -> Result<()> {
        self.rate.step();
        self.shown += 1;
        self.window.show(tracked.frame, tracked.picture, || self.about(tracked));
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<Option<PathBuf>> {
        Ok(None)
    }
}

/// Frames per second of late.
#[derive(Default)]
struct FrameRateMeter {
    last: Option<Instant>,
    fps: f64,
}

impl FrameRateMeter {
    /// A frame more. The mean is over about the last 20 frames.
    fn step(&mut self) {
        let now = Instant::now();
        if let Some(last) = self.last.replace(now) {
            let fps = 1.0 / (now - last).as_secs_f64().max(1e-6);
            self.fps = if self.fps == 0.0 { fps } else { 1.0 / (0.95 / self.fps + 0.05 / fps) };
        }
    }
}
