//! A tracker of any method.

use super::{FrameView, Observer, SavedTarget};
use crate::Error;
use crate::estimate::Estimate;
use crate::network::Network;
use crate::network_error::NetworkError;
use crate::target_tracker::{Input, Scratch, Start, TargetTracker};
use crate::vision::frame::Frame;
use crate::vision::geometry::BoundingBox;
use std::fmt::Debug;

/// A [`TargetTracker`] of a type that is known only when the program runs.
pub(crate) trait DynTracker: Debug + Send + Sync {
    /// As [`TargetTracker::update`].
    ///
    /// # Errors
    /// As there.
    fn update(
        &mut self,
        input: Input<'_>,
        scratch: &mut Scratch,
        observer: Option<&mut dyn Observer>,
        estimate: &mut Estimate,
    ) -> Result<(), NetworkError>;

    /// As [`TargetTracker::log_odds_at`].
    ///
    /// # Errors
    /// As there.
    fn log_odds_at(
        &self,
        frame: &Frame<'_>,
        bbox: BoundingBox,
        scratch: &mut Scratch,
    ) -> Result<Option<f64>, NetworkError>;

    /// The target as a snapshot holds it.
    fn saved(&self) -> SavedTarget;
}

impl<T: TargetTracker> DynTracker for T
where
    SavedTarget: From<T::Snapshot>,
    for<'a> FrameView<'a>: From<T::View<'a>>,
{
    fn update(
        &mut self,
        input: Input<'_>,
        scratch: &mut Scratch,
        observer: Option<&mut dyn Observer>,
        estimate: &mut Estimate,
    ) -> Result<(), NetworkError> {
        let scratch = scratch.of();
        let Some(observer) = observer else {
            return TargetTracker::update(self, input, scratch, None, estimate);
        };
        let mut show = |view: T::View<'_>| observer.observe(&view.into());
        TargetTracker::update(self, input, scratch, Some(&mut show), estimate)
    }

    fn log_odds_at(
        &self,
        frame: &Frame<'_>,
        bbox: BoundingBox,
        scratch: &mut Scratch,
    ) -> Result<Option<f64>, NetworkError> {
        TargetTracker::log_odds_at(self, frame, bbox, scratch.of())
    }

    fn saved(&self) -> SavedTarget {
        TargetTracker::saved(self).into()
    }
}

/// As [`TargetTracker::begin`].
pub(super) fn begin<T: DynTracker + TargetTracker>(
    start: Start<'_>,
    config: &T::Config,
    scratch: &mut Scratch,
) -> Result<(Box<dyn DynTracker>, Estimate), Error> {
    let (target, estimate) = T::begin(start, config, scratch.of())?;
    Ok((Box::new(target), estimate))
}

/// As [`TargetTracker::restore`].
pub(super) fn restore<T: DynTracker + TargetTracker>(
    saved: T::Snapshot,
    config: &T::Config,
    network: Option<&Network>,
) -> Result<Box<dyn DynTracker>, Error> {
    Ok(Box::new(T::restore(saved, config, network)?))
}
