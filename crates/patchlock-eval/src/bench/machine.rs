//! What the runs were made on.

use std::fs;
use std::thread;

use serde::{Deserialize, Serialize};

/// A computer, as far as it matters for speed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Machine {
    /// Name of the processor, where the system tells it.
    pub processor: String,
    /// Processors that the program may use.
    pub cores: usize,
    /// Operating system.
    pub system: String,
    /// Kind of processor.
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
