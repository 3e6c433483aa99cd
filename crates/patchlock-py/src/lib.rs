//! The Python package: a thin layer over the tracker, the frame sources and the command.
//!
//! Users import the package `patchlock` in `python/`; this module, `patchlock._patchlock`, is its Rust part.
//! All work on frames is done with the GIL released.

mod advice;
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

use pyo3::prelude::*;

/// The Rust part of the package `patchlock`.
#[pymodule]
fn _patchlock(module: &Bound<'_, PyModule>) -> PyResult<()> {
    patchlock_media::silence_decoders();
    fork::register(module)?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("PRESETS", patchlock::Preset::ALL.map(patchlock::Preset::name))?;
    module.add_class::<config::Config>()?;
    module.add_class::<config::RobustConfig>()?;
    module.add_class::<config::PaperConfig>()?;
    module.add_class::<config::NetworkConfig>()?;
    module.add_class::<config::PatchModelConfig>()?;
    module.add_class::<network::Network>()?;
    module.add_class::<network::ModelFile>()?;
    module.add_class::<tracker::Tracker>()?;
    module.add_class::<multi::MultiTracker>()?;
    module.add_class::<estimate::Estimate>()?;
    module.add_class::<observation::PaperObservation>()?;
    module.add_class::<observation::RobustObservation>()?;
    module.add_class::<observation::CommitteeObservation>()?;
    module.add_class::<observation::NetworkObservation>()?;
    module.add_class::<source::Frames>()?;
    module.add_class::<scene::Scene>()?;
    module.add_class::<project::Project>()?;
    module.add_class::<video::VideoWriter>()?;
    module.add_function(wrap_pyfunction!(estimate::box_of, module)?)?;
    module.add_function(wrap_pyfunction!(estimate::iou, module)?)?;
    module.add_function(wrap_pyfunction!(read::read_estimates, module)?)?;
    module.add_function(wrap_pyfunction!(tracker::restore, module)?)?;
    module.add_function(wrap_pyfunction!(multi::restore_many, module)?)?;
    module.add_function(wrap_pyfunction!(config::restore_config, module)?)?;
    module.add_function(wrap_pyfunction!(config::checked_config, module)?)?;
    module.add_function(wrap_pyfunction!(network::restore_network, module)?)?;
    module.add_function(wrap_pyfunction!(export::export, module)?)?;
    module.add_function(wrap_pyfunction!(export::_export_formats, module)?)?;
    module.add_function(wrap_pyfunction!(select::select_boxes, module)?)?;
    module.add_function(wrap_pyfunction!(config::parameters, module)?)?;
    module.add_class::<batch::Store>()?;
    module.add_function(wrap_pyfunction!(batch::track_job, module)?)?;
    module.add_function(wrap_pyfunction!(batch::abandon_files, module)?)?;
    module.add_function(wrap_pyfunction!(batch::bench_jobs, module)?)?;
    module.add_function(wrap_pyfunction!(batch::read_truth, module)?)?;
    module.add_function(wrap_pyfunction!(command::run, module)?)
}
