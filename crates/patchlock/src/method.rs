//! The methods of tracking: a closed set. Everything that a tracker needs of its method is here, so
//! that a further method is a further variant.

use crate::config::{Method, TrackerConfig};
use crate::estimate::Estimate;
use crate::network_error::NetworkError;
use crate::network_loop as network;
use crate::observe::{FrameView, NetworkView, Observer, PaperView, RobustView};
use crate::vision::frame::{Frame, GreyImage};
use crate::vision::geometry::BoundingBox;
use crate::{Error, error};
use crate::{paper, robust};
use serde::{Deserialize, Serialize};

/// One target, under the method that follows it.
#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "all targets of a tracker have the same method")]
pub(crate) enum Target {
    Paper(paper::PaperTarget),
    Robust(robust::RobustTarget),
    Network(network::NetworkTarget),
}

/// A target between two frames, as a snapshot holds it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[expect(clippy::large_enum_variant, reason = "all targets of a tracker have the same method")]
pub(crate) enum SavedTarget {
    Paper(paper::SavedPaper),
    Robust(robust::SavedRobust),
    Network(network::SavedNetwork),
}

/// The current frame as the method wants it: made once per frame, shared by all targets.
#[derive(Debug, Default)]
pub(crate) struct Images {
    grey: GreyImage,
}

/// Buffers of one thread for the targets of any method. Those of methods that are not used stay
/// empty.
#[derive(Debug, Default)]
pub(crate) struct MethodScratch {
    paper: paper::PaperScratch,
    robust: robust::RobustScratch,
    network: network::NetworkScratch,
}

impl Images {
    /// Converts a frame to what the method works on.
    pub fn fill(&mut self, frame: &Frame<'_>, method: &Method) -> Result<(), Error> {
        match method {
            Method::Paper(_) => self.grey.fill(frame),
            Method::Robust(_) | Method::Network(_) => frame.check_samples(),
        }
    }
}

impl Target {
    /// Begins on the target in this box of the frame.
    ///
    /// # Errors
    /// [`Error::Network`] if a network is missing or fails; [`Error::BoxTooSmall`].
    pub fn begin(
        (frame, images): (&Frame<'_>, &Images),
        bbox: BoundingBox,
        config: &TrackerConfig,
        scratch: &mut MethodScratch,
    ) -> Result<(Self, Estimate), Error> {
        match &config.method {
            Method::Paper(settings) => {
                paper::check_box(bbox)?;
                let (settings, scratch) = ((config.seed, settings), &mut scratch.paper);
                let (target, estimate) =
                    paper::PaperTarget::begin(&images.grey, bbox, settings, scratch);
                Ok((Self::Paper(target), estimate))
            }
            Method::Robust(settings) => {
                let (settings, scratch) = ((config.seed, settings), &mut scratch.robust);
                let (target, estimate) = robust::RobustTarget::begin(
                    frame,
                    bbox,
                    settings,
                    config.network.as_ref(),
                    scratch,
                )?;
                Ok((Self::Robust(target), estimate))
            }
            Method::Network(_) => {
                let network = config.network.as_ref().ok_or(NetworkError::None)?;
                let (target, estimate) =
                    network::NetworkTarget::begin(network, frame, bbox, &mut scratch.network)?;
                Ok((Self::Network(target), estimate))
            }
        }
    }

    /// Finds the target in the next frame, of the same size, and learns from it.
    ///
    /// # Errors
    /// [`Error::Network`] if a network fails; then nothing has changed.
    pub fn step(
        &mut self,
        (frame, images): (&Frame<'_>, &Images),
        method: &Method,
        scratch: &mut MethodScratch,
        observer: Option<&mut dyn Observer>,
        estimate: &mut Estimate,
    ) -> Result<(), Error> {
        match (self, method) {
            (Self::Paper(target), Method::Paper(settings)) => {
                let scratch = &mut scratch.paper;
                let Some(observer) = observer else {
                    target.step(&images.grey, settings, scratch, None, estimate);
                    return Ok(());
                };
                let mut show = |view: PaperView<'_>| observer.observe(&FrameView::Paper(view));
                target.step(&images.grey, settings, scratch, Some(&mut show), estimate);
            }
            (Self::Robust(target), Method::Robust(_)) => {
                let scratch = &mut scratch.robust;
                let Some(observer) = observer else {
                    return Ok(target.step(frame, scratch, None, estimate)?);
                };
                let mut show = |view: RobustView<'_>| observer.observe(&FrameView::Robust(view));
                target.step(frame, scratch, Some(&mut show), estimate)?;
            }
            (Self::Network(target), Method::Network(settings)) => {
                let scratch = &mut scratch.network;
                let Some(observer) = observer else {
                    return Ok(target.step(frame, settings, scratch, None, estimate)?);
                };
                let mut show = |view: NetworkView<'_>| observer.observe(&FrameView::Network(view));
                target.step(frame, settings, scratch, Some(&mut show), estimate)?;
            }
            // `begin` and `restore` make targets of the configuration's method only.
            (Self::Paper(_) | Self::Robust(_) | Self::Network(_), _) => {}
        }
        Ok(())
    }

    /// The target as a snapshot holds it.
    pub fn saved(&self) -> SavedTarget {
        match self {
            Self::Paper(target) => SavedTarget::Paper(target.saved()),
            Self::Robust(target) => SavedTarget::Robust(target.saved()),
            Self::Network(target) => SavedTarget::Network(target.saved()),
        }
    }

    /// A target that continues from a saved one.
    pub fn restore(saved: SavedTarget, config: &TrackerConfig) -> Result<Self, Error> {
        match (&config.method, saved) {
            (Method::Paper(settings), SavedTarget::Paper(saved)) => {
                paper::PaperTarget::restore(saved, settings)
                    .map(Self::Paper)
                    .map_err(error::snapshot)
            }
            (Method::Robust(settings), SavedTarget::Robust(saved)) => {
                robust::RobustTarget::restore(saved, settings, config.network.as_ref())
                    .map(Self::Robust)
            }
            (Method::Network(_), SavedTarget::Network(saved)) => {
                network::NetworkTarget::restore(saved, config.network.as_ref()).map(Self::Network)
            }
            (method, _) => Err(error::snapshot(format!(
                "its target has another method than its configuration, which says {}",
                method.name()
            ))),
        }
    }
}
