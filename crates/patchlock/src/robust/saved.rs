//! A target between two frames, as a snapshot holds it.

use super::RobustTarget;
use super::locate::{Locator, SavedLocator};
use super::memory::{Memory, SavedMemory};
use super::place::Place;
use super::regain::RegainParams;
use super::rivals::{Rival, RivalState};
use super::search::SearchParams;
use super::status::{Belief, StatusParams};
use super::visible::{SavedVisible, Visible};
use super::window::{SavedWindow, Window};
use super::witness::{SavedWitness, Witness};
use crate::config::RobustConfig;
use crate::network::Network;
use crate::{Error, error};
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
    rival: Option<SavedRival>,
    belief: Belief,
    frames: u64,
}

/// The network's part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct SavedRival {
    witness: SavedWitness,
    state: RivalState,
}

impl RobustTarget {
    /// The target as a snapshot holds it.
    pub fn saved(&self) -> SavedRobust {
        let Self { place, window, locator, memory, visible, rival, belief, frames, .. } = self;
        SavedRobust {
            place: *place,
            window: window.saved(),
            locator: locator.saved(),
            memory: memory.saved(),
            visible: visible.saved(),
            rival: rival
                .as_ref()
                .map(|rival| SavedRival { witness: rival.witness.saved(), state: rival.state() }),
            belief: *belief,
            frames: *frames,
        }
    }

    /// A target that continues from a saved one.
    ///
    /// # Errors
    /// What is damaged, or does not fit the configuration or the network.
    pub fn restore(
        saved: SavedRobust,
        config: &RobustConfig,
        network: Option<&Network>,
    ) -> Result<Self, Error> {
        let SavedRobust { rival, .. } = &saved;
        if rival.is_none() && network.is_some() {
            return Err(error::snapshot("its target was tracked without a network"));
        }
        let rival = rival.clone().map(|saved| saved.restore(config, network)).transpose()?;
        let target = Self::restore_without(saved, config).map_err(error::snapshot)?;
        Ok(Self { rival, ..target })
    }

    /// All but the network's part.
    fn restore_without(saved: SavedRobust, config: &RobustConfig) -> Result<Self, &'static str> {
        let SavedRobust { place, window, locator, memory, visible, belief, frames, .. } = saved;
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
            rival: None,
            belief,
            frames,
            search: SearchParams::new(config),
            status: StatusParams::new(config),
            regain: RegainParams::new(config),
        })
    }
}

impl SavedRival {
    fn restore(self, config: &RobustConfig, network: Option<&Network>) -> Result<Rival, Error> {
        let Self { witness, state } = self;
        if !state.is_sound() {
            return Err(error::snapshot("the place of its network is damaged"));
        }
        Ok(Rival::restore(Witness::restore(witness, network)?, state, config))
    }
}
