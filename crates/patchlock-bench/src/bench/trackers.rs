//! The trackers under test: Patchlock or an external program.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use patchlock::{BoundingBox, Estimate, Tracker, TrackerConfig};
use patchlock_media::{Picture, image_file};

use super::store::{Identity, with_seed};
use super::subject::{Answer, Subject};
use super::trax::Trax;
use crate::Error;
use patchlock_track::UsedNetwork;
use patchlock_track::session::{self, timed_on};
use rayon::ThreadPool;

/// The tracker of this project. Its times exclude decoding.
pub struct Patchlock {
    config: TrackerConfig,
    pool: Arc<ThreadPool>,
    /// `None` before the first box.
    tracker: Option<Tracker>,
}

impl Patchlock {
    /// Creates the tracker that an identity describes, with this seed.
    ///
    /// # Errors
    /// [`Error::Subject`] if the identity is that of another program or version, or of another
    /// network than the one in its configuration.
    pub fn of(identity: &Identity, seed: u64, threads: usize) -> Result<Self, Error> {
        let Identity::Patchlock { version, build, configuration, network, .. } = identity else {
            return Err(Error::Subject("the tracker is an external program".to_string()));
        };
        let here = (env!("CARGO_PKG_VERSION"), patchlock::BUILD);
        if (version.as_str(), build.as_str()) != here {
            let reason = format!(
                "the runs need Patchlock {version} (build {build}), but this is {} (build {}): \
                 install the same build everywhere",
                here.0, here.1
            );
            return Err(Error::Subject(reason));
        }
        let given = configuration.network.as_ref().map(UsedNetwork::from);
        if *network != given {
            return Err(Error::Subject(other_network(network.as_ref(), given.as_ref())));
        }
        let config = with_seed(configuration, seed);
        config.validate().map_err(|error| Error::Subject(error.to_string()))?;
        Ok(Self { config, pool: session::pool(Some(threads))?, tracker: None })
    }

    /// The estimate of the latest frame; `None` before the first one.
    pub fn estimate(&self) -> Option<&Estimate> {
        self.tracker.as_ref().map(Tracker::estimate)
    }

    /// Starts on a box in a picture, or without one tracks the target in the next picture.
    ///
    /// # Errors
    /// The error of the tracker.
    pub fn step_on(
        &mut self,
        picture: &Picture,
        start: Option<BoundingBox>,
    ) -> Result<Answer, patchlock::Error> {
        let frame = picture.frame()?;
        let Some(bbox) = start else {
            // Without a first box there is nothing to follow.
            let Some(tracker) = &mut self.tracker else { return Ok(Answer::of_box(None, 0.0)) };
            let (estimate, seconds) = timed_on(&self.pool, || tracker.update(&frame))?;
            return Ok(Answer::of_estimate(estimate, seconds));
        };
        let config = self.config.clone();
        let (tracker, seconds) = timed_on(&self.pool, || Tracker::start(config, &frame, bbox))?;
        let answer = Answer::of_estimate(tracker.estimate(), seconds);
        self.tracker = Some(tracker);
        // The first box of a trajectory is the one that was given.
        Ok(Answer { bbox: Some(bbox), ..answer })
    }
}

/// Why runs cannot be made with this network.
fn other_network(needed: Option<&UsedNetwork>, given: Option<&UsedNetwork>) -> String {
    let shown = |network: Option<&UsedNetwork>| match network {
        Some(network) => format!("{network}, SHA-256 {}", network.model_sha256),
        None => "none".to_string(),
    };
    format!("the runs need the network {}; given: {}", shown(needed), shown(given))
}

impl Subject for Patchlock {
    fn step(&mut self, file: &Path, start: Option<BoundingBox>) -> Result<Answer, Error> {
        let picture = image_file::load(file).map_err(|reason| Error::frame(file, reason))?;
        self.step_on(&picture, start)
            .map_err(|error| Error::Tracker { path: file.to_path_buf(), reason: error.to_string() })
    }
}

/// Creates the tracker for one run: Patchlock with `threads` threads, or an external program with
/// the time limit `patience` for each answer.
///
/// # Errors
/// [`Error::Subject`] if the tracker cannot be started or is of a different version than the runs.
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
