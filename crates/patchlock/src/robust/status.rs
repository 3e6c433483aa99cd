//! From how sure the memory is to a phase, a status and a score.

use super::Target;
use super::place::Place;
use crate::config::RobustConfig;
use crate::estimate::{Estimate, Status};
use crate::vision::geometry::BoundingBox;
use serde::{Deserialize, Serialize};

/// Rate of the running mean of how sure the memory was.
const RECENT_RATE: f64 = 0.05;

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
    /// Whether the memory is so sure of a place that it can learn from it. Appearance that changes slowly
    /// makes it less sure; it then learns the change.
    pub fn is_sure(&self, certainty: f64, config: &RobustConfig) -> bool {
        certainty > config.sure * self.recent.min(1.0)
    }

    /// The next phase, by how sure the memory is of the place at hand.
    pub fn advance(&mut self, certainty: f64, visible: f64, config: &RobustConfig) {
        // Appearance that changes slowly makes the memory less sure, too, but never suddenly.
        let sudden = certainty < config.lost_drop * self.recent;
        let hidden = visible < config.lost_hidden * self.seen;
        let unknown = certainty < config.lost_below && (sudden || hidden);
        if self.is_sure(certainty, config) {
            self.seen += RECENT_RATE * (visible - self.seen);
        }
        if !unknown {
            self.recent += RECENT_RATE * (certainty - self.recent);
        }
        self.phase = match self.phase {
            Phase::Following { doubtful } if unknown => {
                let doubtful = doubtful + 1;
                if doubtful < config.lost_after as u32 {
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
    pub fn finish_estimate(&self, certainty: f64, config: &RobustConfig, out: &mut Estimate) {
        let [w, h] = self.place.size(self.window.base());
        out.bbox = BoundingBox::around(self.place.centre, w, h);
        out.corners = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]].map(|[dx, dy]| {
            let mut corner = self.place;
            corner.shift([dx * (w - 1.0), dy * (h - 1.0)]);
            corner.centre
        });
        out.score = score(certainty, config);
        out.status = match self.phase {
            Phase::Lost { .. } => Status::Lost,
            Phase::Following { .. } if out.score >= 0.5 => Status::Tracked,
            _ => Status::Uncertain,
        };
        if out.status == Status::Lost {
            out.visibility = None;
        }
    }
}

/// The probability that the box overlaps the target by at least half: a logistic function, fitted by
/// `benchmarks/calibrate.py`.
fn score(certainty: f64, config: &RobustConfig) -> f64 {
    let slope = config.score_slope * (certainty - config.score_even);
    1.0 / (1.0 + (-slope).exp())
}
