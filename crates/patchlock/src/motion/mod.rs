//! The affine state of a target and its motion model.

pub mod model;
pub mod state;
