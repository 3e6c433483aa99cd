//! The paper's patch model of a target's appearance: codes, weights, likelihood and learning.
//!
//! [`model`] combines the steps, which are the other modules.

pub mod buffer;
pub mod likelihood;
pub mod mask;
pub mod memory;
pub mod model;
pub mod params;
pub mod pooling;
pub mod pruning;
pub mod scale;
pub mod sparse;
pub mod subspace;
pub mod templates;
pub mod update;
pub mod visibility;
pub mod weighing;
pub mod weights;
