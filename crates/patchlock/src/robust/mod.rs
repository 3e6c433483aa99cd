//! The method `robust`. Three models: tracking filters, long-term memory, patch visibility. Filters
//! that learn on every frame, with a map of the target's colours, locate the target. Their mean
//! over sure frames is the memory: it says how sure a place is, and finds the target again after a
//! loss. The paper's patch model says which parts are visible.

mod camera;
mod colours;
mod config;
mod evidence;
mod hypothesis;
mod locate;
mod memory;
mod occlusion;
mod output;
mod pose;
mod rotation;
mod saved;
mod score;
mod search;
mod status;
mod tracking_filter;
mod view;
mod window;

use crate::estimate::Estimate;
use crate::network::Network;
use crate::network_error::NetworkError;
use crate::patch_model::memory::LearningScratch;
use crate::patch_model::visibility::Visibility;
use crate::target_tracker::{Input, Start, TargetTracker, ViewSink};
use crate::vision::frame::Frame;
use crate::{Error, error};
pub use config::RobustConfig;
use evidence::Evidence;
use locate::{FrameContext, Locator, LocatorScratch};
use memory::Memory;
use occlusion::{OcclusionModel, OcclusionScratch, PatchObservation};
use pose::Pose;
pub(crate) use saved::SavedRobust;
use search::{Detection, Searcher};
use status::{Phase, TrackState};
pub use view::RobustView;
use window::{SampleBuffers, Window};

/// Elsewhere than where an unseen target is followed, the memory has to be this many times surer.
const REDETECTION_MARGIN: f64 = 1.3;

/// A target of the method `robust`.
#[derive(Debug)]
pub(crate) struct RobustTarget {
    /// Where the filters follow it.
    pose: Pose,
    window: Window,
    locator: Locator,
    memory: Memory,
    occlusion: OcclusionModel,
    state: TrackState,
    /// Frames since the first.
    frames: u64,
    config: RobustConfig,
}

/// Buffers, shared by all targets of a thread. They carry nothing from one frame to the next.
#[derive(Debug, Default)]
pub(crate) struct RobustScratch {
    sample: SampleBuffers,
    locator: LocatorScratch,
    seen: OcclusionScratch,
    learning: LearningScratch,
}

impl RobustTarget {
    /// Moves to where the filters follow the target to.
    fn follow(&mut self, frame: &Frame<'_>, scratch: &mut RobustScratch) {
        let Self { pose, window, locator, memory, config, .. } = self;
        let RobustScratch { sample, locator: buffers, .. } = scratch;
        let context = FrameContext { frame, window, memory, config };
        *pose = locator.locate(context, *pose, sample, buffers);
    }

    /// Searches while the target is lost or occluded; a re-detection is verified. Says whether it is
    /// found.
    fn find_again(&mut self, frame: &Frame<'_>, scratch: &mut RobustScratch) -> bool {
        let (last, next) = match self.state.phase {
            Phase::Lost { next } => (self.pose, next),
            Phase::Occluded { next, last, .. } => (last, next),
            Phase::Tracking { .. } | Phase::Verifying { .. } => return false,
        };
        let Self { window, memory, config, .. } = &*self;
        let RobustScratch { sample, locator: buffers, .. } = &mut *scratch;
        let context = FrameContext { frame, window, memory, config };
        let mut searcher = Searcher { context, sample, response: &mut buffers.memory };
        let found = searcher.search(last, next);
        let is_better =
            |found: &Detection| self.state.is_lost() || self.is_better(frame, *found, scratch);
        let Some(found) = found.filter(is_better) else {
            self.state.search_on(self.config.search_windows as u64 - 1);
            return false;
        };
        self.locator.restart(&self.memory);
        self.state.begin_verification(self.pose, &self.config);
        self.pose = found.pose;
        true
    }

