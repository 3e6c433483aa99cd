//! The trait of all trackers of one target. A tracker is a folder of its own and knows no other.

use crate::Error;
use crate::config::MethodConfig;
use crate::estimate::Estimate;
use crate::network::Network;
use crate::network_error::NetworkError;
use crate::vision::frame::{Frame, GreyImage};
use crate::vision::geometry::BoundingBox;
use std::any::Any;
use std::fmt::Debug;

/// A tracker of one target.
pub(crate) trait TargetTracker: Debug + Send + Sync + Sized + 'static {
    /// Its settings.
    type Config: MethodConfig;
    /// Buffers, shared by all targets of a thread. They carry nothing from one frame to the next.
    type Scratch: Any + Send + Sync + Default;
    /// All that the target's next frames depend on, as a snapshot holds it.
    type Snapshot;
    /// What an observer is shown of a frame.
    type View<'a>;

    /// Begins on a target.
    ///
    /// # Errors
    /// [`Error::Network`] if a network is missing or fails; [`Error::BoxTooSmall`].
    fn begin(
        start: Start<'_>,
        config: &Self::Config,
        scratch: &mut Self::Scratch,
    ) -> Result<(Self, Estimate), Error>;

    /// Finds the target in the next frame, of the same size, learns from it, and shows what happened
    /// if anyone looks.
    ///
    /// # Errors
    /// [`NetworkError::Runtime`] if a network fails.
    fn update(
        &mut self,
        input: Input<'_>,
        scratch: &mut Self::Scratch,
        show: ViewSink<'_, Self>,
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
        _scratch: &mut Self::Scratch,
    ) -> Result<Option<f64>, NetworkError> {
        Ok(None)
    }

    /// The target as a snapshot holds it.
    fn saved(&self) -> Self::Snapshot;

    /// A target that continues from a saved one.
    ///
    /// # Errors
    /// [`Error::Snapshot`] if it does not fit the configuration or is damaged; [`Error::Network`] if
    /// its network is missing or another one.
    fn restore(
        saved: Self::Snapshot,
        config: &Self::Config,
        network: Option<&Network>,
    ) -> Result<Self, Error>;
}

/// Shows the view of a frame. `None` if nobody looks: then no view is made.
pub(crate) type ViewSink<'a, T> = Option<&'a mut dyn FnMut(<T as TargetTracker>::View<'_>)>;

/// A frame, in the forms that trackers work on.
#[derive(Clone, Copy)]
pub(crate) struct Input<'a> {
    pub frame: &'a Frame<'a>,
    /// Filled only if the configuration's tracker needs it.
    pub grey: &'a GreyImage,
}

/// What a tracker begins with.
#[derive(Clone, Copy)]
pub(crate) struct Start<'a> {
    /// The first frame.
    pub input: Input<'a>,
    /// The target's box in it.
    pub bbox: BoundingBox,
    pub seed: u64,
    pub network: Option<&'a Network>,
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
