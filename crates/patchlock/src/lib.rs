//! Patchlock: a visual object tracker.

pub mod config;
pub mod error;
pub mod filter;
pub mod sparse;
pub mod vision;

pub use config::{PARAMETERS, PRESETS, Parameter, TrackerConfig};
pub use error::Error;
pub use vision::frame::Frame;
pub use vision::geometry::BoundingBox;
