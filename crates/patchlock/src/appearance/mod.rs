//! The appearance of a target as patches: what their codes say, how much each counts, and how it is learned.
//!
//! [`model`] is the whole, as one value. The other modules are its steps.

pub mod buffer;
pub mod likelihood;
pub mod mask;
pub mod memory;
pub mod model;
pub mod pooling;
pub mod pruning;
pub mod scale;
pub mod subspace;
pub mod templates;
pub mod update;
pub mod visibility;
pub mod weighing;
pub mod weights;
