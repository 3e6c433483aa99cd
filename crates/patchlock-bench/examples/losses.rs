//! Tracks long rendered clips in which the target disappears and returns, and says how soon the
//! tracker notices both.
//!
//! ```sh
//! cargo run --release -p patchlock-bench --example losses -- PRESET [FRAMES [CLIPS]]
//! ```
//!
//! Half of the clips (10, of 3000 frames each) have full occlusions, the others exits from the
//! frame; each has its own seed. The table has, for each clip and for all:
//!
//! - `losses`: absences, and how many of them were said to be lost within 15 frames of the first
//!   frame in which nothing of the target is visible;
//! - `frames`: the mean number of frames until the status was lost, over the absences in which it
//!   ever was;
//! - `false`: the share of the frames with the box on the target, an overlap of at least 0.5, that
//!   have the status lost; only frames in which at least half of the target is visible;
//! - `returns`: absences with a return, and how many of them were followed by a frame with the
//!   status tracked and the box on the target, within 10 frames and the preset's trial of the first
//!   frame in which at least 90 % are visible again;
//! - `frames`: the mean number of frames until then, over the returns after which it ever came so
//!   far;
//! - `overlap`: the mean overlap over frames in which at least half of the target is visible;
//! - `hidden`: the mean absolute error of the hidden share, over frames with a visibility map;
//! - `ms`: the mean time of a frame.

use std::error::Error;
use std::ops::Range;
use std::time::{Duration, Instant};

use patchlock::{BoundingBox, Estimate, Frame, Preset, Status, Tracker, TrackerConfig, Value};
use patchlock_bench::protocol::HIT_OVERLAP;
use patchlock_scene::{Absences, Scene, SceneConfig, Truth};

/// A loss is said in time within this many frames, and a return within this many after the trial.
const LOSS_FRAMES: usize = 15;
const RETURN_FRAMES: usize = 10;
/// The target has returned when this share of it is visible.
const RETURNED: f64 = 0.9;
/// Frames count as ones in which the target is visible from this share on.
const VISIBLE: f64 = 0.5;
/// The target turns by up to this many degrees to either side.
const TURN: f64 = 20.0;

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let (preset, numbers) = match args.as_slice() {
        [preset, numbers @ ..] if numbers.len() <= 2 => (preset, numbers),
        _ => return Err("usage: losses PRESET [FRAMES [CLIPS]]".into()),
    };
    let config = TrackerConfig::from(preset.parse::<Preset>()?);
    let number = |at: usize, default| numbers.get(at).map_or(Ok(default), |text| text.parse());
    let (frames, clips) = (number(0, 3000)?, number(1, 10)?);
    println!("| clip | losses | frames | false | returns | frames | overlap | hidden | ms |");
    println!("|---|---|---|---|---|---|---|---|---|");
    let mut all = Counts::default();
    for clip in 0..clips {
        let (name, absences) = match clip % 2 {
            0 => ("behind the post", Absences::BehindPost),
            _ => ("outside the frame", Absences::OutsideFrame),
        };
        let seed = clip as u64 + 1;
        let scene = Scene::new(SceneConfig::long(frames, absences, TURN, seed));
        let counts = track(&scene, &config)?;
        println!("{}", counts.row(&format!("{name}, seed {seed}")));
        all.join(&counts);
    }
    println!("{}", all.row("all"));
    Ok(())
}

/// What the tracker said of a frame, and what is true.
struct FrameRecord {
    status: Status,
    is_on: bool,
    truth: Truth,
}

/// A sum and the number of its terms.
#[derive(Clone, Copy, Default)]
struct Mean {
    sum: f64,
    count: usize,
}

impl Mean {
    fn add(&mut self, value: f64) {
        self.sum += value;
        self.count += 1;
    }

    fn join(&mut self, other: Mean) {
        self.sum += other.sum;
        self.count += other.count;
    }

    fn text(self, digits: usize) -> String {
        match self.count {
            0 => "-".to_string(),
            count => format!("{:.digits$}", self.sum / count as f64),
        }
    }
}

/// Sums over the frames and the absences of a clip, or of several.
#[derive(Default)]
struct Counts {
    /// Absences, each with whether the loss was said in time.
    losses: Mean,
    until_lost: Mean,
    false_lost: Mean,
    /// Returns, each with whether the target was tracked again in time.
    returns: Mean,
    until_tracked: Mean,
    overlap: Mean,
    hidden: Mean,
    time: Duration,
    frames: usize,
}

