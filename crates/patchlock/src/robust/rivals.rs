//! Two followers, filters and network. While they agree, one place is made of both. While they
//! disagree, each goes on alone, until the evidence says which of them is right: memory and network
//! judge the places of both.

use super::locate::Setting;
use super::place::Place;
use super::window::SampleBuffers;
use super::witness::{Sight, Witness};
use crate::config::RobustConfig;
use crate::correlation::response::ResponseBuffers;
use crate::network::look::Buffers;
use crate::network_error::NetworkError;
use serde::{Deserialize, Serialize};

/// The network as a second follower.
#[derive(Debug)]
pub(crate) struct Rival {
    pub witness: Witness,
    state: RivalState,
    params: RivalParams,
}

/// What changes from frame to frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct RivalState {
    /// Where the network follows.
    place: Place,
    dispute: Dispute,
    /// How certain the memory was of the last place.
    known: f64,
}

/// What has been seen since filters and network disagree.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Dispute {
    /// The running mean of the network's evidence less that of the filters.
    lead: f64,
    /// Consecutive frames.
    frames: u32,
}

/// What memory and network say of a place.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Testimony {
    /// The memory's response, relative to its mean over sure frames.
    certainty: f64,
    /// The logarithm of the network's odds.
    odds: f64,
}

/// Which of two followers is believed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Ruling {
    /// The filters, for now.
    Filters,
    /// The network, for now.
    Network,
    /// The filters: the network goes on from their place.
    FiltersWin,
    /// The network: the filters go on from its place.
    NetworkWin,
}

/// Where the target was followed to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Followed {
    /// The place that is believed.
    pub place: Place,
    /// Where the filters go on.
    pub filters: Place,
    /// Whether the filters have to begin again there.
    pub restart: bool,
    /// What the network says of the place.
    pub opinion: Option<Opinion>,
}

/// What the network says of a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Opinion {
    /// The logarithm of the odds that the target is there.
    pub odds: f64,
    /// Whether filters and network agree on the place.
    pub agrees: bool,
}

/// How two followers are compared.
#[derive(Debug, Clone, Copy, PartialEq)]
struct RivalParams {
    /// They agree if their boxes overlap by more than this.
    overlap: f64,
    /// While they agree: the share of the way from the filters' centre to the network's, where the
    /// memory knows the target, and where only the network does,
    centre: [f64; 2],
    /// and the share of the network's own change of size.
    size: f64,
    /// Rate of the running mean of the difference in evidence.
    rate: f64,
    /// A dispute ends if the difference is larger than this,
    margin: f64,
    /// after this many frames.
    after: u32,
    /// The network wins only with odds above this.
    odds: f64,
    /// The odds that count as much as a certainty of 1.
    unit: f64,
    /// Added to the network's evidence.
    bias: f64,
}

/// The range in which the network's odds count: beyond it, a network is sure of anything.
const ODDS: [f64; 2] = [-3.0, 2.0];

/// From the first to the second certainty, the memory comes to know the target.
const KNOWN: [f64; 2] = [0.4, 0.9];

/// From the first to the second odds, the network comes to know it.
const TRUSTED: [f64; 2] = [0.0, 2.0];

/// How far a value is on the way through a range, from 0 to 1.
fn progress(value: f64, [from, to]: [f64; 2]) -> f64 {
    ((value - from) / (to - from)).clamp(0.0, 1.0)
}

impl RivalParams {
    fn new(config: &RobustConfig) -> Self {
        Self {
            overlap: config.agree_overlap,
            centre: [config.network_centre, config.network_centre_most],
            size: config.network_size,
            rate: config.dispute_rate,
            margin: config.dispute_margin,
            after: config.dispute_after as u32,
            odds: config.dispute_odds,
            unit: config.dispute_unit,
            bias: config.dispute_bias,
        }
    }

    fn evidence(&self, Testimony { certainty, odds }: Testimony) -> f64 {
        certainty + odds.clamp(ODDS[0], ODDS[1]) / self.unit
    }
}

impl RivalState {
    /// Whether all numbers are finite.
    pub fn is_sound(&self) -> bool {
        self.place.is_sound() && self.dispute.lead.is_finite() && self.known.is_finite()
    }
}

impl Dispute {
    /// Which follower is believed, and the dispute after this frame.
    fn judge(mut self, [filters, network]: [Testimony; 2], params: &RivalParams) -> (Self, Ruling) {
        let difference = params.evidence(network) + params.bias - params.evidence(filters);
        self.lead += params.rate * (difference - self.lead);
        self.frames = self.frames.saturating_add(1);
        let decided = self.frames >= params.after && self.lead.abs() > params.margin;
        match (self.lead > 0.0, decided) {
            (true, true) if network.odds > params.odds => (Self::default(), Ruling::NetworkWin),
            (false, true) => (Self::default(), Ruling::FiltersWin),
            (true, _) => (self, Ruling::Network),
            (false, false) => (self, Ruling::Filters),
        }
    }
}

