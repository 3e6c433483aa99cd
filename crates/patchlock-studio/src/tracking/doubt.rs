//! Which frames of a target to look at next.

use std::fmt;

use patchlock::Status;

use crate::project::{Target, Tracked};

/// A frame whose box may be wrong.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Doubt {
    /// The frame.
    pub frame: usize,
    /// The number of frames that a correction here is expected to repair.
    pub gain: f64,
    /// Why the frame is doubtful.
    pub reason: Reason,
}

/// Why a frame is doubtful. Its text is for a person to read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reason {
    /// The tracker lost the target.
    Lost,
    /// Tracked forward and backward, the boxes overlap by only this share.
    Disagreement(f64),
    /// This share of the target seems to be hidden.
    Hidden(f64),
    /// The score is this low.
    Unsure(f64),
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Lost => write!(f, "lost, or out of the frame"),
            Self::Disagreement(overlap) => {
                write!(f, "forward and backward tracks overlap by {:.0} %", 100.0 * overlap)
            }
            Self::Hidden(share) => write!(f, "hidden {:.0} %", 100.0 * share),
            Self::Unsure(score) => write!(f, "looks different: score {score:.2}"),
        }
    }
}

/// The doubtful frames of a target, one for each stretch of doubtful frames, the most useful first.
pub fn doubts(target: &Target) -> Vec<Doubt> {
    let mut found = Vec::new();
    let mut stretch: Vec<(usize, Tracked)> = Vec::new();
    for (&frame, &tracked) in &target.tracked {
        let follows = stretch.last().is_some_and(|(last, _)| last + 1 == frame);
        if !follows || risk(&tracked) < 0.5 {
            found.extend(worst(&stretch));
            stretch.clear();
        }
        if risk(&tracked) >= 0.5 {
            stretch.push((frame, tracked));
        }
    }
    found.extend(worst(&stretch));
    found.sort_by(|a, b| b.gain.total_cmp(&a.gain).then(a.frame.cmp(&b.frame)));
    found
}

/// The probability that the box of a frame is wrong.
fn risk(tracked: &Tracked) -> f64 {
    let agreement = tracked.agreement.unwrap_or(1.0);
    1.0 - tracked.score.min(agreement)
}

/// The frame of a stretch to look at: its middle.
fn worst(stretch: &[(usize, Tracked)]) -> Option<Doubt> {
    let (frame, tracked) = *stretch.get(stretch.len() / 2)?;
    let gain = stretch.iter().map(|(_, tracked)| risk(tracked)).sum();
    Some(Doubt { frame, gain, reason: reason(&tracked) })
}

fn reason(tracked: &Tracked) -> Reason {
    let agreement = tracked.agreement.unwrap_or(1.0);
    match tracked.visible {
        _ if tracked.status == Status::Lost => Reason::Lost,
        _ if agreement < tracked.score => Reason::Disagreement(agreement),
        Some(visible) if visible < 0.5 => Reason::Hidden(1.0 - visible),
        _ => Reason::Unsure(tracked.score),
    }
}
