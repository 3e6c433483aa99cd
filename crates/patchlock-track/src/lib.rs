//! Tracking around the library: what the program, the studio and the Python package share.
//!
//! A [`session`] has threads and a clock, [`settings`] resolves presets and settings files,
//! [`models`] loads networks, [`start_box`] checks first boxes, [`text`] reads tables of boxes,
//! [`attributes`] are what labels declare, [`outline`] what is drawn beside boxes, and [`export`]
//! writes tracks for other tools.
//!
//! Boxes are [`patchlock::BoundingBox`], in pixels counted from 0.

pub mod attributes;
pub mod error;
pub mod export;
pub mod files;
pub mod models;
pub mod names;
pub mod outline;
pub mod session;
pub mod settings;
pub mod start_box;
pub mod text;

pub use error::Error;
pub use models::{ModelPaths, UsedNetwork};
