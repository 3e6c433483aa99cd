//! Patchlock: a visual object tracker. Draw a box around anything in the first frame; it follows it through
//! the video, says how sure it is, and which parts are hidden. No training, no model files, no GPU.
//!
//! There are two methods. [`Method::Robust`] (the presets `robust`, the default, and `fast`) follows with
//! correlation filters and a map of the target's colours, remembers what was sure, and finds the target again
//! after a loss. [`Method::Patchwise`] (the preset `paper`) is an exact and fast implementation of "Patchwise
//! object tracking via structural local sparse appearance model" (Kashiyani, Shokouhi, 2017).
//!
//! Begin with [`Tracker`] and [`TrackerConfig`]; [`MultiTracker`] follows many targets at once.
//!
//! The library opens no files, prints nothing, reads no clock, and does not panic on any input.
//!
//! # Where the steps of `robust` are
//!
//! | step | module |
//! |---|---|
//! | the whole | `robust` |
//! | features, filters, responses, map of colours, scale, rotation | `correlation` |
//! | windows of the frame | `vision::crop` |
//! | which parts are visible | `appearance`, the paper's patch model |
//!
//! # Where each step of the paper is
//!
//! | step | paper | module |
//! |---|---|---|
//! | the whole | Fig. 1 | `patchwise` |
//! | frame, grey | Sec. 2 | `vision::frame` |
//! | affine state, motion, particles | Sec. 2, Eq. 22-23 | `motion`, `patchwise::particles` |
//! | candidates: bilinear warp | Sec. 2 | `vision::warp` |
//! | patches at two scales | Eq. 1 | `vision::patches` |
//! | dictionaries | Eq. 2 | `sparse::dictionary` |
//! | joint sparse codes with buffers | Eq. 3-9 | `sparse::somp`, `appearance::buffer` |
//! | pooling by alignment | Eq. 10-11 | `appearance::pooling` |
//! | occlusion levels, weights | Eq. 12-14, 18-19 | `appearance::weights` |
//! | likelihood | Eq. 24 | `appearance::likelihood` |
//! | subspace, reconstruction | Eq. 15-16 | `appearance::subspace`, `sparse::lasso` |
//! | mask, new template | Eq. 17, 20-21 | `appearance::mask`, `appearance::update` |
//! | first templates, replacement | Sec. 2.5 | `appearance::templates`, `appearance::memory` |
//!
//! These modules are no part of the public interface: they are visible so that the tests and benchmarks of
//! this crate can reach them, and change without notice.

#[doc(hidden)]
pub mod appearance;
mod config;
#[doc(hidden)]
pub mod correlation;
mod error;
mod estimate;
mod method;
#[doc(hidden)]
pub mod motion;
mod multi;
#[doc(hidden)]
pub mod numeric;
mod observe;
#[doc(hidden)]
pub mod patchwise;
#[doc(hidden)]
pub mod robust;
mod snapshot;
#[doc(hidden)]
pub mod sparse;
mod target_id;
mod tracker;
#[doc(hidden)]
pub mod vision;

pub use appearance::likelihood::{Feature, Gamma, Scales};
pub use appearance::visibility::{Visibility, VisibilityMap};
pub use config::{
    Method, PARAMETERS, PRESETS, Parameter, PatchwiseConfig, Range, RobustConfig, TrackerConfig,
};
pub use error::Error;
pub use estimate::{Estimate, Status};
pub use motion::state::State;
pub use multi::MultiTracker;
pub use observe::{FrameView, Observer, PatchView, PatchwiseView, RobustView, UpdateView};
pub use snapshot::{MultiSnapshot, Snapshot};
pub use sparse::codes::Code;
pub use target_id::TargetId;
pub use tracker::Tracker;
pub use vision::frame::Frame;
pub use vision::geometry::{BoundingBox, Point};

/// Compiles and runs the examples of the README.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;

/// Compiles and runs the examples of the page on embedding.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/embedding.md")]
struct Embedding;
