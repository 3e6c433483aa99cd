//! Numerical building blocks: the choice of CPU instructions, inner products that give the same
//! bits on every processor, aligned rows, singular vectors and a thread team.

pub mod aligned;
mod dot;
pub mod instructions;
pub mod singular;
pub mod thread_team;

pub use dot::{dot, dot_wide, dots_wide};
