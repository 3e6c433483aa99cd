//! The tracker on its threads, with a clock.

use std::time::Instant;

use anyhow::{Context, Result};
use patchlock::{BoundingBox, Estimate, Tracker, TrackerConfig};
use rayon::ThreadPool;

use crate::complaint::{failed, usage};
use patchlock_eval::picture::Picture;

/// More threads than any machine has: a number above it is a slip.
const MOST_THREADS: usize = 1024;

/// So many threads; without a number, one for each core.
pub fn pool(threads: Option<usize>) -> Result<ThreadPool> {
    if let Some(threads) = threads.filter(|threads| !(1..=MOST_THREADS).contains(threads)) {
        return Err(usage(format!("--threads {threads}: it must be 1 to {MOST_THREADS}"))
            .hint("leave it out to use every core; the boxes are the same for any number")
            .into());
    }
    let threads =
        threads.or_else(|| std::thread::available_parallelism().ok().map(usize::from)).unwrap_or(1);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.context("cannot start the threads")
}

/// A tracker and what it runs on.
pub struct Engine {
    tracker: Tracker,
    pool: ThreadPool,
    size: (usize, usize),
    times_ms: Vec<f64>,
}

impl Engine {
    /// A tracker on so many threads; without a number, one for each core.
    pub fn new(config: TrackerConfig, threads: Option<usize>) -> Result<Self> {
        let pool = pool(threads)?;
        Ok(Self { tracker: Tracker::new(config)?, pool, size: (0, 0), times_ms: Vec::new() })
    }

    /// Number of threads.
    pub fn threads(&self) -> usize {
        self.pool.current_num_threads()
    }

    /// Milliseconds of each frame so far.
    pub fn times_ms(&self) -> &[f64] {
        &self.times_ms
    }

    /// Frames a second so far.
    pub fn fps(&self) -> f64 {
        let total: f64 = self.times_ms.iter().sum();
        if total > 0.0 { 1e3 * self.times_ms.len() as f64 / total } else { 0.0 }
    }

    /// Begins with a box.
    pub fn begin(
        &mut self,
        index: usize,
        picture: &Picture,
        bbox: BoundingBox,
    ) -> Result<(Estimate, f64)> {
        self.size = (picture.width, picture.height);
        self.timed(index, picture, |tracker, frame| tracker.init(frame, bbox))
    }

    /// Goes on to the next frame.
    pub fn follow(&mut self, index: usize, picture: &Picture) -> Result<(Estimate, f64)> {
        let (width, height) = self.size;
        if (picture.width, picture.height) != self.size {
            return Err(failed(format!(
                "frame {index} is {} x {} pixels, but the frames before it are {width} x {height}",
                picture.width, picture.height
            ))
            .hint("all frames of a source must have one size; --end stops before that frame")
            .into());
        }
        self.timed(index, picture, Tracker::update)
    }

    fn timed(
        &mut self,
        index: usize,
        picture: &Picture,
        step: impl FnOnce(&mut Tracker, &patchlock::Frame<'_>) -> Result<Estimate, patchlock::Error>
        + Send,
    ) -> Result<(Estimate, f64)> {
        let Self { tracker, pool, .. } = self;
        let frame = picture.frame()?;
        let start = Instant::now();
        let estimate = pool.install(|| step(tracker, &frame));
        let ms = start.elapsed().as_secs_f64() * 1e3;
        let estimate = estimate
            .map_err(|error| failed(format!("the tracker stopped in frame {index}: {error}")))?;
        self.times_ms.push(ms);
        Ok((estimate, ms))
    }
}
