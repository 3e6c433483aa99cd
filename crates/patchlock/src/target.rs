//! The tracker that a configuration asks for. A new one is a folder with an `impl` of
//! [`TargetTracker`], and its lines in [`begin`], [`SavedTarget`], [`saved`] and [`restore`].

use crate::committee::{Committee, CommitteeFit, Member};
use crate::config::{Method, NetworkConfig, RobustConfig, TrackerConfig};
use crate::estimate::Estimate;
use crate::network_error::NetworkError;
use crate::network_loop::{NetworkTarget, SavedNetwork};
use crate::paper::{PaperTarget, SavedPaper, check_box};
use crate::robust::{RobustTarget, SavedRobust};
use crate::target_tracker::{Input, Scratch, TargetTracker};
use crate::vision::frame::{Frame, GreyImage};
use crate::vision::geometry::BoundingBox;
use crate::{Error, error};
use serde::{Deserialize, Serialize};
use std::any::Any;

/// The forms of the current frame: made once for all targets.
#[derive(Debug, Default)]
pub(crate) struct Images {
    grey: GreyImage,
}

/// A target between two frames, as a snapshot holds it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[expect(clippy::large_enum_variant, reason = "all targets of a tracker are alike")]
pub(crate) enum SavedTarget {
    Paper(SavedPaper),
    Robust(SavedRobust),
    Network(SavedNetwork),
    Committee(Vec<SavedTarget>),
}

impl Images {
    /// Converts a frame to what the tracker of a configuration works on.
    ///
    /// # Errors
    /// [`Error::Frame`].
    pub fn fill(&mut self, frame: &Frame<'_>, method: &Method) -> Result<(), Error> {
        if method.settings().needs_grey() {
            return self.grey.fill(frame);
        }
        frame.check_samples()
    }

    /// The frame that was converted last, with its forms.
    pub fn of<'a>(&'a self, frame: &'a Frame<'a>) -> Input<'a> {
        Input { frame, grey: &self.grey }
    }
}

/// Begins on the target in this box of the frame.
///
/// # Errors
/// [`Error::Network`] if a network is missing or fails; [`Error::BoxTooSmall`].
pub(crate) fn begin(
    input: Input<'_>,
    bbox: BoundingBox,
    config: &TrackerConfig,
    scratch: &mut Scratch,
) -> Result<(Box<dyn TargetTracker>, Estimate), Error> {
    let (Input { frame, grey }, seed) = (input, config.seed);
    Ok(match (&config.method, &config.network) {
        (Method::Paper(settings), _) => {
            check_box(bbox)?;
            let (target, estimate) = PaperTarget::begin(grey, bbox, (seed, settings), scratch.of());
            (Box::new(target), estimate)
        }
        (Method::Robust(settings), network) => {
            let (target, estimate) =
                RobustTarget::begin(frame, bbox, (seed, settings), scratch.of());
            let Some(network) = network else { return Ok((Box::new(target), estimate)) };
            let plain = (NetworkConfig::default(), settings.network_fit);
            let (other, _) = NetworkTarget::begin(network, frame, bbox, plain, scratch.of())?;
            (Box::new(committee(target, other, settings)), estimate)
        }
        (Method::Network(settings), network) => {
            let network = network.as_ref().ok_or(NetworkError::None)?;
            let settings = (settings.clone(), 0.0);
            let (target, estimate) =
                NetworkTarget::begin(network, frame, bbox, settings, scratch.of())?;
            (Box::new(target), estimate)
        }
    })
}

/// The committee of the default tracker and a network.
fn committee(filters: RobustTarget, network: NetworkTarget, settings: &RobustConfig) -> Committee {
    let fit = CommitteeFit::of(network.name());
    let filters = Member::new("filters", Box::new(filters), &fit.filters);
    let network = Member::new("network", Box::new(network), &fit.network);
    Committee::new([filters, network], settings, fit)
}

/// A target as a snapshot holds it.
pub(crate) fn saved(target: &dyn TargetTracker) -> SavedTarget {
    let any: &dyn Any = target;
    if let Some(target) = any.downcast_ref::<PaperTarget>() {
        SavedTarget::Paper(target.saved())
    } else if let Some(target) = any.downcast_ref::<RobustTarget>() {
        SavedTarget::Robust(target.saved())
    } else if let Some(target) = any.downcast_ref::<NetworkTarget>() {
        SavedTarget::Network(target.saved())
    } else {
        let members = any.downcast_ref::<Committee>().map(Committee::members);
        SavedTarget::Committee(members.into_iter().flatten().map(saved).collect())
    }
}

/// A target that continues from a saved one.
///
/// # Errors
/// [`Error::Snapshot`] if it does not fit the configuration or is damaged; [`Error::Network`] if its
/// network is missing or another one.
pub(crate) fn restore(
    saved: SavedTarget,
    config: &TrackerConfig,
) -> Result<Box<dyn TargetTracker>, Error> {
    let network = config.network.as_ref();
    Ok(match (&config.method, saved) {
        (Method::Paper(settings), SavedTarget::Paper(saved)) => {
            Box::new(PaperTarget::restore(saved, settings).map_err(error::snapshot)?)
        }
        (Method::Robust(_), SavedTarget::Robust(_)) if network.is_some() => {
            return Err(error::snapshot("its target was tracked without a network"));
        }
        (Method::Robust(settings), SavedTarget::Robust(saved)) => {
            Box::new(RobustTarget::restore(saved, settings).map_err(error::snapshot)?)
        }
        (Method::Robust(settings), SavedTarget::Committee(members)) => {
            let [SavedTarget::Robust(filters), SavedTarget::Network(other)] = &*members else {
                let reason = "the members of its committee are not `robust` and a network";
                return Err(error::snapshot(reason));
            };
            let filters = RobustTarget::restore(filters.clone(), settings);
            let plain = NetworkConfig::default();
            let other = NetworkTarget::restore(other.clone(), plain, network)?;
            Box::new(committee(filters.map_err(error::snapshot)?, other, settings))
        }
        (Method::Network(settings), SavedTarget::Network(saved)) => {
            Box::new(NetworkTarget::restore(saved, settings.clone(), network)?)
        }
        (method, _) => {
            return Err(error::snapshot(format!(
                "its target has another method than its configuration, which says {}",
                method.name()
            )));
        }
    })
}

#[cfg(all(test, feature = "patchnet"))]
mod tests {
    use super::*;
    use crate::network::Network;

    #[test]
    fn our_own_network_has_a_fit_of_its_own() {
        let fit = CommitteeFit::of(Network::patchnet().name());
        assert_ne!(fit, CommitteeFit::of("NanoTrack v3"));
    }
}
