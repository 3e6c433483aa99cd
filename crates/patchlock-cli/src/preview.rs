//! The page of `track`: the user draws the boxes there, and sees the frames while they are tracked.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use anyhow::Result;
use patchlock::BoundingBox;
use patchlock_media::Picture;
use patchlock_studio::server::AllowedHosts;
use patchlock_studio::server::window::{Answer, Window, WindowOptions};
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
    browser::tunnel(window.port()).iter().for_each(|note| say(note));
    if in_browser {
        let opened = window.address_once().map_err(anyhow::Error::from);
        if let Err(reason) = opened.and_then(|address| Ok(browser::open(&address)?)) {
            say(&format!("note: no browser was opened ({reason}): open the address yourself"));
        }
    }
    Ok(Arc::new(window))
}

/// Lets the user draw boxes on a frame.
pub fn ask(window: &Window, frame: usize, picture: &Picture) -> Result<Vec<BoundingBox>, Failure> {
    say("draw a box around the target there");
    match window.ask(frame, picture, &interrupt::requested) {
        Answer::Boxes(boxes) => {
            let shown: Vec<String> = boxes
                .iter()
                .map(|BoundingBox { x, y, w, h }| format!("--box {x},{y},{w},{h}"))
                .collect();
            say(&shown.join(" "));
            Ok(boxes)
        }
        Answer::Cancelled | Answer::Stopped => Err(interrupted("stopped: no box was drawn")),
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
            "targets": targets.collect::<Vec<Value>>(),
        })
    }
}

impl Sink for Preview {
    fn write(&mut self, tracked: &TrackedFrame<'_>) -> Result<()> {
        self.rate.step();
        self.shown += 1;
        self.window.show(tracked.picture, || self.about(tracked));
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
