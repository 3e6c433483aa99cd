//! What a target costs as their number grows: the preset `paper` on the rendered demo scene, on all cores.
//!
//! ```sh
//! cargo run --release -p patchlock --example targets -- 1 2 4 8 16 32 64
//! cargo run --release -p patchlock --example targets -- --separate 1 2 4 8    # a Tracker for each, one after the other
//! ```
//!
//! Of each number of targets: the median milliseconds of a frame, those of a target, and the memory of the process, where the system tells.

use patchlock::{BoundingBox, Frame, MultiTracker, Tracker, TrackerConfig};
use patchlock_scene::{Scene, SceneFrame};
use std::time::Instant;

/// Frames that are timed, after one that is not.
const FRAMES: usize = 5;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut separate = false;
    let mut counts = Vec::new();
    for word in std::env::args().skip(1) {
        match word.as_str() {
            "--separate" => separate = true,
            word => counts.push(word.parse::<usize>()?),
        }
    }
    let scene = Scene::demo();
    let film: Vec<SceneFrame> = (0..FRAMES + 2).map(|k| scene.frame(k)).collect();
    println!("| targets | ms a frame | ms a target | MB |\n|---|---|---|---|");
    for count in counts {
        let mut times = if separate { apart(&film, count)? } else { together(&film, count)? };
        times.sort_by(f64::total_cmp);
        let (ms, memory) = (times[times.len() / 2], memory().unwrap_or_default());
        println!("| {count} | {ms:.1} | {:.1} | {memory} |", ms / count as f64);
    }
    Ok(())
}

fn view(frame: &SceneFrame) -> Result<Frame<'_>, patchlock::Error> {
    Frame::rgb8(&frame.rgb, frame.width, frame.height)
}

/// Boxes of one size, spread over the frame by the golden ratio.
fn boxes(frame: &SceneFrame, count: usize) -> impl Iterator<Item = BoundingBox> {
    let (width, height) = (frame.width as f64 - 64.0, frame.height as f64 - 48.0);
    (0..count).map(move |k| BoundingBox {
        x: (k as f64 * 0.618_034).fract() * width,
        y: (k as f64 + 0.5) / count as f64 * height,
        w: 64.0,
        h: 48.0,
    })
}

fn together(film: &[SceneFrame], count: usize) -> Result<Vec<f64>, patchlock::Error> {
    let mut tracker = MultiTracker::new(TrackerConfig::preset("paper")?)?;
    for bbox in boxes(&film[0], count) {
        tracker.add(&view(&film[0])?, bbox)?;
    }
    timed(film, |frame| tracker.update(frame).map(drop))
}

fn apart(film: &[SceneFrame], count: usize) -> Result<Vec<f64>, patchlock::Error> {
    let mut trackers = Vec::new();
    for bbox in boxes(&film[0], count) {
        let mut tracker = Tracker::new(TrackerConfig::preset("paper")?)?;
        tracker.init(&view(&film[0])?, bbox)?;
        trackers.push(tracker);
    }
    timed(film, |frame| trackers.iter_mut().try_for_each(|tracker| tracker.update(frame).map(drop)))
}

/// Milliseconds of each frame but the first two.
fn timed(
    film: &[SceneFrame],
    mut update: impl FnMut(&Frame<'_>) -> Result<(), patchlock::Error>,
) -> Result<Vec<f64>, patchlock::Error> {
    let mut times = Vec::new();
    for frame in &film[1..] {
        let start = Instant::now();
        update(&view(frame)?)?;
        times.push(start.elapsed().as_secs_f64() * 1e3);
    }
    Ok(times.split_off(1))
}

/// What the process holds now, in MB.
fn memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmRSS:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<u64>().ok()? / 1024)
}
