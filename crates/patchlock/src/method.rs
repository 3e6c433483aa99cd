//! The methods of tracking: a closed set. Everything that a tracker needs of its method is here, so that a
//! further method is a further variant.

use crate::config::{Method, TrackerConfig};
use crate::estimate::Estimate;
use crate::observe::{FrameView, Observer, PatchwiseView, RobustView};
use crate::vision::frame::{Frame, GreyImage};
use crate::vision::geometry::BoundingBox;
use crate::{Error, error};
use crate::{paper, robust};
use serde::{Deserialize, Serialize};

/// One target, under the method that follows it.
#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "all targets of a tracker have the same method")]
pub(crate) enum Target {
    Patchwise(paper::Target),
    Robust(robust::Target),
}

/// A target between two frames, as a snapshot holds it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[expect(clippy::large_enum_variant, reason = "all targets of a tracker have the same method")]
pub(crate) enum SavedTarget {
    Patchwise(paper::Saved),
    Robust(robust::Saved),
}

/// The current frame as the method wants it: made once per frame, shared by all targets.
#[derive(Debug, Default)]
pub(crate) struct Images {
    grey: GreyImage,
}

/// Buffers of one thread for the targets of any method. Those of methods that are not used stay empty.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    patchwise: paper::Scratch,
    robust: robust::Scratch,
}

impl Images {
    /// Converts a frame to what the method works on.
    pub fn fill(&mut self, frame: &Frame<'_>, method: Method) -> Result<(), Error> {
        match method {
            Method::Patchwise => self.grey.fill(frame),
            Method::Robust => frame.check_samples(),
        }
    }
}

impl Target {
    /// Begins on the target in this box of the frame.
    pub fn begin(
        (frame, images): (&Frame<'_>, &Images),
        bbox: BoundingBox,
        config: &TrackerConfig,
        scratch: &mut Scratch,
    ) -> (Self, Estimate) {
        match config.method {
            Method::Patchwise => {
                let settings = (config.seed, &config.patchwise);
                let scratch = &mut scratch.patchwise;
                let (target, estimate) =
                    paper::Target::begin(&images.grey, bbox, settings, scratch);
                (Self::Patchwise(target), estimate)
            }
            Method::Robust => {
                let scratch = &mut scratch.robust;
                let (target, estimate) = robust::Target::begin(frame, bbox, config, scratch);
                (Self::Robust(target), estimate)
            }
        }
    }

    /// Finds the target in the next frame, of the same size, and learns from it.
    pub fn step(
        &mut self,
        (frame, images): (&Frame<'_>, &Images),
        config: &TrackerConfig,
        scratch: &mut Scratch,
        observer: Option<&mut dyn Observer>,
        estimate: &mut Estimate,
    ) {
        match self {
            Self::Patchwise(target) => {
                let (settings, scratch) = (&config.patchwise, &mut scratch.patchwise);
                let Some(observer) = observer else {
                    return target.step(&images.grey, settings, scratch, None, estimate);
                };
                let mut show =
                    |view: PatchwiseView<'_>| observer.observe(&FrameView::Patchwise(view));
                target.step(&images.grey, settings, scratch, Some(&mut show), estimate);
            }
            Self::Robust(target) => {
                let scratch = &mut scratch.robust;
                let Some(observer) = observer else {
                    return target.step(frame, scratch, None, estimate);
                };
                let mut show = |view: RobustView<'_>| observer.observe(&FrameView::Robust(view));
                target.step(frame, scratch, Some(&mut show), estimate);
            }
        }
    }

    /// The target as a snapshot holds it.
    pub fn saved(&self) -> SavedTarget {
        match self {
            Self::Patchwise(target) => SavedTarget::Patchwise(target.saved()),
            Self::Robust(target) => SavedTarget::Robust(target.saved()),
        }
    }

    /// A target that continues from a saved one.
    pub fn restore(saved: SavedTarget, config: &TrackerConfig) -> Result<Self, Error> {
        match (config.method, saved) {
            (Method::Patchwise, SavedTarget::Patchwise(saved)) => {
                paper::Target::restore(saved, &config.patchwise)
                    .map(Self::Patchwise)
                    .map_err(error::snapshot)
            }
            (Method::Robust, SavedTarget::Robust(saved)) => {
                let target = robust::Target::restore(saved, config);
                target.map(Self::Robust).map_err(error::snapshot)
            }
            (method, _) => Err(error::snapshot(format!(
                "its target has another method than its configuration, which says {method:?}"
            ))),
        }
    }
}