/// Tracks a scene from its first true box on.
fn track(scene: &Scene, config: &TrackerConfig) -> Result<Counts, patchlock::Error> {
    let (mut counts, mut records) = (Counts::default(), Vec::new());
    let mut tracker: Option<Tracker> = None;
    for k in 0..scene.len() {
        let (rendered, truth) = (scene.frame(k), scene.truth(k));
        let frame = Frame::rgb8(&rendered.rgb, rendered.width, rendered.height)?;
        let Some(tracker) = &mut tracker else {
            tracker = Some(Tracker::start(config.clone(), &frame, true_box(&truth))?);
            continue;
        };
        let begin = Instant::now();
        let estimate = tracker.update(&frame)?;
        counts.time += begin.elapsed();
        records.push(counts.add(estimate, truth));
    }
    let trial = match config.get("trial") {
        Ok(Value::Whole(frames)) => frames as usize,
        _ => 0,
    };
    for absence in absences(&records) {
        counts.add_absence(&records, absence, RETURN_FRAMES + trial);
    }
    Ok(counts)
}

fn true_box(truth: &Truth) -> BoundingBox {
    let [x, y, w, h] = truth.bbox;
    BoundingBox { x, y, w, h }
}

/// The stretches of frames in which nothing of the target is visible.
fn absences(records: &[FrameRecord]) -> Vec<Range<usize>> {
    let mut first = 0;
    let stretches = records.chunk_by(|a, b| a.truth.is_absent() == b.truth.is_absent());
    let ranges = stretches.filter_map(|stretch| {
        first += stretch.len();
        stretch[0].truth.is_absent().then(|| first - stretch.len()..first)
    });
    ranges.collect()
}

impl Counts {
    fn add(&mut self, estimate: &Estimate, truth: Truth) -> FrameRecord {
        let overlap = estimate.bbox.overlap(&true_box(&truth));
        let is_on = overlap >= HIT_OVERLAP && truth.visible >= VISIBLE;
        self.frames += 1;
        if truth.visible >= VISIBLE {
            self.overlap.add(overlap);
        }
        if is_on {
            self.false_lost.add(f64::from(u8::from(estimate.status == Status::Lost)));
        }
        if let Some(visibility) = &estimate.visibility {
            self.hidden.add((visibility.share() - truth.visible).abs());
        }
        FrameRecord { status: estimate.status, is_on, truth }
    }

    /// Counts an absence, and the return after it, if there is one, with so many frames' time for
    /// it.
    fn add_absence(
        &mut self,
        records: &[FrameRecord],
        absence: Range<usize>,
        return_frames: usize,
    ) {
        let rest = &records[absence.end..];
        let lost = records[absence.clone()].iter().position(|frame| frame.status == Status::Lost);
        // An absence that the clip ends in may be too short to be noticed.
        if absence.len() >= LOSS_FRAMES {
            self.losses.add(f64::from(u8::from(lost.is_some_and(|frames| frames <= LOSS_FRAMES))));
        }
        if let Some(frames) = lost {
            self.until_lost.add(frames as f64);
        }
        // The next absence ends the time in which this return may be noticed.
        let next = rest.iter().position(|frame| frame.truth.is_absent()).unwrap_or(rest.len());
        let rest = &rest[..next];
        let Some(back) = rest.iter().position(|frame| frame.truth.visible >= RETURNED) else {
            return;
        };
        if rest.len() - back <= return_frames {
            return;
        }
        let tracked = |frame: &FrameRecord| frame.status == Status::Tracked && frame.is_on;
        let frames = rest[back..].iter().position(tracked);
        self.returns.add(f64::from(u8::from(frames.is_some_and(|frames| frames <= return_frames))));
        if let Some(frames) = frames {
            self.until_tracked.add(frames as f64);
        }
    }

    fn join(&mut self, other: &Self) {
        self.losses.join(other.losses);
        self.until_lost.join(other.until_lost);
        self.false_lost.join(other.false_lost);
        self.returns.join(other.returns);
        self.until_tracked.join(other.until_tracked);
        self.overlap.join(other.overlap);
        self.hidden.join(other.hidden);
        self.time += other.time;
        self.frames += other.frames;
    }

    /// A row of the table.
    fn row(&self, name: &str) -> String {
        let of = |mean: Mean| format!("{} of {}", mean.sum, mean.count);
        let cells = [
            name.to_string(),
            of(self.losses),
            self.until_lost.text(1),
            self.false_lost.text(4),
            of(self.returns),
            self.until_tracked.text(1),
            self.overlap.text(3),
            self.hidden.text(3),
            format!("{:.1}", 1e3 * self.time.as_secs_f64() / self.frames.max(1) as f64),
        ];
        format!("| {} |", cells.join(" | "))
    }
}
