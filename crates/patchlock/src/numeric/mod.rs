//! Numerical building blocks: the choice of CPU instructions, inner products that give the same
//! bits on every processor, aligned rows, singular vectors, work on many threads or one, and a
//! thread team.

pub mod aligned;
mod dot;
pub mod instructions;
pub mod numbers;
pub mod parallel;
pub mod singular;
pub mod thread_team;

pub use dot::{dot, dot_wide, dots_wide};
