//! A target between two frames, as a snapshot holds it.

use super::RobustTarget;
use super::locate::{Locator, SavedLocator};
use super::memory::{Memory, SavedMemory};
use super::place::Place;
use super::search::SearchParams;
use super::status::{Belief, StatusParams};
use super::visible::{SavedVisible, Visible};
use super::window::{SavedWindow, Window};
use crate::config::RobustConfig;
use serde::{Deserialize, Serialize};

/// More frames than any video has; counting on from here never overflows.
const MAX_FRAMES: u64 = 1 << 53;

/// All that the target's next frames depend on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct SavedRobust {
    place: Place,
    window: SavedWindow,
    locator: SavedLocator,
    memory: SavedMemory,
    visible: SavedVisible,
    belief: Belief,
    frames: u64,
}

impl RobustTarget {
    /// The target as a snapshot holds it.
    pub fn saved(&self) -> SavedRobust {
        let Self { place, window, locator, memory, visible, belief, frames, .. } = self;
        SavedRobust {
            place: *place,
            window: window.saved(),
            locator: locator.saved(),
            memory: memory.saved(),
            visible: visible.saved(),
            belief: *belief,
            frames: *frames,
        }
    }

    /// A target that continues from a saved one.
    ///
    /// # Errors
    /// What is damaged, or does not fit the configuration.
    pub fn restore(saved: SavedRobust, config: &RobustConfig) -> Result<Self, &'static str> {
        let SavedRobust { place, window, locator, memory, visible, belief, frames } = saved;
        if frames > MAX_FRAMES {
            return Err("it has counted more frames than a video has");
        }
        if !place.is_sound() {
            return Err("its place is not finite, or its size not positive");
        }
        if !belief.is_sound() {
            return Err("what it believes of the target is damaged");
        }
        let window = Window::restore(&window, config)?;
        Ok(Self {
            place,
            locator: Locator::restore(locator, &window, config)?,
            memory: Memory::restore(memory, &window, config)?,
            visible: Visible::restore(visible, config)?,
            window,
            belief,
            frames,
            search: SearchParams::new(config),
            status: StatusParams::new(config),
        })
    }
}
