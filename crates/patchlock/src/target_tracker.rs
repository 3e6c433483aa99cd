//! The trait of all trackers of one target. A tracker is a folder of its own and knows no other.

use crate::estimate::Estimate;
use crate::network_error::NetworkError;
use crate::observe::Observer;
use crate::vision::frame::{Frame, GreyImage};
use crate::vision::geometry::BoundingBox;
use std::any::Any;
use std::fmt::Debug;

/// A tracker of one target.
pub(crate) trait TargetTracker: Any + Debug + Send + Sync {
    /// Finds the target in the next frame, of the same size, and learns from it.
    ///
    /// # Errors
    /// [`NetworkError::Runtime`] if a network fails.
    fn update(
        &mut self,
        input: Input<'_>,
        scratch: &mut Scratch,
        observer: Option<&mut dyn Observer>,
        estimate: &mut Estimate,
    ) -> Result<(), NetworkError>;

    /// The logarithm of the odds that the target is in this box of the frame. `None` if the tracker
    /// judges no boxes but its own.
    ///
    /// # Errors
    /// [`NetworkError::Runtime`] if a network fails.
    fn log_odds_at(
        &self,
        _frame: &Frame<'_>,
        _bbox: BoundingBox,
        _scratch: &mut Scratch,
    ) -> Result<Option<f64>, NetworkError> {
        Ok(None)
    }
}

/// A frame, in the forms that trackers work on.
#[derive(Clone, Copy)]
pub(crate) struct Input<'a> {
    pub frame: &'a Frame<'a>,
    /// Filled only if the configuration's tracker needs it.
    pub grey: &'a GreyImage,
}

/// Buffers of one thread, shared by all its targets: one value of each type that a tracker asks for.
#[derive(Debug, Default)]
pub(crate) struct Scratch(Vec<Box<dyn Any + Send + Sync>>);

impl Scratch {
    /// The buffers of this type, made when they are first asked for.
    pub fn of<T: Any + Send + Sync + Default>(&mut self) -> &mut T {
        let known = self.0.iter().position(|buffers| buffers.is::<T>());
        let index = known.unwrap_or_else(|| {
            self.0.push(Box::<T>::default());
            self.0.len() - 1
        });
        self.0[index].downcast_mut().expect("its type was compared or is that of the new value")
    }
}
