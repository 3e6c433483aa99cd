//! A tracker under test.

use std::path::Path;
use std::time::Duration;

use patchlock::{BoundingBox, Tracker, TrackerConfig};
use patchlock_media::{Picture, image_file};

use super::store::Identity;
use super::trax::Trax;
use crate::Error;
use crate::session::{self, Session};

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
    session: Session<Tracker>,
}

impl Patchlock {
    /// A tracker on so many threads.
    ///
    /// # Errors
    /// [`Error::Subject`] where the configuration is wrong; [`Error::Threads`].
    pub fn new(config: TrackerConfig, threads: usize) -> Result<Self, Error> {
        let tracker = Tracker::new(config).map_err(|error| Error::Subject(error.to_string()))?;
        Ok(Self { session: Session::new(tracker, session::pool(Some(threads))?) })
    }

    /// The tracker that an identity names, with a seed.
    ///
    /// # Errors
    /// [`Error::Subject`] where it names another program or another version.
    pub fn of(identity: &Identity, seed: u64, threads: usize) -> Result<Self, Error> {
        let Identity::Patchlock { version, configuration, .. } = identity else {
            return Err(Error::Subject("it is another program".to_string()));
        };
        let here = env!("CARGO_PKG_VERSION");
        if version != here {
            let reason = format!(
                "the runs are of Patchlock {version}, but this is {here}: install the same version everywhere"
            );
            return Err(Error::Subject(reason));
        }
        Self::new(TrackerConfig { seed, ..(**configuration).clone() }, threads)
    }

    /// Begins on a box of a picture.
    ///
    /// # Errors
    /// What the tracker says.
    pub fn begin_on(
        &mut self,
        picture: &Picture,
        bbox: BoundingBox,
    ) -> Result<Answer, patchlock::Error> {
        let frame = picture.frame()?;
        let (_, seconds) = self.session.step(|tracker| tracker.init(&frame, bbox))?;
        // The first line of a trajectory is the box as given.
        Ok(Answer { bbox: Some(bbox), seconds })
    }

    /// Goes on to the next picture.
    ///
    /// # Errors
    /// What the tracker says.
    pub fn follow_to(&mut self, picture: &Picture) -> Result<Answer, patchlock::Error> {
        let frame = picture.frame()?;
        let (estimate, seconds) = self.session.step(|tracker| tracker.update(&frame))?;
        Ok(Answer { bbox: Some(estimate.bbox), seconds })
    }
}

fn load(file: &Path) -> Result<Picture, Error> {
    image_file::load(file)
        .map_err(|reason| Error::Frame { path: file.to_path_buf(), reason: reason.to_string() })
}

fn stopped_at(file: &Path, reason: &patchlock::Error) -> Error {
    Error::Tracker { path: file.to_path_buf(), reason: reason.to_string() }
}

impl Subject for Patchlock {
    fn begin(&mut self, frame: &Path, bbox: BoundingBox) -> Result<Answer, Error> {
        self.begin_on(&load(frame)?, bbox).map_err(|error| stopped_at(frame, &error))
    }

    fn follow(&mut self, frame: &Path) -> Result<Answer, Error> {
        self.follow_to(&load(frame)?).map_err(|error| stopped_at(frame, &error))
    }
}

/// A new tracker for one run: ours on so many threads, or another program that has `patience` for each
/// answer.
///
/// # Errors
/// [`Error::Subject`] where it can't be made ready, or is of another version than the runs are.
pub fn start(
    identity: &Identity,
    seed: u64,
    threads: usize,
    patience: Duration,
) -> Result<Box<dyn Subject>, Error> {
    Ok(match identity {
        Identity::Patchlock { .. } => Box::new(Patchlock::of(identity, seed, threads)?),
        Identity::Trax { command } => Box::new(Trax::start(command, seed, patience)?),
    })
}
