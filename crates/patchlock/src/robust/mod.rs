//! The method `robust`. Three models: tracking filters, long-term memory, patch visibility. Filters
//! that learn on every frame, with a map of the target's colours, locate the target. Their mean
//! over sure frames is the memory: it says how sure a place is, and finds the target again after a
//! loss. The paper's patch model says which parts are visible. A network of the user, if there is
//! one, follows the target beside the filters.

mod colours;
mod estimate;
mod evidence;
mod follower;
mod hypothesis;
mod locate;
mod memory;
mod place;
mod regain;
mod rivals;
mod saved;
mod score;
mod search;
mod size;
mod status;
mod turn;
pub(crate) mod view;
mod visible;
mod window;
mod witness;

use crate::config::RobustConfig;
use crate::estimate::Estimate;
use crate::network::Network;
use crate::network::look::Buffers;
use crate::network_error::NetworkError;
use crate::patch_model::memory::LearningScratch;
use crate::patch_model::visibility::Visibility;
use crate::vision::frame::Frame;
use crate::vision::geometry::BoundingBox;
use evidence::Evidence;
use locate::{Locator, LocatorScratch, Setting};
use memory::Memory;
use place::Place;
use regain::{RegainParams, regain};
use rivals::{Followed, Rival};
pub(crate) use saved::SavedRobust;
use search::{Found, Order, SearchParams, Searcher};
use status::{Belief, Phase, StatusParams};
use view::RobustView;
use visible::{Seen, SeenBuffers, Visible};
use window::{SampleBuffers, Window};
use witness::Witness;

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
    /// The network, if there is one.
    rival: Option<Rival>,
    belief: Belief,
    /// Frames since the first.
    frames: u64,
    search: SearchParams,
    regain: RegainParams,
    status: StatusParams,
}

/// Buffers, shared by all targets of a thread. They carry nothing from one frame to the next.
#[derive(Debug, Default)]
pub(crate) struct RobustScratch {
    sample: SampleBuffers,
    locator: LocatorScratch,
    seen: SeenBuffers,
    learning: LearningScratch,
    network: Buffers,
}

impl RobustTarget {
    /// Begins on the target in this box of the first frame.
    ///
    /// # Errors
    /// The runtime's own, if there is a network.
    pub fn begin(
        frame: &Frame<'_>,
        bbox: BoundingBox,
        (seed, config): (u64, &RobustConfig),
        network: Option<&Network>,
        scratch: &mut RobustScratch,
    ) -> Result<(Self, Estimate), NetworkError> {
        let RobustScratch { sample, locator: buffers, seen, network: looked, .. } = scratch;
        let place = Place::first(bbox);
        let witness =
            network.map(|network| Witness::begin(network, frame, bbox, config.network_fit, looked));
        let rival = witness.transpose()?.map(|witness| Rival::begin(witness, place, config));
        let window = Window::begin(frame, bbox, config, sample);
        let sample = window.sample(frame, place, sample);
        let locator = Locator::begin(frame, &sample, config, buffers);
        let memory = Memory::begin(&sample, locator.filter(), config, &mut buffers.memory);
        let visible = Visible::begin(frame, sample.region(), (seed, config));
        let mut estimate = Estimate::empty();
        let visibility = estimate.visibility.get_or_insert_default();
        let seen = visible.look(frame, sample.region(), seen, visibility);
        let known = memory.recognise(&sample, &mut buffers.memory);
        let evidence = Evidence::new(known, seen.shares(), locator.contrast(), None);
        let (search, regain) = (SearchParams::new(config), RegainParams::new(config));
        let (belief, frames, status) = (Belief::first(&evidence), 0, StatusParams::new(config));
        estimate::fill(place, window.base(), belief.verdict(&evidence, &status), &mut estimate);
        let target = Self {
            place,
            window,
            locator,
            memory,
            visible,
            rival,
            belief,
            frames,
            search,
            regain,
            status,
        };
        Ok((target, estimate))
    }

