//! The cost of tracking many targets on the rendered demo scene, on all cores.
//!
//! ```sh
//! cargo bench -p patchlock --bench targets -- robust 1 2 4 8 16 32 64
//! cargo bench -p patchlock --bench targets -- robust --separate 1 2 4 8  # a Tracker per target
//! ```
//!
//! For each number of targets it prints the median wall-clock time per frame and per target, the
//! processor time per target, and the memory of the process. The last two are read from Linux and
//! are 0 on other systems. All boxes lie around the scene's target, an eighth of a pixel apart. The
//! cost of a target depends on the contents of its box, and only the number of targets should vary
//! here.

use patchlock::{BoundingBox, Error, Frame, MultiTracker, Preset, Tracker};
use patchlock_scene::{Scene, SceneFrame};
use std::fs;
use std::time::Instant;

/// Number of frames that are timed, after one that is not.
const FRAMES: usize = 20;

/// Milliseconds per frame: wall-clock time, and processor time of all threads.
type Cost = [f64; 2];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut separate = false;
    let mut counts = Vec::new();
    // Cargo passes `--bench`.
    let mut words = std::env::args().skip(1).filter(|word| word != "--bench");
    let preset: Preset = words.next().map_or(Ok(Preset::Robust), |preset| preset.parse())?;
    for word in words {
        match word.as_str() {
            "--separate" => separate = true,
            word => counts.push(word.parse::<usize>()?),
        }
    }
    if counts.is_empty() {
        counts = vec![1, 2, 4, 8, 16];
    }
    let scene = Scene::demo();
    let frames: Vec<SceneFrame> = (0..FRAMES + 2).map(|k| scene.frame(k)).collect();
    println!(
        "| targets | ms per frame | ms per target | CPU ms per target | MB |\n|---|---|---|---|---|"
    );
    for count in counts {
        let boxes = boxes(&scene, count);
        let costs = if separate {
            separately(&frames, &boxes, preset)?
        } else {
            with_one_tracker(&frames, &boxes, preset)?
        };
        let [ms, cpu] = [0, 1].map(|k| median(costs.iter().map(|cost| cost[k]).collect()));
        let (targets, memory) = (count as f64, memory().unwrap_or_default());
        println!("| {count} | {ms:.2} | {:.2} | {:.2} | {memory} |", ms / targets, cpu / targets);
    }
    Ok(())
}

fn view(frame: &SceneFrame) -> Result<Frame<'_>, Error> {
    Frame::rgb8(&frame.rgb, frame.width, frame.height)
}

fn boxes(scene: &Scene, count: usize) -> Vec<BoundingBox> {
    let [x, y, w, h] = scene.truth(0).bbox;
    let shift = |k: usize| (k % 8) as f64 / 8.0;
    (0..count).map(|k| BoundingBox { x: x + shift(k), y: y + shift(k / 8), w, h }).collect()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn with_one_tracker(
    frames: &[SceneFrame],
    boxes: &[BoundingBox],
    preset: Preset,
) -> Result<Vec<Cost>, Error> {
    let mut tracker = MultiTracker::new(preset)?;
    for &bbox in boxes {
        tracker.add(&view(&frames[0])?, bbox)?;
    }
    timed(frames, |frame| tracker.update(frame).map(drop))
}

fn separately(
    frames: &[SceneFrame],
    boxes: &[BoundingBox],
    preset: Preset,
) -> Result<Vec<Cost>, Error> {
    let mut trackers = Vec::new();
    for &bbox in boxes {
        trackers.push(Tracker::start(preset, &view(&frames[0])?, bbox)?);
    }
    timed(frames, |frame| {
        trackers.iter_mut().try_for_each(|tracker| tracker.update(frame).map(drop))
    })
}

/// The cost of each frame, except the first two.
fn timed(
    frames: &[SceneFrame],
    mut update: impl FnMut(&Frame<'_>) -> Result<(), Error>,
) -> Result<Vec<Cost>, Error> {
    let mut costs = Vec::new();
    for frame in &frames[1..] {
        let (start, cpu) = (Instant::now(), cpu_ms());
        update(&view(frame)?)?;
        costs.push([start.elapsed().as_secs_f64() * 1e3, cpu_ms() - cpu]);
    }
    Ok(costs.split_off(1))
}

/// Processor time of all threads of the process so far, in milliseconds.
fn cpu_ms() -> f64 {
    let threads = fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let worked = |thread: fs::DirEntry| {
        let text = fs::read_to_string(thread.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse::<f64>().ok()
    };
    threads.filter_map(worked).sum::<f64>() / 1e6
}

/// Resident memory of the process, in MB.
fn memory() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmRSS:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<u64>().ok()? / 1024)
}
