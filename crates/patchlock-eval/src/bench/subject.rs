//! A tracker under test, with a clock around it.

use std::path::Path;
use std::time::Instant;

use patchlock::{BoundingBox, Estimate, Tracker, TrackerConfig};
use rayon::ThreadPool;

use crate::{Error, images};

/// What a tracker says of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answer {
    /// The box, counted from 0; `None` where it gives none.
    pub bbox: Option<BoundingBox>,
    /// Time that it took.
    pub seconds: f64,
}

/// A tracker under test: begun once on a box, then shown one frame after the other.
pub trait Subject {
    /// Begins on a box of a frame.
    ///
    /// # Errors
    /// [`Error::Frame`], [`Error::Tracker`].
    fn begin(&mut self, frame: &Path, bbox: BoundingBox) -> Result<Answer, Error>;

    /// Goes on to the next frame.
    ///
    /// # Errors
    /// As [`Subject::begin`].
    fn follow(&mut self, frame: &Path) -> Result<Answer, Error>;
}

/// The tracker of this project. Decoding is not counted in its time.
pub struct Patchlock {
    tracker: Tracker,
    pool: ThreadPool,
}

impl Patchlock {
    /// A tracker on so many threads.
    ///
    /// # Errors
    /// [`Error::Subject`] where the configuration is wrong or the threads can't be started.
    pub fn new(config: TrackerConfig, threads: usize) -> Result<Self, Error> {
        let tracker = Tracker::new(config).map_err(|error| Error::Subject(error.to_string()))?;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool =
            pool.map_err(|error| Error::Subject(format!("cannot start threads: {error}")))?;
        Ok(Self { tracker, pool })
    }

    fn timed(
        &mut self,
        file: &Path,
        step: impl FnOnce(&mut Tracker, &patchlock::Frame<'_>) -> Result<Estimate, patchlock::Error>
        + Send,
    ) -> Result<(Estimate, f64), Error> {
        let frame_error = |reason: String| Error::Frame { path: file.to_path_buf(), reason };
        let picture = images::load(file).map_err(|error| frame_error(error.to_string()))?;
        let frame = picture.frame().map_err(|error| frame_error(error.to_string()))?;
        let Self { tracker, pool } = self;
        let start = Instant::now();
        let estimate = pool.install(|| step(tracker, &frame));
        let seconds = start.elapsed().as_secs_f64();
        let estimate = estimate.map_err(|error| Error::Tracker {
            path: file.to_path_buf(),
            reason: error.to_string(),
        })?;
        Ok((estimate, seconds))
    }
}

impl Subject for Patchlock {
    fn begin(&mut self, frame: &Path, bbox: BoundingBox) -> Result<Answer, Error> {
        let (_, seconds) = self.timed(frame, |tracker, frame| tracker.init(frame, bbox))?;
        // The first line of a trajectory is the box as given.
        Ok(Answer { bbox: Some(bbox), seconds })
    }

    fn follow(&mut self, frame: &Path) -> Result<Answer, Error> {
        let (estimate, seconds) = self.timed(frame, Tracker::update)?;
        Ok(Answer { bbox: Some(estimate.bbox), seconds })
    }
}