    /// Finds the target in the next frame and learns from it.
    ///
    /// # Errors
    /// The runtime's own, if there is a network; the target is then between two frames.
    pub fn step(
        &mut self,
        frame: &Frame<'_>,
        scratch: &mut RobustScratch,
        show: Option<&mut dyn FnMut(RobustView<'_>)>,
        estimate: &mut Estimate,
    ) -> Result<(), NetworkError> {
        self.frames += 1;
        // The place: followed from the last one or, after a loss, from where the target is found.
        let last = self.place;
        let is_found = self.find_again(frame, scratch)?;
        let is_followed = is_found || !self.belief.is_lost();
        let followed = match is_followed {
            true => self.follow(frame, scratch)?,
            false => Followed::by_filters(self.place),
        };
        // The evidence: what memory, patch model, colours and network say of it.
        let RobustScratch { sample: buffer, locator: buffers, seen, learning, .. } = scratch;
        let sample = self.window.sample(frame, followed.place, buffer);
        let known = self.memory.recognise(&sample, &mut buffers.memory);
        let seen = is_followed.then(|| {
            let visibility = estimate.visibility.get_or_insert_default();
            self.visible.look(frame, sample.region(), seen, visibility)
        });
        let (shares, contrast) =
            (seen.map(Seen::shares).unwrap_or_default(), self.locator.contrast());
        let evidence = Evidence::new(known, shares, contrast, followed.opinion);
        if let Some(rival) = &mut self.rival {
            rival.note(evidence.certainty);
        }
        // The decision: phase, status, score, and what learns.
        let decision = self.belief.advance(&evidence, (self.frames, last), &self.status);
        self.belief = decision.belief;
        if let Some(lessons) = decision.lessons {
            // The filters learn where they follow, also while another place is believed.
            let own = followed.filters;
            let size = lessons.size && own == followed.place;
            if own == followed.place {
                self.locator.learn(frame, &sample, size, buffers);
            }
            if lessons.sure
                && let Some(seen) = seen
            {
                self.memory.learn(self.locator.filter(), evidence.certainty);
                self.visible.learn(seen, self.memory.sure(), learning);
            }
            if own != followed.place {
                let sample = self.window.sample(frame, own, buffer);
                self.locator.learn(frame, &sample, size, buffers);
            }
        }
        let place = decision.back.unwrap_or(followed.place);
        self.place = if self.belief.is_lost() { place } else { followed.filters };
        estimate::fill(place, self.window.base(), decision.verdict, estimate);
        if let Some(show) = show {
            show(self.view((frame, place), &evidence, scratch));
        }
        Ok(())
    }

    /// Where filters and network follow the target to.
    fn follow(
        &mut self,
        frame: &Frame<'_>,
        scratch: &mut RobustScratch,
    ) -> Result<Followed, NetworkError> {
        let Self { place, window, locator, memory, rival, .. } = self;
        let RobustScratch { sample, locator: buffers, network, .. } = scratch;
        let setting = Setting { frame, window, memory };
        let Some(rival) = rival else {
            return Ok(Followed::by_filters(locator.locate(setting, *place, sample, buffers)));
        };
        let sight = rival.look(setting, network)?;
        let filters = locator.locate(setting, *place, sample, buffers);
        let scratch = (sample, &mut buffers.memory, network);
        let followed = rival.compare(setting, filters, sight, scratch)?;
        if followed.restart {
            locator.restart(memory);
        }
        Ok(followed)
    }

    /// Searches while the target is lost or unseen; what is found is on trial. Says whether it is
    /// found.
    fn find_again(
        &mut self,
        frame: &Frame<'_>,
        scratch: &mut RobustScratch,
    ) -> Result<bool, NetworkError> {
        let (last, next) = match self.belief.phase {
            Phase::Lost { next } => (self.place, next),
            Phase::Unseen { next, last, .. } => (last, next),
            Phase::Following { .. } | Phase::Trial { .. } => return Ok(false),
        };
        let Self { window, memory, rival, search, regain: params, .. } = &*self;
        let RobustScratch { sample, locator: buffers, network, .. } = scratch;
        let setting = Setting { frame, window, memory };
        let order = if rival.is_some() { Order::Outwards } else { Order::Rows };
        let mut searcher = Searcher { setting, order, sample, response: &mut buffers.memory };
        let (found, windows) = match rival {
            None => {
                let found = searcher.search(last, next, search);
                let is_better =
                    |found: &Found| self.belief.is_lost() || self.is_better(frame, *found, scratch);
                (found.filter(is_better).map(|found| found.place), search.windows)
            }
            Some(rival) => {
                let witness = (&rival.witness, network);
                let found = regain(searcher, (last, next), (search, params), witness)?;
                (found, params.windows)
            }
        };
        let Some(found) = found else {
            self.belief.search_on(windows - 1);
            return Ok(false);
        };
        self.locator.restart(&self.memory);
        self.belief.begin_trial(self.place, &self.status);
        self.place = found;
        if let Some(rival) = &mut self.rival {
            rival.restart(found);
        }
        Ok(true)
    }

    /// Whether the target is rather at a place that was found than where it is followed, unseen.
    fn is_better(&self, frame: &Frame<'_>, found: Found, scratch: &mut RobustScratch) -> bool {
        let Self { place, window, memory, visible, search, .. } = self;
        let RobustScratch { sample, locator: buffers, seen, .. } = scratch;
        let setting = Setting { frame, window, memory };
        let (order, response) = (Order::Rows, &mut buffers.memory);
        let here = Searcher { setting, order, sample, response }.certainty(*place);
        let is_near = found.place.is_within(*place, window.base());
        let region = found.place.region(window.base());
        (is_near || found.certainty >= SURER * here)
            && visible.look(frame, region, seen, &mut Visibility::default()).shares().shown
                >= search.shown
    }
}
