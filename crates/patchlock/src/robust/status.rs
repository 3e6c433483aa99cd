//! From what memory and patch model say of a place to a phase, a status and a score.

use super::place::Place;
use super::{Scratch, Target};
use crate::config::RobustConfig;
use crate::estimate::{Estimate, Status};
use crate::vision::frame::Frame;
use crate::vision::geometry::BoundingBox;
use serde::{Deserialize, Serialize};

/// Rate of the running mean of how sure the memory was.
const RECENT_RATE: f64 = 0.05;

/// Upper limit of the response elsewhere, relative to that at the place.
const MOST_ELSEWHERE: f64 = 2.0;

/// The score of a box that is as likely to be on the target as not: the least of a tracked target, and the
/// most of a lost one.
const EVEN_SCORE: f64 = 0.5;

/// What memory and patch model say of a place.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Evidence {
    /// How sure the memory is: its response, relative to its mean over sure frames.
    pub certainty: f64,
    /// The memory's strongest response outside half the target's size around the place, relative to that at
    /// the place, from 0 to 2.
    pub elsewhere: f64,
    /// The visible share of the target; 0 where that is not known.
    pub visible: f64,
}

impl Evidence {
    /// The probability that the box overlaps the target by at least half: a logistic function, fitted by
    /// `benchmarks/calibrate.py`.
    pub fn score(&self, config: &RobustConfig) -> f64 {
        let sum = config.score_bias
            + config.score_visible * self.visible
            + config.score_elsewhere * self.elsewhere;
        1.0 / (1.0 + (-sum).exp())
    }
}

/// What the tracker is doing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Phase {
    /// It follows the target; for this many frames on end the memory has not known the place.
    Following { doubtful: u32 },
    /// It has lost the target and searches; `next` is the number of the next window of the search.
    Lost { next: u64 },
    /// It follows what it found while lost, for this many more frames until that is believed; otherwise it
    /// goes back.
    Trial { left: u32, back: Place },
}

impl Target {
    /// What the memory says of the place at hand, of which nothing is known to be visible.
    pub fn ask_memory(&self, frame: &Frame<'_>, scratch: &mut Scratch) -> Evidence {
        let Self { window, follower, .. } = self;
        window.sample(frame, self.place, scratch);
        let certainty = follower.certainty(window, scratch);
        let here = certainty * follower.mean;
        let away =
            scratch.memory.beyond(window.features().fourier(), window.cells().map(|s| s / 2.0));
        let elsewhere = if away <= 0.0 { 0.0 } else { MOST_ELSEWHERE.min(away / here.max(0.0)) };
        Evidence { certainty, elsewhere, visible: 0.0 }
    }

    /// Whether the memory is so sure of a place that it can learn from it. Appearance that changes slowly
    /// makes it less sure; it then learns the change, but not what covers the target slowly.
    pub fn is_sure(&self, evidence: &Evidence, config: &RobustConfig) -> bool {
        evidence.certainty > config.sure * self.recent.min(1.0)
            && !self.is_covered(evidence, config)
    }

    /// Whether next to nothing of the target is visible.
    pub fn is_covered(&self, evidence: &Evidence, config: &RobustConfig) -> bool {
        evidence.visible < config.covered_share * self.seen
    }

    /// Whether something that the patch model half recognises may cover the target: little of it is visible,
    /// the memory responds elsewhere as well, and its colours stand out less from those around it, as where
    /// what covers it is larger. Similar things nearby do the first two, but not the third.
    fn may_be_covered(&self, evidence: &Evidence, config: &RobustConfig) -> bool {
        evidence.visible < config.covered_visible * self.seen
            && evidence.elsewhere > config.covered_elsewhere
            && f64::from(self.colours.contrast()) < config.covered_contrast * self.contrast
    }

    /// The next phase, by how sure the memory is of the place at hand.
    pub fn advance(&mut self, evidence: &Evidence, config: &RobustConfig) {
        let Evidence { certainty, visible, .. } = *evidence;
        // Appearance that changes slowly makes the memory less sure, too, but never suddenly.
        let sudden = certainty < config.lost_drop * self.recent;
        let hidden = visible < config.lost_hidden * self.seen;
        let strange = certainty < config.lost_below && (sudden || hidden);
        // What covers the target slowly may look more like it than what comes suddenly.
        let covered = self.is_covered(evidence, config) && evidence.score(config) < EVEN_SCORE
            || self.may_be_covered(evidence, config);
        let covered = covered && certainty < config.covered_below;
        let unknown = strange || covered;
        let most = if strange { config.lost_after } else { config.covered_after };
        if self.is_sure(evidence, config) {
            self.seen += RECENT_RATE * (visible - self.seen);
            self.contrast += RECENT_RATE * (f64::from(self.colours.contrast()) - self.contrast);
        }
        if !unknown {
            self.recent += RECENT_RATE * (certainty - self.recent);
        }
        self.phase = match self.phase {
            Phase::Following { doubtful } if unknown => {
                let doubtful = doubtful + 1;
                if doubtful < most as u32 {
                    Phase::Following { doubtful }
                } else {
                    Phase::Lost { next: 0 }
                }
            }
            Phase::Following { .. } => Phase::Following { doubtful: 0 },
            Phase::Trial { back, .. } if unknown => {
                self.place = back;
                Phase::Lost { next: 0 }
            }
            Phase::Trial { left, back } if left > 1 => Phase::Trial { left: left - 1, back },
            Phase::Trial { .. } => Phase::Following { doubtful: 0 },
            lost @ Phase::Lost { .. } => lost,
        };
    }

    /// Box, outline, score and status.
    pub fn finish_estimate(&self, evidence: &Evidence, config: &RobustConfig, out: &mut Estimate) {
        let [w, h] = self.place.size(self.window.base());
        out.bbox = BoundingBox::around(self.place.centre, w, h);
        out.corners = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]].map(|[dx, dy]| {
            let mut corner = self.place;
            corner.shift([dx * (w - 1.0), dy * (h - 1.0)]);
            corner.centre
        });
        out.score = evidence.score(config);
        out.status = match self.phase {
            Phase::Lost { .. } => Status::Lost,
            Phase::Following { .. } if out.score >= EVEN_SCORE => Status::Tracked,
            _ => Status::Uncertain,
        };
        if out.status == Status::Lost {
            out.score = out.score.min(EVEN_SCORE);
            out.visibility = None;
        }
    }
}