impl Followed {
    /// Where the filters alone followed the target to.
    pub fn by_filters(place: Place) -> Self {
        Self { place, filters: place, restart: false, opinion: None }
    }
}

impl Rival {
    /// A network that follows from this place on.
    pub fn begin(witness: Witness, place: Place, config: &RobustConfig) -> Self {
        let state = RivalState { place, dispute: Dispute::default(), known: 1.0 };
        Self::restore(witness, state, config)
    }

    /// From a snapshot.
    pub fn restore(witness: Witness, state: RivalState, config: &RobustConfig) -> Self {
        Self { witness, state, params: RivalParams::new(config) }
    }

    /// As a snapshot holds it.
    pub fn state(&self) -> RivalState {
        self.state
    }

    /// Goes on from this place, in agreement.
    pub fn restart(&mut self, place: Place) {
        self.state = RivalState { place, dispute: Dispute::default(), ..self.state };
    }

    /// Notes how certain the memory is of the place on this frame.
    pub fn note(&mut self, certainty: f64) {
        self.state.known = certainty;
    }

    /// Where the network sees the target.
    ///
    /// # Errors
    /// The runtime's own.
    pub fn look(&self, setting: Setting<'_>, buffers: &mut Buffers) -> Result<Sight, NetworkError> {
        self.witness.look(setting.frame, self.state.place, buffers)
    }

    /// Compares where the filters follow the target to with where the network sees it.
    ///
    /// # Errors
    /// The runtime's own.
    pub fn compare(
        &mut self,
        setting: Setting<'_>,
        filters: Place,
        sight: Sight,
        (sample, response, network): (&mut SampleBuffers, &mut ResponseBuffers, &mut Buffers),
    ) -> Result<Followed, NetworkError> {
        let Setting { frame, window, memory } = setting;
        let (base, seen) = (window.base(), window.keep(sight.place, frame));
        if filters.bbox(base).overlap(&seen.bbox(base)) > self.params.overlap {
            let place =
                window.keep(merged(filters, (sight, self.state.known), base, &self.params), frame);
            self.restart(place);
            let opinion = Some(Opinion { odds: sight.odds, agrees: true });
            return Ok(Followed { opinion, ..Followed::by_filters(place) });
        }
        let mut certainty = |place: Place| {
            memory.certainty(memory.respond(&window.sample(frame, place, sample), response))
        };
        let odds = [self.witness.examine(frame, filters, network)?, sight.odds];
        let testimonies = [(filters, odds[0]), (seen, odds[1])]
            .map(|(place, odds)| Testimony { certainty: certainty(place), odds });
        let (dispute, ruling) = self.state.dispute.judge(testimonies, &self.params);
        self.state = RivalState { place: seen, dispute, ..self.state };
        Ok(self.apply(ruling, filters, odds))
    }

    /// What follows from a ruling.
    fn apply(&mut self, ruling: Ruling, filters: Place, odds: [f64; 2]) -> Followed {
        let seen = self.state.place;
        let [ours, theirs] = odds.map(|odds| Some(Opinion { odds, agrees: false }));
        match ruling {
            Ruling::Filters => Followed { opinion: ours, ..Followed::by_filters(filters) },
            Ruling::Network => {
                Followed { place: seen, opinion: theirs, ..Followed::by_filters(filters) }
            }
            Ruling::FiltersWin => {
                self.state.place = filters;
                Followed { opinion: ours, ..Followed::by_filters(filters) }
            }
            Ruling::NetworkWin => {
                Followed { restart: true, opinion: theirs, ..Followed::by_filters(seen) }
            }
        }
    }
}