    /// Whether the target is rather at a place that was found than where it is followed, unseen.
    fn is_better(&self, frame: &Frame<'_>, found: Detection, scratch: &mut RobustScratch) -> bool {
        let Self { pose, window, memory, occlusion, config, .. } = self;
        let RobustScratch { sample, locator: buffers, seen, .. } = scratch;
        let context = FrameContext { frame, window, memory, config };
        let here = Searcher { context, sample, response: &mut buffers.memory }.certainty(*pose);
        let is_near = found.pose.is_within(*pose, window.base());
        let region = found.pose.region(window.base());
        if !(is_near || found.certainty >= REDETECTION_MARGIN * here) {
            return false;
        }
        let seen = occlusion.observe(frame, region, config, seen, &mut Visibility::default());
        seen.shares().reported >= config.seen_again
    }
}

impl TargetTracker for RobustTarget {
    type Config = RobustConfig;
    type Scratch = RobustScratch;
    type Snapshot = SavedRobust;
    type View<'a> = RobustView<'a>;

    fn begin(
        start: Start<'_>,
        config: &RobustConfig,
        scratch: &mut RobustScratch,
    ) -> Result<(Self, Estimate), Error> {
        let Start { input: Input { frame, .. }, bbox, seed, .. } = start;
        let RobustScratch { sample, locator: buffers, seen, .. } = scratch;
        let pose = Pose::first(bbox);
        let window = Window::begin(frame, bbox, config, sample);
        let sample = window.sample(frame, pose, sample);
        let locator = Locator::begin(frame, &sample, config, buffers);
        let memory = Memory::begin(&sample, locator.filter(), &mut buffers.memory);
        let occlusion = OcclusionModel::begin(frame, sample.region(), (seed, config));
        let mut estimate = Estimate::empty();
        let visibility = estimate.visibility.get_or_insert_default();
        let seen = occlusion.observe(frame, sample.region(), config, seen, visibility);
        let known = memory.recognise(&sample, config, &mut buffers.memory);
        let evidence = Evidence::new(known, seen.shares(), locator.contrast());
        let state = TrackState::first(&evidence);
        output::fill(pose, window.base(), state.result(&evidence, config), &mut estimate);
        let config = config.clone();
        let target = Self { pose, window, locator, memory, occlusion, state, frames: 0, config };
        Ok((target, estimate))
    }

    fn update(
        &mut self,
        input: Input<'_>,
        scratch: &mut RobustScratch,
        show: ViewSink<'_, Self>,
        estimate: &mut Estimate,
    ) -> Result<(), NetworkError> {
        let frame = input.frame;
        self.frames += 1;
        // The place: followed from the last one or, after a loss, from where the target is found.
        let last = self.pose;
        let is_followed = self.find_again(frame, scratch) || !self.state.is_lost();
        if is_followed {
            self.follow(frame, scratch);
        }
        // The evidence: what memory, patch model and colours say of it.
        let RobustScratch { sample: buffer, locator: buffers, seen, learning, .. } = scratch;
        let config = &self.config;
        let sample = self.window.sample(frame, self.pose, buffer);
        let known = self.memory.recognise(&sample, config, &mut buffers.memory);
        let seen = is_followed.then(|| {
            let visibility = estimate.visibility.get_or_insert_default();
            self.occlusion.observe(frame, sample.region(), config, seen, visibility)
        });
        let shares = seen.map(PatchObservation::shares).unwrap_or_default();
        let evidence = Evidence::new(known, shares, self.locator.contrast());
        // The decision: phase, status, score, and what learns.
        let decision = self.state.advance(&evidence, (self.frames, last), config);
        self.state = decision.state;
        if let Some(update) = decision.update {
            self.locator.learn(frame, &sample, (config, update.size), buffers);
            if update.sure
                && let Some(seen) = seen
            {
                self.memory.learn(self.locator.filter(), evidence.certainty, config);
                self.occlusion.learn(seen, self.memory.sure(), config, learning);
            }
        }
        let pose = decision.back.unwrap_or(self.pose);
        if self.state.is_lost() {
            self.pose = pose;
        }
        output::fill(pose, self.window.base(), decision.result, estimate);
        if let Some(show) = show {
            show(self.view((frame, pose), &evidence, scratch));
        }
        Ok(())
    }

    fn saved(&self) -> SavedRobust {
        SavedRobust::of(self)
    }

    fn restore(
        saved: SavedRobust,
        config: &RobustConfig,
        _network: Option<&Network>,
    ) -> Result<Self, Error> {
        saved.target(config).map_err(error::snapshot)
    }
}
