//! One estimate of two: if the boxes of both members overlap, both are believed, and their boxes are
//! averaged; otherwise the one with more evidence is.

use crate::estimate::{Estimate, Status};
use crate::robust::RobustConfig;
use crate::vision::geometry::BoundingBox;
use std::ops::Range;

/// Scores count as at least this far from 0 and 1: a logarithm of odds is then at most 9.2.
const LEAST_ODDS: f64 = 1e-4;

/// How much more the box of one member counts than that of another: its exponent is this times the
/// difference of their log odds.
const SHARE: f64 = 0.2;

/// From this score on, the target is tracked where the members' boxes only touch, and whatever is
/// visible: a target that both find, and that the patch model knows little of, looks different
/// more often than it is hidden. Where boxes lie apart, one of them may follow another target of the
/// same looks.
const SURE: f64 = 0.9;

/// What the log odds of a member are worth.
#[derive(Debug, PartialEq)]
pub(crate) struct Weights {
    /// The evidence for a place that it follows to, apart from its log odds.
    bias: f64,
    /// The evidence for a place, for each unit of log odds within `evidence_range`.
    evidence: f64,
    /// The range to which log odds are limited as evidence.
    evidence_range: [f64; 2],
    /// The part of its log odds in those of a box that the other agrees with.
    agreed: f64,
    /// The part of its log odds in those of a box that the other does not agree with.
    alone: f64,
    /// The range to which log odds are limited in the score.
    range: [f64; 2],
    /// The factor of the weight of its box in the mean.
    box_weight: f64,
}

/// What a committee of the default tracker and a network does with what they say: fitted to the
/// development targets by `benchmarks/committee.py`.
#[derive(Debug, PartialEq)]
pub(crate) struct CommitteeFit {
    /// The weights of the default tracker.
    pub filters: Weights,
    /// The weights of the network.
    pub network: Weights,
    /// The log odds of a box that both agree on, apart from what they say, and for each unit of overlap.
    agreement: [f64; 2],
    /// The log odds of a box that the other member does not agree with, apart from what its own says.
    alone: f64,
}

/// With NanoTrack v3, and what was not fitted itself.
const NANOTRACK: CommitteeFit = CommitteeFit {
    filters: Weights {
        bias: 0.0,
        evidence: 0.39,
        evidence_range: [-10.0, 10.0],
        agreed: 0.27,
        alone: 0.65,
        range: [-3.0, 5.0],
        box_weight: 1.0,
    },
    network: Weights {
        bias: 0.33,
        evidence: 0.715,
        evidence_range: [-3.0, 2.0],
        agreed: 0.27,
        alone: 0.48,
        range: [-4.0, 5.0],
        box_weight: 1.0,
    },
    agreement: [0.73, 1.84],
    alone: -0.26,
};

/// With PatchNet. Only the score was fitted: a choice of places of its own gained nothing, so the
/// evidence is that of NanoTrack, in units of PatchNet's log odds. These are higher for boxes that are
/// less exact, which `box_weight` makes up for.
const PATCHNET: CommitteeFit = CommitteeFit {
    filters: Weights { agreed: 0.62, alone: 1.23, ..NANOTRACK.filters },
    network: Weights {
        evidence: 0.79,
        evidence_range: [-0.5, 4.0],
        agreed: 0.4,
        alone: 0.89,
        box_weight: 0.64,
        ..NANOTRACK.network
    },
    agreement: [-2.15, 6.0],
    alone: -0.76,
};

impl CommitteeFit {
    /// The fit of a network, by its name.
    pub fn of(network: &str) -> &'static Self {
        match network {
            "PatchNet" => &PATCHNET,
            _ => &NANOTRACK,
        }
    }
}

/// What is said of the place to which a member follows the target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Vote {
    bbox: BoundingBox,
    /// The logarithm of the odds that the member gives it.
    log_odds: f64,
    /// How much speaks for it, in the judgement of both members.
    evidence: f64,
    /// The log odds that the other member gives it.
    pub judgement: Option<f64>,
    weights: &'static Weights,
}

