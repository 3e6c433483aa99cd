//! Frames, boxes, the warp of candidates, patches of templates, and the guided filter.

pub mod bilinear;
pub(crate) mod camera;
pub mod crop;
pub mod frame;
pub mod geometry;
pub mod guided_filter;
pub mod patches;
pub mod state;
pub mod warp;
