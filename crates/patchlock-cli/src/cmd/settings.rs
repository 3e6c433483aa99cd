//! The options that choose the settings of the tracker.

use std::path::PathBuf;

use clap::Args;
use patchlock::TrackerConfig;
use patchlock_track::settings::{self, Overrides};

use super::PRESETS_SHOWN;
use crate::failure::Failure;

/// Preset, settings file and single settings.
#[derive(Debug, Args)]
pub struct SettingsArgs {
    #[arg(long, value_name = "NAME", default_value = "robust", help = PRESETS_SHOWN)]
    pub preset: String,

    /// Settings that differ from the preset, as TOML; see patchlock config
    #[arg(long, value_name = "FILE.toml")]
    pub config: Option<PathBuf>,

    /// The network of the preset network: a folder with the ONNX files of one model, or the file
    /// of a model that has one; see patchlock model
    #[arg(long, value_name = "DIR|FILE")]
    pub model: Option<PathBuf>,

    /// Run the network with this library of onnxruntime, such as libonnxruntime.so, instead of the
    /// built-in runtime
    #[arg(long, value_name = "FILE", requires = "model")]
    pub runtime: Option<PathBuf>,

    /// Change one setting, such as search=7 or rotate=false; may be repeated. It takes precedence
    /// over --config
    #[arg(long, value_name = "NAME=VALUE")]
    pub set: Vec<String>,
}

impl SettingsArgs {
    /// The configuration, with a seed that takes precedence.
    pub fn resolve(&self, seed: Option<u64>) -> Result<TrackerConfig, Failure> {
        let overrides = Overrides {
            set: &self.set,
            seed,
            model: self.model.as_deref(),
            runtime: self.runtime.as_deref(),
        };
        settings::resolve(&self.preset, self.config.as_deref(), overrides).map_err(Failure::from)
    }
}