/// What both members say together.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Consensus {
    pub bbox: BoundingBox,
    /// The probability that the box overlaps the target by at least half.
    pub score: f64,
    /// The member that is believed and has the largest log odds.
    pub leader: usize,
    /// The numbers of the members that are believed.
    pub group: Range<usize>,
    /// Whether a member's box does not even touch the one that is believed.
    contested: bool,
}

impl Vote {
    /// What a member says of its own place.
    pub fn own(estimate: &Estimate, weights: &'static Weights) -> Self {
        let score = estimate.score.clamp(LEAST_ODDS, 1.0 - LEAST_ODDS);
        let log_odds = (score / (1.0 - score)).ln();
        let evidence = weights.bias + weights.evidence_of(log_odds);
        Self { bbox: estimate.bbox, log_odds, evidence, judgement: None, weights }
    }

    /// Adds the log odds that the other member gives the place.
    pub fn add_judgement(&mut self, log_odds: f64, weights: &Weights) {
        self.evidence += weights.evidence_of(log_odds);
        self.judgement = Some(log_odds);
    }
}

impl Weights {
    fn evidence_of(&self, log_odds: f64) -> f64 {
        let [least, most] = self.evidence_range;
        self.evidence * log_odds.clamp(least, most)
    }
}

impl Consensus {
    /// What both members say together. They agree if their boxes overlap by more than
    /// `agree_overlap`.
    pub fn of(votes: &[Vote; 2], agree_overlap: f64, fit: &CommitteeFit) -> Self {
        let overlap = votes[0].bbox.overlap(&votes[1].bbox);
        let group = if overlap > agree_overlap {
            0..2
        } else if votes[1].evidence > votes[0].evidence {
            1..2
        } else {
            0..1
        };
        let believed = &votes[group.clone()];
        let by_odds = |&a: &usize, &b: &usize| votes[a].log_odds.total_cmp(&votes[b].log_odds);
        let leader = group.clone().max_by(by_odds).unwrap_or(group.start);
        let first = &votes[leader];
        let sum = if let [only] = believed {
            fit.alone + only.weights.alone * only.in_range()
        } else {
            let [agreement, each] = fit.agreement;
            let said = believed.iter().map(|member| member.weights.agreed * member.in_range());
            let sum = agreement + each * overlap + said.sum::<f64>();
            // What no member finds is not there, however close together they look for it.
            if first.log_odds < 0.0 { sum.min(first.log_odds) } else { sum }
        };
        let bbox = mean_box(believed);
        let contested = votes.iter().any(|vote| vote.bbox.overlap(&bbox) == 0.0);
        Self { bbox, score: 1.0 / (1.0 + (-sum).exp()), leader, group, contested }
    }

    /// Whether the members agree on the place.
    pub fn agrees(&self) -> bool {
        self.group.len() > 1
    }

    /// The status: a target is tracked while members agree and enough of it is known to be visible,
    /// or while the score is high and no member is elsewhere.
    pub fn status(&self, visible: Option<f64>, config: &RobustConfig) -> Status {
        let is_sure = self.score >= SURE && !self.contested;
        let is_known =
            self.agrees() && visible.is_some_and(|share| share >= config.visible_tracked);
        match self.score {
            score if score < config.score_lost => Status::Lost,
            score if score < config.score_tracked => Status::Uncertain,
            _ if is_sure || is_known => Status::Tracked,
            _ => Status::Uncertain,
        }
    }
}

/// Whether it is known which parts of the target are visible: those of a lost target are not, and
/// those of a tracked one only if enough are.
pub(super) fn knows_visibility(status: Status, visible: f64, config: &RobustConfig) -> bool {
    match status {
        Status::Tracked => visible >= config.visible_tracked,
        Status::Uncertain => true,
        Status::Lost => false,
    }
}

impl Vote {
    fn in_range(&self) -> f64 {
        let [least, most] = self.weights.range;
        self.log_odds.clamp(least, most)
    }
}

