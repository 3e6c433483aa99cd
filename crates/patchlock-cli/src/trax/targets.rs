//! The client's targets and the states that are reported for them.

use std::sync::Arc;

use patchlock::{BoundingBox, Error, Estimate, Method, TrackerConfig};
use patchlock_bench::trax::message::Message;
use patchlock_bench::trax::region::Region;
use patchlock_media::Picture;
use patchlock_track::UsedNetwork;
use patchlock_track::many_targets::ManyTargets;
use rayon::ThreadPool;

/// The targets, in the order in which they were given.
pub struct Targets {
    /// The tracker, with the index of each target as its id.
    tracker: ManyTargets,
    /// Which targets were given as polygons, and are reported as such.
    as_polygons: Vec<bool>,
}

impl Targets {
    /// No targets yet.
    ///
    /// # Errors
    /// As [`ManyTargets::new`].
    pub fn new(config: TrackerConfig, pool: Arc<ThreadPool>) -> Result<Self, Error> {
        Ok(Self { tracker: ManyTargets::new(config, pool)?, as_polygons: Vec::new() })
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
    /// As [`ManyTargets::forget`].
    pub fn forget(&mut self) -> Result<(), Error> {
        self.tracker.forget()?;
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
        let known = self.as_polygons.len();
        // The parser has refused regions without a target, so none is dropped here.
        let (regions, boxes): (Vec<&Region>, Vec<BoundingBox>) =
            begin.iter().filter_map(|region| Some((region, region.bbox()?))).unzip();
        let begin: Vec<(u64, BoundingBox)> = (known as u64..).zip(boxes).collect();
        let (found, _) = self.tracker.step(&picture.frame()?, &begin)?;
        let (old, new) = found.split_at(known);
        let answers = old.iter().zip(&self.as_polygons);
        let mut states: Vec<Message> = answers
            .map(|(target, as_polygon)| match as_polygon {
                true => state(&Region::outline(&target.estimate.corners), &target.estimate),
                false => state(&Region::Rectangle(target.estimate.bbox), &target.estimate),
            })
            .collect();
        states.extend(
            new.iter().zip(&regions).map(|(target, region)| state(region, &target.estimate)),
        );
        self.as_polygons.extend(regions.iter().map(|region| matches!(region, Region::Polygon(_))));
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
