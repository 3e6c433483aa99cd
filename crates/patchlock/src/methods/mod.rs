//! The methods of tracking: the list of all trackers, and what is made from it.

mod dyn_tracker;
mod list;
mod observe;
mod preset;
mod reading;
mod tracker_config;

use crate::config::{MethodConfig, MethodInfo, Parameter, PatchModelConfig, SEED};
use crate::estimate::Estimate;
use crate::network::Network;
use crate::target_tracker::{Scratch, Start};
use crate::{Error, error};
pub(crate) use dyn_tracker::DynTracker;
pub use observe::{CommitteeView, MemberView, Observer};
pub use tracker_config::{PARAMETERS, TrackerConfig};

list::methods! {
    /// The default: correlation filters follow and remember the target and find it again after a
    /// loss, and the paper's patch model sees what is hidden.
    Robust = robust::{RobustConfig, RobustView, SavedRobust, RobustTarget};
    /// The paper's tracker: particles, weighed by structural local sparse appearance.
    Paper = paper::{PaperConfig, PaperView, SavedPaper, PaperTarget}, PatchModelConfig;
    /// A network, [`TrackerConfig::network`], in the loop that was published with it.
    Network = network_loop::{NetworkConfig, NetworkView, SavedNetwork, NetworkTarget};
}

impl Method {
    /// What is known of the method without its settings.
    pub fn info(&self) -> &'static MethodInfo {
        self.settings().info()
    }

    /// The name of the method, which is also that of its group of settings.
    pub fn name(&self) -> &'static str {
        self.info().name
    }

    /// The patch model, if the method has one.
    pub fn patches(&self) -> Option<&PatchModelConfig> {
        self.settings().patches()
    }
}