/// The mean of boxes, weighed by the log odds of their members: of the centres, and of the
/// logarithms of the sizes.
fn mean_box(members: &[Vote]) -> BoundingBox {
    let (mut centre, mut size, mut sum) = ([0.0; 2], [0.0; 2], 0.0);
    for Vote { bbox, log_odds, weights: Weights { box_weight, .. }, .. } in members {
        let weight = box_weight * (SHARE * log_odds).exp();
        let (at, sides) = (bbox.centre(), [bbox.w, bbox.h]);
        for axis in 0..2 {
            centre[axis] += weight * at[axis];
            size[axis] += weight * sides[axis].ln();
        }
        sum += weight;
    }
    let [w, h] = size.map(|logarithm| (logarithm / sum).exp());
    BoundingBox::around(centre.map(|at| at / sum), w, h)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILTERS: Weights = NANOTRACK.filters;
    const NETWORK: Weights = NANOTRACK.network;

    const HERE: BoundingBox = BoundingBox { x: 10.0, y: 20.0, w: 40.0, h: 20.0 };
    const NEAR: BoundingBox = BoundingBox { x: 14.0, ..HERE };
    const TOUCHING: BoundingBox = BoundingBox { x: 40.0, ..HERE };
    const AWAY: BoundingBox = BoundingBox { x: 90.0, ..HERE };

    /// What a member says that gives its box these log odds.
    fn says(bbox: BoundingBox, log_odds: f64, weights: &'static Weights) -> Vote {
        let estimate = Estimate { bbox, score: logistic(log_odds), ..Estimate::empty() };
        Vote::own(&estimate, weights)
    }

    fn logistic(sum: f64) -> f64 {
        1.0 / (1.0 + (-sum).exp())
    }

    fn consensus(votes: &[Vote; 2]) -> Consensus {
        Consensus::of(votes, 0.4, &NANOTRACK)
    }

    fn config() -> RobustConfig {
        RobustConfig {
            score_tracked: 0.7,
            visible_tracked: 0.5,
            score_lost: 0.5,
            ..Default::default()
        }
    }

    #[test]
    fn those_that_agree_or_the_one_with_more_evidence_are_believed() {
        // Boxes and log odds of filters and network, what the network gives the filters' box, and
        // who is believed.
        for (filters, network, judged, expected) in [
            // They agree.
            ((HERE, 2.0), (NEAR, 2.0), None, 0..2),
            ((HERE, -2.0), (NEAR, -2.0), None, 0..2),
            // They do not.
            ((HERE, 2.0), (AWAY, 2.0), Some(-3.0), 1..2),
            ((HERE, 2.0), (AWAY, 2.0), Some(2.0), 0..1),
            ((HERE, 2.0), (AWAY, -1.0), Some(-1.0), 0..1),
            ((HERE, -1.0), (AWAY, -1.0), Some(-1.0), 1..2),
            // A network is never surer than its range says.
            ((HERE, 2.0), (AWAY, 9.0), Some(2.0), 0..1),
        ] {
            let mut votes =
                [says(filters.0, filters.1, &FILTERS), says(network.0, network.1, &NETWORK)];
            if let Some(judged) = judged {
                votes[0].add_judgement(judged, &NETWORK);
            }
            let consensus = consensus(&votes);
            assert_eq!(consensus.group, expected, "{filters:?} {network:?} {judged:?}");
            assert_eq!(consensus.agrees(), expected.len() > 1);
        }
    }

    #[test]
    fn the_score_counts_log_odds_and_overlap() {
        let overlap = HERE.overlap(&NEAR);
        for (boxes, odds, sum) in [
            ([HERE, HERE], [2.0, 3.0], 0.73 + 1.84 + 0.27 * 5.0),
            ([HERE, NEAR], [2.0, 3.0], 0.73 + 1.84 * overlap + 0.27 * 5.0),
            ([HERE, NEAR], [-9.0, 9.0], 0.73 + 1.84 * overlap + 0.27 * (5.0 - 3.0)),
            ([HERE, HERE], [-1.0, -2.0], -1.0),
            ([HERE, AWAY], [-3.0, 3.0], 0.48 * 3.0 - 0.26),
            ([HERE, AWAY], [2.0, -4.0], 0.65 * 2.0 - 0.26),
        ] {
            let votes = [says(boxes[0], odds[0], &FILTERS), says(boxes[1], odds[1], &NETWORK)];
            let Consensus { score, .. } = consensus(&votes);
            assert!((score - logistic(sum)).abs() < 1e-9, "{boxes:?} {odds:?}: {score}");
        }
    }

    #[test]
    fn boxes_that_agree_are_averaged_by_belief() {
        let large = BoundingBox::around(HERE.centre(), 60.0, 30.0);
        let equal = [says(HERE, 1.0, &FILTERS), says(large, 1.0, &NETWORK)];
        let BoundingBox { x, y, w, h } = consensus(&equal).bbox;
        // The mean of sizes on a logarithmic scale, around the same centre.
        let expected = BoundingBox::around(HERE.centre(), 2400f64.sqrt(), 600f64.sqrt());
        for (value, expected) in
            [(x, expected.x), (y, expected.y), (w, expected.w), (h, expected.h)]
        {
            assert!((value - expected).abs() < 1e-9, "{value} {expected}");
        }
        // e^(0.2 * 5) times as much as the other one.
        let surer = [says(HERE, 4.0, &FILTERS), says(NEAR, -1.0, &NETWORK)];
        let x = 10.0 + 4.0 / (1.0 + std::f64::consts::E);
        assert!((consensus(&surer).bbox.x - x).abs() < 1e-9);
        // Half of the weight of the other.
        const HALF: Weights = Weights { box_weight: 0.5, ..NETWORK };
        let half = [says(HERE, 1.0, &FILTERS), says(NEAR, 1.0, &HALF)];
        let x = 10.0 + 4.0 / 3.0;
        assert!((consensus(&half).bbox.x - x).abs() < 1e-9);
    }

    #[test]
    fn the_status_follows_from_score_agreement_and_visibility() {
        use Status::{Lost, Tracked, Uncertain};
        for (score, other, visible, status) in [
            (0.7, HERE, Some(0.5), Tracked),
            (0.89, TOUCHING, Some(0.5), Uncertain),
            (0.9, TOUCHING, Some(0.5), Tracked),
            (0.9, AWAY, Some(0.5), Uncertain),
            (0.89, HERE, None, Uncertain),
            (0.9, HERE, None, Tracked),
            (0.9, TOUCHING, None, Tracked),
            (0.9, AWAY, None, Uncertain),
            (0.9, TOUCHING, Some(0.0), Tracked),
            (0.89, HERE, Some(0.49), Uncertain),
            (0.9, AWAY, Some(0.49), Uncertain),
            (0.69, HERE, Some(1.0), Uncertain),
            (0.5, AWAY, None, Uncertain),
            (0.49, HERE, Some(1.0), Lost),
        ] {
            let votes = [says(HERE, 5.0, &FILTERS), says(other, -5.0, &NETWORK)];
            let consensus = Consensus { score, ..consensus(&votes) };
            let found = consensus.status(visible, &config());
            assert_eq!(found, status, "{score} {other:?} {visible:?}");
        }
    }

    #[test]
    fn a_tracked_target_is_never_mostly_hidden() {
        use Status::{Lost, Tracked, Uncertain};
        for (status, visible, known) in [
            (Tracked, 0.5, true),
            (Tracked, 0.49, false),
            (Uncertain, 0.49, true),
            (Lost, 1.0, false),
        ] {
            let knows = knows_visibility(status, visible, &config());
            assert_eq!(knows, known, "{status:?} {visible}");
        }
    }

    #[test]
    fn scores_of_0_and_1_are_odds_that_can_be_computed_with() {
        for (score, log_odds) in [(0.0, -9.2), (1.0, 9.2), (0.5, 0.0)] {
            let estimate = Estimate { bbox: HERE, score, ..Estimate::empty() };
            let vote = Vote::own(&estimate, &FILTERS);
            assert!((vote.log_odds - log_odds).abs() < 0.02, "{score}");
        }
    }
}
