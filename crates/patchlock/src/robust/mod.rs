//! The method `robust`. Three models: tracking filters, long-term memory, patch visibility. Filters
//! that learn on every frame, with a map of the target's colours, locate the target. Their mean
//! over sure frames is the memory: it says how sure a place is, and finds the target again after a
//! loss. The paper's patch model says which parts are visible.

mod choose;
mod colours;
mod estimate;
mod follower;
mod locate;
mod memory;
mod place;
mod saved;
mod search;
mod size;
mod status;
mod turn;
pub(crate) mod view;
mod visible;
mod window;

use crate::config::RobustConfig;
use crate::estimate::Estimate;
use crate::patch_model::memory::LearningScratch;
use crate::vision::frame::Frame;
use crate::vision::geometry::BoundingBox;
use locate::{Locator, LocatorScratch, Setting};
use memory::Memory;
use place::Place;
pub(crate) use saved::SavedRobust;
use search::{SearchParams, Searcher};
use status::{Belief, Evidence, Phase, StatusParams};
use view::RobustView;
use visible::{Seen, SeenBuffers, Visible};
use window::{SampleBuffers, Window};

/// A target of the method `robust`.
#[derive(Debug)]
pub(crate) struct RobustTarget {
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
        let evidence = Evidence::new(known, seen.share(), locator.contrast());
        let (status, search) = (StatusParams::new(config), SearchParams::new(config));
        let (belief, frames) = (Belief::first(&evidence), 0);
        estimate::fill(place, window.base(), belief.verdict(&evidence, &status), &mut estimate);
        let target =
            Self { place, window, locator, memory, visible, belief, frames, search, status };
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
        // The place: located from the last one or, after a loss, from where the memory finds it.
        let is_located = !self.belief.is_lost() || self.find_again(frame, scratch);
        let RobustScratch { sample, locator: buffers, seen, learning } = scratch;
        if is_located {
            let setting = Setting { frame, window: &self.window, memory: &self.memory };
            self.place = self.locator.locate(setting, self.place, sample, buffers);
        }
        // The evidence: what memory, patch model and colours say of it.
        let sample = self.window.sample(frame, self.place, sample);
        let known = self.memory.recognise(&sample, &mut buffers.memory);
        let seen = is_located.then(|| {
            let visibility = estimate.visibility.get_or_insert_default();
            self.visible.look(frame, sample.region(), seen, visibility)
        });
        let visible = seen.map_or(0.0, Seen::share);
        let evidence = Evidence::new(known, visible, self.locator.contrast());
        // The decision: phase, status, score, and what learns.
        let decision = self.belief.advance(&evidence, self.frames, &self.status);
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
        self.place = decision.back.unwrap_or(self.place);
        estimate::fill(self.place, self.window.base(), decision.verdict, estimate);
        if let Some(show) = show {
            show(self.view(frame, &evidence, scratch));
        }
    }

    /// Searches while the target is lost; what is found is on trial. Says whether it is found.
    fn find_again(&mut self, frame: &Frame<'_>, scratch: &mut RobustScratch) -> bool {
        let Phase::Lost { next } = self.belief.phase else { return false };
        let setting = Setting { frame, window: &self.window, memory: &self.memory };
        let RobustScratch { sample, locator: LocatorScratch { memory: response, .. }, .. } =
            scratch;
        let found = Searcher { setting, sample, response }.search(self.place, next, &self.search);
        let Some(place) = found else {
            self.belief.search_on(self.search.windows - 1);
            return false;
        };
        self.locator.restart(&self.memory);
        self.belief.begin_trial(self.place, &self.status);
        self.place = place;
        true
    }
}
