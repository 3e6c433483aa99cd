//! The client's targets and the states that are reported for them.

use std::sync::Arc;

use patchlock::{BoundingBox, Error, Estimate, Method, MultiTracker, TrackerConfig};
use patchlock_bench::trax::message::Message;
use patchlock_bench::trax::region::Region;
use patchlock_media::Picture;
use patchlock_track::UsedNetwork;
use rayon::ThreadPool;

/// The targets, in the order in which they were given.
pub struct Targets {
    tracker: MultiTracker,
    pool: Arc<ThreadPool>,
    /// Which targets were given as polygons, and are reported as such.
    as_polygons: Vec<bool>,
}

impl Targets {
    /// No targets yet.
    ///
    /// # Errors
    /// As [`MultiTracker::new`].
    pub fn new(config: TrackerConfig, pool: Arc<ThreadPool>) -> Result<Self, Error> {
        Ok(Self { tracker: MultiTracker::new(config)?, pool, as_polygons: Vec::new() })
    }

    /// What follows the targets.
    pub fn method(&self) -> &Method {
        &self.tracker.config().method
    }

    /// The network that follows the targets, if one does.
    pub fn network(&self) -> Option<UsedNetwork> {
        self.tracker.config().network.as_ref().map(UsedNetwork::from)
    }

    /// Removes all targets and resets the tracker to its initial state.
    ///
    /// # Errors
    /// As [`Targets::new`].
    pub fn forget(&mut self) -> Result<(), Error> {
        self.tracker = MultiTracker::new(self.tracker.config().clone())?;
        self.as_polygons.clear();
        Ok(())
    }

    /// Tracks the targets in a picture, then starts new ones; returns the state of each. The state
    /// of a new target is its given region.
    ///
    /// # Errors
    /// The reason why the tracker refuses the picture or a region.
    pub fn track(&mut self, picture: &Picture, begin: Vec<Region>) -> Result<Vec<Message>, String> {
        if self.as_polygons.is_empty() && begin.is_empty() {
            return Err("there is no target yet: send initialize before frame".to_string());
        }
        self.states(picture, &begin).map_err(|error| error.to_string())
    }

    fn states(&mut self, picture: &Picture, begin: &[Region]) -> Result<Vec<Message>, Error> {
        let Self { tracker, pool, as_polygons } = self;
        let known = as_polygons.len();
        // The parser has refused regions without a target, so none is dropped here.
        let (regions, boxes): (Vec<&Region>, Vec<BoundingBox>) =
            begin.iter().filter_map(|region| Some((region, region.bbox()?))).unzip();
        let frame = picture.frame()?;
        pool.install(|| {
            if known > 0 {
                tracker.update(&frame)?;
            }
            boxes.iter().try_for_each(|bbox| tracker.add(&frame, *bbox).map(|_| ()))
        })?;
        let (old, new) = tracker.tracked().split_at(known);
        let answers = old.iter().zip(as_polygons.iter());
        let mut states: Vec<Message> = answers
            .map(|(target, as_polygon)| match as_polygon {
                true => state(&Region::outline(&target.estimate.corners), &target.estimate),
                false => state(&Region::Rectangle(target.estimate.bbox), &target.estimate),
            })
            .collect();
        states.extend(
            new.iter().zip(&regions).map(|(target, region)| state(region, &target.estimate)),
        );
        as_polygons.extend(regions.iter().map(|region| matches!(region, Region::Polygon(_))));
        Ok(states)
    }
}

/// The state of a target: its region, its score, its status and, for any type of region, its
/// rotated outline.
fn state(region: &Region, estimate: &Estimate) -> Message {
    Message::new("state", &[&region.to_string()])
        .with("confidence", estimate.score)
        .with("status", estimate.status)
        .with("region", Region::outline(&estimate.corners))
}
