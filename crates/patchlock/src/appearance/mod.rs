//! The appearance of the target: what its codes say, what weighs how much, and how it is learned.

pub mod buffer;
mod crew;
pub mod elimination;
pub mod likelihood;
pub mod mask;
pub mod pooling;
pub mod scale;
mod singular;
pub mod subspace;
pub mod templates;
pub mod update;
pub mod weighing;
pub mod weights;
