//! Describes the computer that runs were made on.

use std::fs;
use std::thread;

use serde::{Deserialize, Serialize};

/// The properties of a computer that matter for speed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Machine {
    /// Name of the processor, or `unknown`.
    pub processor: String,
    /// Number of logical processors available to the program.
    pub cores: usize,
    /// Operating system.
    pub system: String,
    /// Processor architecture.
    pub architecture: String,
}

impl Machine {
    /// This computer.
    pub fn here() -> Self {
        let info = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let model = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
        Self {
            processor: model.map_or("unknown", |(_, name)| name.trim()).to_string(),
            cores: thread::available_parallelism().map_or(1, usize::from),
            system: std::env::consts::OS.to_string(),
            architecture: std::env::consts::ARCH.to_string(),
        }
    }
}
