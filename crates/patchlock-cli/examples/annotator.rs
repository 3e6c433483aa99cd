//! The annotator's bill: how many key frames a person has to draw until every frame has a good box.
//! The ground truth of a dataset plays the person.
//!
//! ```sh
//! cargo run --release -p patchlock-cli --example annotator -- DATASET... [--boxes FOLDER]
//! ```
//!
//! A target is done when the mean overlap of its boxes is at least 0.8 and no overlap is below 0.5;
//! key frames count as exact. The table has the number of key frames per 100 frames, for each
//! target and in the mean over the targets of a dataset, with
//!
//! - `interpolation`: straight lines between key frames, the next one placed where the overlap is
//!   smallest; what a tool without a tracker does, with an oracle for the place;
//! - `ours`: tracked between key frames from both sides, the next one placed where
//!   [`suggestions`](patchlock_studio::tracking::review::suggestions) points;
//! - `oracle`: the same tracks, the next key frame placed where the overlap is smallest.
//!
//! `benchmarks/annotator_csrt.py` prints the same for OpenCV's CSRT, corrected at the first bad
//! frame.

use std::collections::{BTreeMap, HashMap};
use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use patchlock::{Preset, Tracker};
use patchlock_bench::dataset::{Dataset, Sequence};
use patchlock_media::image_file;
use patchlock_studio::project::{Key, Target, TrackedBox};
use patchlock_studio::tracking::{join, review};

type Result<T> = std::result::Result<T, Box<dyn Error + Send + Sync>>;

const MEAN: f64 = 0.8;
const LEAST: f64 = 0.5;

fn main() -> Result<()> {
    let datasets: Vec<PathBuf> = std::env::args().skip(1).map(PathBuf::from).collect();
    if datasets.is_empty() {
        return Err("usage: annotator DATASET...".into());
    }
    println!("| target | frames | interpolation | ours | oracle |\n|---|---|---|---|---|");
    for root in &datasets {
        let bills = bill(root)?;
        for (name, frames, keys) in &bills {
            let [a, b, c] = keys.map(|keys| per_hundred(keys, *frames));
            println!("| {name} | {frames} | {a:.1} | {b:.1} | {c:.1} |");
        }
        let mean = [0, 1, 2].map(|k| {
            let rates = bills.iter().map(|(_, frames, keys)| per_hundred(keys[k], *frames));
            rates.sum::<f64>() / bills.len() as f64
        });
        println!("| **{}** | | {:.2} | {:.2} | {:.2} |", root.display(), mean[0], mean[1], mean[2]);
    }
    Ok(())
}

fn per_hundred(keys: usize, frames: usize) -> f64 {
    100.0 * keys as f64 / frames as f64
}

/// The targets of a dataset with their number of frames and the key frames of each way, on all
/// processors.
fn bill(root: &Path) -> Result<Vec<(String, usize, [usize; 3])>> {
    let dataset = Dataset::open(root)?;
    let (next, done) = (AtomicUsize::new(0), Mutex::new(BTreeMap::new()));
    let work = || {
        while let Some(sequence) = dataset.sequences.get(next.fetch_add(1, Ordering::Relaxed)) {
            let keys = AnnotationRun::new(sequence).and_then(|mut run| run.keys());
            eprintln!("{}", sequence.name);
            done.lock().unwrap().insert(sequence.name.clone(), (sequence.truth.len(), keys));
        }
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| (0..threads).for_each(|_| drop(scope.spawn(work))));
    let done = done.into_inner().unwrap();
    done.into_iter().map(|(name, (frames, keys))| Ok((name, frames, keys?))).collect()
}

fn middle_of_the_longest(target: &Target) -> usize {
    let keys: Vec<usize> = target.keys.keys().copied().collect();
    let longest = keys.windows(2).max_by_key(|pair| pair[1] - pair[0]);
    longest.map_or(0, |pair| pair[0].midpoint(pair[1]))
}

/// The ground truth of a target, and what was tracked from its frames so far.
struct AnnotationRun<'a> {
    sequence: &'a Sequence,
    first: usize,
    /// By the frame that was tracked from and whether it was forward; the frames in the order of
    /// tracking.
    found: HashMap<(usize, bool), Vec<TrackedBox>>,
}

impl<'a> AnnotationRun<'a> {
    fn new(sequence: &'a Sequence) -> Result<Self> {
        let first = sequence.truth.iter().position(Option::is_some).ok_or("no truth")?;
        Ok(Self { sequence, first, found: HashMap::new() })
    }

    fn keys(&mut self) -> Result<[usize; 3]> {
        let interpolated = self.fill(|run, keys| Ok(run.interpolate(keys)), |_, worst| worst)?;
        let frames = self.sequence.truth.len();
        let ours = self.fill(Self::track, |target, _| {
            match review::suggestions(target, frames).first() {
                Some(suggestion) => suggestion.frame,
                // Only short spans are left: in the middle of the longest.
                None => middle_of_the_longest(target),
            }
        })?;
        let oracle = self.fill(Self::track, |_, worst| worst)?;
        Ok([interpolated, ours, oracle])
    }

