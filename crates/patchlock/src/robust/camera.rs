//! Slow rotation of the camera. The tracking filter learns a slow rotation of the target instead of
//! following it; where the camera turns, the background tells. The sum of its rotations is a
//! hypothesis for the target, which has to earn its response.

use crate::vision::camera::{CameraScratch, ReducedFrame};
use crate::vision::frame::Frame;
use serde::{Deserialize, Serialize};

/// Tracking filter and memory together must respond this many times stronger to the target turned
/// with the camera.
pub(crate) const MARGIN: f64 = 1.08;

/// The smallest sum of rotations that is tried, in radians.
const LEAST: f64 = 0.1;

/// Frames from one measurement to the next.
const INTERVAL: u32 = 4;

/// The rotation of the camera since it was last tried.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct CameraRotation {
    /// The frame of the last measurement; `None` if rotation is not followed.
    reference: Option<ReducedFrame>,
    /// Frames since then.
    frames: u32,
    /// The sum of the measured rotations, in radians, clockwise on screen.
    sum: f64,
}

/// The buffers of a [`CameraRotation`].
#[derive(Debug, Default)]
pub(crate) struct CameraBuffers {
    scratch: CameraScratch,
    reduced: ReducedFrame,
}

impl CameraRotation {
    /// Begins at a frame.
    pub fn begin(frame: &Frame<'_>, rotate: bool, buffers: &mut CameraBuffers) -> Self {
        let reference = rotate.then(|| {
            let mut reference = ReducedFrame::default();
            reference.fill(frame, &mut buffers.scratch);
            reference
        });
        Self { reference, frames: 0, sum: 0.0 }
    }

    /// Whether rotation is followed.
    pub fn follows(&self) -> bool {
        self.reference.is_some()
    }

    /// Whether all numbers are ones that frames can lead to.
    pub fn is_sound(&self) -> bool {
        self.reference.as_ref().is_none_or(ReducedFrame::is_sound) && self.sum.is_finite()
    }

    /// Measures the rotation on every few frames. Returns the sum once it is large enough to be
    /// tried, and begins again at 0.
    pub fn advance(&mut self, frame: &Frame<'_>, buffers: &mut CameraBuffers) -> Option<f64> {
        let reference = self.reference.as_mut()?;
        self.frames = self.frames.saturating_add(1);
        if self.frames < INTERVAL {
            return None;
        }
        self.frames = 0;
        let CameraBuffers { scratch, reduced } = buffers;
        reduced.fill(frame, scratch);
        self.sum += reference.rotation_to(reduced, scratch).unwrap_or(0.0);
        std::mem::swap(reference, reduced);
        (self.sum.abs() >= LEAST).then(|| std::mem::take(&mut self.sum))
    }
}
