//! Patchlock: a visual object tracker. Draw a box around anything in the first frame; it follows it
//! through the video, says how sure it is, and which parts are hidden. No training, no model files,
//! no GPU.
//!
//! There are three methods. [`Method::Robust`] (the preset `robust`, the default)
//! follows with correlation filters and a map of the target's colours, remembers what was sure, and
//! finds the target again after a loss. [`Method::Paper`] (the preset `paper`) is an exact and fast
//! implementation of "Patchwise object tracking via structural local sparse appearance model"
//! (Kashiyani, Shokouhi, 2017). [`Method::Network`] (the preset `network`) follows with a small
//! [`Network`]: PatchNet, which is built in, or one of the user, from ONNX files. With a network,
//! `robust` is a committee of its filters and the network.
//!
//! Begin with [`Tracker`] and [`TrackerConfig`]; [`MultiTracker`] follows many targets at once.
//!
//! The library opens no files, prints nothing, reads no clock, and does not panic on any input.
//!
//! `ARCHITECTURE.md` in the repository shows the way of a frame through the modules, and `PAPER.md`
//! where each equation of the paper is. The modules are private. The feature `internals` makes some
//! of them public for the tests and benchmarks of this workspace; they change without notice.

mod committee;
mod config;
mod error;
mod estimate;
mod methods;
mod multi;
#[cfg_attr(not(feature = "network"), expect(dead_code, reason = "nothing makes a network"))]
mod network;
mod network_error;
mod network_loop;
mod robust;
mod snapshot;
mod target;
mod target_id;
mod target_tracker;
mod tracker;
mod value;

// The documentation has only what is public without the feature, whichever features it is made with.
#[cfg(not(all(feature = "internals", not(doc))))]
mod correlation;
#[cfg(all(feature = "internals", not(doc)))]
pub mod correlation;
#[cfg(not(all(feature = "internals", not(doc))))]
mod numeric;
#[cfg(all(feature = "internals", not(doc)))]
pub mod numeric;
#[cfg(not(all(feature = "internals", not(doc))))]
mod paper;
#[cfg(all(feature = "internals", not(doc)))]
pub mod paper;
#[cfg(not(all(feature = "internals", not(doc))))]
mod patch_model;
#[cfg(all(feature = "internals", not(doc)))]
pub mod patch_model;
#[cfg(not(all(feature = "internals", not(doc))))]
mod vision;
#[cfg(all(feature = "internals", not(doc)))]
pub mod vision;

pub use config::{MethodInfo, NetworkUse, Parameter, PatchModelConfig, Range};
pub use error::Error;
pub use estimate::{Estimate, Status};
pub use methods::{
    CommitteeView, FrameView, MemberView, Method, Observer, PARAMETERS, Preset, TrackerConfig,
};
pub use multi::{MultiTracker, TargetEstimate};
pub use network::Network;
#[cfg(feature = "network")]
pub use network::{KNOWN_MODELS, KnownModel, ModelFile, Runtime};
pub use network_error::NetworkError;
pub use network_loop::{NetworkConfig, NetworkView};
pub use paper::{PaperConfig, PaperView, PatchView, UpdateView};
pub use patch_model::likelihood::{Feature, Gamma, Scales};
pub use patch_model::sparse::codes::Code;
pub use patch_model::visibility::{Visibility, VisibilityMap};
pub use robust::{RobustConfig, RobustView};
pub use snapshot::{MultiSnapshot, Snapshot};
pub use target_id::TargetId;
pub use tracker::Tracker;
pub use value::{Kind, Value};
pub use vision::frame::Frame;
pub use vision::geometry::{BoundingBox, Point};
pub use vision::state::State;

/// Identifies the build: a hash of the library's sources, in hexadecimal. Boxes of two builds with
/// the same hash and the same dependencies are comparable.
pub const BUILD: &str = env!("PATCHLOCK_BUILD");

/// Compiles and runs the examples of the README.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;

/// Compiles and runs the example of the README of this crate.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct CrateReadme;

/// Compiles and runs the examples of the page on embedding.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/embedding.md")]
struct Embedding;

/// Compiles the examples of the page on networks.
#[cfg(all(doctest, feature = "network"))]
#[doc = include_str!("../../../docs/networks.md")]
struct Networks;