    /// The number of key frames until all boxes are good; `place` says where the next one is, from
    /// the target as it is and the frame with the smallest overlap.
    fn fill(
        &mut self,
        boxes: impl Fn(&mut Self, &BTreeMap<usize, Key>) -> Result<BTreeMap<usize, TrackedBox>>,
        place: impl Fn(&Target, usize) -> usize,
    ) -> Result<usize> {
        let mut keys = BTreeMap::from([(self.first, self.key(self.first))]);
        loop {
            let tracked = boxes(self, &keys)?;
            let (mean, least, worst) = self.overlap(&tracked);
            if mean >= MEAN && least >= LEAST {
                return Ok(keys.len());
            }
            let target = Target {
                id: 1,
                label: String::new(),
                attributes: BTreeMap::new(),
                changes: BTreeMap::new(),
                keys: keys.clone(),
                tracked,
                hidden: self.first.checked_sub(1).map(|last| [0, last]).into_iter().collect(),
            };
            let mut frame = place(&target, worst);
            // Where the truth says nothing, the nearest frame of which it does.
            let can_be =
                |frame: &usize| self.sequence.truth[*frame].is_some() && !keys.contains_key(frame);
            let frames = (self.first..self.sequence.truth.len()).filter(can_be);
            frame = frames.min_by_key(|other| other.abs_diff(frame)).ok_or("no frame is left")?;
            keys.insert(frame, self.key(frame));
        }
    }

    fn key(&self, frame: usize) -> Key {
        let bbox = self.sequence.truth[frame].expect("a frame with truth");
        Key::new(bbox)
    }

    /// Mean and smallest overlap, and where that is. Key frames are exact.
    fn overlap(&self, tracked: &BTreeMap<usize, TrackedBox>) -> (f64, f64, usize) {
        let (mut sum, mut count, mut least) = (0.0, 0, (f64::MAX, 0));
        for (frame, truth) in self.sequence.truth.iter().enumerate().skip(self.first) {
            let Some(truth) = truth else { continue };
            let overlap = tracked.get(&frame).map_or(1.0, |tracked| tracked.bbox.overlap(truth));
            (sum, count) = (sum + overlap, count + 1);
            if overlap < least.0 {
                least = (overlap, frame);
            }
        }
        (sum / f64::from(count), least.0, least.1)
    }

    fn interpolate(&self, keys: &BTreeMap<usize, Key>) -> BTreeMap<usize, TrackedBox> {
        let ends: Vec<_> = keys.iter().collect();
        let mut boxes = BTreeMap::new();
        for (at, (first, from)) in ends.iter().enumerate() {
            let end = ends.get(at + 1).map_or(self.sequence.truth.len(), |(last, _)| **last);
            let to = ends.get(at + 1).map_or(from.bbox, |(_, to)| to.bbox);
            for frame in *first + 1..end {
                let share = (frame - *first) as f64 / (end - *first) as f64;
                let bbox = join::between(from.bbox, to, share);
                let (score, status) = (1.0, patchlock::Status::Tracked);
                boxes.insert(
                    frame,
                    TrackedBox { bbox, score, status, visible: None, agreement: None },
                );
            }
        }
        boxes
    }

    fn track(&mut self, keys: &BTreeMap<usize, Key>) -> Result<BTreeMap<usize, TrackedBox>> {
        let frames: Vec<usize> = keys.keys().copied().collect();
        let mut boxes = BTreeMap::new();
        for (at, &first) in frames.iter().enumerate() {
            let Some(&last) = frames.get(at + 1) else {
                let open = self.run(first, self.sequence.truth.len() - 1)?;
                boxes.extend((first + 1..).zip(open));
                continue;
            };
            let forward = self.run(first, last)?;
            let mut backward = self.run(last, first)?;
            backward.reverse();
            let ends = [keys[&first].bbox, keys[&last].bbox];
            let joined = join::join(ends[0], &forward, &backward, ends[1], |_| None);
            boxes.extend((first + 1..).zip(joined));
        }
        Ok(boxes)
    }

    /// The frames after `from` up to and with `to`, tracked from the truth in `from`.
    fn run(&mut self, from: usize, to: usize) -> Result<Vec<TrackedBox>> {
        let count = from.abs_diff(to);
        let key = (from, to > from);
        if let Some(found) = self.found.get(&key)
            && found.len() >= count
        {
            return Ok(found[..count].to_vec());
        }
        let mut tracker: Option<Tracker> = None;
        let mut found = Vec::new();
        for step in 0..=count {
            let frame = if to > from { from + step } else { from - step };
            let picture = image_file::load(&self.sequence.frames[frame])?;
            let pixels = picture.frame()?;
            match &mut tracker {
                Some(tracker) => found.push(TrackedBox::from(tracker.update(&pixels)?)),
                None => {
                    let bbox = self.key(from).bbox;
                    tracker = Some(Tracker::start(Preset::Robust, &pixels, bbox)?);
                }
            }
        }
        self.found.insert(key, found.clone());
        Ok(found)
    }
}
