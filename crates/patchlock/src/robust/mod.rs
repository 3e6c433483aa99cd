//! The method `robust`. Three models: tracking filters, long-term memory, patch visibility. Filters
//! that learn on every frame, with a map of the target's colours, locate the target. Their mean
//! over sure frames is the memory: it says how sure a place is, and finds the target again after a
//! loss. The paper's patch model says which parts are visible.

mod colours;
mod estimate;
mod evidence;
mod follower;
mod hypothesis;
mod locate;
mod memory;
mod place;
mod saved;
mod score;
mod search;
mod size;
mod status;
mod turn;
mod view;
mod visible;
mod window;

use crate::config::RobustConfig;
use crate::estimate::Estimate;
use crate::network_error::NetworkError;
use crate::observe::{FrameView, Observer, RobustView};
use crate::patch_model::memory::LearningScratch;
use crate::patch_model::visibility::Visibility;
use crate::target_tracker::{Input, Scratch, TargetTracker};
use crate::vision::frame::Frame;
use crate::vision::geometry::BoundingBox;
use evidence::Evidence;
use locate::{Locator, LocatorScratch, Setting};
use memory::Memory;
use place::Place;
pub(crate) use saved::SavedRobust;
use search::{Found, SearchParams, Searcher};
use status::{Belief, Phase, StatusParams};
use visible::{Seen, SeenBuffers, Visible};
use window::{SampleBuffers, Window};

/// Elsewhere than where an unseen target is followed, the memory has to be this many times surer.
const SURER: f64 = 1.3;

/// A target of the method `robust`.
#[derive(Debug)]
pub(crate) struct RobustTarget {
    /// Where the filters follow it.
    place: Place,
    window: Window,
    locator: Locator,
    memory: Memory,
    visible: Visible,
    belief: Belief,
    /// Frames since the first.
    frames: u64,
    search: SearchParams,
    status: StatusParams,
}

/// Buffers, shared by all targets of a thread. They carry nothing from one frame to the next.
#[derive(Debug, Default)]
pub(crate) struct RobustScratch {
    sample: SampleBuffers,
    locator: LocatorScratch,
    seen: SeenBuffers,
    learning: LearningScratch,
}

impl RobustTarget {
    /// Begins on the target in this box of the first frame.
    pub fn begin(
        frame: &Frame<'_>,
        bbox: BoundingBox,
        (seed, config): (u64, &RobustConfig),
        scratch: &mut RobustScratch,
    ) -> (Self, Estimate) {
        let RobustScratch { sample, locator: buffers, seen, .. } = scratch;
        let place = Place::first(bbox);
        let window = Window::begin(frame, bbox, config, sample);
        let sample = window.sample(frame, place, sample);
        let locator = Locator::begin(frame, &sample, config, buffers);
        let memory = Memory::begin(&sample, locator.filter(), config, &mut buffers.memory);
        let visible = Visible::begin(frame, sample.region(), (seed, config));
        let mut estimate = Estimate::empty();
        let visibility = estimate.visibility.get_or_insert_default();
        let seen = visible.look(frame, sample.region(), seen, visibility);
        let known = memory.recognise(&sample, &mut buffers.memory);
        let evidence = Evidence::new(known, seen.shares(), locator.contrast());
        let (search, status) = (SearchParams::new(config), StatusParams::new(config));
        let belief = Belief::first(&evidence);
        estimate::fill(place, window.base(), belief.verdict(&evidence, &status), &mut estimate);
        let target =
            Self { place, window, locator, memory, visible, belief, frames: 0, search, status };
        (target, estimate)
    }

