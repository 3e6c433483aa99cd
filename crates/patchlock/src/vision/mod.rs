//! Pixels: frames, boxes, the warp of candidates, the patches of a template, and the filter of masks.

pub mod frame;
pub mod geometry;
pub mod guided_filter;
pub mod patches;
pub mod warp;
