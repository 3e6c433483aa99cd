//! Patchlock: a visual object tracker. Draw a box around anything in the first frame; it follows it through the video, says how
//! sure it is, and which parts are hidden. It is an exact and fast implementation of "Patchwise object tracking via structural
//! local sparse appearance model" (Kashiyani, Shokouhi, 2017). No training, no model files, no GPU.
//!
//! Begin with [`Tracker`] and [`TrackerConfig`]; [`MultiTracker`] follows many targets at once.
//!
//! # The way of the data, and where each step of the paper is
//!
//! | step | paper | module |
//! |---|---|---|
//! | frame, grey | Sec. 2 | [`vision::frame`] |
//! | affine state, motion, particles | Sec. 2 | [`filter`] |
//! | candidates: bilinear warp | Sec. 2 | [`vision::warp`] |
//! | patches at two scales | Eq. 1 | [`vision::patches`] |
//! | dictionaries | Eq. 2 | [`sparse::dictionary`] |
//! | joint sparse codes with buffers | Eq. 3-9 | [`sparse::somp`], [`appearance::buffer`] |
//! | pooling by alignment | Eq. 10-11 | [`appearance::pooling`] |
//! | occlusion levels, weights | Eq. 12-14, 18-19 | [`appearance::weights`] |
//! | likelihood | Eq. 24 | [`appearance::likelihood`] |
//! | subspace, reconstruction, mask, new template | Eq. 15-17, 20-21 | [`appearance::subspace`], [`sparse::lasso`], [`appearance::mask`], [`appearance::update`] |
//! | first templates, replacement | Sec. 2.5 | [`appearance::templates`] |
//!
//! `vision`, `sparse` and `filter` know nothing of each other; `appearance` uses the first two; the tracker puts all four together.
//!
//! The library opens no files, prints nothing, reads no clock, and does not panic on any input.

pub mod appearance;
pub mod config;
pub mod error;
pub mod estimate;
pub mod filter;
mod memory;
pub mod multi;
pub mod observe;
pub mod simd;
pub mod sparse;
pub mod tracker;
pub mod vision;

pub use config::{PARAMETERS, PRESETS, Parameter, TrackerConfig};
pub use error::Error;
pub use estimate::{Estimate, VisibilityMap};
pub use memory::Snapshot;
pub use multi::{MultiSnapshot, MultiTracker, TargetId};
pub use observe::{FrameView, Observer};
pub use tracker::Tracker;
pub use vision::frame::Frame;
pub use vision::geometry::BoundingBox;

/// Compiles and runs the examples of the README.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;

/// Compiles and runs the examples of the page on embedding.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/embedding.md")]
struct Embedding;
