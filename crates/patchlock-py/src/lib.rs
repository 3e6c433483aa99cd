//! The Python package: a thin layer over the tracker, the frame sources and the command.
//!
//! Users import the package `patchlock` in `python/`; this module, `patchlock._patchlock`, is its Rust part.
//! All work on frames is done with the GIL released.

mod advice;
mod arrays;
mod batch;
mod command;
mod config;
mod draw;
mod driver;
mod errors;
mod estimate;
mod export;
mod fork;
mod multi;
mod network;
mod observation;
mod pixels;
mod project;
mod read;
mod scene;
mod select;
mod source;
mod threads;
mod tracker;
mod video;

/// The Rust part of the package `patchlock`.
#[pyo3::pymodule]
mod _patchlock {
    use patchlock::Preset;
    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::{
        batch::{Store, abandon_files, bench_jobs, read_truth, track_job},
        command::run,
        config::{Config, NetworkConfig, PaperConfig, PatchModelConfig, RobustConfig},
        config::{checked_config, parameters, restore_config},
        estimate::{Estimate, box_of, iou},
        export::{_export_formats, export},
        multi::{MultiTracker, restore_many},
        network::{ModelFile, Network, restore_network},
        observation::{
            CommitteeObservation, NetworkObservation, PaperObservation, RobustObservation,
        },
        project::Project,
        read::read_estimates,
        scene::Scene,
        select::select_boxes,
        source::Frames,
        tracker::{Tracker, restore},
        video::VideoWriter,
    };

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        patchlock_media::silence_decoders();
        crate::fork::register(module)?;
        module.add("__version__", env!("CARGO_PKG_VERSION"))?;
        module.add("PRESETS", Preset::ALL.map(Preset::name))
    }
}