/// The place between filters and network while they agree, if the memory was this certain of the
/// last place. Filters hardly follow what changes its looks; a network does.
fn merged(
    filters: Place,
    (sight, certainty): (Sight, f64),
    base: [f64; 2],
    params: &RivalParams,
) -> Place {
    let between = |from: [f64; 2], to: [f64; 2], share: f64| {
        [0, 1].map(|k| from[k] + share * (to[k] - from[k]))
    };
    let [least, most] = params.centre;
    let strange = (1.0 - progress(certainty, KNOWN)) * progress(sight.odds, TRUSTED);
    let share = least + (most - least) * strange;
    let centre = between(filters.centre, sight.place.centre, share);
    let size = between(filters.size(base), sight.size, params.size * sight.rate);
    Place { centre, ..filters }.sized(size, base)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PARAMS: RivalParams = RivalParams {
        overlap: 0.4,
        centre: [0.5, 1.0],
        size: 0.5,
        rate: 0.5,
        margin: 0.1,
        after: 3,
        odds: 0.0,
        unit: 2.0,
        bias: 0.0,
    };

    fn says(certainty: f64, odds: f64) -> Testimony {
        Testimony { certainty, odds }
    }

    #[test]
    fn evidence_is_certainty_and_odds_within_limits() {
        for (certainty, odds, evidence) in [
            (0.9, 0.0, 0.9),
            (0.5, 1.0, 1.0),
            (0.5, 2.0, 1.5),
            (0.5, 9.0, 1.5),
            (0.5, -3.0, -1.0),
            (0.5, -9.0, -1.0),
        ] {
            assert_eq!(PARAMS.evidence(says(certainty, odds)), evidence, "{certainty} {odds}");
        }
    }

    /// The rulings on frames on which the same is said again and again.
    fn rulings(filters: Testimony, network: Testimony, frames: usize) -> Vec<Ruling> {
        let mut dispute = Dispute::default();
        let mut judge = || {
            let (after, ruling) = dispute.judge([filters, network], &PARAMS);
            dispute = after;
            ruling
        };
        (0..frames).map(|_| judge()).collect()
    }

    #[test]
    fn a_dispute_is_decided_after_some_frames_if_the_difference_is_clear() {
        use Ruling::{Filters, FiltersWin, Network, NetworkWin};
        for (filters, network, expected) in [
            (says(0.9, 1.0), says(0.3, 1.0), [Filters, Filters, FiltersWin, Filters]),
            (says(0.3, -1.0), says(0.9, 1.0), [Network, Network, NetworkWin, Network]),
            // A network that does not believe itself wins no dispute.
            (says(0.1, -2.0), says(0.9, -0.1), [Network; 4]),
            // The difference is too small.
            (says(0.9, 1.0), says(0.85, 1.0), [Filters; 4]),
            (says(0.85, 1.0), says(0.9, 1.0), [Network; 4]),
        ] {
            assert_eq!(rulings(filters, network, 4), expected, "{filters:?} {network:?}");
        }
    }

    #[test]
    fn a_bias_favours_the_network() {
        let (params, both) = (RivalParams { bias: 0.5, ..PARAMS }, says(0.5, 0.5));
        let (dispute, ruling) = Dispute::default().judge([both, both], &params);
        assert_eq!((dispute.lead, ruling), (0.25, Ruling::Network));
    }

    #[test]
    fn who_leads_is_decided_by_the_mean_over_frames() {
        let (strong, weak) = (says(0.9, 0.0), says(0.1, 0.0));
        let (dispute, ruling) = Dispute::default().judge([strong, weak], &PARAMS);
        assert_eq!(ruling, Ruling::Filters);
        // One frame does not turn it: the mean is -0.4, then -0.05, then 0.35.
        let (dispute, ruling) = dispute.judge([weak, says(0.4, 0.0)], &PARAMS);
        assert_eq!(ruling, Ruling::Filters, "{dispute:?}");
        let (_, ruling) = dispute.judge([weak, says(0.8, 0.1)], &PARAMS);
        assert_eq!(ruling, Ruling::NetworkWin);
    }

    #[test]
    fn while_both_agree_the_place_is_between_them() {
        let base = [20.0, 10.0];
        let filters = Place { centre: [50.0, 40.0], scale: 1.0, stretch: 1.0, rotation: 0.2 };
        let seen = Place { centre: [54.0, 38.0], scale: 1.1, ..filters };
        let sight = Sight { place: seen, size: [40.0, 10.0], rate: 0.4, odds: 1.0 };
        let place = merged(filters, (sight, 0.9), base, &PARAMS);
        // Half of the way to the centre; the size goes 0.5 * 0.4 of its way.
        assert_eq!((place.centre, place.rotation), ([52.0, 39.0], 0.2));
        let [w, h] = place.size(base);
        assert!((w - 24.0).abs() < 1e-12 && (h - 10.0).abs() < 1e-12, "{w} {h}");
        // The memory does not know the target: the network's centre counts more, if it does.
        for (certainty, odds, x) in [
            (0.4, 2.0, 54.0),
            (0.65, 2.0, 53.0),
            (0.4, 1.0, 53.0),
            (0.65, 1.0, 52.5),
            (0.0, 0.0, 52.0),
            (1.2, 9.0, 52.0),
        ] {
            let place = merged(filters, (Sight { odds, ..sight }, certainty), base, &PARAMS);
            assert!((place.centre[0] - x).abs() < 1e-12, "{certainty} {odds}: {:?}", place.centre);
        }
    }
}
