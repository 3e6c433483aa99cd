//! What every room computes with: the instructions of the processor at hand, and inner products that are the same with all of them.

mod dot;
pub mod instructions;

pub use dot::{dot, dot_wide, dots_wide};
