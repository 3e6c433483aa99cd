//! The options that choose the settings of the tracker.

use std::path::PathBuf;

use clap::Args;
use patchlock::TrackerConfig;
use patchlock_track::ModelPaths;
use patchlock_track::settings::{self, Overrides};

use super::{presets_named, presets_shown};
use crate::failure::Failure;

/// Preset, settings file and single settings.
#[derive(Debug, Args)]
pub struct SettingsArgs {
    #[arg(
        long,
        value_name = "NAME",
        default_value = "robust",
        help = presets_named(),
        long_help = presets_shown()
    )]
    pub preset: String,

    /// Settings that differ from the preset, as TOML; see patchlock config
    #[arg(long, value_name = "FILE.toml")]
    pub config: Option<PathBuf>,

    #[command(flatten)]
    pub model: ModelArgs,

    /// Change one setting, such as search=7 or rotate=false; may be repeated
    ///
    /// It takes precedence over --config.
    #[arg(long, value_name = "NAME=VALUE")]
    pub set: Vec<String>,
}

/// The network.
#[derive(Debug, Args)]
pub struct ModelArgs {
    /// The network of robust and network: patchnet (the default), none, or your ONNX files
    ///
    /// patchnet is part of Patchlock. Otherwise the files of one model: their folder, or the only file;
    /// patchlock model --help says where to get one. ./patchnet is a folder of that name. robust uses
    /// the network beside its own models. With none, it needs one core in place of two.
    #[arg(long, value_name = "NAME|DIR|FILE")]
    pub model: Option<PathBuf>,

    /// Run the network with this library of onnxruntime, such as libonnxruntime.so
    ///
    /// It takes the place of the built-in runtime. The library is code: load only one that you trust.
    #[arg(long, value_name = "FILE")]
    pub runtime: Option<PathBuf>,
}

impl ModelArgs {
    pub fn paths(&self) -> ModelPaths {
        ModelPaths { model: self.model.clone(), runtime: self.runtime.clone() }
    }
}

impl SettingsArgs {
    /// The configuration, with a seed that takes precedence.
    pub fn resolve(&self, seed: Option<u64>) -> Result<TrackerConfig, Failure> {
        let overrides = Overrides { set: &self.set, seed, paths: self.model.paths() };
        Ok(settings::resolve(&self.preset, self.config.as_deref(), overrides)?.0)
    }
}