    /// Finds the target in the next frame and learns from it.
    pub fn step(
        &mut self,
        frame: &Frame<'_>,
        scratch: &mut RobustScratch,
        show: Option<&mut dyn FnMut(RobustView<'_>)>,
        estimate: &mut Estimate,
    ) {
        self.frames += 1;
        // The place: followed from the last one or, after a loss, from where the target is found.
        let last = self.place;
        let is_followed = self.find_again(frame, scratch) || !self.belief.is_lost();
        if is_followed {
            self.follow(frame, scratch);
        }
        // The evidence: what memory, patch model and colours say of it.
        let RobustScratch { sample: buffer, locator: buffers, seen, learning, .. } = scratch;
        let sample = self.window.sample(frame, self.place, buffer);
        let known = self.memory.recognise(&sample, &mut buffers.memory);
        let seen = is_followed.then(|| {
            let visibility = estimate.visibility.get_or_insert_default();
            self.visible.look(frame, sample.region(), seen, visibility)
        });
        let shares = seen.map(Seen::shares).unwrap_or_default();
        let evidence = Evidence::new(known, shares, self.locator.contrast());
        // The decision: phase, status, score, and what learns.
        let decision = self.belief.advance(&evidence, (self.frames, last), &self.status);
        self.belief = decision.belief;
        if let Some(lessons) = decision.lessons {
            self.locator.learn(frame, &sample, lessons.size, buffers);
            if lessons.sure
                && let Some(seen) = seen
            {
                self.memory.learn(self.locator.filter(), evidence.certainty);
                self.visible.learn(seen, self.memory.sure(), learning);
            }
        }
        let place = decision.back.unwrap_or(self.place);
        if self.belief.is_lost() {
            self.place = place;
        }
        estimate::fill(place, self.window.base(), decision.verdict, estimate);
        if let Some(show) = show {
            show(self.view((frame, place), &evidence, scratch));
        }
    }

    /// Moves to where the filters follow the target to.
    fn follow(&mut self, frame: &Frame<'_>, scratch: &mut RobustScratch) {
        let Self { place, window, locator, memory, .. } = self;
        let RobustScratch { sample, locator: buffers, .. } = scratch;
        *place = locator.locate(Setting { frame, window, memory }, *place, sample, buffers);
    }

    /// Searches while the target is lost or unseen; what is found is on trial. Says whether it is
    /// found.
    fn find_again(&mut self, frame: &Frame<'_>, scratch: &mut RobustScratch) -> bool {
        let (last, next) = match self.belief.phase {
            Phase::Lost { next } => (self.place, next),
            Phase::Unseen { next, last, .. } => (last, next),
            Phase::Following { .. } | Phase::Trial { .. } => return false,
        };
        let Self { window, memory, search, .. } = &*self;
        let RobustScratch { sample, locator: buffers, .. } = &mut *scratch;
        let setting = Setting { frame, window, memory };
        let mut searcher = Searcher { setting, sample, response: &mut buffers.memory };
        let found = searcher.search(last, next, search);
        let is_better =
            |found: &Found| self.belief.is_lost() || self.is_better(frame, *found, scratch);
        let Some(found) = found.filter(is_better) else {
            self.belief.search_on(self.search.windows - 1);
            return false;
        };
        self.locator.restart(&self.memory);
        self.belief.begin_trial(self.place, &self.status);
        self.place = found.place;
        true
    }

    /// Whether the target is rather at a place that was found than where it is followed, unseen.
    fn is_better(&self, frame: &Frame<'_>, found: Found, scratch: &mut RobustScratch) -> bool {
        let Self { place, window, memory, visible, search, .. } = self;
        let RobustScratch { sample, locator: buffers, seen, .. } = scratch;
        let setting = Setting { frame, window, memory };
        let here = Searcher { setting, sample, response: &mut buffers.memory }.certainty(*place);
        let is_near = found.place.is_within(*place, window.base());
        let region = found.place.region(window.base());
        (is_near || found.certainty >= SURER * here)
            && visible.look(frame, region, seen, &mut Visibility::default()).shares().shown
                >= search.shown
    }
}

impl TargetTracker for RobustTarget {
    fn update(
        &mut self,
        input: Input<'_>,
        scratch: &mut Scratch,
        observer: Option<&mut dyn Observer>,
        estimate: &mut Estimate,
    ) -> Result<(), NetworkError> {
        let scratch = scratch.of();
        match observer {
            None => self.step(input.frame, scratch, None, estimate),
            Some(observer) => {
                let mut show = |view: RobustView<'_>| observer.observe(&FrameView::Robust(view));
                self.step(input.frame, scratch, Some(&mut show), estimate);
            }
        }
        Ok(())
    }
}
