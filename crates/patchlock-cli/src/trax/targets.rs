//! The targets that a client has given, and what is answered of them.

use patchlock::{Error, Estimate, MultiTracker, TrackerConfig};
use patchlock_eval::picture::Picture;
use patchlock_eval::trax::message::Message;
use patchlock_eval::trax::region::Region;
use rayon::ThreadPool;

/// The targets, in the order in which they were given.
pub struct Targets {
    config: TrackerConfig,
    pool: ThreadPool,
    tracker: MultiTracker,
    /// Which of them were given as polygons, and are answered so.
    as_polygons: Vec<bool>,
}

impl Targets {
    /// No targets yet.
    ///
    /// # Errors
    /// As [`MultiTracker::new`].
    pub fn new(config: TrackerConfig, pool: ThreadPool) -> Result<Self, Error> {
        let tracker = MultiTracker::new(config.clone())?;
        Ok(Self { config, pool, tracker, as_polygons: Vec::new() })
    }

    /// Forgets all, as if nothing had been tracked before.
    ///
    /// # Errors
    /// As [`Targets::new`].
    pub fn forget(&mut self) -> Result<(), Error> {
        self.tracker = MultiTracker::new(self.config.clone())?;
        self.as_polygons.clear();
        Ok(())
    }

    /// Finds the targets in a picture, then begins on new ones; gives the state of each. That of a new target is its region as given.
    ///
    /// # Errors
    /// Why the tracker refuses the picture or a region.
    pub fn look(&mut self, picture: &Picture, begin: Vec<Region>) -> Result<Vec<Message>, String> {
        if self.as_polygons.is_empty() && begin.is_empty() {
            return Err("there is no target yet: initialize comes before frame".to_string());
        }
        self.follow(picture, begin).map_err(|error| error.to_string())
    }

    fn follow(&mut self, picture: &Picture, begin: Vec<Region>) -> Result<Vec<Message>, Error> {
        let frame = picture.frame()?;
        let Self { pool, tracker, as_polygons, .. } = self;
        let estimates = pool.install(|| tracker.update(&frame))?;
        let answers = estimates.iter().zip(as_polygons.iter());
        let mut states: Vec<Message> = answers
            .map(|((_, estimate), as_polygon)| match as_polygon {
                true => state(&Region::outline(&estimate.corners), estimate),
                false => state(&Region::Rectangle(estimate.bbox), estimate),
            })
            .collect();
        for region in begin {
            let Some(bbox) = region.bbox() else { continue }; // a request has no regions without a target
            let (_, estimate) = pool.install(|| tracker.add(&frame, bbox))?;
            states.push(state(&region, &estimate));
            as_polygons.push(matches!(region, Region::Polygon(_)));
        }
        Ok(states)
    }
}

/// The answer for a target: where it is, how sure that is, and its turned outline whatever the form of the region.
fn state(region: &Region, estimate: &Estimate) -> Message {
    Message::new("state", &[&region.to_string()])
        .with("confidence", estimate.score)
        .with("region", Region::outline(&estimate.corners))
}
