//! A target between two frames, as a snapshot holds it.

use super::locate::{Locator, LocatorState};
use super::memory::Memory;
use super::occlusion::{OcclusionModel, SavedOcclusionModel};
use super::pose::Pose;
use super::status::TrackState;
use super::window::{Window, WindowShape};
use super::{RobustConfig, RobustTarget};
use serde::{Deserialize, Serialize};

/// More frames than any video has; counting on from here never overflows.
const MAX_FRAMES: u64 = 1 << 53;

/// All that the target's next frames depend on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct SavedRobust {
    pose: Pose,
    window: WindowShape,
    locator: LocatorState,
    memory: Memory,
    occlusion: SavedOcclusionModel,
    state: TrackState,
    frames: u64,
}

impl SavedRobust {
    /// The target as a snapshot holds it.
    pub fn of(target: &RobustTarget) -> Self {
        let RobustTarget { pose, window, locator, memory, occlusion, state, frames, .. } = target;
        Self {
            pose: *pose,
            window: window.shape(),
            locator: locator.saved(),
            memory: memory.clone(),
            occlusion: occlusion.saved(),
            state: *state,
            frames: *frames,
        }
    }

    /// A target that continues from a saved one.
    ///
    /// # Errors
    /// What is damaged, or does not fit the configuration.
    pub fn target(self, config: &RobustConfig) -> Result<RobustTarget, &'static str> {
        let Self { pose, window, locator, memory, occlusion, state, frames } = self;
        if frames > MAX_FRAMES {
            return Err("it has counted more frames than a video has");
        }
        if !pose.is_sound() {
            return Err("its pose is not finite, or its size not positive");
        }
        if !state.is_sound() {
            return Err("what it believes of the target is damaged");
        }
        let window = Window::restore(window)?;
        let locator = Locator::restore(locator, &window, config)?;
        memory.check(&window)?;
        Ok(RobustTarget {
            pose,
            locator,
            memory,
            occlusion: OcclusionModel::restore(occlusion, config)?,
            window,
            state,
            frames,
            config: config.clone(),
        })
    }
}
