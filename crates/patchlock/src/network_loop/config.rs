//! The settings of the method `network`.

use crate::config::{MethodConfig, MethodInfo, NetworkUse, SEED, group, number};

group! {
    /// The settings of the method `network`. What belongs to a network, such as how fast the size
    /// follows, is published with it and not a setting.
    NetworkConfig ("network") {}
    "own choice" {
        /// The score from which on the target counts as tracked.
        tracked_score: f64 = 0.5, number(0.0, 1.0);
        /// The score below which the target counts as lost.
        lost_score: f64 = 0.25, number(0.0, 1.0);
    }
}

impl MethodConfig for NetworkConfig {
    fn info(&self) -> &'static MethodInfo {
        &MethodInfo {
            name: Self::NAME,
            purpose: "a network alone",
            family: "network",
            title: "Visual object tracker with a network",
            network: NetworkUse::Required,
            score_is_probability: true,
            megabytes: 5,
        }
    }

    // It draws no random numbers.
    fn reads(&self, name: &str, _has_network: bool) -> bool {
        name != SEED.name
    }
}
