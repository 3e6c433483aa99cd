//! The tracker that a configuration asks for: that of its method, or a committee.

use crate::committee::{Committee, CommitteeFit, Member};
use crate::estimate::Estimate;
use crate::methods::{DynTracker, Method, SavedTarget, TrackerConfig};
use crate::network_loop::{NetworkConfig, NetworkTarget};
use crate::robust::{RobustConfig, RobustTarget};
use crate::target_tracker::{Input, Scratch, Start, TargetTracker};
use crate::vision::frame::{Frame, GreyImage};
use crate::vision::geometry::BoundingBox;
use crate::{Error, error};

/// The forms of the current frame: made once for all targets.
#[derive(Debug, Default)]
pub(crate) struct Images {
    grey: GreyImage,
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
) -> Result<(Box<dyn DynTracker>, Estimate), Error> {
    let TrackerConfig { seed, method, network } = config;
    let start = Start { input, bbox, seed: *seed, network: network.as_ref() };
    match method {
        Method::Robust(settings) if network.is_some() => {
            let (filters, estimate) = RobustTarget::begin(start, settings, scratch.of())?;
            let plain = (&NetworkConfig::default(), settings.network_fit);
            let (other, _) = NetworkTarget::fitted(start, plain, scratch.of())?;
            Ok((Box::new(committee(filters, other, settings)), estimate))
        }
        _ => method.begin(start, scratch),
    }
}

/// The committee of the default tracker and a network.
fn committee(filters: RobustTarget, network: NetworkTarget, settings: &RobustConfig) -> Committee {
    let fit = CommitteeFit::of(network.name());
    let filters = Member::new("filters", Box::new(filters), &fit.filters);
    let network = Member::new("network", Box::new(network), &fit.network);
    Committee::new([filters, network], settings, fit)
}

/// A target that continues from a saved one.
///
/// # Errors
/// [`Error::Snapshot`] if it does not fit the configuration or is damaged; [`Error::Network`] if its
/// network is missing or another one.
pub(crate) fn restore(
    saved: SavedTarget,
    config: &TrackerConfig,
) -> Result<Box<dyn DynTracker>, Error> {
    let network = config.network.as_ref();
    match (&config.method, saved) {
        (Method::Robust(_), SavedTarget::Robust(_)) if network.is_some() => {
            Err(error::snapshot("its target was tracked without a network"))
        }
        (Method::Robust(settings), SavedTarget::Committee(members)) => {
            let [SavedTarget::Robust(filters), SavedTarget::Network(other)] = &*members else {
                let reason = "the members of its committee are not `robust` and a network";
                return Err(error::snapshot(reason));
            };
            let filters = RobustTarget::restore(filters.clone(), settings, None);
            let plain = NetworkConfig::default();
            let other = NetworkTarget::restore(other.clone(), &plain, network)?;
            Ok(Box::new(committee(filters?, other, settings)))
        }
        (method, saved) => method.restore(saved, network),
    }
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
