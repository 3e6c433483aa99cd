//! The particle filter: the affine state, its motion, and the particles of a frame.

pub mod motion;
pub mod particles;
pub mod state;
